// How the volume is shown in 3D, apart from how it is drawn: `state.space` of viewer.js.
import { mapNames } from "./color_maps.js";

export const kindsOfSpace = ["surface", "fog", "materials"];

/** As long as nobody has changed anything. `crop` is the box of the samples that are drawn: { low, high }, or all. */
export const newSpace = () => ({
  kind: "surface",
  map: "grey",
  opacity: { surface: 1, fog: 0.5 },
  crop: undefined,
  turn: { around: 0.5, up: 0.35 },
  zoom: 1.15,
});

/** The box of the samples that are drawn, of a volume with these dims: at least one along each axis. */
export function cropOf({ crop }, dims) {
  const low = dims.map((n, axis) => Math.min(Math.max(Math.floor(crop?.low[axis] ?? 0), 0), n - 1));
  const high = dims.map((n, axis) => Math.min(Math.max(Math.floor(crop?.high[axis] ?? n), low[axis] + 1), n));
  return { low, high };
}

const rounded = (number) => Math.round(number * 1e4) / 1e4;

/** Keys and values of an address; none for what nobody has changed. Without a choice, materials are shown if there are any. */
export function spaceParts({ kind, map, opacity, crop, turn, zoom }, level, hasMaterials) {
  const plain = newSpace();
  const parts = [];
  if (kind !== (hasMaterials ? "materials" : plain.kind) || (kind in opacity && opacity[kind] !== plain.opacity[kind]))
    parts.push(["space", kind in opacity ? [kind, opacity[kind]] : kind]);
  if (level !== undefined) parts.push(["level", level]);
  if (map !== plain.map) parts.push(["map", map]);
  if (crop) parts.push(["crop", [...crop.low, ...crop.high]]);
  if (turn.around !== plain.turn.around || turn.up !== plain.turn.up || zoom !== plain.zoom)
    parts.push(["turn", [turn.around, turn.up, zoom].map(rounded)]);
  return parts;
}

/**
 * What an address says, as `space` of a state with the other things as they are at first; undefined if it says nothing.
 * `textOf(key)` is the value of a key, and `numbersOf(key, count)` as many numbers.
 */
export function spaceIn(textOf, numbersOf) {
  const space = newSpace();
  const [kind, opacity] = textOf("space")?.split(",") ?? [];
  if (kindsOfSpace.includes(kind)) space.kind = kind;
  if (kind in space.opacity && opacity !== undefined && Number(opacity) >= 0 && Number(opacity) <= 1) space.opacity[kind] = Number(opacity);
  if (mapNames.includes(textOf("map"))) space.map = textOf("map");
  const crop = numbersOf("crop", 6);
  if (crop && [0, 1, 2].every((axis) => crop[axis] >= 0 && crop[axis] < crop[axis + 3])) space.crop = { low: crop.slice(0, 3), high: crop.slice(3) };
  const turn = numbersOf("turn", 3);
  if (turn?.[2] > 0.1 && turn[2] < 100 && Math.abs(turn[1]) < 1.6) {
    space.turn = { around: turn[0], up: turn[1] };
    space.zoom = turn[2];
  }
  return ["space", "map", "crop", "turn"].some((key) => textOf(key) !== undefined) ? space : undefined;
}
