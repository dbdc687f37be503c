// Measured points of a CSV file with headings as the command calibrate reads them. units: about.units.
function readPoints(text, units, temperature) {
  const lines = text.replace(/^\ufeff/, "").split(/\r\n|\n|\r/);
  const rows = lines.map((line, n) => ({ line: n + 1, text: line.trim() }))
    .filter((row) => row.text && !row.text.startsWith("#"));
  if (rows.length < 2) throw new Error("needs a line of headings and a line for each point");
  const separator = [";", "\t", ","].find((mark) => rows[0].text.includes(mark)) ?? ",";
  const cells = (row) => row.text.split(separator).map((cell) => cell.trim().replace(/^"(.*)"$/, "$1"));
  const columns = cells(rows[0]).map((heading) => columnOf(heading, units));
  for (const key of ["preload", "speed", "torque"]) {
    const found = columns.filter((column) => column?.key === key).length;
    if (found !== 1) throw new Error(`${found ? "several columns" : "no column"} ${key}; needs one, as in preload [N], speed [r/min], torque [N.m]`);
  }
  if (rows.length > 2001) throw new Error(`${rows.length - 1} points; at most 2000`);
  return rows.slice(1).map((row) => pointOf(row, cells(row), columns, temperature));
}

function columnOf(heading, units) {
  const bracket = heading.match(/^(.*?)\s*[[(]\s*(.*?)\s*[\])]$/);
  const stem = (bracket ? bracket[1] : heading).trim().toLowerCase().replace(/[ -]/g, "_");
  const joined = (unit) => unit.replace(/[\s.*^\u00b7\u22c5-]/g, "").replace("\u00b0", "deg");
  const letters = (unit) => unit.toLowerCase().replace(/[^a-z0-9]/g, "");
  for (const [key, { names, units: known }] of Object.entries(units)) {
    const name = names.find((one) => stem === one || (!bracket && stem.startsWith(`${one}_`)));
    if (!name) continue;
    const given = bracket ? bracket[2] : stem.slice(name.length + 1);
    const same = bracket ? joined : letters;
    const unit = Object.keys(known).find((one) => same(one) === same(given));
    if (!unit) throw new Error(`column ${heading}: unit ${given || "missing"}; allowed: ${Object.keys(known).join(", ")}`);
    return { key, factor: known[unit][0], offset: known[unit][1] };
  }
  return null;
}

function pointOf(row, cells, columns, temperature) {
  const point = { axial_load: 0, temperature, assumed: true };
  columns.forEach((column, n) => {
    if (!column) return;
    const text = cells[n] ?? "";
    const plain = text.replace(",", ".");
    if (!/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain)) throw new Error(`line ${row.line}: ${column.key} = '${text}'; needs a number`);
    point[column.key] = (Number(plain) + column.offset) * column.factor;
    if (column.key === "temperature") point.assumed = false;
  });
  if (!(point.preload > 0)) throw new Error(`line ${row.line}: preload is not above 0`);
  if (!(point.torque * point.speed > 0)) throw new Error(`line ${row.line}: torque and speed need the same sign and may not be 0`);
  point.torque = Math.abs(point.torque);
  point.speed = Math.abs(point.speed);
  return point;
}
