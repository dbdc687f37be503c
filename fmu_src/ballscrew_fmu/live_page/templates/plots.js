// The plots of the live page, by uPlot. Each has lines over one input, the others being those of the state.

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const format = (x, digits = 4) => (x === null || !Number.isFinite(x) ? "-" : String(Number(x.toPrecision(digits))));
const printing = () => document.documentElement.classList.contains("printing");
const spaced = (lo, hi, count, log) => Array.from({ length: count }, (_, n) => {
  const share = n / (count - 1);
  return log ? lo * (hi / lo) ** share : lo + (hi - lo) * share;
});

const DASHES = { "--viscous": [8, 4], "--hysteresis": [3, 3], "--sliding": [10, 4, 2, 4] };
const MICRO = 1e6, PER_CENT = 100;
// label, colour, value of the results at a point; more: options of uPlot
const line = (label, name, value, more) => ({ label, name, value, more });
const held = (value) => (v) => (v.preload ? value(v) : null); // by preload: else no interval
const ends = about.nodes === null ? [] : [
  line("low", "--total", held((v) => v.torque_low), { width: 1, dash: [2, 3] }),
  line("high", "--total", held((v) => v.torque_high), { width: 1, dash: [2, 3] }),
];
const torque = line("torque", "--total", (v) => v.friction_torque, { width: 3 });
const film = line("least film", "--total", (v) => MICRO * v.film_thickness_min, { width: 3 });
const useful = (value) => (v) => (v.axial_load && about.lead ? PER_CENT * value(v) : null);
const forces = [line(`${about.side} A`, "--total", (v) => v.force_nut_a), line(`${about.side} B`, "--viscous", (v) => v.force_nut_b)];
const shares = [
  line("driving", "--total", useful((v) => v.driving_efficiency)),
  line("backdriving", "--sliding", useful((v) => v.backdriving_efficiency)),
];
const aboveZero = (_, lo, hi) => [0, 1.08 * (hi || 1)];
// marks: lines with a dot at the operating point; right: axis of the lines with this scale
const PLOTS = [
  {
    id: "torque", over: "speed", y: "torque [N m]", range: aboveZero, measured: true, marks: [torque],
    lines: [torque, ...ends, ...about.parts.map(([name, label]) => line(label, `--${name.split("_")[0]}`, (v) => v[name]))],
  },
  {
    id: "film", over: "speed", y: "film [\u00b5m]", right: "lambda", marks: [film],
    lines: [
      film, line("screw", "--viscous", (v) => MICRO * v.film_thickness_central_screw),
      line("nut", "--hysteresis", (v) => MICRO * v.film_thickness_central_nut),
      line("lambda", "--sliding", (v) => v.lambda_ratio, { scale: "lambda" }),
    ],
  },
  { id: "warm", over: "temperature", y: "torque [N m]", range: aboveZero, lines: [torque, ...ends], marks: [torque] },
  { id: "forces", over: "axial_load", y: "force [N]", range: aboveZero, lines: forces, marks: forces },
  { id: "efficiency", over: "axial_load", y: "efficiency [%]", range: () => [0, 100], lines: shares, marks: shares },
];

const withUnit = (x, unit) => (format(x) === "-" || !unit ? format(x) : `${format(x)} ${unit}`);
const series = ({ label, name, more }, unit) => ({
  label, stroke: () => colour(name), width: 2, dash: DASHES[name], points: { show: false }, pxAlign: 0, value: (_, y) => withUnit(y, more?.scale ? "" : unit), ...more,
});
const dots = (label, name, filled) => ({
  label, stroke: () => colour(name), paths: () => null, value: () => "",
  points: { show: true, size: 9, width: 1.5, stroke: () => colour(name), fill: () => colour(filled ? name : "--paper") },
});
const axis = (label, more) => ({
  label, labelSize: 20, labelGap: 0, size: 50, stroke: () => colour("--ink"), font: "12px system-ui, sans-serif",
  labelFont: "12px system-ui, sans-serif", grid: { stroke: () => colour("--line"), width: 1 },
  ticks: { stroke: () => colour("--line"), width: 1, size: 4 }, values: (_, splits) => splits.map((x) => (x === null ? "" : format(x))), ...more,
});

// Round places of a logarithmic axis, and which of them have room for a number: 1 of each decade, 1 and 3, or 1, 2, 5.
const ROUND = Array.from({ length: 90 }, (_, n) => Number(`${1 + n % 9}e${Math.floor(n / 9) - 3}`));
const roundPlaces = (_, __, lo, hi) => ROUND.filter((x) => x >= lo && x <= hi);
const withRoom = (u, places) => {
  const { min, max } = u.scales.x, decade = u.bbox.width / devicePixelRatio / Math.log10(max / min);
  const firsts = decade > 180 ? "125" : decade > 90 ? "13" : "1";
  return places.map((x) => (firsts.includes(x.toExponential()[0]) ? x : null));
};

