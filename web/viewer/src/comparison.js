// Two files: the second one beside the first, at the same place and in the same window, or their difference.
import { allowedOf, boundOf, DifferenceShades, DifferenceTiles } from "./difference.js";
import { scaleOf } from "./describe.js";
import { Shades } from "./shades.js";

/** Fails with an Error if two volumes do not have the same size. */
export function requireEqualSizes(second, secondName, first, firstName) {
  const text = ({ dims }) => dims.join(" × ");
  if (text(first) !== text(second))
    throw new Error(`${secondName} has ${text(second)} samples, but ${firstName} has ${text(first)}: they cannot be compared`);
}

/**
 * What the second views show, as the state of a viewer: what is not its own is that of `state`, such as the position and the
 * zoom. `first` is `state`.
 */
export function secondState(state) {
  return Object.assign(Object.create(state), {
    first: state,
    volume: undefined,
    tiles: undefined,
    shades: undefined,
    scale: undefined,
    name: "",
    // These are of the samples of the first.
    colors: undefined,
    labels: undefined,
    showsGrid: false,
  });
}

/** Lets the second views show another file: { volume, tiles, name }. */
export function showFile(second, { volume, tiles, name }) {
  const { low, high } = second.first.shades;
  const scale = scaleOf(volume);
  Object.assign(second, { volume, tiles, name, scale, shades: new Shades(scale), isDifference: false });
  second.shades.set(low, high);
  delete second.slab;
}

/** Lets the second views show the file minus the first one. */
export function showDifference(second, { volume, tiles, name }) {
  const { first } = second;
  const scale = scaleOf(volume);
  if (first.scale.note || scale.note) throw new Error("each slice has its own slope, so there is no difference of values");
  const limits = [boundOf(first.volume, first.scale), boundOf(volume, scale)];
  const limit = limits.includes(null) ? undefined : limits[0] + limits[1];
  const allowed = allowedOf([first.volume, volume], [first.scale, scale]);
  const difference = new DifferenceTiles(first, { volume, tiles, scale }, allowed);
  Object.assign(second, {
    name: `${name} − ${first.name}`,
    tiles: difference,
    // What views need of a volume.
    volume: {
      dims: volume.dims,
      levels: difference.levels,
      type: "float64",
      geometry: first.volume.geometry,
      brickEdge: first.volume.brickEdge,
      lead: first.volume.lead,
      storesGrid: false,
      // A difference of two files that are within their bounds is off by no more than both.
      bounds: { maxError: limit ?? null },
    },
    scale: { slope: 1, intercept: 0, unit: first.scale.unit === scale.unit ? scale.unit : "" },
    shades: new DifferenceShades(allowed),
    isDifference: true,
    limit,
    // The maximum of a difference is not the difference of maxima.
    slab: { ...first.slab, kind: "none" },
  });
}
