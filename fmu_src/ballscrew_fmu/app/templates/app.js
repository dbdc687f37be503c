"use strict";
// The page of the app. Its state (what is entered) is here and in the address; the server answers from it alone.
const element = (id) => document.getElementById(id);
const made = (name, values = {}, ...content) => {
  const one = Object.assign(document.createElement(name), values);
  one.append(...content);
  return one;
};
const format = (x, digits = 4) => (Number.isFinite(x) ? String(Number(x.toPrecision(digits))) : "-");
const tab = crypto.randomUUID();
const FRESH = { sizes: {}, text: "", changes: {}, point: {}, fitted: "" };
let state = structuredClone(FRESH), past = [], last = null, job = null, waiting = 0, plot = null;

// --- questions to the server ---

// The answer to a question, progress on the way; null: another question has taken its place.
async function ask(name, content, shown = true) {
  job?.abort();
  const own = (job = new AbortController());
  element("job").hidden = !shown;
  element("progress").removeAttribute("value");
  element("doing").textContent = "";
  if (shown) element("done").textContent = "";
  try {
    const answer = await fetch(name, {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ tab, ...content }), signal: own.signal,
    });
    if (!answer.ok) throw new Error((await answer.text()).trim());
    const lines = answer.body.pipeThrough(new TextDecoderStream()).getReader();
    for (let text = "", found = null; ; ) {
      const { value, done } = await lines.read();
      text += value ?? "";
      const parts = text.split("\n");
      text = parts.pop();
      for (const part of parts) {
        const { progress, ...rest } = JSON.parse(part);
        if (!progress) found = rest;
        else if (progress[2]) {
          Object.assign(element("progress"), { max: progress[1] || 1, value: progress[0] });
          element("doing").textContent = progress[2];
        }
      }
      if (done) return own.signal.aborted || found?.cancelled ? null : found ?? { problem: "the server has ended", problems: [] };
    }
  } catch (error) {
    return own.signal.aborted ? null : { problem: `No answer: ${error.message}. Is the program still running?`, problems: [] };
  } finally {
    if (job === own) {
      job = null;
      element("job").hidden = true;
    }
  }
}

// --- fields ---

const fields = {}; // by name: its element, label, and what it is a field of
// numbers of a catalogue that are entries of the file
const ENTRY_OF = { ball_mm: "screw.ball_diameter_mm", turns: "screw.turns", starts: "screw.starts", nut_kind: "screw.preload_kind", hand: "screw.hand" };

function field(one, part) {
  const id = `field-${one.name}`;
  const input = one.choices?.length || one.kind === "switch"
    ? made("select", { id, name: one.name }, made("option", { value: "" }), ...(one.choices?.length ? one.choices : ["true", "false"]).map((word) => made("option", { value: word, textContent: word.replaceAll("_", " ") })))
    : made("input", { id, name: one.name, type: "text", spellcheck: false, title: `${one.meaning}${one.allowed ? `; ${one.allowed}` : ""}` });
  const note = made("small", { id: `${id}-note` });
  input.setAttribute("aria-describedby", note.id);
  input.addEventListener(input.tagName === "SELECT" ? "change" : "input", () => entered(part, one.name, input.value));
  fields[one.name] = { input, note, part, one, row: made("div", { className: "entry" }, made("label", { htmlFor: id, textContent: one.label, title: one.meaning }), input, ...(input.tagName === "SELECT" ? [] : [made("span", { textContent: one.unit })]), note) };
  return fields[one.name].row;
}

// Values of the state in the fields, those of the answer as their default; reasons and problems beside them.
function fill(problems = []) {
  const wrong = Object.fromEntries(problems.map((one) => [one.entry.replace(/^screw: /, ""), one]));
  for (const [name, { input, note, part, row, one }] of Object.entries(fields)) {
    const value = last?.values?.[ENTRY_OF[name] ?? name], own = state[part][name] ?? "", bad = wrong[name];
    const other = part === "point" ? format(last?.point?.[name] ?? NaN, 6).replace("-", last?.point?.[name] < 0 ? "-" : "") : value?.value ?? one.default ?? "";
    if (input !== document.activeElement || own !== input.value) input.value = own || (input.tagName === "SELECT" ? value?.value ?? one.default ?? "" : "");
    input.placeholder = other;
    row.classList.toggle("assumed", Boolean(value?.assumed) && !own);
    row.classList.toggle("wrong", Boolean(bad));
    input.setAttribute("aria-invalid", Boolean(bad));
    note.textContent = bad ? `Allowed: ${bad.allowed}. ${bad.remedy[0].toUpperCase()}${bad.remedy.slice(1)}.` : value?.assumed && !own ? `assumed: ${value.assumed}` : "";
    if (bad) row.closest("details")?.setAttribute("open", "");
  }
}