function makePlot({ id, over, y, right, range, measured, lines, marks }, state) {
  const place = document.getElementById(id), { label, unit, min, max } = about.inputs[over];
  const log = over === "speed" && state.log;
  const tall = place.classList.contains("tall");
  const size = () => (printing() ? { width: tall ? 680 : 325, height: tall ? 340 : 165 } : { width: place.clientWidth, height: tall ? 340 : 240 });
  const names = [null, ...lines.map((one) => one.name), ...marks.map(() => "--mark"), "--ink", "--soft"];
  const high = lines.findIndex((one) => one.label === "high") + 1;
  const made = new uPlot({
    ...size(),
    axes: [
      axis(`${label.toLowerCase()} [${unit}]`, {
        size: 32, space: over === "axial_load" ? 70 : 45, ...(log ? { splits: roundPlaces, filter: withRoom } : {}),
      }), axis(y),
      ...(right ? [axis(right, { scale: right, side: 1, grid: { show: false } })] : []),
    ],
    series: [
      { label: label.toLowerCase(), value: (_, v) => withUnit(v, unit) }, ...lines.map((one) => series(one, y.match(/\[(.*)\]/)[1])),
      ...marks.map((one, n) => dots(marks.length > 1 ? `${one.label} here` : "operating point", "--mark", !n)),
      ...(measured ? [dots("measured here", "--ink", true), dots("measured elsewhere", "--soft", false)] : []),
    ],
    bands: high ? [{ series: [high, high - 1], fill: () => colour("--band") }] : [],
    scales: {
      x: { time: false, distr: log ? 3 : 1, range: () => [over === "speed" && !log ? 0 : min, max] },
      y: range ? { range } : { distr: 3 }, ...(right ? { [right]: { distr: 3 } } : {}),
    },
    cursor: { drag: { x: false, y: false }, points: { size: 7 } },
    legend: { markers: { stroke: (_, n) => (n ? `var(${names[n]})` : null) } }, // in CSS: the legend is made once, dark or light
  }, [[], ...lines.map(() => []), ...marks.map(() => []), ...(measured ? [[], []] : [])], place);
  new ResizeObserver(() => requestAnimationFrame(() => made.setSize(size()))).observe(place);
  return { made, size };
}

// A measured point that belongs to the curve of the state.
const near = (p, state) => Math.abs(p.preload / state.preload - 1) <= 0.02 && Math.abs(p.temperature - state.temperature) <= 1
  && Math.abs(p.axial_load - state.axial_load) <= 0.02 * state.preload;

function drawPlot({ over, y, measured, lines, marks }, made, model, state) {
  const { min, max, label, unit } = about.inputs[over], own = over === "speed" ? Math.abs(state[over]) : state[over];
  const here = Math.min(own, max), visible = here >= (over === "speed" && !state.log ? 0 : min);
  const places = spaced(min, max, 121, over === "speed" && state.log).map((x) => ({ x }));
  if (visible) places.push({ x: here, here: true });
  if (measured) places.push(...state.points.map((point) => ({ x: point.speed, point })));
  places.sort((a, b) => a.x - b.x);
  const columns = Array.from({ length: 1 + lines.length + marks.length + (measured ? 2 : 0) }, () => []);
  for (const { x, here: marked, point } of places) {
    const v = model({ ...state, [over]: x }), beyond = over === "axial_load" && v.clamped & 8;
    const row = [x, ...lines.map(({ value }) => (beyond ? null : value(v))), ...marks.map(({ value }) => (marked && !beyond ? value(v) : null))];
    if (measured) row.push(...[true, false].map((same) => (point && near(point, state) === same ? point.torque : null)));
    row.forEach((value, n) => columns[n].push(value));
  }
  const at = places.findIndex((place) => place.here), column = columns[1].filter((value) => value !== null);
  made.setData(columns);
  made.setLegend({ idx: at < 0 ? null : at });
  const of = (n) => `${lines[n].label} ${format(columns[n + 1][at], 3)}`;
  made.root.parentElement.setAttribute("aria-label", `${y} over ${label.toLowerCase()}: ${lines[0].label} from ${format(column[0], 3)} to ${format(column.at(-1), 3)}`
    + `${at < 0 ? "" : `; at ${format(here)} ${unit}: ${lines.map((_, n) => of(n)).join(", ")}`}`);
}
