// Pointers and keys, as actions.
import { followPointers, wheelSlices, wheelZoom } from "./gestures.js";
import { isMeasuring } from "./measures.js";

// Pixels that a finger moves for a slice.
const swipePixels = 12;

/** Drags, wheels and touches on a slice. */
export function handlePointers(view, state, actions) {
  const { canvas } = view;
  let tool;
  let swiped;
  let before;

  const moveTo = ([x, y]) => {
    const position = [...state.position];
    [position[view.across], position[view.down]] = view.placeAt(x, y);
    actions.moveTo(position);
  };
  const swipe = (dy) => {
    swiped += dy;
    const slices = Math.trunc(swiped / swipePixels);
    swiped -= slices * swipePixels;
    // As a page scrolls: swiping up goes to the next slice.
    if (slices !== 0) actions.step(view.normal, -slices);
  };

  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.focus({ preventScroll: true });
    if (event.button === 1) event.preventDefault();
  });
  canvas.addEventListener("pointermove", (event) => {
    const box = canvas.getBoundingClientRect();
    if (state.volume) actions.point(view, event.clientX - box.left, event.clientY - box.top);
  });
  canvas.addEventListener("pointerleave", () => actions.point(undefined));
  canvas.addEventListener("dblclick", () => actions.one(view.name));
  followPointers(canvas, {
    start(point, { button, shiftKey, pointerType }) {
      if (!state.volume) return;
      tool = button === 2 ? "window" : button === 1 || shiftKey ? "pan" : state.tool;
      if (tool === "move" && pointerType === "touch") tool = "slices";
      swiped = 0;
      before = actions.remember();
      if (tool === "move") moveTo(point);
      if (isMeasuring(tool)) actions.measuring.start(view, point, pointerType);
    },
    drag(dx, dy, point) {
      if (!state.volume) return;
      if (tool === "move") moveTo(point);
      else if (tool === "slices") swipe(dy);
      else if (tool === "pan") actions.pan(view, dx, dy);
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
      if (slices !== 0) actions.step(view.normal, slices);
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
    const [right, down] = view.signs;
    const work = {
      ArrowLeft: () => actions.step(view.across, -right * count),
      ArrowRight: () => actions.step(view.across, right * count),
      ArrowUp: () => actions.step(view.down, -down * count),
      ArrowDown: () => actions.step(view.down, down * count),
      PageUp: () => actions.step(view.normal, count),
      PageDown: () => actions.step(view.normal, -count),
      Home: () => actions.step(view.normal, -state.position[view.normal]),
      End: () => actions.step(view.normal, state.volume.dims[view.normal]),
      "+": () => actions.zoom(view, 1.25),
      "=": () => actions.zoom(view, 1.25),
      "-": () => actions.zoom(view, 0.8),
      0: () => actions.fit(),
      "[": () => actions.changeWindow(0, 0.9),
      "]": () => actions.changeWindow(0, 1 / 0.9),
      "{": () => actions.changeWindow(-0.05, 1),
      "}": () => actions.changeWindow(0.05, 1),
      a: () => actions.autoWindow(),
      w: () => actions.preset(event.shiftKey ? -1 : 1),
      s: () => actions.slab(),
      d: () => actions.compare(),
      ",": () => actions.thicken(view, -1),
      ".": () => actions.thicken(view, 1),
      g: () => actions.grid(),
      l: () => actions.colors(),
      1: () => actions.tool("move"),
      2: () => actions.tool("window"),
      3: () => actions.tool("pan"),
      4: () => actions.tool("ruler"),
      5: () => actions.tool("angle"),
      6: () => actions.tool("ellipse"),
      7: () => actions.tool("rectangle"),
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