function entered(part, name, value) {
  remember(`${part} ${name}`);
  if (value.trim()) state[part][name] = value;
  else delete state[part][name];
  changed();
}

// --- state, address, undo ---

let edited = "";
function remember(what) {
  if (what && what === edited) return; // further keys in one field are one change
  edited = what;
  past.push(JSON.stringify(state));
  if (past.length > 100) past.shift();
  element("undo").disabled = false;
}

function undo() {
  if (!past.length) return;
  state = JSON.parse(past.pop());
  edited = "";
  element("undo").disabled = !past.length;
  last = null;
  element("problem").hidden = true;
  ofFile();
  fill();
  changed();
}

async function packed(text) {
  const stream = new Blob([text]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  return btoa(Array.from(bytes, (x) => String.fromCharCode(x)).join("")).replaceAll("+", "-").replaceAll("/", "_");
}

async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (x) => x.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"))).text();
}

async function takeAddress() {
  try {
    if (location.hash.length > 2) {
      const given = JSON.parse(await unpacked(location.hash.slice(1)));
      state = Object.fromEntries(Object.entries(FRESH).map(([name, own]) => [name, given[name] && typeof given[name] === typeof own ? given[name] : structuredClone(own)]));
    }
  } catch {
    state = structuredClone(FRESH);
    element("problem").textContent = "The address does not hold a screw of this page; it begins anew.";
    element("problem").hidden = false;
  }
}

function changed() {
  clearTimeout(waiting);
  document.body.classList.add("old");
  waiting = setTimeout(answer, 300);
}

// --- answers ---

async function answer() {
  packed(JSON.stringify(state)).then((text) => history.replaceState(null, "", `#${text}`));
  const empty = !state.text && !state.sizes.diameter_mm && !state.sizes.lead_mm;
  if (empty) return beginAnew();
  const quick = await ask("torque", state, false);
  if (!quick) return;
  if (quick.problem) return refuse(quick);
  last = quick.result;
  element("problem").hidden = true;
  document.body.classList.remove("old");
  element("title").textContent = `Friction of ${last.name}`;
  document.title = last.name;
  fill();
  headline(last.at, 2, "about ", last.notes);
  element("quick").hidden = false;
  curve();
  for (const one of document.querySelectorAll("#save, #print, .take")) one.disabled = false;
  element("live").hidden = element("axis").hidden = true;
  await wholePage();
}

// The page before a screw is entered.
function beginAnew() {
  job?.abort();
  last = null;
  fill();
  document.body.classList.remove("old");
  document.title = "Ball screw";
  element("title").textContent = "Friction of a ball screw";
  element("torque").textContent = "-";
  element("interval").textContent = "Enter diameter and lead.";
  element("notes").replaceChildren();
  element("quick").hidden = element("live").hidden = element("axis").hidden = true;
  for (const one of document.querySelectorAll("#save, #print, .take")) one.disabled = true;
}

// The live page and the numbers by the map.
async function wholePage() {
  const whole = await ask("page", state);
  if (!whole) return;
  if (whole.problem) return refuse(whole);
  headline(whole.result.at, 4, "", last.notes, whole.result.notes);
  budget(whole.result.budget);
  const live = element("live");
  live.onload = () => setTimeout(fitFrame, 600);
  live.src = `${whole.result.shown}${last.point.axial_load_n ? `#axial_load=${last.point.axial_load_n}` : ""}`;
  live.hidden = false;
}

// The live page as high as its content, so that one page scrolls; once, for its layout follows the height.
function fitFrame() {
  const content = element("live").contentDocument?.querySelector("main");
  if (content) element("live").style.height = `${Math.ceil(content.getBoundingClientRect().height) + 60}px`;
}

