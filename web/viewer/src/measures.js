// Rulers, angles and regions in slices: what they are, and what they measure. Regions have more in regions.js.
//
// A measure has a `kind`, and lies in the slice `slice` across the axis `normal`, or in a `plane` (see plane.js). Its `points`
// are places in the volume, in which sample i reaches from i to i + 1.
import { measuredText } from "./numbers.js";
import { positionOfSlice } from "./places.js";

/** The tools that measure, and how many points each needs. */
export const pointsOf = { ruler: 2, angle: 3, ellipse: 2, rectangle: 2 };

export const isMeasuring = (tool) => tool in pointsOf;

export const isFinished = ({ kind, points }) => points.length === pointsOf[kind];

const minus = (a, b) => a.map((n, i) => n - b[i]);
const dot = (a, b) => a.reduce((sum, n, i) => sum + n * b[i], 0);

/**
 * From one place to another: { vector, unit, note }. In the unit of lengths, with the directions of the axes; or in voxels if
 * the file does not state how far apart samples are along an axis that this needs, and then `note` says why.
 */
export function vectorBetween({ geometry }, places, from, to) {
  const { spacing, directions } = geometry;
  const { factors, isUneven } = places;
  // One slice alone has a position, but no distance.
  const slices = places.slices?.length > 1 ? places.slices : undefined;
  const change = minus(to, from);
  const inVoxels = (note) => ({ vector: change, unit: "voxels", note });
  if (!spacing) return inVoxels("spacing unknown");
  const isMoved = (axis) => Math.abs(change[axis]) > 1e-9;
  // The positions of slices are enough along z.
  const unknown = [0, 1, 2].filter((axis) => !Math.abs(spacing[axis]) && isMoved(axis) && !(axis === 2 && slices));
  if (unknown.length > 0) return inVoxels(`spacing along ${unknown.map((axis) => "xyz"[axis]).join(", ")} unknown`);
  if (isUneven && !places.slices && isMoved(2)) return inVoxels("slices unevenly spaced");
  const along = (axis) => [0, 1, 2].map((row) => (directions ? directions[axis][row] : axis === row ? spacing[axis] : 0));
  // Samples lie in the middle.
  const depth = () => minus(...[to, from].map((place) => positionOfSlice(slices, place[2] - 0.5)));
  const parts = [0, 1, 2].map((axis) =>
    axis === 2 && slices ? (isMoved(2) ? depth() : [0, 0, 0]) : along(axis).map((n) => n * change[axis]),
  );
  const vector = [0, 1, 2].map((row) => factors[row] * (parts[0][row] + parts[1][row] + parts[2][row]));
  return { vector, unit: places.unit };
}

/** The length of a ruler: { length, unit, note }. */
export function lengthOf(volume, places, [a, b]) {
  const { vector, unit, note } = vectorBetween(volume, places, a, b);
  return { length: Math.hypot(...vector), unit, note };
}

/** The angle at the second of three points: { degrees, note }. */
export function angleOf(volume, places, [a, apex, b]) {
  const arms = [a, b].map((end) => vectorBetween(volume, places, apex, end));
  const note = arms.map((arm) => arm.note).find(Boolean);
  // Either both arms are lengths, or none is.
  const [u, v] = note ? [minus(a, apex), minus(b, apex)] : arms.map(({ vector }) => vector);
  const cosine = dot(u, v) / (Math.hypot(...u) * Math.hypot(...v));
  const degrees = (Math.acos(Math.min(Math.max(cosine, -1), 1)) * 180) / Math.PI;
  return { degrees, note: note && `${note}: as if voxels were cubes` };
}

/** What can be told apart of means and deviations of a region, in values. */
function resolutionOf({ low, high }, { bounds, type }, { slope, note }) {
  if (bounds.maxError > 0) return bounds.maxError * Math.abs(slope);
  const isExact = bounds.maxError === 0 && !type.startsWith("float") && !note;
  return isExact ? Math.abs(slope) / 20 : (high - low) / 1000 || Math.abs(low) / 1e6 || 1;
}

/** A mean or a deviation of a region, as a text without a unit. */
export const meanText = (number, statistics, { volume, scale }) =>
  measuredText(number, resolutionOf(statistics, volume, scale));

/** What a measure says over the picture: "" as long as points are missing, or samples. */
export function resultText(measure, { volume, places, scale }) {
  if (!isFinished(measure)) return "";
  if (measure.kind === "ellipse" || measure.kind === "rectangle") {
    const { statistics, message } = measure;
    if (message) return "no mean";
    if (!statistics) return "";
    if (statistics.count === 0) return "no number";
    return `mean ${meanText(statistics.mean, statistics, { volume, scale })} ${scale.unit}`.trim();
  }
  if (measure.kind === "angle") {
    const { degrees } = angleOf(volume, places, measure.points);
    return Number.isFinite(degrees) ? `${measuredText(degrees, 0.5)}°` : "";
  }
  const { length, unit } = lengthOf(volume, places, measure.points);
  return `${measuredText(length, unit === "voxels" ? 1 : finestStep(measure, places))} ${unit}`;
}

/** What must be known of a result; "" if there is nothing. */
export function noteOf(measure, { volume, places }) {
  if (measure.message) return measure.message;
  if (!isFinished(measure) || (measure.kind !== "angle" && measure.kind !== "ruler")) return "";
  const { note } = (measure.kind === "angle" ? angleOf : lengthOf)(volume, places, measure.points);
  return note ?? "";
}

/** The smallest distance of samples in the slice. */
function finestStep({ normal }, { steps }) {
  return Math.min(...steps.filter((_, axis) => axis !== normal));
}
