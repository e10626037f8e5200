// Measures over a slice: lines, handles, and results; and which of them is at a point.
import { isFinished, isMeasuring, resultText } from "./measures.js";
import { handlesOf as cornersOf, isRegion } from "./regions.js";

const ink = "#7df0b0";
const chosenInk = "#fff3a0";
const shadow = "rgba(0, 0, 0, 0.8)";
// Pixels from a handle or a line that a mouse, and a finger, may be off.
const reach = { mouse: 8, touch: 22 };

/** The measures in the slice or the plane that a view shows. */
export const measuresIn = (view, { measures }) => measures.filter((measure) => view.holds(measure));

/** Where the handles of a measure are on the canvas. */
const handlesOf = (view, measure) =>
  (isRegion(measure) ? cornersOf(measure) : measure.points).map((place) => view.pointIn(place));

/** Points around a region on the canvas, the first one once more at the end. */
function outlineOf(view, measure) {
  const corners = handlesOf(view, measure);
  if (measure.kind === "rectangle") return [...corners, corners[0]];
  const [[ax, ay], , [bx, by]] = corners;
  return Array.from({ length: 65 }, (_, i) => {
    const turn = (i / 32) * Math.PI;
    return [(ax + bx) / 2 + (Math.cos(turn) * (bx - ax)) / 2, (ay + by) / 2 + (Math.sin(turn) * (by - ay)) / 2];
  });
}

/** The lines of a measure on the canvas: [from, to]. */
function linesOf(view, measure) {
  const handles = isRegion(measure) ? outlineOf(view, measure) : handlesOf(view, measure);
  return handles.slice(1).map((to, i) => [handles[i], to]);
}

function distanceToLine([x, y], [[ax, ay], [bx, by]]) {
  const [dx, dy] = [bx - ax, by - ay];
  const share = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1);
  const t = Math.min(Math.max(share, 0), 1);
  return Math.hypot(x - ax - t * dx, y - ay - t * dy);
}

/** What is at a point of the canvas: { measure, handle }, without a handle if it is a line; or nothing. */
export function measureAt(view, state, point, pointerType) {
  const most = reach[pointerType === "touch" ? "touch" : "mouse"];
  // The one that was drawn last is on top.
  const measures = measuresIn(view, state).toReversed();
  let best = { distance: most };
  for (const measure of measures)
    for (const [handle, at] of handlesOf(view, measure).entries()) {
      const distance = Math.hypot(at[0] - point[0], at[1] - point[1]);
      if (distance < best.distance) best = { distance, measure, handle };
    }
  if (best.measure) return best;
  const measure = measures.find((one) => linesOf(view, one).some((line) => distanceToLine(point, line) < most));
  return measure && { measure };
}

/** Draws the measures in the slice of a view. The context has pixels of the page. */
export function drawMeasures(context, view, state) {
  for (const measure of measuresIn(view, state)) drawMeasure(context, view, state, measure);
}

function drawMeasure(context, view, state, measure) {
  const isChosen = measure === state.chosenMeasure;
  const color = isChosen ? chosenInk : ink;
  const path = new Path2D();
  for (const [from, to] of linesOf(view, measure)) {
    path.moveTo(...from);
    path.lineTo(...to);
  }
  context.save();
  context.setLineDash(isFinished(measure) ? [] : [5, 4]);
  for (const [width, style] of [
    [4, shadow],
    [1.5, color],
  ]) {
    context.lineWidth = width;
    context.strokeStyle = style;
    context.stroke(path);
  }
  context.setLineDash([]);
  const handles = handlesOf(view, measure);
  if (isChosen || isMeasuring(state.tool) || !isFinished(measure))
    for (const [x, y] of handles) {
      context.lineWidth = 1.5;
      context.fillStyle = shadow;
      context.strokeStyle = color;
      context.beginPath();
      context.arc(x, y, 4, 0, 2 * Math.PI);
      context.fill();
      context.stroke();
    }
  // Results are those of the first file.
  const { first = state } = state;
  const isOther = first !== state && isRegion(measure);
  const text = isOther ? String(measure.number) : `${measure.number}: ${resultText(measure, first) || "…"}`;
  const rightmost = handles.reduce((most, at) => (at[0] > most[0] ? at : most));
  writeBeside(context, text, measure.kind === "angle" ? (handles[1] ?? rightmost) : rightmost, color, view.canvas);
  context.restore();
}

/** Right of and below a point, within the canvas. */
function writeBeside(context, text, [right, low], color, { clientWidth, clientHeight }) {
  context.font = "13px system-ui, sans-serif";
  context.textAlign = "left";
  const x = Math.min(right + 8, clientWidth - context.measureText(text).width - 6);
  const y = Math.min(low + 16, clientHeight - 6);
  context.lineWidth = 3;
  context.strokeStyle = shadow;
  context.strokeText(text, x, y);
  context.fillStyle = color;
  context.fillText(text, x, y);
}
