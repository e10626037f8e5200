// Where samples are: the unit of lengths, the steps between samples, and positions in the world.
import { millimetersOf, signsOf, unitNamesOf } from "../../niivue/places.js";
import { placeText } from "./numbers.js";
import { arePerpendicular, axesOf } from "./sides.js";

/**
 * What views need of a geometry: `unit`, the name of the unit of all lengths, and whether the file gives one: else it is
 * "units", as the program calls them, also in spaces of patients: only formats such as DICOM say that these are in mm, and
 * then the file has "mm". `steps`, the distances of samples in it
 * (1 where it is not known); `factors`, which turn lengths of the file along each axis into it; `axes` (see sides.js);
 * `slices`, the positions of unevenly spaced ones; and `notes`, sentences about what pictures do not show.
 */
export function placesOf(volume) {
  const { spacing, directions } = volume.geometry;
  const { unit, hasUnit, factors } = unitOf(volume);
  const steps = [0, 1, 2].map((axis) => {
    const step = directions
      ? Math.hypot(...directions[axis].map((n, row) => n * factors[row]))
      : spacing?.[axis] * factors[axis];
    return Math.abs(step) || 1;
  });
  const axes = axesOf(volume);
  const notes = [];
  if (!axes) notes.push("directions unknown: the file does not state which side of the patient is where");
  else if (!arePerpendicular(axes)) notes.push("axes are not perpendicular, but are drawn as if they were: angles are distorted");
  if (!spacing) notes.push("spacing unknown: drawn as if equal along all axes");
  else if (spacing.some((step) => !Math.abs(step)))
    notes.push(
      `distance along ${[..."xyz"].filter((_, axis) => !Math.abs(spacing[axis])).join(", ")} unknown: drawn as 1 ${unit === "units" ? "unit" : unit}`,
    );
  const slices = positionsOfSlices(volume);
  const isUneven = volume.pair("slice_positions") !== undefined;
  if (isUneven) notes.push("slices along z are unevenly spaced, but drawn as if even");
  return { unit, hasUnit, steps, factors, axes, notes, slices, isUneven };
}

/** The unit of lengths: that of the scan, or samples if it has no spacing; and what turns lengths of each axis into it. */
function unitOf(volume) {
  const factors = [1, 1, 1];
  if (!volume.geometry.spacing) return { unit: "samples", hasUnit: true, factors };
  const names = unitNamesOf(volume).map((name) => name.trim());
  const given = names.filter((name) => name !== "");
  const hasUnit = given.length > 0;
  const lengths = names.map((name) => millimetersOf(name));
  if (given.length === 3 && lengths.every((length) => length !== undefined)) {
    if (lengths.every((length) => length === lengths[0]))
      return { unit: lengths[0] === 1e-3 ? "µm" : names[0], hasUnit, factors };
    return { unit: "mm", hasUnit, factors: lengths };
  }
  return { unit: hasUnit && given.every((name) => name === given[0]) ? given[0] : "units", hasUnit, factors };
}

/** The positions of unevenly spaced slices, three numbers each; undefined if they are even, or cannot be read. */
function positionsOfSlices(volume) {
  const rows = volume
    .pair("slice_positions")
    ?.split(";")
    .map((text) => text.trim().split(/\s+/).map(Number));
  return rows?.length === volume.dims[2] && rows.every((row) => row.length === 3 && row.every(Number.isFinite))
    ? rows
    : undefined;
}

/** The position of a slice, which may lie between two or beyond the last one, of unevenly spaced ones. */
export function positionOfSlice(slices, z) {
  if (slices.length === 1) return slices[0];
  const below = Math.min(Math.max(Math.floor(z), 0), slices.length - 2);
  return slices[below].map((n, row) => n + (z - below) * (slices[below + 1][row] - n));
}

/**
 * The position in the world of a sample, or of a place between samples, which are at their numbers, as three texts; undefined
 * if the file gives none. `step`: see placeText().
 */
export function positionTexts({ geometry }, { steps, factors, slices }, place, step = Math.min(...steps)) {
  const { spacing, origin, directions } = geometry;
  if (!spacing) return undefined;
  return [0, 1, 2].map((row) => {
    const along = (axis) => (directions ? directions[axis][row] : axis === row ? spacing[axis] || 1 : 0);
    const start = slices ? positionOfSlice(slices, place[2])[row] : (origin?.[row] ?? 0);
    const terms = [start, ...place.map((p, axis) => (slices && axis === 2 ? 0 : p * along(axis)))].map(
      (t) => t * factors[row],
    );
    const sum = terms.reduce((a, b) => a + b, 0);
    return placeText(sum, step, Math.max(...terms.map(Math.abs)));
  });
}
