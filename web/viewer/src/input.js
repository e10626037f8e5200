// Pointers and keys, as actions.
import { followPointers, wheelSlices, wheelZoom } from "./gestures.js";
import { isMeasuring } from "./measures.js";
import { isAtHandle } from "./plane_line.js";

// Pixels that a finger moves for a slice.
const swipePixels = 12;
// Degrees by which keys turn the oblique plane.
const keyDegrees = 2;
// Slices, to get to the first or the last one.
const farAway = 1e9;

/** Drags, wheels and touches on a slice. */
export function handlePointers(view, state, actions) {
  const { canvas } = view;
  let tool;
  let swiped;
  let before;
  let from;

  const moveTo = (point) => actions.moveIn(view, point);
  // Of the line of the oblique plane.
  const isHandle = (point, pointerType) => !view.isPlane && isAtHandle(view, state, point, pointerType);
  const swipe = (dy) => {
    swiped += dy;
    const slices = Math.trunc(swiped / swipePixels);
    swiped -= slices * swipePixels;
    // As a page scrolls: swiping up goes to the next slice.
    if (slices !== 0) actions.go(view, 2, -slices);
  };

  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.focus({ preventScroll: true });
    if (event.button === 1) event.preventDefault();
  });
  canvas.addEventListener("pointermove", (event) => {
    const box = canvas.getBoundingClientRect();
    if (!state.volume) return;
    const point = [event.clientX - box.left, event.clientY - box.top];
    actions.point(view, ...point);
    if (event.buttons === 0) canvas.style.cursor = state.tool === "move" && isHandle(point, event.pointerType) ? "grab" : "";
  });
  canvas.addEventListener("pointerleave", () => actions.point(undefined));
  canvas.addEventListener("dblclick", () => actions.one(view.name));
  followPointers(canvas, {
    start(point, { button, shiftKey, pointerType }) {
      if (!state.volume) return;
      tool = button === 2 ? "window" : button === 1 || shiftKey ? "pan" : state.tool;
      if (tool === "move" && isHandle(point, pointerType)) tool = "tilt";
      if (tool === "move" && pointerType === "touch") tool = "slices";
      swiped = 0;
      from = point;
      before = actions.remember();
      if (tool === "move") moveTo(point);
      if (isMeasuring(tool)) actions.measuring.start(view, point, pointerType);
    },
    drag(dx, dy, point) {
      if (!state.volume) return;
      if (tool === "move") moveTo(point);
      else if (tool === "slices") swipe(dy);
      else if (tool === "pan") actions.pan(view, dx, dy);
      else if (tool === "tilt") actions.tilt(view, before.plane, from, point);
      else if (isMeasuring(tool)) actions.measuring.drag(view, point);
      else actions.changeWindow(dy / 400, Math.exp(dx / 250));
    },
    cancel() {
      if (!state.volume) return;
      actions.measuring.cancel();
      actions.restore(before);
    },
    end: () => actions.measuring.end(view),
    tap(point) {
      if (!state.volume) return;
      if (state.tool === "move") moveTo(point);
      if (isMeasuring(state.tool)) actions.measuring.choose(view, point, "touch");
    },
    pinch(factor, middle, dx, dy) {
      if (!state.volume) return;
      actions.pan(view, dx, dy);
      actions.zoom(view, factor, ...middle);
    },
  });

  const slicesOf = wheelSlices();
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (!state.volume) return;
      event.preventDefault();
      if (event.ctrlKey || event.metaKey) {
        const box = canvas.getBoundingClientRect();
        return actions.zoom(view, wheelZoom(event), event.clientX - box.left, event.clientY - box.top);
      }
      const slices = slicesOf(event);
      if (slices !== 0) actions.go(view, 2, slices);
    },
    { passive: false },
  );
}

/** Keys, wherever no field is being edited. */
export function handleKeys(state, actions, activeView) {
  addEventListener("keydown", (event) => {
    if (!state.volume || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest?.("input, select, summary")) return;
    // These press a button.
    if (event.key === "Enter" && event.target.closest?.("button")) return;
    const view = activeView();
    const count = event.shiftKey ? 10 : 1;
    const back = event.shiftKey ? -1 : 1;
    const work = {
      ArrowLeft: () => actions.go(view, 0, -count),
      ArrowRight: () => actions.go(view, 0, count),
      ArrowUp: () => actions.go(view, 1, -count),
      ArrowDown: () => actions.go(view, 1, count),
      PageUp: () => actions.go(view, 2, count),
      PageDown: () => actions.go(view, 2, -count),
      Home: () => actions.go(view, 2, -farAway),
      End: () => actions.go(view, 2, farAway),
      "+": () => actions.zoom(view, 1.25),
      "=": () => actions.zoom(view, 1.25),
      "-": () => actions.zoom(view, 0.8),
      0: () => actions.fit(),
      "[": () => actions.changeWindow(0, 0.9),
      "]": () => actions.changeWindow(0, 1 / 0.9),
      "{": () => actions.changeWindow(-0.05, 1),
      "}": () => actions.changeWindow(0.05, 1),
      a: () => actions.autoWindow(),
      w: () => actions.preset(back),
      s: () => actions.slab(),
      d: () => actions.compare(),
      ",": () => actions.thicken(view, -1),
      ".": () => actions.thicken(view, 1),
      o: () => actions.plane(),
      t: () => actions.turn("tilt", back * keyDegrees),
      r: () => actions.turn("turn", back * keyDegrees),
      y: () => actions.turn("spin", back * keyDegrees),
      g: () => actions.grid(),
      l: () => actions.colors(),
      1: () => actions.tool("move"),
      2: () => actions.tool("window"),
      3: () => actions.tool("pan"),
      4: () => actions.tool("ruler"),
      5: () => actions.tool("angle"),
      6: () => actions.tool("ellipse"),
      7: () => actions.tool("rectangle"),
      8: () => actions.tool("tilt"),
      Enter: () => actions.measuring.putPoint(view),
      Delete: () => actions.measuring.remove(),
      Backspace: () => actions.measuring.remove(),
      Escape: () => actions.measuring.leave(),
      m: () => actions.one(view.name),
      p: () => actions.picture(),
    }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!work) return;
    event.preventDefault();
    work();
  });
}
