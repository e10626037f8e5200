// @tagrid/cornerstone: .tag files in Cornerstone3D. index.d.ts describes what is exported.
import { millimetersOf, signsOf, unitNamesOf } from "@tagrid/niivue/places.js";

/** The types of samples that Cornerstone shows as they are. */
const shown = { uint8: Uint8Array, int16: Int16Array, uint16: Uint16Array, float32: Float32Array };
const mostBytes = 2 ** 29;

export function registerTagrid({ cache, imageLoader, metaData, volumeLoader }, open, options = {}) {
  /** Of each volume, what it is without its samples. */
  const known = new Map();
  volumeLoader.registerVolumeLoader("tagrid", (volumeId) => {
    const stopped = new AbortController();
    const load = async () => {
      const { scalarData, ...rest } = await opened(volumeId, open, { ...options, signal: stopped.signal });
      known.set(volumeId, rest);
      // Cornerstone caches what the promise gives.
      const volume = volumeLoader.createLocalVolume(volumeId, { ...rest, scalarData, preventCache: true });
      // Its slices are to be sent to the graphics card: a volume that streams would say so of each one.
      volume.invalidate();
      // Cornerstone gives the slices of such a volume windows without a width.
      for (const imageId of volume.imageIds) Object.assign(cache.getImage(imageId), rest.metadata.voiLut[0]);
      return volume;
    };
    return { promise: load(), cancelFn: () => stopped.abort(), decache: () => known.delete(volumeId) };
  });
  // Cornerstone asks for slices of volumes that it has, by names that it gave them.
  imageLoader.registerImageLoader("tagrid", (imageId) => ({ promise: slice(cache, imageId) }));
  metaData.addProvider((type, imageId) => moduleOf(known, type, imageId), 100);
}

async function slice(cache, imageId) {
  const image = cache.getImage(imageId);
  if (!image) throw new Error(`${imageId} is no slice of a volume that was loaded`);
  return image;
}

/** What Cornerstone asks of a slice; undefined for anything else. */
function moduleOf(known, type, imageId) {
  const name = typeof imageId === "string" && /^(tagrid:.*)_slice_(\d+)$/.exec(imageId);
  const volume = name ? known.get(name[1]) : undefined;
  if (volume && type === "generalSeriesModule") return { modality: volume.metadata.Modality };
  return volume && type === "imagePlaneModule" ? planeOf(volume, Number(name[2])) : undefined;
}

/** Where a slice is: Cornerstone gives all slices of such a volume the place of the first one. */
function planeOf({ dimensions, spacing, origin, direction, metadata }, number) {
  return {
    frameOfReferenceUID: metadata.FrameOfReferenceUID,
    rows: dimensions[1],
    columns: dimensions[0],
    imageOrientationPatient: direction.slice(0, 6),
    rowCosines: direction.slice(0, 3),
    columnCosines: direction.slice(3, 6),
    imagePositionPatient: origin.map((first, row) => first + number * spacing[2] * direction[6 + row]),
    pixelSpacing: [spacing[1], spacing[0]],
    rowPixelSpacing: spacing[1],
    columnPixelSpacing: spacing[0],
    sliceThickness: spacing[2],
  };
}

async function opened(volumeId, open, options) {
  // scheme:address#level=1&volume=2
  const [address, fragment = ""] = volumeId.slice(volumeId.indexOf(":") + 1).split("#");
  const asked = new URLSearchParams(fragment);
  const first = await open(address, options);
  try {
    const number = numberOf(asked, "volume") ?? 0;
    const volume = number === 0 ? first : await first.volume(number, options);
    const level = numberOf(asked, "level");
    const local = await localVolume(volume, { level, signal: options.signal });
    return { ...local, metadata: { ...local.metadata, FrameOfReferenceUID: volumeId } };
  } finally {
    first.close();
  }
}

function numberOf(asked, name) {
  const text = asked.get(name);
  if (text !== null && !/^\d+$/.test(text)) throw new RangeError(`${name}=${text} is not a number`);
  return text === null ? undefined : Number(text);
}

