// The page: opens a file, and links the views.
import { open } from "@tagrid/decoder";
import { boundRows, factRows, fillList, numberText, scaleOf, unitOf } from "./describe.js";
import { handleKeys, handlePointers } from "./input.js";
import { Shades, percentiles } from "./shades.js";
import { SliceView } from "./slice_view.js";
import { Tiles } from "./tiles.js";
import { SpaceView } from "./space_view.js";

const element = (id) => document.getElementById(id);
const sections = Object.fromEntries([...document.querySelectorAll("#views section")].map((s) => [s.dataset.view, s]));

// What the views share. Positions are samples of the volume; the zoom is pixels of the page for a unit of length.
const state = {
  volume: undefined,
  tiles: undefined,
  shades: undefined,
  scale: undefined,
  unit: "",
  steps: [1, 1, 1],
  position: [0, 0, 0],
  zoom: 1,
  tool: "move",
  isFitted: true,
  isWindowChosen: false,
  showsGrid: false,
};

const sliceViews = [
  ["axial", 2],
  ["coronal", 1],
  ["sagittal", 0],
].map(([name, normal]) => {
  const canvas = document.createElement("canvas");
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `${name} slice`);
  const slider = document.createElement("input");
  Object.assign(slider, { type: "range", min: 0, className: "slices" });
  slider.setAttribute("aria-label", `number of the ${name} slice`);
  slider.addEventListener("input", () => {
    const position = [...state.position];
    position[normal] = slider.valueAsNumber;
    actions.moveTo(position);
  });
  sections[name].append(canvas, slider);
  const onError = (error) => {
    failure = error.message;
    draw();
  };
  return Object.assign(new SliceView(canvas, name, normal, state, () => draw(), onError), { slider });
});
const spaceView = new SpaceView(sections.space, state);
let file;
// Milliseconds.
const retryAfter = 3000;
let retryTimer;

// For tests, and for whoever looks into the page: milliseconds since the page was opened.
const times = {};

function say(text, isError = false) {
  element("status").textContent = text;
  element("status").classList.toggle("error", isError);
}

let isDrawingPlanned = false;
function draw() {
  if (isDrawingPlanned) return;
  isDrawingPlanned = true;
  requestAnimationFrame(() => {
    isDrawingPlanned = false;
    if (!state.volume) return;
    for (const view of sliceViews) view.draw();
    noteTimes();
    if (!isFirstDrawn && haveFirst()) {
      isFirstDrawn = true;
      read();
    }
    const isComplete = sliceViews.every((view) => !view.isShown || view.isComplete);
    showProgress(isComplete);
    // After the slices, which come first.
    if (isComplete) spaceView.update();
  });
}

function noteTimes() {
  const shown = sliceViews.filter((view) => view.isShown);
  if (shown.some((view) => view.shown !== undefined)) times.first ??= performance.now();
  if (shown.every((view) => view.shown !== undefined)) times.all ??= performance.now();
  if (shown.every((view) => view.isComplete)) times.complete ??= performance.now();
}

let failure;
function showProgress(isComplete) {
  if (failure) return say(failure, true);
  say(isComplete ? gridNote() : "Reading …");
}

function gridNote() {
  if (!state.showsGrid) return "";
  if (!state.volume.storesGrid) return "The file stores no grid: it follows from the samples. tagrid mesh computes it.";
  const states = sliceViews.map((view) => view.gridState);
  if (states.includes("reading")) return "Reading the grid …";
  return states.includes("far") ? "Zoom in to see the grid: it is drawn over samples of the volume itself." : "";
}

const haveFirst = () => sliceViews.every((view) => view.hasFirst);
// Finer samples are read when the first pictures are on the screen, which must not wait for them.
let isFirstDrawn = false;
let timer;
/** Reads what the views want. */
function read() {
  clearTimeout(timer);
  if (!state.volume) return;
  if (!haveFirst()) isFirstDrawn = false;
  state.tiles.want(sliceViews.flatMap((view, order) => view.regions(order, isFirstDrawn)));
  for (const view of sliceViews) view.wantGrid();
  const waits = Math.max(...sliceViews.map((view) => view.waits));
  if (waits > 0) timer = setTimeout(read, waits + 1);
}

/** After any change of what is shown. */
function update() {
  if (!state.volume) return;
  if (state.isFitted) fit();
  for (const { slider, normal } of sliceViews) {
    slider.max = state.volume.dims[normal] - 1;
    slider.value = state.position[normal];
  }
  draw();
  read();
  showReadout();
}

