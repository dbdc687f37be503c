// The plots of the live page, by uPlot. Each has lines over one input, the others being those of the state.

const format = (x, digits = 4) => (x === null || !Number.isFinite(x) ? "-" : String(Number(x.toPrecision(digits))));
const withUnit = (x, unit) => (format(x) === "-" || !unit ? format(x) : `${format(x)} ${unit}`);
const BLUE = "#0b5a8c", GREEN = "#00875f", BROWN = "#8a5a00", PURPLE = "#b8478a", RED = "#c8400b";
const COLOURS = { viscous_torque: GREEN, hysteresis_torque: BROWN, sliding_torque: PURPLE, seal_torque: "#6a4fb0" };
const INK = "#1a1a1a", SOFT = "#55606e", GRID = "#d5dae0", BAND = "#0b5a8c26";
const POINTS = 121; // of a line

// label, colour, value of the results at a point; more: options of uPlot
const line = (label, colour, value, more) => ({ label, colour, value, more });
const ends = about.nodes === null ? [] : ["low", "high"].map((end) => (
  line(end, BLUE, (v) => (v.preload ? v[`torque_${end}`] : null), { width: 1, dash: [2, 3] })
));
const torque = line("torque", BLUE, (v) => v.friction_torque, { width: 3 });
const film = line("least film", BLUE, (v) => 1e6 * v.film_thickness_min, { width: 3 });
const forces = ["a", "b"].map((nut, n) => (
  line(`${about.side} ${nut.toUpperCase()}`, [BLUE, GREEN][n], (v) => v[`force_nut_${nut}`])
));
const efficiency = (name) => (v) => (v.axial_load && about.lead ? 100 * v[name] : null);
const efficiencies = [
  line("driving", BLUE, efficiency("driving_efficiency")),
  line("backdriving", PURPLE, efficiency("backdriving_efficiency")),
];
const fromZero = (_, low, high) => [0, 1.08 * (high || 1)];
// marks: lines with a dot at the operating point; right: axis of the lines with this scale
const PLOTS = [
  {
    id: "torque", over: "speed", y: "torque", unit: "N m", range: fromZero, measured: true, marks: [torque],
    lines: [torque, ...ends, ...about.parts.map(([name, label]) => line(label, COLOURS[name], (v) => v[name]))],
  },
  {
    id: "film", over: "speed", y: "film", unit: "\u00b5m", right: "lambda", marks: [film],
    lines: [
      film,
      line("screw", GREEN, (v) => 1e6 * v.film_thickness_central_screw),
      line("nut", BROWN, (v) => 1e6 * v.film_thickness_central_nut),
      line("lambda", PURPLE, (v) => v.lambda_ratio, { scale: "lambda", value: (_, y) => format(y) }),
    ],
  },
  { id: "warm", over: "temperature", y: "torque", unit: "N m", range: fromZero, lines: [torque, ...ends], marks: [torque] },
  { id: "forces", over: "axial_load", y: "force", unit: "N", range: fromZero, lines: forces, marks: forces },
  { id: "efficiency", over: "axial_load", y: "efficiency", unit: "%", range: () => [0, 100], lines: efficiencies, marks: efficiencies },
];

const series = ({ label, colour, more }, unit) => ({
  label, stroke: colour, width: 2, pxAlign: 0, points: { show: false }, value: (_, y) => withUnit(y, unit), ...more,
});
const dots = (label, colour, fill) => ({
  label, stroke: colour, paths: () => null, value: () => "", points: { show: true, size: 9, width: 1.5, stroke: colour, fill },
});
const axis = (label, more) => ({
  label, labelSize: 20, labelGap: 0, size: 50, stroke: INK, font: "12px sans-serif", labelFont: "12px sans-serif",
  grid: { stroke: GRID, width: 1 }, ticks: { stroke: GRID, width: 1, size: 4 },
  values: (_, splits) => splits.map((x) => (x === null ? "" : format(x))), ...more,
});

// The plot with its lines, marks and measured points in this order, still without data.
function makePlot({ id, over, y, unit, right, range, measured, lines, marks }) {
  const box = document.getElementById(id), input = about.inputs[over];
  const size = () => ({ width: box.clientWidth, height: measured ? 340 : 240 });
  const high = lines.findIndex((one) => one.label === "high") + 1;
  const all = [
    { label: input.label.toLowerCase(), value: (_, x) => withUnit(x, input.unit) },
    ...lines.map((one) => series(one, unit)),
    ...marks.map((one, n) => dots(marks.length > 1 ? `${one.label} here` : "operating point", RED, n ? "white" : RED)),
    ...(measured ? [dots("measured here", INK, INK), dots("measured elsewhere", SOFT, "white")] : []),
  ];
  const plot = new uPlot({
    ...size(),
    series: all,
    axes: [
      axis(`${input.label.toLowerCase()} [${input.unit}]`, { size: 32, space: over === "axial_load" ? 70 : 45 }),
      axis(`${y} [${unit}]`),
      ...(right ? [axis(right, { scale: right, side: 1, grid: { show: false } })] : []),
    ],
    bands: high ? [{ series: [high, high - 1], fill: BAND }] : [],
    scales: {
      x: { time: false, distr: over === "speed" ? 3 : 1, range: () => [input.min, input.max] },
      y: range ? { range } : { distr: 3 },
      ...(right ? { [right]: { distr: 3 } } : {}),
    },
    cursor: { drag: { x: false, y: false }, points: { size: 7 } },
  }, all.map(() => []), box);
  new ResizeObserver(() => plot.setSize(size())).observe(box);
  return plot;
}

// A measured point that belongs to the curve of the state.
const near = (p, state) => Math.abs(p.preload / state.preload - 1) <= 0.02 && Math.abs(p.temperature - state.temperature) <= 1
  && Math.abs(p.axial_load - state.axial_load) <= 0.02 * state.preload;

function drawPlot({ over, measured, lines, marks }, plot, model, state) {
  const { min, max, log } = about.inputs[over], here = over === "speed" ? Math.abs(state[over]) : state[over];
  const places = Array.from({ length: POINTS }, (_, n) => {
    const ratio = n / (POINTS - 1);
    return { x: log ? min * (max / min) ** ratio : min + (max - min) * ratio };
  });
  if (here >= min && here <= max) places.push({ x: here, marked: true });
  if (measured) places.push(...state.points.map((point) => ({ x: point.speed, point })));
  places.sort((a, b) => a.x - b.x);
  const rows = places.map(({ x, marked, point }) => {
    const v = model({ ...state, [over]: x }), beyond = over === "axial_load" && v.clamped & 8;
    return [
      x,
      ...lines.map(({ value }) => (beyond ? null : value(v))),
      ...marks.map(({ value }) => (marked && !beyond ? value(v) : null)),
      ...(measured ? [true, false].map((same) => (point && near(point, state) === same ? point.torque : null)) : []),
    ];
  });
  plot.setData(rows[0].map((_, column) => rows.map((row) => row[column])));
  const at = places.findIndex((place) => place.marked);
  plot.setLegend({ idx: at < 0 ? null : at });
}
