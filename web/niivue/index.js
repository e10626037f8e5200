// @tagrid/niivue: .tag files in NiiVue. index.d.ts describes what is exported.

/** NIfTI's numbers of the types of samples. */
const codes = { uint8: 2, int16: 4, int32: 8, float32: 16, float64: 64, int8: 256, uint16: 512, uint32: 768 };
const sizes = { uint8: 1, int16: 2, int32: 4, float32: 4, float64: 8, int8: 1, uint16: 2, uint32: 4 };
/** Millimeters: the program's table of units (io/volume/lengths.cpp). */
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

export function chunkedSource(volume) {
  const size = sizes[volume.type];
  return {
    datatypeCode: codes[volume.type],
    levels: volume.levels.map(({ level, factor, dims, geometry }) => ({
      level,
      shape: [...dims],
      spacing: spacingOf(volume, { factor, geometry }),
    })),
    async fetchChunk({ levelIndex, texOrigin, texDims, signal }) {
      const { dims } = volume.levels[levelIndex];
      const [nx, ny, nz] = texDims;
      const all = new Uint8Array(nx * ny * nz * size);
      const low = texOrigin.map((first) => Math.max(first, 0));
      const high = texOrigin.map((first, axis) => Math.min(first + texDims[axis], dims[axis]));
      if (low.some((first, axis) => first >= high[axis])) return all;
      const samples = await volume.read({ level: levelIndex, box: { low, high }, signal });
      const bytes = new Uint8Array(samples.buffer, samples.byteOffset, samples.byteLength);
      const [x0, y0, z0] = low.map((first, axis) => first - texOrigin[axis]);
      const [width, height, depth] = high.map((end, axis) => end - low[axis]);
      for (let z = 0; z < depth; ++z)
        for (let y = 0; y < height; ++y) {
          const from = (z * height + y) * width * size;
          all.set(bytes.subarray(from, from + width * size), (((z0 + z) * ny + y0 + y) * nx + x0) * size);
        }
      return all;
    },
  };
}

export async function niftiFile(volume, { level = volume.levels.length - 1, name = "volume.nii", signal } = {}) {
  const chosen = volume.levels[level];
  if (!chosen) throw new RangeError(`there is no level ${level}; the levels are 0 to ${volume.levels.length - 1}`);
  const { dims } = chosen;
  if (dims.some((n) => n > 32767))
    throw new RangeError(`${dims.join(" x ")} samples are more than NIfTI can say; choose a coarser level`);
  const header = new DataView(new ArrayBuffer(352));
  header.setInt32(0, 348, true);
  [3, ...dims, 1, 1, 1, 1].forEach((n, i) => header.setInt16(40 + 2 * i, n, true));
  header.setInt16(70, codes[volume.type], true);
  header.setInt16(72, 8 * sizes[volume.type], true);
  [1, ...spacingOf(volume, chosen)].forEach((step, i) => header.setFloat32(76 + 4 * i, step, true));
  header.setFloat32(108, 352, true);
  const [slope, intercept] = scaleOf(volume);
  header.setFloat32(112, slope, true);
  header.setFloat32(116, intercept, true);
  header.setUint8(123, 2); // millimeters
  header.setInt16(254, 1, true); // the matrix says where the samples are
  matrixOf(volume, chosen).flat().forEach((number, i) => header.setFloat32(280 + 4 * i, number, true));
  [0x6e, 0x2b, 0x31, 0].forEach((letter, i) => header.setUint8(344 + i, letter));
  return new File([header.buffer, await volume.read({ level, signal })], name);
}

/** Slope and intercept of values. Slopes of single slices count, where there are any, and NIfTI cannot say them. */
function scaleOf(volume) {
  if (volume.pair("slice_slopes") === undefined)
    return [Number(volume.pair("rescale_slope") ?? 1), Number(volume.pair("rescale_intercept") ?? 0)];
  console.warn("tagrid: each slice has a slope of its own, which NIfTI cannot say; the samples are those of the file");
  return [1, 0];
}

/** From numbers of samples to right, anterior, superior, in millimeters: three rows of four. */
function matrixOf(volume, { factor, geometry: { spacing, origin, directions } }) {
  const along = (axis) => [0, 1, 2].map((row) => (row === axis ? spacing?.[axis] || factor : 0));
  const columns = directions ?? [0, 1, 2].map(along);
  // Without an origin, the first sample of the volume is at 0, and that of an overview in the middle of its block.
  const first = origin ?? [0, 1, 2].map((axis) => (((spacing?.[axis] || factor) / factor) * (factor - 1)) / 2);
  const units = unitsOf(volume);
  return signsOf(volume.field("space") ?? "").map((sign, row) =>
    [...columns, first].map((column) => sign * units[row] * column[row]),
  );
}

/** Of "left-posterior-superior" or "LPS": what turns x, y and z to right, anterior and superior. */
function signsOf(space) {
  const name = space.toLowerCase();
  const words = name.length === 3 ? [...name] : name.split("-");
  const signs = ["rl", "ap", "si"].map((letters, axis) => [1, -1][letters.indexOf(words[axis]?.[0] || " ")]);
  return words.length === 3 && signs.every(Boolean) ? signs : [1, 1, 1];
}

function spacingOf(volume, { factor, geometry: { spacing, directions } }) {
  const units = unitsOf(volume);
  if (directions) return directions.map((step) => Math.hypot(...step.map((n, row) => n * units[row])));
  return [0, 1, 2].map((axis) => (spacing?.[axis] || factor) * units[axis]);
}

function unitsOf(volume) {
  const found = volume.field(volume.geometry.directions ? "space units" : "units") ?? "";
  const units = [...found.matchAll(/"((?:[^"\\]|\\.)*)"/g)].map(([, unit]) => millimeters(unit.replace(/\\"/g, '"')));
  return units.length === 3 ? units : [1, 1, 1];
}

/** The millimeters of a unit; 1 if it is "" or not known. */
function millimeters(unit) {
  const name = unit.trim();
  const small = name.toLowerCase();
  const word = small.replace(/s$/, "").replace(/metre$/, "meter");
  // In a name in capitals only, M is not the prefix mega.
  const inCapitals = /^[A-Z]+$/.test(name) && lengths.has(small) ? small : undefined;
  const length = lengths.get(spellings.get(name) ?? inCapitals ?? words.get(word) ?? name);
  if (length === undefined && name) console.warn(`tagrid: the unit "${name}" is not known; its lengths count as millimeters`);
  return length ?? 1;
}