function fit() {
  const shown = sliceViews.filter((view) => view.isShown);
  if (shown.length === 0) return;
  state.isFitted = true;
  state.zoom = Math.min(...shown.map((view) => view.fittingZoom()));
  for (const view of sliceViews) {
    const { dims } = state.volume;
    view.center = [dims[view.across] / 2, dims[view.down] / 2];
  }
}

// ---- What the input does -------------------------------------------------------------------------------------------

const actions = {
  moveTo(position) {
    const { dims } = state.volume;
    const within = position.map((p, axis) => Math.min(Math.max(Math.floor(p), 0), dims[axis] - 1));
    for (const view of sliceViews) if (within[view.normal] !== state.position[view.normal]) view.changed();
    state.position = within;
    // Follows the cross hair where it leaves the canvas.
    for (const view of sliceViews) {
      if (!view.isShown || state.isFitted) continue;
      const [x, y] = view.pointOf([within[view.across] + 0.5, within[view.down] + 0.5]);
      const { clientWidth: width, clientHeight: height } = view.canvas;
      const out = (p, size) => (p < 0 ? -p : p > size ? size - p : 0);
      if (out(x, width) || out(y, height)) view.pan(out(x, width), out(y, height));
    }
    update();
  },
  step(axis, count) {
    const position = [...state.position];
    position[axis] += count;
    actions.moveTo(position);
  },
  zoom(view, factor, x = view.canvas.clientWidth / 2, y = view.canvas.clientHeight / 2) {
    state.isFitted = false;
    const { dims } = state.volume;
    const least = view.fittingZoom() / 8;
    const most = 100 / Math.min(...state.steps);
    view.zoomAround(x, y, () => {
      state.zoom = Math.min(Math.max(state.zoom * factor, Math.min(least, most)), most);
    });
    // The others look at the cross hair.
    for (const other of sliceViews) {
      if (other === view) continue;
      other.center = [other.across, other.down].map((axis) => Math.min(state.position[axis] + 0.5, dims[axis]));
      other.changed();
    }
    update();
  },
  pan(view, dx, dy) {
    state.isFitted = false;
    view.pan(dx, dy);
    update();
  },
  window(low, high) {
    if (!Number.isFinite(low) || !Number.isFinite(high)) return;
    state.isWindowChosen = true;
    setWindow(low, high);
  },
  /** The level by a share of the width, and the width by a factor. */
  changeWindow(levelShare, widthFactor) {
    const { low, high } = state.shades;
    const width = high - low;
    const level = (low + high) / 2 + levelShare * width;
    actions.window(level - (width * widthFactor) / 2, level + (width * widthFactor) / 2);
  },
  autoWindow() {
    state.isWindowChosen = false;
    chooseWindow();
    update();
  },
  fit() {
    state.isFitted = true;
    for (const view of sliceViews) view.changed();
    update();
  },
  grid() {
    state.showsGrid = !state.showsGrid;
    element("grid").setAttribute("aria-pressed", String(state.showsGrid));
    update();
  },
  tool(name) {
    state.tool = name;
    for (const button of document.querySelectorAll("[data-tool]"))
      button.setAttribute("aria-pressed", String(button.dataset.tool === name));
  },
  one(name) {
    showTab(shownTab === name ? "all" : name);
  },
  point(view, x, y) {
    pointed = view && { view, x, y };
    showReadout();
  },
};

function setWindow(low, high) {
  state.shades.set(low, high);
  const put = (id, number) => {
    if (document.activeElement !== element(id)) element(id).value = numberText(number, 5);
  };
  put("window-level", (low + high) / 2);
  put("window-width", high - low);
  spaceView.windowChanged();
  draw();
}

/** From the slices of the coarsest overview that are there. */
function chooseWindow() {
  if (state.isWindowChosen) return;
  const level = state.volume.levels.length - 1;
  const { factor } = state.volume.levels[level];
  const arrays = sliceViews.flatMap(({ normal }) =>
    state.tiles.ofSlice(level, normal, Math.floor(state.position[normal] / factor)),
  );
  const ends = percentiles(arrays, 0.005);
  if (!ends) return;
  const values = ends.map((sample) => state.scale.slope * sample + state.scale.intercept).sort((a, b) => a - b);
  if (values[0] === values[1]) values[1] += 1;
  setWindow(...values);
}

