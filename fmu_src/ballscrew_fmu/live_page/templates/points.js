// A number with a decimal comma or point, NaN of other texts; no marks of thousands.
function decimal(text) {
  const plain = text.replace(",", ".");
  const value = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain) ? Number(plain) : NaN;
  return Number.isFinite(value) ? value : NaN;
}

// Text of a file: UTF-16 with a mark, UTF-8 or Windows-1252.
function decoded(bytes) {
  const wide = { "255,254": "utf-16le", "254,255": "utf-16be" }[bytes.subarray(0, 2).join()];
  try {
    return new TextDecoder(wide ?? "utf-8", { fatal: true }).decode(bytes);
  } catch {
    return new TextDecoder("windows-1252").decode(bytes);
  }
}

// Measured points of a CSV file with headings as the command calibrate reads them. units: about.units.
function readPoints(text, units, temperature) {
  const lines = text.replace(/^\ufeff/, "").split(/\r\n|\n|\r/);
  const rows = lines.map((text, n) => ({ line: n + 1, text }))
    .filter(({ text }) => /[^\s;,]/.test(text) && !/^(\s*#|sep=)/.test(text));
  // headings may be in a comment above the numbers
  const comment = rows.length && lines.slice(0, rows[0].line - 1).findLast((text) => /^\s*#/.test(text));
  if (comment && /^[-+.,;\s\deE]*$/.test(rows[0].text)) rows.unshift({ line: 0, text: comment.replace(/^[\s#]+/, "") });
  if (rows.length < 2) throw new Error("needs a line of headings and a line for each point");
  const separator = [";", "\t", ","].find((mark) => rows[0].text.includes(mark)) ?? ",";
  const outsideQuotes = new RegExp(`${separator}(?=(?:[^"]*"[^"]*")*[^"]*$)`);
  const cells = (row) => row.text.split(outsideQuotes).map((cell) => cell.trim().replace(/^"(.*)"$/, "$1"));
  const columns = cells(rows[0]).map((heading) => columnOf(heading, units));
  for (const key of Object.keys(units)) {
    const found = columns.filter((column) => column?.key === key).length;
    if (found > 1 || (!found && ["preload", "speed", "torque"].includes(key))) throw new Error(`${found ? "several columns" : "no column"} ${key}; needs one, as in preload [N], speed [r/min], torque [N.m]`);
  }
  if (rows.length > 2001) throw new Error(`${rows.length - 1} points; at most 2000`);
  const fields = rows.map(cells), numbers = fields.slice(1).flatMap((row) => row.filter((_, n) => columns[n]));
  const short = fields.findIndex((row) => row.length !== columns.length);
  if (short > 0) throw new Error(`line ${rows[short].line}: ${fields[short].length} fields; the headings are ${columns.length}; decimal commas need semicolons between the fields`);
  const mixed = [",", "."].map((mark) => numbers.find((text) => text.includes(mark)));
  if (mixed.every(Boolean)) throw new Error(`'${mixed[0]}' and '${mixed[1]}': decimal commas or points, not both, and no marks of thousands`);
  // as csv_file._check_marks
  const group = /^[+-]?[1-9]\d{0,2}[.,]\d{3}$/, other = (text) => /^[+-]?[1-9]\d{3}/.test(text) || (/[.,]/.test(text) && !group.test(text));
  columns.forEach((column, n) => {
    const texts = column ? fields.slice(1).map((row) => row[n]) : [], first = texts.find((text) => group.test(text));
    const grouped = texts.some((text) => /^[+-]?[1-9]\d\d$/.test(text)) && !texts.some(other);
    if (first && (grouped || !(separator === "," || numbers.some(other)))) throw new Error(`'${first}' under ${column.key} can be read in two ways, ${first.replace(",", ".")} or ${first.replace(/[.,]/, "")}: export without thousands`);
  });
  return rows.slice(1).map((row, n) => pointOf(row, fields[n + 1], columns, temperature));
}

function columnOf(heading, units) {
  const text = heading.replace(/[\u00b5\u03bc]/g, "u");
  const bracket = text.match(/^(.*?)\s*[[(]\s*(.*?)\s*[\])]$/) ?? text.match(/^(.*\S)\s+(?:in|\/)\s+(\S+)$/);
  const stem = (bracket ? bracket[1] : text).trim().toLowerCase().replace(/[ -]/g, "_");
  const joined = (unit) => unit.replace("\u00b0", "deg").replace("\u207b\u00b9", "1").replace(/[\s.*^_\u00b7\u22c5\u30fb-]/g, "");
  const letters = (unit) => unit.toLowerCase().replace(/[^a-z0-9]/g, "");
  for (const [key, { names, units: known }] of Object.entries(units)) {
    const name = names.find((one) => stem === one || (!bracket && stem.startsWith(`${one}_`)));
    if (!name) continue;
    const given = bracket ? bracket[2] : stem.slice(name.length + 1);
    const same = bracket ? joined : letters;
    const unit = Object.keys(known).find((one) => same(one) === same(given))
      ?? Object.keys(known).find((one) => letters(one) === letters(given) && !/^MN/.test(joined(given)));
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
    const value = decimal(text);
    if (Number.isNaN(value)) throw new Error(`line ${row.line}: ${column.key} = '${text}'; needs a number`);
    point[column.key] = (value + column.offset) * column.factor;
    if (column.key === "temperature") point.assumed = false;
  });
  if (!(point.preload > 0)) throw new Error(`line ${row.line}: preload is not above 0`);
  if (!(point.torque * point.speed > 0)) throw new Error(`line ${row.line}: torque and speed need the same sign and may not be 0`);
  point.torque = Math.abs(point.torque);
  point.speed = Math.abs(point.speed);
  return point;
}
