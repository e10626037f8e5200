// Ellipses and rectangles in slices: which samples are in them, and what these are like.
//
// A region is a measure (see measures.js) with two points: opposite corners of it, or of the rectangle around the ellipse. A
// sample is in it if its middle is.
import { vectorBetween } from "./measures.js";

const mostBins = 64;

export const isRegion = ({ kind }) => kind === "ellipse" || kind === "rectangle";

const axesIn = ({ normal }) => [0, 1, 2].filter((axis) => axis !== normal);

/** The corners of a region, one after the other around it, as places. */
export function handlesOf({ normal, points: [a, b] }) {
  const [u, v] = axesIn({ normal });
  return [
    [a, a],
    [b, a],
    [b, b],
    [a, b],
  ].map(([across, down]) => {
    const place = [...a];
    [place[u], place[v]] = [across[u], down[v]];
    return place;
  });
}

/** The points of a region of which a corner is at another place. */
export function withCorner(region, corner, place) {
  // The opposite one stays.
  return [place, handlesOf(region)[(corner + 2) % 4]];
}

/** From the lower to the higher end of a region along an axis. */
const endsOf = ({ points: [a, b] }, axis) => [Math.min(a[axis], b[axis]), Math.max(a[axis], b[axis])];

/** The box of the samples that a region may have: { low, high }; undefined if it has none. */
export function boxOf(region, dims) {
  const low = [0, 0, 0];
  const high = [0, 0, 0];
  [low[region.normal], high[region.normal]] = [region.slice, region.slice + 1];
  for (const axis of axesIn(region)) {
    const [begin, end] = endsOf(region, axis);
    low[axis] = Math.max(Math.ceil(begin - 0.5), 0);
    high[axis] = Math.min(Math.floor(end - 0.5), dims[axis] - 1) + 1;
    if (low[axis] >= high[axis]) return undefined;
  }
  return { low, high };
}

/** The lines of samples of a box, along the lower axis of the slice: [first, end, the index of the first one in the box]. */
function* linesOf(region, { low, high }) {
  const [u, v] = axesIn(region);
  const [centers, radii] = [u, v]
    .map((axis) => endsOf(region, axis))
    .reduce(([c, r], [a, b]) => [[...c, (a + b) / 2], [...r, (b - a) / 2]], [[], []]);
  const width = high[u] - low[u];
  for (let j = low[v]; j < high[v]; ++j) {
    let [first, end] = [low[u], high[u]];
    if (region.kind === "ellipse") {
      const isIn = (i) => ((i + 0.5 - centers[0]) / radii[0]) ** 2 + ((j + 0.5 - centers[1]) / radii[1]) ** 2 <= 1;
      while (first < end && !isIn(first)) ++first;
      while (first < end && !isIn(end - 1)) --end;
    }
    if (first < end) yield [first, end, (j - low[v]) * width + first - low[u], j];
  }
}

/**
 * Statistics of the samples of a box, in values: { count, missing, mean, deviation, low, high, bins }. `missing` are those
 * that are not finite, and in nothing else. The deviation is that of these samples, not an estimate for others. `bins` are
 * { begin, width, counts }. Undefined if the region has no samples.
 */
export function statisticsOf(region, box, samples, scale, isWhole) {
  const meaning = (z) => (scale.note && scale.ofSlice ? scale.ofSlice(z) : scale);
  const [, v] = axesIn(region);
  const values = new Float64Array(samples.length);
  let [count, missing, sum, low, high] = [0, 0, 0, Infinity, -Infinity];
  for (const [first, end, start, j] of linesOf(region, box)) {
    const { slope, intercept } = meaning(v === 2 ? j : region.slice);
    for (let i = start; i < start + end - first; ++i) {
      if (!Number.isFinite(samples[i])) {
        ++missing;
        continue;
      }
      const value = slope * samples[i] + intercept;
      values[count++] = value;
      sum += value;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (count + missing === 0) return undefined;
  if (count === 0) return { count, missing };
  const mean = sum / count;
  let squares = 0;
  for (let i = 0; i < count; ++i) squares += (values[i] - mean) ** 2;
  const step = isWhole && !scale.note ? Math.abs(scale.slope) : 0;
  const bins = binsOf(values.subarray(0, count), low, high, step);
  return { count, missing, mean, deviation: Math.sqrt(squares / count), low, high, bins };
}

/** Values that are multiples of a step have bins of the same number of steps each. */
function binsOf(values, low, high, step) {
  if (low === high) return { begin: low - (step || 1) / 2, width: step || 1, counts: [values.length] };
  const steps = step > 0 ? Math.round((high - low) / step) + 1 : mostBins;
  const stepsOfBin = Math.ceil(steps / mostBins);
  const number = Math.ceil(steps / stepsOfBin);
  const width = step > 0 ? stepsOfBin * step : (high - low) / number;
  const begin = step > 0 ? low - step / 2 : low;
  const counts = new Array(number).fill(0);
  for (const value of values) ++counts[Math.min(Math.floor((value - begin) / width), number - 1)];
  return { begin, width, counts };
}

/** The area of some samples of a region: { area, unit }; in voxels if it is not known how far apart they are. */
export function areaOf(region, count, volume, places) {
  const inVoxels = { area: count, unit: "voxels" };
  if (places.isUneven && region.normal !== 2) return inVoxels;
  const [u, v] = axesIn(region).map((axis) => {
    const to = [0, 1, 2].map((other) => (other === axis ? 1 : 0));
    return vectorBetween(volume, places, [0, 0, 0], to);
  });
  if (u.note || v.note) return inVoxels;
  const [a, b] = [u.vector, v.vector];
  const cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  return { area: count * Math.hypot(...cross), unit: `${places.unit}²` };
}
