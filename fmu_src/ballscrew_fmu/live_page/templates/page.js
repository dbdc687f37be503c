// The live page. What it computes comes from page_point of the C code (native/page/page.c), in SI units. The state has
// the units of the fields: N, r/min, degC, N.
const RPM = Math.PI / 30, CELSIUS = 273.15;
const element = (id) => document.getElementById(id);
const INPUTS = Object.keys(about.inputs);
const interval = about.nodes !== null;

// --- the model: WebAssembly and its map ---

async function content(id) {
  const text = atob(element(id).textContent), packed = new Uint8Array(text.length);
  for (let n = 0; n < text.length; n++) packed[n] = text.charCodeAt(n); // Uint8Array.from takes 20 times as long
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Numbers whose first bytes come first, then their second ones: such files are smaller.
async function numbers(id) {
  const planes = await content(id), count = planes.length / 8, bytes = new Uint8Array(planes.length);
  for (let k = 0; k < 8; k++) for (let n = 0; n < count; n++) bytes[8 * n + k] = planes[k * count + n];
  return bytes;
}

// Function of an operating point in the units of the state: object with the values by name, valid until the next call.
async function openModel() {
  const { instance } = await WebAssembly.instantiate(await content("wasm"), { env: Math });
  const c = instance.exports;
  const text = (start) => {
    const bytes = new Uint8Array(c.memory.buffer, start);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  };
  const placed = (bytes) => {
    const start = c.page_bytes(bytes.length);
    new Uint8Array(c.memory.buffer, start, bytes.length).set(bytes);
    return start;
  };
  const map = await numbers("map");
  const problem = text(c.page_open(placed(map), map.length, about.law, about.lead, about.seal));
  if (problem) throw new Error(problem);
  if (interval) c.page_take_ends(placed(await numbers("ends")), ...about.nodes);
  const values = new Float64Array(c.memory.buffer, c.page_values(), c.page_count());
  const found = {}, place = {};
  for (let n = 0; n < values.length; n++) {
    place[text(c.page_name(n))] = n;
    Object.defineProperty(found, text(c.page_name(n)), { get: () => values[n], enumerable: true });
  }
  return (at) => {
    values[place.preload] = at.preload;
    values[place.speed] = at.speed * RPM;
    values[place.temperature] = at.temperature + CELSIUS;
    values[place.axial_load] = at.axial_load ?? 0;
    c.page_point();
    return found;
  };
}

// --- state and address ---

const state = { ...about.start, log: true, points: [], source: "" }; // source: name of the points
const wrong = {}; // why the text of a field is no value, by input; the state has the last value then
const allowed = (key, x) => x >= (about.inputs[key].least ?? -Infinity) && x <= (about.inputs[key].most ?? Infinity);

function toAddress() {
  const given = new URLSearchParams(INPUTS.map((key) => [key, state[key]]));
  if (!state.log) given.set("log", "0");
  if (state.points.length && state.points.length <= 300) {
    given.set("points", state.points.map((p) => [...INPUTS.map((key) => p[key]), p.torque].map((x) => format(x, 7)).join("_")).join("~"));
  }
  return `#${given}`;
}

function ofAddress(address) {
  const given = new URLSearchParams(address.replace(/^#/, ""));
  const number = (text) => (text?.trim() && Number.isFinite(Number(text)) ? Number(text) : null);
  const row = (texts) => Object.fromEntries([...INPUTS, "torque"].map((key, n) => [key, number(texts[n])]));
  const points = (given.get("points") ?? "").split("~").map((text) => row(text.split("_")));
  return {
    ...Object.fromEntries(INPUTS.map((key) => [key, number(given.get(key))]).map(([key, x]) => [key, x !== null && allowed(key, x) ? x : about.start[key]])),
    log: given.get("log") !== "0",
    points: points.filter((point) => INPUTS.every((key) => point[key] !== null && allowed(key, point[key])) && [point.preload, point.speed, point.torque].every((x) => x > 0)),
    source: "address of this page",
  };
}

// --- results beside the fields ---

const RESULTS = [
  ...about.parts.map(([name, label]) => [`${label} part`, (v) => v[name], "N m"]),
  [`torque of ${about.side} A`, (v) => v.friction_torque_nut_a, "N m"],
  [`torque of ${about.side} B`, (v) => v.friction_torque_nut_b, "N m"],
  ["friction power", (v) => v.power_loss, "W"],
  ["least film", (v) => 1e6 * v.film_thickness_min, "\u00b5m"],
  ["central film, screw", (v) => 1e6 * v.film_thickness_central_screw, "\u00b5m"],
  ["central film, nut", (v) => 1e6 * v.film_thickness_central_nut, "\u00b5m"],
  ["lambda", (v) => v.lambda_ratio, ""],
  ["temperature rise in the film", (v) => v.film_temperature_rise, "K"],
  ["contact pressure, highest", (v) => 1e-9 * v.contact_pressure_max, "GPa", about.loaded],
  ["ball load, highest", (v) => v.ball_load_max, "N", about.loaded],
  [`axial force of ${about.side} A`, (v) => v.force_nut_a, "N"],
  [`axial force of ${about.side} B`, (v) => v.force_nut_b, "N"],
  ["efficiency, driving", (v) => (state.axial_load && about.lead ? 100 * v.driving_efficiency : null), "%"],
  ["efficiency, backdriving", (v) => (state.axial_load && about.lead ? 100 * v.backdriving_efficiency : null), "%"],
];

const named = (key) => `${about.inputs[key].label.toLowerCase()} ${format(state[key], 6)} ${about.inputs[key].unit}`;

function outside(clamped) {
  const { preload, speed, temperature } = about.inputs;
  const limits = [
    `the map has ${format(preload.min)} to ${format(preload.max)} N`, `the map ends at ${format(speed.max)} r/min`,
    `the map has ${format(temperature.min)} to ${format(temperature.max)} degC`,
    `one ${about.side} has more than ${format(preload.max)} N, where the map ends`,
  ];
  const found = INPUTS.flatMap((key, n) => (clamped >> n & 1 ? [`${named(key)} (${limits[n]})`] : []));
  if (!found.length) return "";
  const light = clamped === 1 && state.preload < preload.min;
  return `Out of range: ${found.join("; ")}. The numbers are ${light ? "extrapolated from the lowest preload" : "those at the edge"} of the map.`;
}

// Words on a trend of the torque that thick films do not have: nut_map.trend, by differences of the same steps.
function trend(at) {
  const [thick, kelvin, log, least, words] = about.trend, { temperature } = at, speed = Math.abs(at.speed);
  const within = (key, x) => Math.min(Math.max(x, about.inputs[key].min), about.inputs[key].max);
  if (!(model(at).lambda_ratio > thick) || within("speed", speed) !== speed || within("temperature", temperature) !== temperature) return "";
  const change = (key, ...ends) => {
    const [first, second] = ends.map((x) => model({ ...at, speed, [key]: within(key, x) }).friction_torque);
    return Math.abs(second - first) > least * first ? second - first : 0;
  };
  const rises = change("temperature", temperature - kelvin / 2, temperature + kelvin / 2) > 0;
  return words[rises + 2 * (change("speed", speed * Math.exp(-log / 2), speed * Math.exp(log / 2)) < 0)];
}

// What the command torque says of the results at a point with them.
function cautions(at) {
  const odd = trend(at), v = model(at); // the values are those of the last call
  const found = about.cautions.filter(([name, , least, most]) => v[name] && (v[name] < least || v[name] > (most ?? Infinity)));
  const [relieved, loaded] = [v.force_nut_a, v.force_nut_b].sort((a, b) => a - b);
  const slip = v.preload > 0 && relieved > 0 && relieved < about.slip * loaded;
  return [
    ...(odd ? [`Caution: ${odd}.`] : []),
    ...found.map(([name, label, , , words]) => `Caution: ${label} ${format(1e6 * v[name], 2)} \u00b5m, ${words}.`),
    ...(slip ? ["Caution: oversize balls slip on one set of flanks: outside the map, the torque is up to 40 % off."] : []),
  ];
}

function table(id, head, rows) {
  const cells = (row, tag) => {
    const line = document.createElement("tr");
    for (const cell of row) {
      const one = line.appendChild(document.createElement(cell.heads ? "th" : tag));
      if (cell.heads) one.scope = "row";
      cell instanceof Node ? one.append(cell) : (one.textContent = cell.heads ?? cell.text ?? cell);
      if (cell.far) one.className = "far";
    }
    return line;
  };
  element(id).tHead?.replaceChildren(...(rows.length ? [cells(head, "th")] : []));
  element(id).tBodies[0].replaceChildren(...rows.map((row) => cells(row, "td")));
}

function headline(v) {
  const bad = Object.keys(wrong);
  if (bad.length) return ["-", `not computed: results and plots are still those of ${bad.map(named).join(", ")}, last valid`];
  const torque = `${format(v.friction_torque)} N m`;
  if (state.speed === 0) return [torque, `at rest; it takes ${format(v.breakaway_torque)} N m to start`];
  if (!interval) return [torque, about.meaning];
  if (!state.preload) return [torque, v.friction_torque ? "no interval at preload 0" : "no preload, so no torque and no interval"];
  const ends = [v.torque_low, v.torque_high].sort((a, b) => a - b);
  return [torque, `interval ${format(ends[0], 3)} to ${format(ends[1], 3)} N m, ${about.meaning}${state.axial_load ? "; approximate under an axial load" : ""}`];
}

// Friction at the screw by part: label, value, low, high; bilinear in ln speed and temperature, then the sum.
function axisParts(v) {
  const { speeds, temperatures, parts } = about.axis, sign = state.speed < 0 ? -1 : 1;
  const cell = (nodes, x) => {
    const at = Math.min(Math.max(x, nodes[0]), nodes.at(-1)), n = Math.max(nodes.findIndex((one) => one >= at), 1);
    return [n, (at - nodes[n - 1]) / (nodes[n] - nodes[n - 1])];
  };
  const [i, s] = cell(speeds.map(Math.log), Math.log(Math.abs(state.speed))), [j, t] = cell(temperatures, state.temperature);
  const inside = (rows) => [[j - 1, 1 - t], [j, t]].reduce((sum, [k, w]) => sum + w * ((1 - s) * rows[k][i - 1] + s * rows[k][i]), 0);
  const ends = [v.torque_low, v.torque_high].map((x) => (interval && x ? sign * x : NaN)).sort((a, b) => a - b);
  const all = [["nut", sign * v.friction_torque, ...ends], ...parts.map(([label, values]) => [label, ...values.map(inside)])];
  const [sum, below, above] = [([, x]) => x, ([, x, low]) => (x - low) ** 2, ([, x, , high]) => (high - x) ** 2].map((f) => all.reduce((total, row) => total + f(row), 0));
  return [...all, ["sum", sum, sum - Math.sqrt(below), sum + Math.sqrt(above)]];
}

function axisTable(v) {
  if (!about.axis) return;
  const shown = ([label, x, low, high]) => [{ heads: label }, withUnit(x, "N m"), Number.isFinite(low) ? `${format(low, 3)} to ${format(high, 3)}` : ""];
  table("axis", [], state.speed ? axisParts(v).map(shown) : [[{ heads: "at rest" }, "friction balances the drive"]]);
}

// Fills the results. Returns a sentence about them.
function results() {
  const cares = cautions(state), v = model(state), stale = Object.values(wrong).join(" "), [torque, words] = headline(v);
  element("headline").textContent = torque;
  element("headline-interval").textContent = words;
  element("desk").classList.toggle("stale", stale !== "");
  table("results", [], RESULTS.map(([label, value, unit, loaded]) => [
    { heads: loaded && state.axial_load ? `${label} (${loaded})` : label }, withUnit(value(v), unit),
  ]));
  axisTable(v);
  const text = [outside(v.clamped), ...cares].join(" ").trim();
  if (element("outside").textContent !== text) element("outside").textContent = text;
  element("outside").hidden = !text;
  return stale ? `${stale} ${words}.` : `${format(v.friction_torque, 3)} newton metres at ${INPUTS.map(named).join(", ")}. ${text}`;
}

// --- plots ---

function draw() {
  asked = false;
  results();
  for (const plot of PLOTS) drawPlot(plot, plots[plot.id].made, model, state);
  if (element("curve").closest("details").open) numbersOfCurve();
}

function numbersOfCurve() {
  const { min, max } = about.inputs.speed;
  const [curve, films] = PLOTS, shown = [...curve.lines, films.lines[0], films.lines.at(-1)];
  const head = ["speed [r/min]", ...shown.map(({ label }) => label), ""].map((label, n) => (n && n <= curve.lines.length ? `${label} [N\u00a0m]` : label));
  head[head.indexOf("least film")] = "least film [\u00b5m]";
  table("curve", head.slice(0, -1), spaced(min, max, 13, true).map((x) => {
    const v = model({ ...state, speed: x });
    return [x, ...shown.map(({ value }) => value(v))].map((y) => format(y));
  }));
}

// --- measured points ---

function comparePoints() {
  const rows = state.points.map((point) => {
    const v = model(point), computed = v.friction_torque;
    return { point, computed, share: computed / point.torque - 1, outside: v.clamped !== 0, held: point.torque >= v.torque_low && point.torque <= v.torque_high };
  });
  const [preload, speed, ...others] = INPUTS.filter((key) => key !== "axial_load" || state.points.some((point) => point.axial_load));
  const head = (key) => `${about.inputs[key].label.toLowerCase()} [${about.inputs[key].unit}]`;
  table("points", [head(preload), head(speed), "measured [N\u00a0m]", "deviation", "computed [N\u00a0m]", ...others.map(head), ""], rows.map(({ point, computed, share, outside }) => {
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: "show" });
    button.setAttribute("aria-label", `show the operating point of ${format(point.torque)} N m`);
    button.onclick = () => {
      change(Object.fromEntries(INPUTS.map((key) => [key, point[key]])));
      element("torque").scrollIntoView({ block: "center" });
    };
    const percent = `${share >= 0 ? "+" : ""}${(100 * share).toFixed(1)} %${outside ? ", outside the map" : ""}`;
    const text = (keys) => keys.map((key) => format(point[key]));
    return [...text([preload, speed]), format(point.torque), { text: percent, far: Math.abs(share) > 0.2 }, format(computed), ...text(others), button];
  }));
  const mean = (value) => rows.reduce((sum, row) => sum + value(row), 0) / rows.length;
  const largest = Math.max(...rows.map((row) => Math.abs(row.share)));
  const beyond = rows.filter((row) => row.outside).length;
  const ratio = Math.exp(mean((row) => -Math.log1p(row.share)));
  element("deviation").textContent = !rows.length ? "" : [
    `${state.source}: ${rows.length} point${rows.length > 1 ? "s" : ""}: mean deviation (computed over measured, minus 1) ${(100 * mean((row) => Math.abs(row.share))).toFixed(2)} %, with its sign ${(100 * mean((row) => row.share)).toFixed(2)} %, largest ${(100 * largest).toFixed(1)} %`,
    interval ? `; ${rows.filter((row) => row.held).length} inside the interval` : "", beyond ? `; ${beyond} outside the map` : "",
    ratio > 10 || ratio < 0.1 ? `; measured over computed: ${format(ratio, 2)}, is the unit right?` : "",
    rows.length > 300 ? "; the address of this page does not have them (more than 300)" : "", ". In the plot above: filled at its preload (2 %), temperature (1 K) and axial load, hollow at others.",
  ].join("");
  element("forget").hidden = !rows.length;
}

async function takeFile(file) {
  try {
    if (file.size > 2e6) throw new Error("more than 2 MB");
    const points = readPoints(decoded(new Uint8Array(await file.arrayBuffer())), about.units, state.temperature + CELSIUS);
    const shown = points.map((p) => ({ ...p, speed: p.speed / RPM, temperature: p.temperature - CELSIUS }));
    shown.forEach((point, n) => {
      const key = INPUTS.find((one) => !allowed(one, point[one])), { label, least, most, unit } = about.inputs[key] ?? {};
      if (key) throw new Error(`point ${n + 1}: ${label.toLowerCase()} ${format(point[key])} ${unit}; allowed: ${least ?? "any"} to ${most ?? "any"} ${unit}`);
    });
    element("bad-file").hidden = true;
    const first = shown.some((point) => near(point, state)) ? {} : Object.fromEntries(INPUTS.map((key) => [key, shown[0][key]]));
    change({ ...first, points: shown, source: file.name });
    if (points[0].assumed) element("deviation").textContent += ` No column temperature: ${format(state.temperature)} degC taken.`;
    if ("speed" in first) element("deviation").textContent += " Operating point: that of the first point.";
  } catch (error) {
    const kept = state.points.length ? ` The points shown are the earlier ones, of ${state.source}.` : "";
    element("bad-file").textContent = `${file.name} not taken: ${error.message}.${kept}`;
    element("bad-file").hidden = false;
  }
}

// --- fields, sliders, events ---

// Position of a slider, 0 to 200, of a value; and back, with three digits, so that a step of the slider changes it.
const place = ({ min, max, log }, x) => 200 * (log ? Math.log(Math.max(x, min) / min) / Math.log(max / min) : (x - min) / (max - min));
const valueAt = ({ min, max, log }, n) => {
  const value = Number((log ? min * (max / min) ** (n / 200) : min + (max - min) * n / 200).toPrecision(3));
  return Math.min(Math.max(value, min), max);
};

// Takes the text of a field. One comma or point before three digits may also part thousands: refused where both may be.
function takeText(key, field) {
  const { least, most, unit } = about.inputs[key], text = field.value.trim().replace("\u2212", "-"), value = decimal(text);
  const thousands = /^[+-]?[1-9]\d{0,2}[.,]\d{3}$/.test(text) && allowed(key, Number(text.replace(/[.,]/, "")));
  if (allowed(key, value) && !thousands) return change({ [key]: value }, field);
  const range = most !== null ? `${least} to ${most} ${unit}` : least !== null ? `${least} ${unit} or more` : `in ${unit}`;
  const short = text.replace(/[.,]?0+$/, ""), decimals = short === text ? `${text}0` : short;
  wrong[key] = thousands ? `Write ${text.replace(/[.,]/, "")} or ${decimals} for ${text}.`
    : Number.isNaN(value) ? `Needs a number, ${range}; no mark for thousands.` : `Allowed: ${range}.`;
  change({}, field);
}

function fillFields(edited) {
  for (const key of INPUTS) {
    const { min, max, unit } = about.inputs[key], field = element(key), slider = element(`${key}-slider`);
    if (edited !== field && !wrong[key]) field.value = format(state[key], 7);
    field.setAttribute("aria-invalid", key in wrong);
    element(`${key}-range`).textContent = wrong[key] ?? (key === "speed" ? `map up to ${format(max)} ${unit}` : `map ${format(min)} to ${format(max)} ${unit}`);
    if (edited !== slider) slider.value = place(about.inputs[key], state[key]);
    slider.setAttribute("aria-valuetext", `${format(state[key])} ${unit}`);
  }
  element("log").checked = state.log;
}

let model, plots = {}, asked = false, told, stored;

// Makes the plots over an input, or all.
function makePlots(over) {
  for (const plot of PLOTS.filter((one) => !over || one.over === over)) {
    plots[plot.id]?.made.destroy();
    plots[plot.id] = makePlot(plot, state);
  }
}

// New values of the state; edited: the field or slider that they come from.
function change(values, edited) {
  const log = state.log;
  for (const key of Object.keys(values)) delete wrong[key];
  Object.assign(state, values);
  fillFields(edited);
  if (log !== state.log) makePlots("speed");
  if ("points" in values) comparePoints();
  if (!asked) requestAnimationFrame(draw);
  asked = true;
  clearTimeout(told);
  told = setTimeout(() => { element("said").textContent = results(); }, 700);
  clearTimeout(stored);
  if (location.protocol !== "about:") stored = setTimeout(() => history.replaceState(null, "", toAddress()), 200);
}

function listen() {
  for (const key of INPUTS) {
    const field = element(key), slider = element(`${key}-slider`);
    const slide = (n) => change({ [key]: valueAt(about.inputs[key], n) }, slider);
    field.addEventListener("input", () => takeText(key, field));
    field.addEventListener("keydown", (event) => { // to the next other value of the slider
      const step = { ArrowUp: 1, ArrowDown: -1 }[event.key];
      if (!step) return;
      event.preventDefault();
      for (let n = Math.min(200, Math.round(place(about.inputs[key], state[key]))); n >= 0 && n <= 200; n += step) {
        if ((valueAt(about.inputs[key], n) - state[key]) * step <= 0) continue;
        slider.value = n;
        return slide(n);
      }
    });
    slider.addEventListener("input", () => slide(Number(slider.value)));
  }
  element("inputs").addEventListener("submit", (event) => event.preventDefault());
  element("log").addEventListener("change", (event) => change({ log: event.target.checked }));
  element("curve").closest("details").addEventListener("toggle", draw);
  element("file").addEventListener("change", (event) => { takeFile(event.target.files[0]); event.target.value = ""; });
  element("published")?.addEventListener("click", () => change({ points: about.published, source: "published points" }));
  element("forget").addEventListener("click", () => change({ points: [] }));
  const zone = element("measured");
  addEventListener("dragover", (event) => { event.preventDefault(); zone.classList.add("over"); });
  addEventListener("dragleave", () => zone.classList.remove("over"));
  addEventListener("drop", (event) => {
    event.preventDefault();
    zone.classList.remove("over");
    if (event.dataTransfer.files.length) takeFile(event.dataTransfer.files[0]);
  });
  addEventListener("hashchange", () => change(ofAddress(location.hash)));
  const redraw = () => Object.values(plots).forEach(({ made, size }) => { made.setSize(size()); made.redraw(false, true); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  // on paper: light colours, width of a page
  for (const [event, on] of [["beforeprint", true], ["afterprint", false]]) {
    addEventListener(event, () => { document.documentElement.classList.toggle("printing", on); redraw(); });
  }
}

(async () => {
  try {
    model = await openModel();
    window.live = { model, state, change, axisParts }; // for the console: live.model({ ...live.state, speed: 100 }).friction_torque
    element("desk").hidden = false;
    Object.assign(state, ofAddress(location.hash));
    makePlots();
    listen();
    change({ points: state.points });
    requestAnimationFrame(() => requestAnimationFrame(() => performance.mark("first picture")));
  } catch (error) {
    element("problem").textContent = `This page cannot compute in this browser: ${error.message}. It needs WebAssembly and DecompressionStream (browsers since 2023).`;
    element("problem").hidden = false;
  }
})();
