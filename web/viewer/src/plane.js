// Planes through the volume in any direction: where they lie, and how they are turned.
//
// A plane is { base, tilt, turn, spin, through }. It begins as the slice of `base` (axial, coronal or sagittal), as that is
// drawn, and is turned by degrees: by `tilt` about the line that runs across the picture, with the lower edge to the feet in
// an axial one; by `turn` about the line that runs down; and before both by `spin` in the picture. It passes through a place
// of the volume, in which sample i reaches from i to i + 1.
//
// Vectors are in the unit of lengths of the file, with the directions of its axes. So what is drawn is true to scale also if
// these are not perpendicular.
import { layoutsOf } from "./sides.js";

export const bases = ["axial", "coronal", "sagittal"];

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, factor) => a.map((n) => n * factor);
const plus = (a, b) => a.map((n, i) => n + b[i]);
const unit = (a) => scaled(a, 1 / Math.hypot(...a));
/** A sum of three vectors with these factors. */
const sumOf = (vectors, factors) => vectors.reduce((sum, vector, i) => plus(sum, scaled(vector, factors[i])), [0, 0, 0]);
const radians = (degrees) => (degrees * Math.PI) / 180;

/**
 * The steps of the axes of the samples: { axes, inverse }; the vector between two places is sumOf(axes, their difference), and
 * the other way with `inverse`. As if axes were perpendicular where the file does not say how they run.
 */
export function stepsIn({ geometry }, { steps, factors }) {
  const { directions } = geometry;
  const given = directions?.map((direction) => direction.map((n, row) => n * factors[row]));
  const volumeOf = ([a, b, c]) => dot(a, cross(b, c));
  const isSound = given && Math.abs(volumeOf(given)) > 1e-3 * steps[0] * steps[1] * steps[2];
  const axes = isSound ? given : steps.map((step, axis) => [0, 1, 2].map((row) => (row === axis ? step : 0)));
  const size = volumeOf(axes);
  const [a, b, c] = axes;
  const rows = [cross(b, c), cross(c, a), cross(a, b)].map((row) => scaled(row, 1 / size));
  return { axes, inverse: [0, 1, 2].map((i) => rows.map((row) => row[i])) };
}

export const vectorOf = ({ axes }, change) => sumOf(axes, change);
export const changeOf = ({ inverse }, vector) => sumOf(inverse, vector);

/** The frame of a slice as it is drawn: vectors of length 1 that run to the right, down, and away from whoever looks. */
export function frameOfSlice({ across, down, signs }, { axes }) {
  const right = unit(scaled(axes[across], signs[0]));
  const low = scaled(axes[down], signs[1]);
  const lower = unit(plus(low, scaled(right, -dot(low, right))));
  return [right, lower, cross(right, lower)];
}

const baseFrame = ({ base }, steps, patientAxes) => frameOfSlice(layoutsOf(patientAxes)[bases.indexOf(base)], steps);

/** The frame of a plane: vectors of length 1 that run to the right of its picture, down, and across the plane. */
export function frameOf(plane, steps, patientAxes) {
  const base = baseFrame(plane, steps, patientAxes);
  const [a, b, c] = [-plane.tilt, plane.turn, plane.spin].map(radians);
  const [ca, sa, cb, sb, cc, sc] = [a, b, c].flatMap((angle) => [Math.cos(angle), Math.sin(angle)]);
  // Rotations about the second, the first and the third vector, of which the last one is the first to be done.
  return [
    [cb * cc + sb * sa * sc, ca * sc, -sb * cc + cb * sa * sc],
    [-cb * sc + sb * sa * cc, ca * cc, sb * sc + cb * sa * cc],
    [sb * ca, -sa, cb * ca],
  ].map((column) => sumOf(base, column));
}

/** The angles of a plane with the frame that is given: { tilt, turn, spin }, to a hundredth of a degree. */
function anglesOf(frame, base) {
  const [right, down, normal] = frame.map((vector) => base.map((other) => dot(vector, other)));
  const sine = Math.min(Math.max(-normal[1], -1), 1);
  // Looking along the line that runs down, turn and spin are the same.
  const isLocked = Math.abs(sine) > 1 - 1e-9;
  const angles = {
    tilt: -Math.asin(sine),
    turn: isLocked ? Math.atan2(-right[2], right[0]) : Math.atan2(normal[0], normal[2]),
    spin: isLocked ? 0 : Math.atan2(right[1], down[1]),
  };
  return Object.fromEntries(Object.entries(angles).map(([name, angle]) => [name, Math.round((angle * 18000) / Math.PI) / 100 + 0]));
}

