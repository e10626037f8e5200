// @tagrid/niivue: .tag files in NiiVue. index.d.ts describes what is exported.
import { millimetersOf, signsOf, unitNamesOf } from "./places.js";

/** NIfTI's numbers of the types of samples. */
const codes = { uint8: 2, int16: 4, int32: 8, float32: 16, float64: 64, int8: 256, uint16: 512, uint32: 768 };
const sizes = { uint8: 1, int16: 2, int32: 4, float32: 4, float64: 8, int8: 1, uint16: 2, uint32: 4 };
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
  return (signsOf(volume.field("space")) ?? [1, 1, 1]).map((sign, row) =>
    [...columns, first].map((column) => sign * units[row] * column[row]),
  );
}

function spacingOf(volume, { factor, geometry: { spacing, directions } }) {
  const units = unitsOf(volume);
  if (directions) return directions.map((step) => Math.hypot(...step.map((n, row) => n * units[row])));
  return [0, 1, 2].map((axis) => (spacing?.[axis] || factor) * units[axis]);
}

/** The millimeters of the unit of each axis; a unit that is not known counts as one. */
function unitsOf(volume) {
  return unitNamesOf(volume).map((name) => {
    const length = millimetersOf(name);
    if (length === undefined && name.trim())
      console.warn(`tagrid: the unit "${name.trim()}" is not known; its lengths count as millimeters`);
    return length ?? 1;
  });
}
