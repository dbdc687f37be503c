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
  const { instance } = await WebAssembly.instantiate(await content("wasm"));
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
  c._initialize();
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

const state = { ...about.start, points: [], source: "" }; // source: name of the points
const allowed = (key, x) => {
  const { least, most } = about.inputs[key];
  return Number.isFinite(x) && x >= (least ?? -Infinity) && x <= (most ?? Infinity);
};

function ofAddress(address) {
  const texts = [...new URLSearchParams(address.slice(1))];
  const values = texts.filter(([key, text]) => INPUTS.includes(key) && text && allowed(key, Number(text)));
  return Object.fromEntries(values.map(([key, text]) => [key, Number(text)]));
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
  ["contact pressure, highest", (v) => 1e-9 * v.contact_pressure_max, "GPa"],
  ["ball load, highest", (v) => v.ball_load_max, "N"],
  [`axial force of ${about.side} A`, (v) => v.force_nut_a, "N"],
  [`axial force of ${about.side} B`, (v) => v.force_nut_b, "N"],
  ["efficiency, driving", efficiency("driving_efficiency"), "%"],
  ["efficiency, backdriving", efficiency("backdriving_efficiency"), "%"],
];

// Words on values at which the results hold less, or ""; clamped: bits in the order of the inputs.
function cautions(v) {
  const texts = INPUTS.filter((_, n) => v.clamped >> n & 1).map((key) => {
    const { label, unit, min, max } = about.inputs[key];
    if (key === "axial_load") return `one ${about.side} has more force than the ${format(max)} N of the map`;
    return `${label.toLowerCase()} ${format(state[key], 6)} ${unit} (map ${format(min)} to ${format(max)} ${unit})`;
  });
  const outside = texts.length ? [`Out of range: ${texts.join("; ")}. The numbers are those at the edge of the map, below its preload extrapolated.`] : [];
  const [thinnest, thickest] = about.films, least = v.film_thickness_min;
  const most = Math.max(v.film_thickness_central_screw, v.film_thickness_central_nut);
  if (least && least < thinnest) outside.push(`Caution: least film ${format(1e6 * least, 2)} \u00b5m, oil is no continuum there.`);
  if (most > thickest) outside.push(`Caution: film ${format(1e6 * most, 2)} \u00b5m, above a tenth of the ball radius.`);
  return outside.join(" ");
}

function headline(v) {
  const torque = `${format(v.friction_torque)} N m`, wrong = INPUTS.find((key) => !element(key).validity.valid);
  if (wrong) return ["-", `${about.inputs[wrong].label.toLowerCase()} ${element(wrong).validationMessage}; results and plots are those of the last valid inputs`];
  if (state.speed === 0) return [torque, `at rest; it takes ${format(v.breakaway_torque)} N m to start`];
  if (!interval) return [torque, about.meaning];
  if (!state.preload) return [torque, "no interval at preload 0"];
  const [low, high] = [v.torque_low, v.torque_high].sort((a, b) => a - b);
  const load = state.axial_load ? "; approximate under an axial load" : "";
  return [torque, `interval ${format(low, 3)} to ${format(high, 3)} N m, ${about.meaning}${load}`];
}

function fillTable(id, head, rows) {
  const lineOf = (cells, tag) => {
    const row = document.createElement("tr");
    row.append(...cells.map((text) => Object.assign(document.createElement(tag), { textContent: text })));
    return row;
  };
  element(id).tHead.replaceChildren(...(rows.length && head.length ? [lineOf(head, "th")] : []));
  element(id).tBodies[0].replaceChildren(...rows.map((cells) => lineOf(cells, "td")));
}

function draw() {
  drawing = false;
  const v = model(state), [torque, words] = headline(v), text = cautions(v);
  element("headline").textContent = torque;
  element("headline-interval").textContent = words;
  element("desk").classList.toggle("stale", torque === "-");
  element("outside").textContent = text;
  element("outside").hidden = !text;
  fillTable("results", [], RESULTS.map(([label, value, unit]) => [label, withUnit(value(v), unit)]));
  PLOTS.forEach((plot, n) => drawPlot(plot, plots[n], model, state));
}

// --- measured points ---