function refuse({ problem, problems }) {
  document.body.classList.add("old");
  fill(problems);
  const here = problems.length && problems.every((one) => one.entry in fields);
  element("problem").textContent = here ? "" : problem;
  element("problem").hidden = Boolean(here);
  element("interval").textContent = here ? "Not computed: see the field in red." : "Not computed.";
}

function headline([torque, low, high], digits, about, notes, doubts = []) {
  const { preload_n, speed_rpm, temperature_c, axial_load_n, temperature_difference_k } = last.point;
  element("torque").textContent = `${about}${format(torque, digits)} N m`;
  const range = Number.isFinite(low) ? `interval ${format(Math.min(low, high), Math.min(digits, 3))} to ${format(Math.max(low, high), Math.min(digits, 3))} N m, ${last.meaning}. ` : "";
  const implied = last.implied.preload_implied_n ? ` The drag torque implies a true preload of ${format(last.implied.preload_implied_n, 3)} N.` : "";
  const loads = `${axial_load_n ? `, axial load ${format(axial_load_n, 6)} N` : ""}${temperature_difference_k ? `, screw warmer by ${format(temperature_difference_k, 4)} K` : ""}`;
  element("interval").textContent = `${range}At ${format(preload_n, 6)} N, ${format(speed_rpm, 6)} r/min, ${format(temperature_c, 5)} \u00b0C${loads}; ${last.oil}.${implied}`;
  const line = (text, bad) => made("li", { className: bad ? "bad" : "", textContent: `${text[0].toUpperCase()}${text.slice(1)}.` });
  element("notes").replaceChildren(...doubts.map((text) => line(text, true)), ...notes.map((text) => line(text, false)));
}

const curveSize = () => ({ width: element("curve").clientWidth || 600, height: 300 });

function curve() {
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const axis = (label) => ({ label, stroke: () => colour("--ink"), grid: { stroke: () => colour("--line"), width: 1 }, values: (_, at) => at.map((x) => (x === null ? "" : format(x))) });
  const line = (label, more) => ({ label, stroke: () => colour("--total"), points: { show: false }, value: (_, y) => `${format(y)} N m`, ...more });
  plot?.destroy();
  plot = new uPlot({
    ...curveSize(), scales: { x: { time: false, distr: 3 }, y: { range: (_, lo, hi) => [0, 1.08 * hi] } },
    axes: [axis("speed [r/min]"), axis("friction torque [N m]")],
    series: [{ label: "speed", value: (_, x) => `${format(x)} r/min` }, line("torque", { width: 3 }), line("low", { dash: [2, 3] }), line("high", { dash: [2, 3] })],
    bands: [{ series: [3, 2], fill: () => colour("--band") }],
  }, [last.speed_rpm, last.torque, last.low, last.high], element("curve"));
}

function table(id, head, rows) {
  const cells = (row, tag) => made("tr", {}, ...row.map((text) => made(tag, { textContent: text })));
  element(id).tHead.replaceChildren(cells(head, "th"));
  element(id).tBodies[0].replaceChildren(...rows.map((row) => cells(row, "td")));
}

function budget(found) {
  element("axis").hidden = !found;
  if (!found) return;
  const row = (label, torque, low, high, power) => [label, format(torque), `${format(low, 3)} to ${format(high, 3)}`, `${format((100 * torque) / found.friction_torque_nm, 2)} %`, format(power, 3)];
  const parts = Object.keys(found.parts).map((name) => row(found.names[name], found.parts[name], found.parts_low[name], found.parts_high[name], found.power_w[name]));
  table("budget", ["part", "N m", "about 80 %", "share", "W"], [...parts, row("sum", found.friction_torque_nm, found.torque_low_nm, found.torque_high_nm, found.power_loss_w)]);
}

// --- files to take away, files that are dropped ---

