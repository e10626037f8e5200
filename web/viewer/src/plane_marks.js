// What is drawn over the picture of a plane, as marks.js does over a slice.
import { lossText } from "./describe.js";
import { drawCrossAt, drawScaleBar, drawSides, writerOn } from "./marks.js";
import { drawMeasures } from "./measure_marks.js";

/** A title and a line of notes. */
export function titleOfPlane(view, { volume, places, scale }) {
  const factor = view.shown === undefined ? 1 : volume.levels[view.shown].factor;
  const notes = [];
  if (factor > 1) notes.push(`overview 1:${factor}`);
  if (!view.isSettled) notes.push(view.shown === undefined ? "reading" : "reading finer samples");
  else if (view.isWhole === false) notes.push("not all samples: zoom in, or they cannot be read");
  if (!view.sides) notes.push("directions unknown");
  if (places.isUneven) notes.push("slices unevenly spaced");
  if (scale.note) notes.push("slopes differ by slice");
  return [view.title, notes.join(" · ")];
}

/** The context has pixels of the page. */
export function drawPlaneMarks(context, view, state) {
  const { clientWidth: width, clientHeight: height } = view.canvas;
  const write = writerOn(context);
  drawCrossAt(context, view.pointIn(view.cross), width, height);
  drawMeasures(context, view, state);
  const [title, notes] = titleOfPlane(view, state);
  write(title, 9, 19, "left");
  if (notes) write(notes, 9, view.slider.offsetTop + view.slider.offsetHeight + 15, "left", "13px", "#f2b134");
  drawScaleBar(context, state, write, width, height);
  drawSides(view, write, width, height);
  const loss = lossText(state.volume, state.scale);
  if (loss) write(loss, 9, height - 28, "left", "12px");
  write("between samples", 9, height - 11, "left", "12px");
}