// ---- Readout -------------------------------------------------------------------------------------------------------

let pointed;
function showReadout() {
  const { volume, tiles, scale, unit } = state;
  if (!volume) return;
  const place = [...state.position];
  if (pointed) {
    const { view } = pointed;
    const [across, down] = view.placeAt(pointed.x, pointed.y).map(Math.floor);
    [place[view.across], place[view.down]] = [across, down];
  }
  if (place.some((p, axis) => p < 0 || p >= volume.dims[axis]))
    return fillList(element("readout"), [["sample", "outside"]]);
  const rows = [["sample", place.join(", ")]];
  const { geometry } = volume;
  if (geometry.spacing) {
    const { origin, directions, spacing } = geometry;
    const world = [0, 1, 2].map((a) => {
      const steps = directions ? directions.map((d) => d[a]) : spacing.map((s, axis) => (axis === a ? s : 0));
      return (origin?.[a] ?? 0) + place.reduce((sum, p, axis) => sum + p * steps[axis], 0);
    });
    rows.push([`position (${unit})`, world.map((w) => numberText(w, 5)).join(", ")]);
  }
  const found = sampleAt(place, pointed?.view ?? sliceViews[0]);
  if (found) {
    const value = scale.slope * found.sample + scale.intercept;
    rows.push(["value", `${numberText(value)} ${scale.unit}`]);
    if (scale.slope !== 1 || scale.intercept !== 0) rows.push(["stored sample", numberText(found.sample)]);
    if (found.factor > 1) rows.push(["", `mean in overview 1:${found.factor}`]);
  } else rows.push(["value", "…"]);
  fillList(element("readout"), rows);

  function sampleAt(at, { normal, across, down }) {
    for (const { level, factor } of volume.levels) {
      const [i, j, slice] = [at[across], at[down], at[normal]].map((p) => Math.floor(p / factor));
      const [column, row] = [tiles.number(i), tiles.number(j)];
      const samples = tiles.get(level, normal, slice, column, row);
      if (!samples) continue;
      const [x0, x1] = tiles.range(level, across, column);
      return { sample: samples[(j - tiles.range(level, down, row)[0]) * (x1 - x0) + i - x0], factor };
    }
    return undefined;
  }
}

// ---- Files ---------------------------------------------------------------------------------------------------------

let opening;
let shownVolume; // its number, as the list of volumes has it
async function openFile(source, name, options = {}) {
  opening?.abort();
  const controller = new AbortController();
  opening = controller;
  times.start = performance.now();
  for (const key of ["open", "first", "all", "complete"]) delete times[key];
  element("failure").textContent = "";
  say(`Opening ${name} …`);
  try {
    const opened = await open(source, { ...options, base: new URL("decoder/", import.meta.url), signal: controller.signal });
    if (controller.signal.aborted) return opened.close();
    file?.close();
    file = opened;
    times.open = performance.now();
    element("welcome").hidden = true;
    element("name").textContent = name;
    element("name").title = name;
    document.title = `${name} – tagrid viewer`;
    element("volume-choice").hidden = file.volumes === 1;
    element("volume").replaceChildren(
      ...Array.from({ length: file.volumes }, (_, i) => new Option(String(i), String(i))),
    );
    shownVolume = "0";
    show(file);
  } catch (error) {
    if (controller.signal.aborted) return;
    const text = `${name}: ${error.message}`;
    element("failure").textContent = text;
    say(text, true);
  }
}

/** Servers and networks that fail may answer again. */
function retryLater(volume) {
  clearTimeout(retryTimer);
  retryTimer = setTimeout(() => {
    if (state.volume !== volume) return;
    failure = undefined;
    state.tiles.retry();
    update();
  }, retryAfter);
}

function show(volume) {
  state.tiles?.close();
  failure = undefined;
  state.volume = volume;
  state.tiles = new Tiles(
    volume,
    () => {
      chooseWindow();
      update();
    },
    (error) => {
      failure = error.message;
      if (error.code === "io-error") retryLater(volume);
    },
  );
  state.scale = scaleOf(volume);
  state.unit = unitOf(volume);
  state.steps = (volume.geometry.spacing ?? [1, 1, 1]).map((s) => Math.abs(s) || 1);
  state.shades = new Shades(state.scale);
  state.position = volume.dims.map((n) => Math.floor(n / 2));
  state.isFitted = true;
  state.isWindowChosen = false;
  if (volume.range) {
    const ends = [volume.range.low, volume.range.high].map((s) => state.scale.slope * s + state.scale.intercept);
    setWindow(Math.min(...ends), Math.max(...ends));
  }
  for (const view of sliceViews) view.reset();
  fillList(element("bounds"), boundRows(volume, state.scale));
  fillList(element("facts"), factRows(volume, state.scale, state.unit));
  element("metadata").textContent = volume.metadata;
  spaceView.reset();
  update();
}

