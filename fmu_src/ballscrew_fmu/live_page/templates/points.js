// Text of a file: UTF-8 or Windows-1252.
function decoded(bytes) {
  try {
    return new TextDecoder("utf-8", { fatal: true }).decode(bytes);
  } catch {
    return new TextDecoder("windows-1252").decode(bytes);
  }
}

// Measured points of a CSV file with headings as the command calibrate reads them. units: about.units.
function readPoints(text, units, temperature) {
  const rows = text.split(/\r?\n/).map((text, n) => ({ line: n + 1, text })).filter(({ text }) => /^[^#]*[^\s;,#]/.test(text));
  if (rows.length < 2) throw new Error("needs a line of headings and a line for each point");
  const separator = [";", "\t", ","].find((mark) => rows[0].text.includes(mark)) ?? ",";
  const cells = ({ text }) => text.split(separator).map((cell) => cell.trim().replace(/^"(.*)"$/, "$1"));
  const columns = cells(rows[0]).map((heading) => columnOf(heading, units));
  for (const key of Object.keys(units)) {
    const count = columns.filter((column) => column?.key === key).length;
    if (count > 1) throw new Error(`several columns ${key}`);
    if (!count && ["preload", "speed", "torque"].includes(key)) throw new Error(`no column ${key}; needs one, as in preload [N], speed [r/min], torque [N.m]`);
  }
  const numbers = rows.slice(1).flatMap((row) => cells(row).filter((_, n) => columns[n]));
  const mixed = [",", "."].map((mark) => numbers.find((text) => text.includes(mark)));
  if (mixed.every(Boolean)) throw new Error(`'${mixed[0]}' and '${mixed[1]}': decimal commas or points, not both, and no marks of thousands`);
  return rows.slice(1).map((row) => pointOf(row.line, cells(row), columns, temperature));
}

// Quantity of a column with its unit in brackets, or behind an underscore.
function columnOf(heading, units) {
  const bracket = heading.match(/^(.*?)\s*[[(]\s*(.*?)\s*[\])]$/);
  const stem = (bracket ? bracket[1] : heading).trim().toLowerCase().replace(/[ -]/g, "_");
  const plain = bracket
    ? (unit) => unit.replace(/[\s.*^\u00b7\u22c5-]/g, "").replace("\u00b0", "deg")
    : (unit) => unit.toLowerCase().replace(/[^a-z0-9]/g, "");
  for (const [key, { names, units: known }] of Object.entries(units)) {
    const name = names.find((one) => stem === one || (!bracket && stem.startsWith(`${one}_`)));
    if (!name) continue;
    const given = bracket ? bracket[2] : stem.slice(name.length + 1);
    const unit = Object.keys(known).find((one) => plain(one) === plain(given));
    if (!unit) throw new Error(`column ${heading}: unit ${given || "missing"}; allowed: ${Object.keys(known).join(", ")}`);
    return { key, factor: known[unit][0], offset: known[unit][1] };
  }
  return null;
}

function pointOf(line, cells, columns, temperature) {
  if (cells.length !== columns.length) throw new Error(`line ${line}: ${cells.length} fields; the headings are ${columns.length}; decimal commas need semicolons between the fields`);
  const point = { axial_load: 0, temperature };
  columns.forEach((column, n) => {
    if (!column) return;
    const value = cells[n] ? Number(cells[n].replace(",", ".")) : NaN;
    if (!Number.isFinite(value)) throw new Error(`line ${line}: ${column.key} = '${cells[n]}'; needs a number`);
    point[column.key] = (value + column.offset) * column.factor;
  });
  if (!(point.preload > 0)) throw new Error(`line ${line}: preload is not above 0`);
  if (!(point.torque * point.speed > 0)) throw new Error(`line ${line}: torque and speed need the same sign and may not be 0`);
  return { ...point, torque: Math.abs(point.torque), speed: Math.abs(point.speed) };
}
