// Materials by values, and labels of materials: the texts of `tagrid mesh --materials` and `--labels`, with its errors.

/**
 * Colors that people with color blindness tell apart: Okabe and Ito, "Color Universal Design" (2002), without black; also
 * Wong, "Points of view: Color blindness", Nature Methods 8 (2011), 441. In an order in which neighbors differ much.
 */
export const palette = ["#0072b2", "#e69f00", "#56b4e9", "#d55e00", "#009e73", "#f0e442", "#cc79a7"];

/** Labels of materials are from 0 to this. */
export const largestLabel = 65535;
const all = "all";
const mostMaterials = 65536;
const longestName = 38;
const largestNames = 16 << 20;
// As far apart as float32 tells them.
const largestValue = 1e37;

/** A finite number, as the program reads it; undefined if it is none. */
function numberIn(text) {
  const number = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text) ? Number(text) : NaN;
  return Number.isFinite(number) ? number + 0 : undefined;
}

const wholeNumberIn = (text) => (/^[+-]?\d+$/.test(text) ? Number(text) + 0 : undefined);

/** The materials of a text `NAME=LOW:HIGH,...`, in its order: { name, low, high }. Fails with an Error. */
export function materialsOf(text) {
  const materials = text.split(",").map(rangeIn);
  for (const { setName, low, high } of materials) {
    if (!/^[A-Za-z]/.test(setName) || setName.length > longestName)
      throw new Error(
        `'${setName}' is not a name of at most ${longestName} letters, digits and underscores that begins with a letter`,
      );
    if (!(low < high)) throw new Error(`${setName} has no values from ${shown(low)} to ${shown(high)}`);
  }
  const sorted = inOrder(materials);
  for (const [i, { setName, low }] of sorted.entries())
    if (i > 0 && low < sorted[i - 1].high)
      throw new Error(`${setName} begins at ${shown(low)}, but another one ends at ${shown(sorted[i - 1].high)}`);
  const { ends } = classesOf(materials);
  if (ends.length === 0)
    throw new Error("all values are of one material; give the value at which another one begins");
  const rounded = (end) => Math.fround(Math.min(Math.max(end - ends[0], -largestValue), largestValue));
  for (let i = 1; i < ends.length; ++i)
    if (!(rounded(ends[i]) > rounded(ends[i - 1])))
      throw new Error(`${ends[i - 1]} and ${ends[i]} are too close for the precision of float32`);
  if (ends.length + 1 > mostMaterials)
    throw new Error(`there are ${ends.length + 1}, but at most ${mostMaterials - 1} are possible`);
  const names = materials.map(({ setName }) => setName.toLowerCase());
  const twice = materials.find((_, i) => names.indexOf(names[i]) < i);
  if (twice) throw new Error(`two are called '${twice.setName}', if case is ignored`);
  return materials.map(({ name, low, high }) => ({ name, low, high }));
}

/** A material `NAME=LOW:HIGH`, where LOW or HIGH may be missing; with the name that it would have in a mesh. */
function rangeIn(text) {
  const [, name, low, high] = /^([^=]+)=([^:]*):(.*)$/s.exec(text) ?? [];
  if (name === undefined)
    throw new Error(`'${text}' is not NAME=LOW:HIGH, such as bone=300: or soft=-200:300`);
  const end = (part, limit) => {
    if (part === "") return limit;
    const number = numberIn(part);
    if (number === undefined) throw new Error(`${text}: '${part}' is not a number`);
    return number;
  };
  return { name: name.trim(), setName: setNameOf(name), low: end(low, -Infinity), high: end(high, Infinity) };
}

const shown = (number) => String(number).replace("Infinity", "inf");

/** The name of a set of elements: other characters than letters and digits become underscores. */
function setNameOf(name) {
  const kept = name.replaceAll(/[^A-Za-z0-9]+/g, "_").replaceAll(/^_|_$/g, "");
  if (kept === "") return name;
  return /^\d/.test(kept) ? `m_${kept}` : kept;
}

const inOrder = (materials) => [...materials].sort((a, b) => a.low - b.low);

/**
 * The values at which another class begins, and the material of each class, from low values to high ones; undefined if
 * it is none: as many and one more.
 */
export function classesOf(materials) {
  const ends = [];
  const classes = [];
  let end = -Infinity;
  for (const material of inOrder(materials)) {
    if (material.low > end) {
      if (end > -Infinity) ends.push(end);
      classes.push(undefined);
    }
    if (material.low > -Infinity) ends.push(material.low);
    classes.push(material);
    end = material.high;
  }
  if (end < Infinity) {
    ends.push(end);
    classes.push(undefined);
  }
  return { ends, classes };
}

