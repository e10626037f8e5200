// What a header says of places: the patient's sides, and units of lengths. The viewer uses it, too.

/** Millimeters: the program's table of units (io/metadata/lengths.cpp; tests/plugins/units_test.py compares them). */
const lengths = new Map(Object.entries({ fm: 1e-12, pm: 1e-9, angstrom: 1e-7, nm: 1e-6, um: 1e-3, mm: 1, cm: 10, dm: 100, m: 1e3,
  dam: 1e4, hm: 1e5, km: 1e6, mil: 0.0254, inch: 25.4, ft: 304.8, yd: 914.4 }));
/** Other spellings, as they are. */
const spellings = new Map(Object.entries({ "\u00b5m": "um", "\u03bcm": "um", "\u00b5": "um", "\u03bc": "um", "\\u00B5m": "um",
  "\\u03BCm": "um", "\u00c5": "angstrom", "\u212b": "angstrom", A: "angstrom", '"': "inch" }));
/** Words in small letters, without the "s" of several; "metre" is "meter". */
const words = new Map(Object.entries({ femtometer: "fm", picometer: "pm", nanometer: "nm", micron: "um", micrometer: "um",
  millimeter: "mm", centimeter: "cm", decimeter: "dm", meter: "m", kilometer: "km", angstrom: "angstrom",
  "\u00e5ngstr\u00f6m": "angstrom", ang: "angstrom", mil: "mil", thou: "mil", inch: "inch", inche: "inch", in: "inch", foot: "ft",
  feet: "ft", yard: "yd" }));

const wordsOfSides = [["right", "left"], ["anterior", "posterior"], ["superior", "inferior"]];

/**
 * Of the name of a space, "left-posterior-superior" or "LPS": for x, y and z, 1 if it runs to the right, to the front, or
 * up, and -1 if it runs the other way. Undefined if the name does not say it, or not in this order.
 */
export function signsOf(space = "") {
  const name = space.trim().toLowerCase();
  const isShort = name.length === 3;
  const parts = isShort ? [...name] : name.split("-");
  const signs = wordsOfSides.map((pair, axis) => [1, -1][pair.findIndex((word) => (isShort ? word[0] : word) === parts[axis])]);
  return parts.length === 3 && signs.every(Boolean) ? signs : undefined;
}

/** The names of the units of the axes; of the coordinates, where the volume has directions. "" where none is given. */
export function unitNamesOf(volume) {
  const found = volume.field(volume.geometry.directions ? "space units" : "units") ?? "";
  const names = [...found.matchAll(/"((?:[^"\\]|\\.)*)"/g)].map(([, unit]) => unit.replace(/\\"/g, '"'));
  return names.length === 3 ? names : ["", "", ""];
}

/** The millimeters of a unit; undefined if it is "" or not known. */
export function millimetersOf(unit) {
  const name = unit.trim();
  const small = name.toLowerCase();
  const word = small.replace(/s$/, "").replace(/metre$/, "meter");
  // In a name in capitals only, M is not the prefix mega.
  const inCapitals = /^[A-Z]+$/.test(name) && lengths.has(small) ? small : undefined;
  return lengths.get(spellings.get(name) ?? inCapitals ?? words.get(word) ?? name);
}