element("volume").addEventListener("change", async ({ target }) => {
  const [of, chosen] = [file, target.value];
  // Another one may have been chosen since, or another file.
  const isStillChosen = () => file === of && target.value === chosen;
  try {
    const volume = await of.volume(Number(chosen));
    if (!isStillChosen()) return;
    shownVolume = chosen;
    show(volume);
  } catch (error) {
    if (!isStillChosen()) return;
    target.value = shownVolume;
    failure = error.message;
    draw();
  }
});
element("file").addEventListener("change", ({ target }) => {
  if (target.files[0]) openFile(target.files[0], target.files[0].name);
});
element("address").addEventListener("submit", (event) => {
  event.preventDefault();
  openAddress(new FormData(event.target).get("src"));
});
addEventListener("dragover", (event) => {
  event.preventDefault();
  document.body.classList.add("dropping");
});
addEventListener("dragleave", () => document.body.classList.remove("dropping"));
addEventListener("drop", (event) => {
  event.preventDefault();
  document.body.classList.remove("dropping");
  const dropped = event.dataTransfer.files[0];
  if (dropped) openFile(dropped, dropped.name);
});

function openAddress(text) {
  let url;
  try {
    url = new URL(text, location.href);
  } catch {
    element("failure").textContent = `${text} is not an address`;
    return;
  }
  // Other schemes of addresses may run code, or read what only this page may.
  if (!/^https?:$/.test(url.protocol)) {
    element("failure").textContent = "an address begins with http:// or https://";
    return;
  }
  openFile(url, nameIn(url));
}

/** The name of the file at an address. Names that are no UTF-8 stay encoded. */
function nameIn({ pathname, host }) {
  const name = pathname.split("/").at(-1);
  try {
    return decodeURIComponent(name) || host;
  } catch {
    return name;
  }
}

// ---- Controls ------------------------------------------------------------------------------------------------------

let shownTab;
const isNarrow = matchMedia("(max-width: 720px)");
function showTab(name) {
  shownTab = name;
  element("views").classList.toggle("single", name !== "all");
  for (const [view, section] of Object.entries(sections)) section.hidden = name !== "all" && name !== view;
  for (const button of document.querySelectorAll("[data-tab]"))
    button.setAttribute("aria-pressed", String(button.dataset.tab === name));
  for (const view of sliceViews) view.changed();
  update();
}
for (const button of document.querySelectorAll("[data-tab]"))
  button.addEventListener("click", () => showTab(button.dataset.tab));
for (const button of document.querySelectorAll("[data-tool]"))
  button.addEventListener("click", () => actions.tool(button.dataset.tool));
const activeView = () =>
  sliceViews.find((view) => view.canvas === document.activeElement) ??
  sliceViews.find((view) => view.isShown) ??
  sliceViews[0];
element("auto").addEventListener("click", () => state.volume && actions.autoWindow());
element("grid").addEventListener("click", () => state.volume && actions.grid());
element("fit").addEventListener("click", () => state.volume && actions.fit());
element("zoom-in").addEventListener("click", () => state.volume && actions.zoom(activeView(), 1.5));
element("zoom-out").addEventListener("click", () => state.volume && actions.zoom(activeView(), 1 / 1.5));
for (const id of ["window-level", "window-width"])
  element(id).addEventListener("input", () => {
    const [level, width] = [element("window-level").valueAsNumber, element("window-width").valueAsNumber];
    if (state.volume && width > 0) actions.window(level - width / 2, level + width / 2);
  });
for (const view of sliceViews) handlePointers(view, state, actions);
handleKeys(state, actions, activeView);
new ResizeObserver(() => {
  for (const view of sliceViews) view.changed();
  update();
}).observe(element("views"));

globalThis.tagridViewer = { state, sliceViews, spaceView, actions, times };
showTab(isNarrow.matches ? "axial" : "all");
const source = new URLSearchParams(location.search).get("src");
if (source) {
  element("welcome").hidden = false;
  openAddress(source);
}