export async function localVolume(volume, { level = defaultLevel(volume), signal } = {}) {
  const chosen = volume.levels[level];
  if (!chosen) throw new RangeError(`there is no level ${level}; the levels are 0 to ${volume.levels.length - 1}`);
  const { spacing, origin, direction } = placeOf(volume, chosen);
  const scalarData = valuesOf(volume, await volume.read({ level, signal }));
  const bits = 8 * scalarData.BYTES_PER_ELEMENT;
  const [columns, rows] = chosen.dims;
  return {
    dimensions: [...chosen.dims],
    spacing,
    origin,
    direction,
    scalarData,
    metadata: {
      BitsAllocated: bits,
      BitsStored: bits,
      HighBit: bits - 1,
      SamplesPerPixel: 1,
      PhotometricInterpretation: "MONOCHROME2",
      PixelRepresentation: scalarData instanceof Int16Array ? 1 : 0,
      Modality: volume.pair("rescale_units") === "HU" ? "CT" : "OT",
      ImageOrientationPatient: direction.slice(0, 6),
      PixelSpacing: [spacing[1], spacing[0]],
      Columns: columns,
      Rows: rows,
      voiLut: [windowOf(volume)],
      VOILUTFunction: "LINEAR_EXACT",
    },
  };
}

/** The finest level that takes at most 512 MiB, or the coarsest one. */
function defaultLevel({ levels, type }) {
  const bytes = (shown[type] ?? Float32Array).BYTES_PER_ELEMENT;
  const found = levels.findIndex(({ dims: [x, y, z] }) => x * y * z * bytes <= mostBytes);
  return found < 0 ? levels.length - 1 : found;
}

/** Slope and intercept of values. Slopes of single slices count, where there are any: then there are only samples. */
function scaleOf(volume) {
  if (volume.pair("slice_slopes") === undefined)
    return [Number(volume.pair("rescale_slope") ?? 1), Number(volume.pair("rescale_intercept") ?? 0)];
  console.warn("tagrid: each slice has a slope of its own; Cornerstone gets the samples of the file");
  return [1, 0];
}

/** Values in one of Cornerstone's types: that of the samples, a type of integers that holds them, or float32. */
function valuesOf(volume, samples) {
  const [slope, intercept] = scaleOf(volume);
  if (slope === 1 && intercept === 0 && samples instanceof (shown[volume.type] ?? Array)) return samples;
  const Values = typeOfValues(volume, slope, intercept);
  const values = new Values(samples.length);
  for (let i = 0; i < samples.length; ++i) values[i] = slope * samples[i] + intercept;
  return values;
}

/** Decoded samples may be beyond the range of the original ones by the bound. */
function typeOfValues({ type, range, bounds }, slope, intercept) {
  const isWhole = !type.startsWith("float") && Number.isInteger(slope) && Number.isInteger(intercept);
  if (!isWhole || !range || bounds.maxError === null) return Float32Array;
  const ends = [range.low - bounds.maxError, range.high + bounds.maxError].map((end) => slope * end + intercept);
  const [low, high] = [Math.min(...ends), Math.max(...ends)];
  if (low >= -32768 && high <= 32767) return Int16Array;
  return low >= 0 && high <= 65535 ? Uint16Array : Float32Array;
}

function windowOf(volume) {
  const [slope, intercept] = volume.pair("slice_slopes") === undefined ? scaleOf(volume) : [1, 0];
  if (!volume.range) return { windowWidth: undefined, windowCenter: undefined };
  const { low, high } = volume.range;
  const width = Math.max(Math.abs(slope * (high - low)), 1);
  return { windowWidth: width, windowCenter: (slope * (low + high)) / 2 + intercept };
}

/** Spacing, origin and direction in millimeters, with x to the left, y to the back and z up, as in DICOM. */
function placeOf(volume, { factor, geometry: { spacing, origin, directions } }) {
  const units = unitNamesOf(volume).map((name) => millimetersOf(name) ?? 1);
  // To the right, the front and up; then x and y are turned. Of a space that is not known, places stay as they are.
  const toRight = signsOf(volume.field("space"));
  const signs = toRight ? [-toRight[0], -toRight[1], toRight[2]] : [1, 1, 1];
  const turned = (place) => place.map((number, row) => signs[row] * units[row] * number + 0);
  const along = (axis) => [0, 1, 2].map((row) => (row === axis ? spacing?.[axis] || factor : 0));
  // Without an origin, the first sample of the volume is at 0, and that of an overview in the middle of its block.
  const first = origin ?? [0, 1, 2].map((axis) => (((spacing?.[axis] || factor) / factor) * (factor - 1)) / 2);
  const columns = (directions ?? [0, 1, 2].map(along)).map(turned);
  const lengths = columns.map((column) => Math.hypot(...column));
  return {
    spacing: lengths,
    origin: turned(first),
    direction: columns.flatMap((column, axis) => column.map((number) => number / lengths[axis])),
  };
}