/** A plane that is turned by some degrees about a vector of length 1: what lies to the right of it in a picture goes down. */
export function turnedAbout(plane, axis, degrees, steps, patientAxes) {
  const [c, s] = [Math.cos(radians(degrees)), Math.sin(radians(degrees))];
  // Rodrigues' formula.
  const turned = (v) => plus(plus(scaled(v, c), scaled(cross(axis, v), s)), scaled(axis, dot(axis, v) * (1 - c)));
  const frame = frameOf(plane, steps, patientAxes).map(turned);
  return { ...plane, ...anglesOf(frame, baseFrame(plane, steps, patientAxes)) };
}

/** How far a place is from a plane, on the side to which the normal points. */
export const distanceTo = ({ through }, normal, steps, place) => dot(normal, vectorOf(steps, place.map((n, i) => n - through[i])));

/**
 * The line in which a plane cuts a slice of the volume: two places; undefined if it does not, or is parallel. The slice lies
 * at `at` along the axis `across`.
 */
export function lineInSlice(plane, normal, steps, dims, across, at) {
  // In samples, the plane is where dot(weights, place) is a number.
  const weights = steps.axes.map((axis) => dot(axis, normal));
  const [u, v] = [0, 1, 2].filter((axis) => axis !== across);
  const rest = dot(weights, plane.through) - weights[across] * at;
  if (Math.hypot(weights[u], weights[v]) < 1e-6 * Math.hypot(...weights)) return undefined;
  const ends = [];
  for (const [one, other] of [[u, v], [v, u]]) {
    if (weights[other] === 0) continue;
    for (const edge of [0, dims[one]]) {
      const found = (rest - weights[one] * edge) / weights[other];
      const place = [];
      [place[one], place[other], place[across]] = [edge, found, at];
      if (found >= 0 && found <= dims[other] && ends.every((end) => Math.hypot(...end.map((n, i) => n - place[i])) > 1e-6)) ends.push(place);
    }
  }
  return ends.length > 1 ? ends.slice(0, 2) : undefined;
}

/** A place on the way from one in the volume to another one, and in the volume: the last one if that is in it. */
export function withinVolume(from, to, dims) {
  const share = Math.min(
    1,
    ...to.map((end, axis) => {
      const way = end - from[axis];
      const limit = way > 0 ? dims[axis] : 0;
      return way === 0 || (end >= 0 && end <= dims[axis]) ? 1 : Math.max((limit - from[axis]) / way, 0);
    }),
  );
  return from.map((n, axis) => Math.min(Math.max(n + share * (to[axis] - n), 0), dims[axis]));
}

const angleText = (angle) => `${Math.round(angle * 10) / 10}°`;

/** What a plane is, in words: `label` is that of the slice with which it begins. */
export function planeText({ tilt, turn, spin }, label) {
  const parts = [["tilted", tilt], ["turned", turn], ["spun", spin]].filter(([, angle]) => angle !== 0);
  return [label, ...parts.map(([word, angle]) => `${word} ${angleText(angle)}`)].join(", ");
}

/** An angle from -180 to 180 degrees. */
export const within180 = (degrees) => (Math.abs(degrees) <= 180 ? degrees : ((((degrees + 180) % 360) + 360) % 360) - 180);

/** Numbers of a plane, as an address has them: the base, the angles, and the place through which it passes. */
export const planeNumbers = ({ base, tilt, turn, spin, through }) => [base, tilt, turn, spin, ...through.map((n) => Math.round(n * 1e6) / 1e6)];

/** The plane that a text of planeNumbers() says; undefined if it is none. */
export function planeIn(text) {
  const [base, ...rest] = text?.split(",") ?? [];
  const numbers = rest.map((part) => (part.trim() === "" ? NaN : Number(part)));
  if (!bases.includes(base) || numbers.length !== 6 || !numbers.every(Number.isFinite)) return undefined;
  const [tilt, turn, spin] = numbers.slice(0, 3).map(within180);
  return { isShown: true, base, tilt, turn, spin, through: numbers.slice(3) };
}
