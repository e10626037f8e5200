// What pointers and wheels mean, before anything is done with it.

// Pixels that a finger may move in a tap.
const tapPixels = 8;
// Milliseconds: a finger that began to move so shortly before the second one came belongs to the pinch.
const pinchDelay = 300;

/**
 * Follows the pointers on a canvas. Calls `on`:
 * - `start(point, event)` when a drag begins: for a finger, once it has moved; `drag(dx, dy, point)` for its moves;
 * - `cancel()` when it turns out that the drag is the beginning of a pinch;
 * - `tap(point)` when a finger leaves without having moved;
 * - `pinch(factor, middle, dx, dy)` while two fingers move: the place between them has moved by dx, dy to `middle`, and
 *   their distance has grown by the factor. Nothing else is called until all fingers have left;
 * - `end()` when the last pointer has left.
 * Points are pixels of the page in the canvas.
 */
export function followPointers(canvas, on) {
  const pointers = new Map();
  let doing = "nothing";
  let began;
  const at = ({ clientX, clientY }) => {
    const box = canvas.getBoundingClientRect();
    return [clientX - box.left, clientY - box.top];
  };
  const middleOf = ([a, b]) => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
  // Fingers that touch each other have no direction to grow in.
  const distanceOf = ([a, b]) => Math.max(Math.hypot(a[0] - b[0], a[1] - b[1]), 10);

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, at(event));
    if (pointers.size > 1) {
      if (doing === "drag" && performance.now() - began.time < pinchDelay) on.cancel?.();
      doing = pointers.size === 2 && doing !== "done" ? "pinch" : "done";
      return;
    }
    began = { point: at(event), event, time: performance.now() };
    doing = event.pointerType === "touch" ? "wait" : "drag";
    if (doing === "drag") on.start(began.point, event);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = at(event);
    if (doing === "pinch") {
      const old = [...pointers.values()];
      pointers.set(event.pointerId, now);
      const moved = [...pointers.values()];
      const [from, to] = [middleOf(old), middleOf(moved)];
      return on.pinch(distanceOf(moved) / distanceOf(old), to, to[0] - from[0], to[1] - from[1]);
    }
    if (doing === "wait") {
      if (Math.hypot(now[0] - began.point[0], now[1] - began.point[1]) < tapPixels) return;
      doing = "drag";
      began.time = performance.now();
      on.start(began.point, began.event);
    }
    pointers.set(event.pointerId, now);
    if (doing === "drag") on.drag(now[0] - before[0], now[1] - before[1], now);
  });
  for (const name of ["pointerup", "pointercancel"])
    canvas.addEventListener(name, (event) => {
      if (!pointers.delete(event.pointerId)) return;
      if (doing === "wait" && name === "pointerup") on.tap?.(began.point);
      if (doing === "pinch") doing = "done";
      if (pointers.size > 0) return;
      doing = "nothing";
      on.end?.();
    });
}

// What pages scroll for a notch differs: 100 or 120 pixels in Chromium, 3 lines in Firefox, more or less by the
// settings of a system. An event of so many pixels, or of a line or page, is a notch.
const leastNotch = 40;
// Chromium on macOS sends multiples of this for the notches of a wheel.
const macNotch = 4.000244140625;
// Touch pads, and wheels with fine steps, send less, more often: so many pixels or lines are as much as a notch.
const pixelsOfNotch = 100;
const linesOfNotch = 3;

/** A function of the events of a wheel: -1, 0 or 1 slices. Never more, so that none is skipped. */
export function wheelSlices() {
  let turned = 0; // in notches
  return (event) => {
    // Asked first: Firefox then counts in lines.
    const { deltaMode } = event;
    const { deltaY } = event;
    if (deltaY === 0) return 0;
    const way = Math.sign(deltaY);
    const isNotch = deltaMode === 0 ? Math.abs(deltaY) >= leastNotch || deltaY % macNotch === 0 : Math.abs(deltaY) >= 1;
    if (isNotch) {
      turned = 0;
      return way;
    }
    if (Math.sign(turned) !== way) turned = 0;
    turned += deltaY / (deltaMode === 0 ? pixelsOfNotch : linesOfNotch);
    // Sums of fractions are a little more or less.
    if (Math.abs(turned) < 1 - 1e-6) return 0;
    turned -= way;
    return way;
  };
}

/** The factor of the zoom that an event of a wheel means: with Ctrl, or by the pinch of a touch pad, which is the same. */
export function wheelZoom(event) {
  const { deltaMode } = event;
  const pixels = event.deltaY * [1, pixelsOfNotch / linesOfNotch, 400][deltaMode];
  return Math.exp(-Math.max(-200, Math.min(200, pixels)) / 250);
}
