// The sides of the patient: which planes the axes of the samples make, and which side is at which edge of a picture.
//
// Vectors are in the coordinates left, posterior, head.
import { signsOf } from "../../niivue/places.js";

const letters = ["RL", "AP", "FH"];
// A direction has a second letter, and a plane is oblique, from this share of its length on: about 3 degrees.
const leastShare = 0.05;
const orders = [
  [0, 1, 2],
  [0, 2, 1],
  [1, 0, 2],
  [1, 2, 0],
  [2, 0, 1],
  [2, 1, 0],
];
const axisNames = "xyz";

/** What turns vectors of a file into left, posterior, head: factors of their numbers; undefined if it does not say it. */
export function towardPatient(volume) {
  const signs = signsOf(volume.field("space"));
  return signs && [-signs[0], -signs[1], signs[2]];
}

const dot = (a, b) => a.reduce((sum, n, i) => sum + n * b[i], 0);

/** Where the three axes of the samples run, as vectors of length 1; undefined if the file does not say it. */
export function axesOf(volume) {
  const toLeft = towardPatient(volume);
  const { directions } = volume.geometry;
  if (!toLeft || !directions) return undefined;
  const axes = directions.map((direction) => {
    const vector = direction.map((n, i) => n * toLeft[i]);
    const length = Math.hypot(...vector);
    return vector.map((n) => n / length);
  });
  const [a, b, c] = axes;
  const determinant = dot(a, [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]]);
  // Directions that lie in one plane, or are no numbers, place nothing.
  return Math.abs(determinant) > 1e-3 ? axes : undefined;
}

/** The sides that a direction points to, the nearest one first: "L", or "LA" if it is oblique. */
export function lettersOf(vector) {
  const length = Math.hypot(...vector);
  return vector
    .map((n, i) => ({ share: Math.abs(n) / length, letter: letters[i][n > 0 ? 1 : 0] }))
    .filter(({ share }) => share >= leastShare)
    .sort((a, b) => b.share - a.share)
    .map(({ letter }) => letter)
    .join("");
}

/**
 * For left, posterior, head: the axis of the samples that runs most along it, and whether it does (1) or runs the other
 * way (-1). Without axes, x, y, z.
 */
export function nearestAxes(axes) {
  if (!axes) return [0, 1, 2].map((axis) => ({ axis, sign: 1 }));
  const along = (order) => order.reduce((sum, axis, side) => sum + Math.abs(axes[axis][side]), 0);
  const best = orders.reduce((most, order) => (along(order) > along(most) + 1e-9 ? order : most));
  return best.map((axis, side) => ({ axis, sign: axes[axis][side] < 0 ? -1 : 1 }));
}

/** True if angles in pictures, where axes are perpendicular, are those of the patient, to about a degree. */
export const arePerpendicular = ([a, b, c]) =>
  [dot(a, b), dot(b, c), dot(c, a)].every((cosine) => Math.abs(cosine) < 0.02);

/**
 * How the axial, the coronal and the sagittal slices are drawn, as radiologists hang them: the right of the patient is
 * on the left, the front on the left or above, and the head above. `across` is the axis of the samples that runs to the
 * right of the picture and `down` the one that runs down, where the sign is 1; with -1 it runs the other way. `sides`
 * are the letters at the edges. Without axes, planes have the names of their axes, and no letters.
 */
export function layoutsOf(axes) {
  const [left, back, head] = nearestAxes(axes);
  const up = { axis: head.axis, sign: -head.sign };
  return [
    ["axial", left, back, head],
    ["coronal", left, up, back],
    ["sagittal", back, up, left],
  ].map(([name, across, down, { axis: normal }]) => {
    const layout = { normal, across: across.axis, down: down.axis, signs: [across.sign, down.sign] };
    const plain = [across.axis, down.axis]
      .sort()
      .map((axis) => axisNames[axis])
      .join("–");
    if (!axes) return { ...layout, label: plain, title: plain, sides: undefined };
    const toward = ({ axis, sign }, way) => lettersOf(axes[axis].map((n) => n * sign * way));
    const sides = {
      left: toward(across, -1),
      right: toward(across, 1),
      top: toward(down, -1),
      bottom: toward(down, 1),
    };
    const isOblique = sides.right.length > 1 || sides.bottom.length > 1;
    return {
      ...layout,
      label: name[0].toUpperCase() + name.slice(1),
      title: isOblique ? `${name} (oblique)` : name,
      sides,
    };
  });
}
