// The line in which the plane cuts a slice, drawn over the slice: a drag of its ends turns the plane.
import { frameOf, frameOfSlice, lineInSlice, stepsIn, turnedAbout } from "./plane.js";

const ink = "#6fd3ff";
const shadow = "rgba(0, 0, 0, 0.8)";
// Pixels from the middle of the line to its handles, at most, and what a mouse and a finger may be off.
const armLength = 110;
const reach = { mouse: 10, touch: 22 };
const shortestArm = 24;

/** Two points of the canvas; undefined if the slice and the plane do not meet, or there is no plane. */
export function lineIn(view, { plane, volume, places, position }) {
  if (!plane.isShown) return undefined;
  const steps = stepsIn(volume, places);
  const [, , normal] = frameOf(plane, steps, places.axes);
  const line = lineInSlice(plane, normal, steps, volume.dims, view.normal, position[view.normal] + 0.5);
  return line?.map((place) => view.pointIn(place));
}

/** The place through which the plane passes, and the handles of its line, as points of the canvas. */
function gripsOf(view, state) {
  const line = lineIn(view, state);
  if (!line) return undefined;
  const middle = view.pointIn(state.plane.through);
  const handles = line
    .map(([x, y]) => {
      const [dx, dy] = [x - middle[0], y - middle[1]];
      const length = Math.hypot(dx, dy);
      const share = Math.min(armLength, length) / length;
      return length < shortestArm ? undefined : [middle[0] + dx * share, middle[1] + dy * share];
    })
    .filter(Boolean);
  return { line, middle, handles };
}

/** True if a handle of the line is at a point of the canvas. */
export function isAtHandle(view, state, [x, y], pointerType) {
  const most = reach[pointerType === "touch" ? "touch" : "mouse"];
  return gripsOf(view, state)?.handles.some((handle) => Math.hypot(handle[0] - x, handle[1] - y) < most) ?? false;
}

/** The plane `before`, turned in a slice as a drag from one point of the canvas to another turns the line. */
export function turnedByDrag(view, state, before, from, to) {
  const { volume, places } = state;
  const steps = stepsIn(volume, places);
  const middle = view.pointIn(before.through);
  const angle = ([x, y]) => Math.atan2(y - middle[1], x - middle[0]);
  const degrees = ((angle(to) - angle(from)) * 180) / Math.PI;
  const [, , axis] = frameOfSlice(view, steps);
  return turnedAbout(before, axis, degrees, steps, places.axes);
}

/** The context has pixels of the page. */
export function drawPlaneLine(context, view, state) {
  const grips = gripsOf(view, state);
  if (!grips) return;
  const path = new Path2D();
  path.moveTo(...grips.line[0]);
  path.lineTo(...grips.line[1]);
  context.save();
  for (const [width, style] of [
    [3.5, shadow],
    [1.5, ink],
  ]) {
    context.lineWidth = width;
    context.strokeStyle = style;
    context.stroke(path);
  }
  for (const [x, y] of grips.handles) {
    context.fillStyle = ink;
    context.strokeStyle = shadow;
    context.beginPath();
    context.arc(x, y, 6, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
  }
  context.restore();
}
