// Pointers and keys, as actions.

/** Drags, wheels and touches on a slice. */
export function handlePointers(view, state, actions) {
  const { canvas } = view;
  const pointers = new Map();
  let tool;

  const at = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const moveTo = ([x, y]) => {
    const position = [...state.position];
    [position[view.across], position[view.down]] = view.placeAt(x, y);
    actions.moveTo(position);
  };

  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    if (!state.volume) return;
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, at(event));
    tool = event.button === 2 ? "window" : event.button === 1 || event.shiftKey ? "pan" : state.tool;
    if (event.button === 1) event.preventDefault();
    if (pointers.size === 1 && tool === "move") moveTo(at(event));
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!state.volume) return;
    const now = at(event);
    actions.point(view, ...now);
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      const distance = (p) => Math.max(Math.hypot(p[0] - other[0], p[1] - other[1]), 10);
      actions.zoom(view, distance(now) / distance(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
      actions.pan(view, dx / 2, dy / 2);
    } else if (tool === "move") moveTo(now);
    else if (tool === "pan") actions.pan(view, dx, dy);
    else actions.changeWindow(dy / 400, Math.exp(dx / 250));
    pointers.set(event.pointerId, now);
  });
  for (const name of ["pointerup", "pointercancel"])
    canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("pointerleave", () => actions.point(undefined));
  canvas.addEventListener("dblclick", () => actions.one(view.name));

  // Touch pads send many small steps: a slice for each 40 pixels of them.
  let turned = 0;
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (!state.volume) return;
      event.preventDefault();
      const pixels = event.deltaY * (event.deltaMode === 1 ? 40 : event.deltaMode === 2 ? 400 : 1);
      if (event.ctrlKey || event.metaKey)
        return actions.zoom(view, Math.exp(-Math.max(-200, Math.min(200, pixels)) / 250), ...at(event));
      turned += pixels;
      const slices = Math.trunc(turned / 40);
      if (slices === 0) return;
      turned -= slices * 40;
      actions.step(view.normal, slices);
    },
    { passive: false },
  );
}

/** Keys, wherever no field is being edited. */
export function handleKeys(state, actions, activeView) {
  addEventListener("keydown", (event) => {
    if (!state.volume || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest?.("input, select, summary")) return;
    const view = activeView();
    const count = event.shiftKey ? 10 : 1;
    const up = view.flipped ? 1 : -1;
    const work = {
      ArrowLeft: () => actions.step(view.across, -count),
      ArrowRight: () => actions.step(view.across, count),
      ArrowUp: () => actions.step(view.down, up * count),
      ArrowDown: () => actions.step(view.down, -up * count),
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
      g: () => actions.grid(),
      1: () => actions.tool("move"),
      2: () => actions.tool("window"),
      3: () => actions.tool("pan"),
      m: () => actions.one(view.name),
    }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!work) return;
    event.preventDefault();
    work();
  });
}