/** The names of labels in a text: a Map; empty for "all". Undefined if the text is where a file of names is. */
export function namesOf(text) {
  if (text === all || text === "") return new Map();
  if (!text.includes("=")) return undefined;
  const names = new Map();
  for (const item of text.split(",")) {
    const equals = item.indexOf("=");
    const label = equals < 0 ? undefined : wholeNumberIn(item.slice(0, equals));
    if (label === undefined) throw new Error(`'${item}' is not LABEL=NAME, such as 1=bone`);
    addName(names, label, item.slice(equals + 1));
  }
  return names;
}

/** The names in a file: CSV, a color table of 3D Slicer, or a description of labels of ITK-SNAP. */
export function namesInFile(text, file) {
  if (text.length > largestNames) throw new Error(`${file}: is too large for a list of names`);
  const names = new Map();
  for (const line of text.replace(/^\ufeff/, "").split("\n")) addLine(names, line, file);
  if (names.size === 0) throw new Error(`${file}: has no line with the number and the name of a label`);
  // Lists of programs have the background, too.
  if (names.size > 1) names.delete(0);
  return names;
}

function addLine(names, line, file) {
  // Names between commas, semicolons or tabs may have blanks.
  const hasQuotes = line.includes('"');
  const hasSeparators = /[,;\t]/.test(line) && !hasQuotes;
  const pattern = hasSeparators ? /[^\t,;\r]+/g : /"([^"]*)"?|[^ \t,;\r"][^ \t,;\r]*/g;
  const fields = [...line.matchAll(pattern)].map(([field, quoted]) => quoted ?? field);
  if (fields.length === 0 || fields[0].startsWith("#")) return;
  const label = wholeNumberIn(fields[0]);
  if (label === undefined) {
    if (names.size === 0 && !/\d/.test(fields[0])) return; // the names of columns
    throw new Error(`${file}: '${line}' does not begin with the number of a label`);
  }
  const isName = (field) => numberIn(field) === undefined;
  const first = fields.findIndex((field, i) => i > 0 && isName(field));
  if (first < 0) throw new Error(`${file}: label ${label} has no name`);
  let end = first + 1;
  // Between blanks, a name has all words up to the four numbers of a color, or up to the next number.
  if (!hasSeparators && !hasQuotes) {
    const hasColor = fields.length - first > 4 && !fields.slice(-4).some(isName);
    const number = fields.findIndex((field, i) => i > first && !isName(field));
    end = hasColor ? fields.length - 4 : number < 0 ? fields.length : number;
  }
  addName(names, label, fields.slice(first, end).join(" "));
}

function addName(names, label, name) {
  if (names.has(label)) throw new Error(`label ${label} has two names`);
  if (label < 0 || label > largestLabel) throw new Error(`${label} is not from 0 to ${largestLabel}`);
  names.set(label, name.trim() || nameWithout(label));
}

/** The name of a label that has none. */
export const nameWithout = (label) => `label_${label}`;

/** Fails with an Error if the samples of a volume cannot be labels. */
export function requireLabels({ type, range, bounds }, file) {
  if (type.startsWith("float")) throw new Error(`${file}: labels must be integers, but its samples are ${type}`);
  if (range.low < 0 || range.high > largestLabel)
    throw new Error(
      `${file}: labels must be from 0 to ${largestLabel}, but its samples are from ${range.low} to ${range.high}`,
    );
  if (bounds.maxError === null) throw new Error(`${file}: its samples may be wrong, so they cannot be labels`);
  if (bounds.maxError > 0)
    throw new Error(
      `${file}: its samples may be wrong by ${bounds.maxError}, so they cannot be labels; encode it without a loss`,
    );
}

/** True if samples of two volumes of the same size are at other positions, as far as both state where they are. */
export function lieElsewhere({ geometry: a }, { geometry: b, dims }) {
  if (!a.spacing || !b.spacing) return false;
  const tenth = Math.abs(b.spacing[0] || 1) / 10;
  const differ = (u, v) => Math.hypot(...u.map((n, i) => n - v[i])) > tenth;
  if (a.origin && b.origin && differ(a.origin, b.origin)) return true;
  if (!a.directions !== !b.directions) return false;
  const across = ({ spacing, directions }) =>
    directions
      ? [0, 1, 2].map((row) => directions.reduce((sum, step, axis) => sum + step[row] * (dims[axis] - 1), 0))
      : spacing.map((step, axis) => step * (dims[axis] - 1));
  return differ(across(a), across(b));
}

/** Fails with an Error if there are not as many labels as samples. */
export function requireSameSize(labels, labelFile, volume, file) {
  if (labels.dims.some((n, axis) => n !== volume.dims[axis]))
    throw new Error(
      `${labelFile}: has ${labels.dims.join(" x ")} labels, but ${file} has ${volume.dims.join(" x ")} samples`,
    );
}
