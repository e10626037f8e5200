// What is drawn over a slice: cross hair, title, scale bar, the sides of the patient, and what could not be read.
import { lossText } from "./describe.js";
import { drawMeasures } from "./measure_marks.js";
import { drawPlaneLine } from "./plane_line.js";
import { slabText } from "./slab.js";

const axisNames = ["x", "y", "z"];
const ink = "#f4f4f4";
const shadow = "rgba(0, 0, 0, 0.8)";

/** A function that writes a text at a point of a context, legible over any picture. */
export const writerOn =
  (context) =>
  (text, x, y, align, font = "13px", color = ink) => {
    context.font = `${font} system-ui, sans-serif`;
    context.textAlign = align;
    context.lineWidth = 3;
    context.strokeStyle = shadow;
    context.strokeText(text, x, y);
    context.fillStyle = color;
    context.fillText(text, x, y);
  };

/** `view` is a SliceView, and `state` what the views share. The context has pixels of the page. */
export function drawMarks(context, view, state) {
  const { clientWidth: width, clientHeight: height } = view.canvas;
  drawCrossAt(context, view.pointIn(view.cross), width, height);
  drawPlaneLine(context, view, state);
  drawMeasures(context, view, state);
  const write = writerOn(context);
  const [title, notes] = titleOf(view, state);
  write(title, 9, 19, "left");
  // Below the slider.
  if (notes) write(notes, 9, view.slider.offsetTop + view.slider.offsetHeight + 15, "left", "13px", "#f2b134");
  drawScaleBar(context, state, write, width, height);
  drawSides(view, write, width, height);
  const loss = lossText(state.volume, state.scale);
  if (loss) write(loss, 9, height - 28, "left", "12px");
  if (view.isCompared) write(endOf(state.name), 9, height - (loss ? 44 : 28), "left", "bold 12px");
  // The axes of samples, as they run.
  const arrows = [view.signs[0] > 0 ? "→" : "←", view.signs[1] > 0 ? "↓" : "↑"];
  write([view.across, view.down].map((axis, i) => axisNames[axis] + arrows[i]).join(" "), 9, height - 11, "left");
}

/** The end of a name that is long, which mostly tells more than its beginning. */
const endOf = (name) => (name.length > 40 ? `…${name.slice(-39)}` : name);

/**
 * A title and a line of notes. Slices are counted from 1, as people count, and by their index, as the program does.
 */
export function titleOf(view, { position, volume, places, scale }) {
  const { normal } = view;
  const index = position[normal];
  const title = `${view.title}  slice ${index + 1} of ${volume.dims[normal]} (${axisNames[normal]} = ${index})`;
  const factor = view.shown === undefined ? 1 : volume.levels[view.shown].factor;
  const notes = [];
  const { slab } = view;
  if (slab) notes.push(slabText(slab, normal, places));
  if (factor > 1) notes.push(`overview 1:${factor}`);
  if (!view.isSettled) notes.push(view.shown === undefined ? "reading" : "reading finer samples");
  if (!view.sides) notes.push("directions unknown");
  if (places.isUneven && normal !== 2) notes.push("slices unevenly spaced");
  if (scale.note) notes.push("slopes differ by slice");
  return [title, notes.join(" · ")];
}

export function drawCrossAt(context, [x, y], width, height) {
  context.strokeStyle = "rgba(242, 177, 52, 0.75)";
  context.lineWidth = 1;
  context.beginPath();
  // With a gap, so that the place itself is seen.
  const gap = 8;
  for (const [x0, y0, x1, y1] of [
    [0, y, x - gap, y],
    [x + gap, y, width, y],
    [x, 0, x, y - gap],
    [x, y + gap, x, height],
  ]) {
    context.moveTo(Math.round(x0) + 0.5, Math.round(y0) + 0.5);
    context.lineTo(Math.round(x1) + 0.5, Math.round(y1) + 0.5);
  }
  context.stroke();
}

export function drawScaleBar(context, { zoom, places }, write, width, height) {
  // As long as a round number of units allows.
  const most = Math.min(180, width / 3) / zoom;
  const power = 10 ** Math.floor(Math.log10(most));
  const length = [5, 2, 1].map((n) => n * power).find((n) => n <= most) ?? power;
  const pixels = length * zoom;
  const [right, low] = [width - 12, height - 14];
  context.fillStyle = shadow;
  context.fillRect(right - pixels - 2, low - 4, pixels + 4, 8);
  context.fillStyle = ink;
  context.fillRect(right - pixels, low - 2, pixels, 4);
  write(`${Number(length.toPrecision(3))} ${places.unit}`, right, low - 9, "right");
}

export function drawSides({ sides }, write, width, height) {
  if (!sides) return;
  const font = "bold 17px";
  write(sides.left, 9, height / 2 + 6, "left", font);
  write(sides.right, width - 9, height / 2 + 6, "right", font);
  // Below the title, beside the slider.
  write(sides.top, width / 2, 44, "center", font);
  write(sides.bottom, width / 2, height - 11, "center", font);
}

/** Hatches boxes [x, y, width, height], so that they are not mistaken for air. */
export function drawUnreadable(context, boxes) {
  for (const [x, y, width, height] of boxes) {
    context.save();
    context.beginPath();
    context.rect(x, y, width, height);
    context.clip();
    context.fillStyle = "rgba(120, 0, 0, 0.45)";
    context.fillRect(x, y, width, height);
    context.strokeStyle = "#ff5c4d";
    context.lineWidth = 1;
    context.beginPath();
    const [right, bottom] = [Math.min(x + width, context.canvas.width), Math.min(y + height, context.canvas.height)];
    // The hatches of neighbors meet: they are where x + y is a multiple of 12.
    const [left, top] = [Math.max(x, 0), Math.max(y, 0)];
    for (let sum = Math.floor((left + top) / 12) * 12; sum < right + bottom; sum += 12) {
      context.moveTo(sum - top, top);
      context.lineTo(sum - bottom, bottom);
    }
    context.stroke();
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "center";
    context.fillStyle = "#ffd2cc";
    if (width > 60 && height > 20) context.fillText("unreadable", x + width / 2, y + height / 2);
    context.restore();
  }
}