function comparePoints() {
  const rows = state.points.map((point) => {
    const v = model(point), error = v.friction_torque / point.torque - 1;
    const inside = point.torque >= v.torque_low && point.torque <= v.torque_high;
    return { point, computed: v.friction_torque, error, inside, outside: v.clamped !== 0 };
  });
  const percent = (x, digits) => `${x >= 0 ? "+" : ""}${(100 * x).toFixed(digits)} %`;
  const head = [...INPUTS.map((key) => `${about.inputs[key].label.toLowerCase()} [${about.inputs[key].unit}]`),
    "measured [N\u00a0m]", "computed [N\u00a0m]", "deviation"];
  fillTable("points", head, rows.map(({ point, computed, error, outside }) => [
    ...INPUTS.map((key) => format(point[key])), format(point.torque), format(computed), `${percent(error, 1)}${outside ? ", outside the map" : ""}`,
  ]));
  const mean = (value) => rows.reduce((sum, row) => sum + value(row), 0) / rows.length;
  const largest = Math.max(...rows.map((row) => Math.abs(row.error)));
  const beyond = rows.filter((row) => row.outside).length;
  element("deviation").textContent = !rows.length ? "" : [
    `${state.source}, ${rows.length} points: mean deviation of computed from measured torque ${(100 * mean((row) => Math.abs(row.error))).toFixed(2)} %`,
    `with its sign ${percent(mean((row) => row.error), 2)}`, `largest ${(100 * largest).toFixed(1)} %`,
    ...(interval ? [`${rows.filter((row) => row.inside).length} inside the interval`] : []), ...(beyond ? [`${beyond} outside the map`] : []),
  ].join(", ");
  element("forget").hidden = !rows.length;
}

async function takeFile(file) {
  try {
    const points = readPoints(decoded(new Uint8Array(await file.arrayBuffer())), about.units, state.temperature + CELSIUS);
    const shown = points.map((p) => ({ ...p, speed: p.speed / RPM, temperature: p.temperature - CELSIUS }));
    shown.forEach((point, n) => {
      const key = INPUTS.find((one) => !allowed(one, point[one])), { label, least, most, unit } = about.inputs[key] ?? {};
      if (key) throw new Error(`point ${n + 1}: ${label.toLowerCase()} ${format(point[key])} ${unit}; allowed: ${least ?? "any"} to ${most ?? "any"} ${unit}`);
    });
    element("bad-file").hidden = true;
    change({ points: shown, source: file.name });
  } catch (error) {
    element("bad-file").textContent = `${file.name} not read: ${error.message}.`;
    element("bad-file").hidden = false;
  }
}

// --- fields, sliders, events ---

// Position of a slider, 0 to 200, of a value; and back, with three digits.
const position = ({ min, max, log }, x) => 200 * (log ? Math.log(Math.max(x, min) / min) / Math.log(max / min) : (x - min) / (max - min));
const valueAt = ({ min, max, log }, n) => {
  const value = Number((log ? min * (max / min) ** (n / 200) : min + (max - min) * n / 200).toPrecision(3));
  return Math.min(Math.max(value, min), max);
};

let model, plots, stored, drawing = false;

// New values of the state; edited: the field or slider that they come from.
function change(values, edited) {
  Object.assign(state, values);
  for (const key of INPUTS) {
    const field = element(key), slider = element(`${key}-slider`);
    if (edited !== field && (key in values || field.validity.valid)) {
      field.value = format(state[key], 7);
      field.setCustomValidity("");
    }
    if (edited !== slider) slider.value = position(about.inputs[key], state[key]);
  }
  if ("points" in values) comparePoints();
  if (!drawing) requestAnimationFrame(draw);
  drawing = true;
  if (location.protocol === "about:") return; // in a frame of the report
  clearTimeout(stored);
  stored = setTimeout(() => history.replaceState(null, "", `#${new URLSearchParams(INPUTS.map((key) => [key, state[key]]))}`), 200);
}

function listen() {
  for (const key of INPUTS) {
    const field = element(key), slider = element(`${key}-slider`);
    field.addEventListener("input", () => {
      const value = field.value.trim() ? Number(field.value) : NaN, { least, most, unit } = about.inputs[key];
      field.setCustomValidity(allowed(key, value) ? "" : `needs a number with a decimal point, ${least ?? "any"} to ${most ?? "any"} ${unit}`);
      change(field.validity.valid ? { [key]: value } : {}, field);
    });
    slider.addEventListener("input", () => change({ [key]: valueAt(about.inputs[key], Number(slider.value)) }, slider));
  }
  element("file").addEventListener("change", (event) => { takeFile(event.target.files[0]); event.target.value = ""; });
  element("forget").addEventListener("click", () => change({ points: [] }));
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    if (event.dataTransfer.files.length) takeFile(event.dataTransfer.files[0]);
  });
  addEventListener("hashchange", () => change(ofAddress(location.hash)));
}

(async () => {
  try {
    model = await openModel();
    window.live = { model, state, change }; // for the console: live.model({ ...live.state, speed: 100 }).friction_torque
    element("desk").hidden = false;
    plots = PLOTS.map(makePlot);
    listen();
    change(ofAddress(location.hash));
  } catch (error) {
    element("problem").textContent = `This page cannot compute in this browser: ${error.message}. It needs WebAssembly and DecompressionStream (browsers since 2023).`;
    element("problem").hidden = false;
  }
})();