const bytesOf = (text) => Uint8Array.from(atob(text), (x) => x.charCodeAt(0));
function keep(name, content) {
  const link = made("a", { download: name, href: URL.createObjectURL(new Blob([content])) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  element("done").textContent = `Saved as ${name}, where your browser keeps files.`;
}

// After a question beside the answer: its problem, and the live page, if it was given up for this.
function resume({ problem = "" }) {
  element("problem").textContent = problem;
  element("problem").hidden = !problem;
  if (last && element("live").hidden) wholePage();
}

async function take(name, more = {}) {
  const found = await ask(name, { ...state, ...more });
  if (!found) return;
  if (found.result?.file) keep(found.result.file, bytesOf(found.result.base64));
  resume(found);
}

// The screw file, and beside it the numbers of its calibration: a screw file has none.
function save() {
  if (!last) return;
  const name = last.name.replace(/[^\w.-]+/g, "_");
  keep(`${name}.toml`, last.text);
  if (state.fitted) {
    keep(`${name}_friction.toml`, state.fitted);
    element("done").textContent = `Saved as ${name}.toml and, for its calibration, ${name}_friction.toml: open both, the screw first. The operating point is in the address of this page only.`;
  }
}

async function printed() {
  const found = await ask("report", state);
  if (!found || found.problem) return found && resume(found);
  const frame = made("iframe", { src: found.result.shown, className: "unseen" });
  frame.onload = () => { frame.contentWindow.print(); setTimeout(() => frame.remove(), 60000); };
  document.body.append(frame);
  resume(found);
}

async function contentOf(file) {
  if (file.size > 24e6) throw new Error(`${file.name} has ${format(file.size / 1e6, 3)} MB; allowed: up to 24 MB`);
  const url = await new Promise((done, failed) => {
    const reader = new FileReader();
    reader.onload = () => done(reader.result);
    reader.onerror = () => failed(reader.error);
    reader.readAsDataURL(file);
  });
  return url.slice(url.indexOf(",") + 1);
}

async function openFile(file) {
  if (file.size > 1e6) throw new Error("more than 1 MB is no screw file");
  const text = await file.text();
  if (/^\[(mechanistic|three_parameter)\]/m.test(text)) {
    if (!last) throw new Error("it holds the numbers of a calibration: open its screw first");
    remember("");
    state.fitted = text;
    ofFile();
    return changed();
  }
  remember("");
  state = { ...structuredClone(FRESH), text, point: state.point };
  last = null;
  ofFile();
  fill();
  changed();
}

// A screw of a file has no numbers of a catalogue beside it; a screw that is not calibrated no points.
function ofFile() {
  if (!state.fitted && !element("forget").hidden) { element("picture").hidden = true; tell([]); }
  if (state.fitted && element("forget").hidden) tell(["The curve is that of a screw calibrated before."]);
  element("forget").hidden = !state.fitted;
  element("sizes").hidden = Boolean(state.text);
  element("sizes-note").textContent = state.text ? "The screw is that of the opened file; change its entries below." : "Diameter and lead are enough. What is not entered is assumed, and marked with its reason.";
}

const tell = (lines, more = []) => element("found").replaceChildren(...lines.map((text) => made("p", { textContent: text })),
  ...(more.length ? [made("details", {}, made("summary", { textContent: "Details of the fit" }), ...more.map((text) => made("p", { textContent: text })))] : []));

async function torques(file) {
  const data = await contentOf(file);
  const { result: found, problem } = (await ask("calibrate", { ...state, data })) ?? {};
  if (problem) {
    tell([`${file.name} not taken: ${problem}`, ...(state.fitted ? ["The calibration before stays in force."] : [])]);
    element("picture").hidden = true;
    return resume({});
  }
  if (!found) return;
  remember("");
  state.fitted = found.fitted;
  const off = found.points.map((one) => Math.abs(one.deviation));
  const mean = off.reduce((sum, x) => sum + x, 0) / off.length;
  tell([`${off.length} torques of ${file.name}: the curve is that of the calibrated screw now, off by ${format(100 * mean, 2)} % of them in the mean, ${format(100 * Math.max(...off), 2)} % at most.`], found.notes);
  Object.assign(element("picture"), { src: `data:image/png;base64,${found.picture}`, alt: "Measured torques and the calibrated law", hidden: false });
  element("forget").hidden = false;
  changed();
}

// A log asks what it needs: the server names the fields.
let asked = null; // the log that they are of
async function log(file, answers = {}) {
  const data = await contentOf(file);
  const found = await ask("identify", { ...state, data, answers });
  if (!found) return;
  const { result, problem } = found;
  const questions = element("questions");
  asked = file;
  if (!questions.childElementCount || questions.hidden) {
    const names = (await ask("questions", {}, false))?.result?.questions ?? [];
    const inputs = names.map((one) => made("input", { type: "text", name: one.name, id: `ask-${one.name}`, title: one.meaning }));
    questions.replaceChildren(...names.map((one, n) => made("div", { className: "entry" }, made("label", { htmlFor: inputs[n].id, textContent: one.label, title: one.meaning }), inputs[n], made("span", { textContent: one.unit }))),
      made("button", { type: "button", textContent: "Identify", onclick: () => log(asked, Object.fromEntries(inputs.map((one) => [one.name, one.value]))) }));
    questions.hidden = false;
  }
  tell([`${file.name}${problem ? `: ${problem}` : ". It changes nothing above; for a calibration drop torques."}`]);
  if (result) element("found").append(made("pre", { textContent: result.text }));
  element("picture").hidden = Boolean(problem);
  if (!problem) Object.assign(element("picture"), { src: `data:image/png;base64,${result.picture}`, alt: "Friction over speed of the log" });
  resume({});
}

const taken = (take) => async (event) => {
  const [file] = event.target.files;
  event.target.value = "";
  try {
    if (file) await take(file);
  } catch (error) {
    element("problem").textContent = `${file.name} not taken: ${error.message}.`;
    element("problem").hidden = false;
  }
};

// --- start ---

function listen() {
  element("open").addEventListener("change", taken(openFile));
  element("torques").addEventListener("change", taken(torques));
  element("log").addEventListener("change", taken((file) => { element("questions").hidden = true; return log(file); }));
  element("save").addEventListener("click", save);
  element("undo").addEventListener("click", undo);
  element("print").addEventListener("click", printed);
  element("cancel").addEventListener("click", () => job?.abort());
  element("forget").addEventListener("click", () => { remember(""); state.fitted = ""; ofFile(); changed(); });
  element("form").addEventListener("submit", (event) => event.preventDefault());
  for (const one of document.querySelectorAll(".take")) one.addEventListener("click", () => take(one.dataset.run, { format: element("format").value, torque_constant_nm_a: element("torque-constant").value }));
  addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey)) return;
    if (event.key === "p" && last) { event.preventDefault(); printed(); }
    if (event.key === "z" && document.activeElement.tagName !== "INPUT") { event.preventDefault(); undo(); }
  });
  addEventListener("resize", () => { plot?.setSize(curveSize()); setTimeout(fitFrame, 600); });
  addEventListener("pagehide", () => job?.abort());
  const zone = element("measured");
  addEventListener("dragover", (event) => { event.preventDefault(); zone.classList.add("over"); });
  addEventListener("dragleave", () => zone.classList.remove("over"));
  addEventListener("drop", (event) => {
    event.preventDefault();
    zone.classList.remove("over");
    const [file] = event.dataTransfer.files;
    if (!file) return;
    const to = file.name.toLowerCase().endsWith(".toml") ? openFile : null;
    if (to) return taken(to)({ target: { files: [file] } });
    file.slice(0, 4000).text().then((head) => taken(/\b(time|zeit)\b/i.test(head) ? log : torques)({ target: { files: [file] } }));
  });
  addEventListener("hashchange", async () => { await takeAddress(); last = null; ofFile(); fill(); changed(); });
}

(async () => {
  const found = await ask("form", {}, false);
  if (!found?.result) return refuse(found ?? { problem: "no answer", problems: [] });
  const { sizes, groups, point, version, text } = found.result;
  if (text) FRESH.text = state.text = text;
  element("sizes").append(...sizes.map((one) => field(one, "sizes")));
  element("point").append(...point.map((one) => field(one, "point")));
  for (const { title, table: name, entries } of groups) {
    element("groups").append(made("details", { id: `group-${name}` }, made("summary", { textContent: title[0].toUpperCase() + title.slice(1) }), ...entries.map((one) => field(one, "changes"))));
  }
  element("version").textContent = `ballscrew-tehl ${version}.`;
  await takeAddress();
  listen();
  ofFile();
  fill();
  document.body.dataset.ready = "yes";
  answer();
})();
