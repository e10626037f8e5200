// The oblique plane of the viewer, in headless Chromium. What it shows is compared with formulas: places follow from the
// spacing and the angles, and samples are linear along each axis, so that interpolation does not change them.
import assert from "node:assert/strict";
import { test } from "node:test";
import { browser, open, picture, readout, write } from "./viewer_pages.mjs";

const set = (page, id, value) =>
  page.evaluate(`{ const field = document.getElementById("${id}"); field.value = ${JSON.stringify(value)};
    field.dispatchEvent(new Event("input")); field.dispatchEvent(new Event("change")); }`);
const isDone = "tagridViewer.planeView.isSettled && tagridViewer.sliceViews.every((view) => !view.isShown || view.isSettled)";
const pause = (page) => page.evaluate("new Promise((done) => setTimeout(done, 700))");
const listed = (page) =>
  page.evaluate(`[...document.querySelectorAll("#measures li button:first-child")].map((e) => e.textContent)`);

const dims = [100, 90, 60];
const steps = [0.5, 0.8, 1.25];
const lps = ["space: left-posterior-superior", `space directions: (${steps[0]},0,0) (0,${steps[1]},0) (0,0,${steps[2]})`,
  "space origin: (-10,20,30)", 'space units: "mm" "mm" "mm"'];
// Of places, in which sample i is at i.
const sampleOf = (x, y, z) => 40 * x + 3 * x * y - 2 * y * z + 11 * z;

const radians = (degrees) => (degrees * Math.PI) / 180;
const times = (m, v) => m.map((row) => row.reduce((sum, n, i) => sum + n * v[i], 0));
/** The vectors of an axial plane, whose picture has left on the right and the back below: to the right, down, across. */
function frame({ tilt, turn = 0, spin = 0 }) {
  const [a, b, c] = [-tilt, turn, spin].map(radians);
  const aboutX = [[1, 0, 0], [0, Math.cos(a), -Math.sin(a)], [0, Math.sin(a), Math.cos(a)]];
  const aboutY = [[Math.cos(b), 0, Math.sin(b)], [0, 1, 0], [-Math.sin(b), 0, Math.cos(b)]];
  const aboutZ = [[Math.cos(c), -Math.sin(c), 0], [Math.sin(c), Math.cos(c), 0], [0, 0, 1]];
  return [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((v) => times(aboutY, times(aboutX, times(aboutZ, v))));
}
const sum = (...vectors) => [0, 1, 2].map((i) => vectors.reduce((total, v) => total + v[i], 0));
const scaled = (v, factor) => v.map((n) => n * factor);
const dot = (a, b) => a.reduce((total, n, i) => total + n * b[i], 0);
/** Millimeters from the corner of the volume: sample i reaches from i to i + 1. */
const inMillimeters = (place) => place.map((n, axis) => n * steps[axis]);

/** Points of the canvas from vectors in the plane, from its foot of the middle of the volume. */
async function geometryOf(page, angles, through) {
  const [right, down, normal] = frame(angles);
  const { zoom, width, height, left, top } = await page.evaluate(`(() => { const { canvas } = tagridViewer.planeView, box = canvas.getBoundingClientRect();
    return { zoom: tagridViewer.state.zoom, width: box.width, height: box.height, left: box.left, top: box.top }; })()`);
  const center = inMillimeters(dims.map((n) => n / 2));
  const off = dot(normal, sum(center, scaled(inMillimeters(through), -1)));
  const middle = sum(center, scaled(normal, -off));
  return {
    /** Millimeters at a point of the canvas. */
    at: (x, y) => sum(middle, scaled(right, (x - width / 2) / zoom), scaled(down, (y - height / 2) / zoom)),
    /** The point of the canvas with a place in millimeters. */
    pointOf: (place) => [right, down].map((v, i) => dot(v, sum(place, scaled(middle, -1))) * zoom + [width, height][i] / 2),
    onPage: ([x, y]) => [left + x, top + y],
    zoom, width, height,
  };
}
const pixelAt = (page, x, y) =>
  page.evaluate(`(() => { tagridViewer.planeView.draw();
    return [...tagridViewer.planeView.canvas.getContext("2d").getImageData(${x}, ${y}, 1, 1).data]; })()`);

test("pixels and the readout are the values at places that follow from the angles and the spacing", async () => {
  const page = await open(write("oblique", dims, Int32Array, sampleOf, [...lps, "rescale_units:=HU"]));
  await page.evaluate("tagridViewer.actions.window(-2000, 20000); tagridViewer.actions.moveTo([52, 40, 33])");
  const through = [52.5, 40.5, 33.5];
  await page.evaluate("tagridViewer.sliceViews[0].canvas.focus()");
  await page.key("o");
  let checked = 0;
  for (const angles of [{ tilt: 0 }, { tilt: 35 }, { tilt: -20, turn: 15 }, { tilt: 50, turn: -40, spin: 25 }]) {
    for (const name of ["tilt", "turn", "spin"]) await set(page, `plane-${name}`, String(angles[name] ?? 0));
    await pause(page);
    await page.until(isDone);
    const { at, onPage, width, height } = await geometryOf(page, angles, through);
    for (const [i, j] of [[0.3, 0.3], [0.45, 0.35], [0.6, 0.42], [0.35, 0.62], [0.55, 0.7], [0.68, 0.62]]) {
      const [x, y] = [Math.floor(i * width), Math.floor(j * height)];
      // Of the middle of the pixel, counted in samples.
      const place = at(x + 0.5, y + 0.5).map((n, axis) => n / steps[axis] - 0.5);
      if (place.some((n, axis) => n < 0 || n > dims[axis] - 1)) continue;
      const grey = Math.round(((sampleOf(...place) + 2000) * 255) / 22000);
      const pixel = await pixelAt(page, x, y);
      assert.ok(Math.abs(pixel[0] - grey) <= 1 && pixel[0] === pixel[1], `${JSON.stringify(angles)} ${place}: ${pixel} ${grey}`);
      ++checked;
    }
    // A pointer is at the corner of a pixel.
    const [x, y] = [Math.floor(0.42 * width), Math.floor(0.57 * height)];
    const place = at(x, y).map((n, axis) => n / steps[axis] - 0.5);
    await page.move(...onPage([x, y]));
    const shown = await readout(page);
    const numbers = (text) => text.split(", ").map(Number);
    for (const [axis, n] of numbers(shown["place (samples)"]).entries()) assert.ok(Math.abs(n - place[axis]) < 0.02, `${shown["place (samples)"]} ${place}`);
    for (const [axis, n] of numbers(shown["position (mm)"]).entries())
      assert.ok(Math.abs(n - (place[axis] * steps[axis] + [-10, 20, 30][axis])) < 0.02, shown["position (mm)"]);
    const value = Number(shown.value.replace(/ HU$/, ""));
    assert.ok(Math.abs(value - sampleOf(...place)) < 5 + 1e-3 * Math.abs(value), `${shown.value} ${sampleOf(...place)}`);
    const nearest = numbers(shown["nearest sample"]);
    assert.deepEqual(nearest, place.map(Math.round));
    assert.equal(shown["its value"], `${sampleOf(...nearest)} HU`);
  }
  assert.ok(checked > 15, `${checked}`);
  await picture(page, "oblique");
  // Straight, and at the middle of samples, it is the slice.
  await page.evaluate(`document.getElementById("plane-reset").click()`);
  await pause(page);
  await page.until(isDone);
  const { pointOf, onPage } = await geometryOf(page, { tilt: 0 }, through);
  await page.move(...onPage(pointOf(inMillimeters([20.5, 30.5, 33.5]))));
  const shown = await readout(page);
  assert.deepEqual([shown["nearest sample"], shown["its value"]], ["20, 30, 33", `${sampleOf(20, 30, 33)} HU`]);
  // Outside of the volume there is nothing.
  assert.deepEqual((await pixelAt(page, 3, Math.floor((await geometryOf(page, { tilt: 0 }, through)).height / 2) - 60)).slice(0, 3), [0, 0, 0]);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("overviews are shown where the picture is small, means say so, and what is no number is violet", async () => {
  const linear = (x, y, z) => (x === 70 ? NaN : 10 * x + 20 * y - 30 * z);
  const page = await open(write("plane-levels", dims, Float32Array, linear, lps, "--overviews", "4"), 420, 300);
  await page.evaluate("tagridViewer.actions.window(-1000, 3000); tagridViewer.actions.one('plane'); tagridViewer.actions.moveTo([50, 45, 30])");
  await set(page, "plane-tilt", "20");
  await pause(page);
  await page.until(isDone);
  const at = [50.5, 45.5, 30.5];
  // Between the samples before and after those that are none, and beyond them.
  for (const [x, isNumber] of [[60, true], [70.5, false], [71.2, false], [80, true]]) {
    const { pointOf } = await geometryOf(page, { tilt: 20 }, at);
    const [px, py] = pointOf(sum(inMillimeters([x, 45.5, 30.5]), scaled(frame({ tilt: 20 })[1], 4))).map(Math.floor);
    const [red, green, blue] = await pixelAt(page, px, py);
    assert.equal(red === green && green === blue, isNumber, `${x}: ${[red, green, blue]}`);
    if (!isNumber) assert.deepEqual([red, green, blue], [110, 0, 140]);
  }
  await page.evaluate("tagridViewer.actions.zoom(tagridViewer.planeView, 0.05)");
  await pause(page);
  await page.until(isDone);
  assert.ok((await page.evaluate("tagridViewer.planeView.shown")) > 0);
  const place = sum(inMillimeters([30.5, 45.5, 30.5]), scaled(frame({ tilt: 20 })[1], 6));
  const [x, y, zoom] = await page.evaluate(`[...tagridViewer.planeView.pointIn(${JSON.stringify(place.map((n, axis) => n / steps[axis]))}), tagridViewer.state.zoom]`);
  // In the middle of a pixel, which is some millimeters wide.
  const [px, py] = [x, y].map(Math.floor);
  const [toRight, toLow] = frame({ tilt: 20 });
  const seen = sum(place, scaled(toRight, (px + 0.5 - x) / zoom), scaled(toLow, (py + 0.5 - y) / zoom));
  const expected = linear(...seen.map((n, axis) => n / steps[axis] - 0.5));
  const [grey] = await pixelAt(page, px, py);
  const value = (grey * 4000) / 255 - 1000;
  assert.ok(Math.abs(value - expected) < 25, `${value} ${expected}`);
  await page.evaluate(`tagridViewer.actions.point(undefined)`);
  await picture(page, "oblique-overview");
  assert.deepEqual(page.errors, []);
  await page.close();
});

// Two balls of a phantom, in a plane that lies across all axes.
const angles = { tilt: 32, turn: -24, spin: 10 };
const through = [50.5, 45.5, 30.5];
const [right, down] = frame(angles);
const middle = inMillimeters(through);
const balls = [sum(middle, scaled(right, -13), scaled(down, -9)), sum(middle, scaled(right, 11), scaled(down, 16))];
const radius = 4;
const inBall = (x, y, z) => {
  const place = inMillimeters([x + 0.5, y + 0.5, z + 0.5]);
  const distance = Math.min(...balls.map((ball) => Math.hypot(...sum(place, scaled(ball, -1)))));
  // With a soft edge, so that its size does not depend on the steps.
  return Math.round(1000 * Math.max(0, Math.min(1, radius - distance + 0.5)));
};

/** The middles and sizes of the balls in the picture, in pixels, the left one first. */
const found = (page) =>
  page.evaluate(`(() => { const view = tagridViewer.planeView;
    view.draw();
    const { width, height } = view.canvas;
    const { data } = view.canvas.getContext("2d").getImageData(0, 0, width, height);
    const spots = [[0, 0, 0], [0, 0, 0]];
    const [cx] = view.pointIn(view.cross);
    for (let y = 60; y < height - 70; ++y) for (let x = 60; x < width - 60; ++x) {
      const [r, g, b] = data.subarray(4 * (y * width + x));
      if (r < 128 || r !== g || r !== b) continue;
      const spot = spots[x < cx ? 0 : 1];
      spot[0] += x + 0.5; spot[1] += y + 0.5; ++spot[2];
    }
    return spots.map(([x, y, count]) => ({ x: x / count, y: y / count, count })); })()`);

test("the picture is true to scale, and a ruler in it has the length between two balls of a phantom", async () => {
  const page = await open(write("balls", dims, Int16Array, inBall, lps));
  await page.evaluate("tagridViewer.actions.window(0, 1000); tagridViewer.actions.moveTo([50, 45, 30])");
  for (const [name, angle] of Object.entries(angles)) await set(page, `plane-${name}`, String(angle));
  await page.evaluate("tagridViewer.actions.one('plane'); tagridViewer.actions.moveTo([50, 45, 30])");
  await pause(page);
  await page.until(isDone);
  const { pointOf, onPage, zoom } = await geometryOf(page, angles, through);
  const spots = await found(page);
  for (const [i, { x, y, count }] of spots.entries()) {
    const [expectedX, expectedY] = pointOf(balls[i]);
    assert.ok(Math.hypot(x - expectedX, y - expectedY) < 2, `${i}: ${x},${y} and ${expectedX},${expectedY}`);
    // A circle of 4 mm.
    const area = Math.PI * (radius * zoom) ** 2;
    assert.ok(Math.abs(count / area - 1) < 0.06, `${count} of ${area}`);
  }
  const length = Math.hypot(...sum(balls[0], scaled(balls[1], -1)));
  await page.key("4");
  await page.drag(onPage([spots[0].x, spots[0].y]), onPage([spots[1].x, spots[1].y]));
  const [text] = await listed(page);
  assert.match(text, /^1: ruler [\d.]+ mm \(oblique\)$/);
  assert.ok(Math.abs(Number(/ruler ([\d.]+)/.exec(text)[1]) - length) < 0.2, `${text}: ${length}`);
  // A right angle of the phantom: from the middle along the two vectors of the plane.
  await page.key("5");
  const corner = sum(middle, scaled(right, -10), scaled(down, 12));
  await page.drag(onPage(pointOf(sum(corner, scaled(down, -10)))), onPage(pointOf(corner)));
  await page.drag(onPage(pointOf(sum(corner, scaled(right, 5)))), onPage(pointOf(sum(corner, scaled(right, 12)))));
  const angle = Number(/angle ([\d.]+)/.exec((await listed(page))[1])[1]);
  assert.ok(Math.abs(angle - 90) < 1, `${angle}`);
  // Regions have samples of slices only.
  await page.key("6");
  await page.drag(onPage(pointOf(sum(middle, scaled(right, -5)))), onPage(pointOf(sum(middle, scaled(right, 5), scaled(down, 5)))));
  assert.equal((await listed(page)).length, 2);
  await page.key("1");
  await pause(page);
  await picture(page, "oblique-ruler");
  // In another plane it is not drawn; the list shows its plane.
  await page.key("t");
  assert.equal(await page.evaluate("tagridViewer.state.plane.tilt"), 34);
  assert.equal(await page.evaluate("tagridViewer.planeView.holds(tagridViewer.state.measures[0])"), false);
  await page.evaluate(`document.querySelector("#measures button").click()`);
  assert.equal(await page.evaluate("tagridViewer.state.plane.tilt"), 32);
  assert.equal(await page.evaluate("tagridViewer.planeView.holds(tagridViewer.state.measures[0])"), true);
  // Arrows move it in its plane.
  const before = await page.evaluate("tagridViewer.state.measures[0].points");
  await page.evaluate(`document.querySelector("#measures button").focus()`);
  await page.key("ArrowRight");
  const after = await page.evaluate("tagridViewer.state.measures[0].points");
  const moved = inMillimeters(after[0].map((n, axis) => n - before[0][axis]));
  for (const axis of [0, 1, 2]) assert.ok(Math.abs(moved[axis] - 0.5 * right[axis]) < 1e-6, `${moved}`);
  // A link shows the same plane and the same measurements.
  await page.evaluate("document.activeElement.blur()");
  await pause(page);
  await page.until(isDone);
  const again = await browser.newPage(1280, 860);
  await again.goTo(await page.evaluate("location.href"));
  await again.until(`tagridViewer.times.complete && ${isDone}`);
  await pause(again);
  await again.until(isDone);
  assert.deepEqual(await listed(again), await listed(page));
  assert.equal(await again.evaluate("location.href"), await page.evaluate("location.href"));
  const [here, there] = [await found(page), await found(again)];
  for (const i of [0, 1]) for (const key of ["x", "y"]) assert.ok(Math.abs(here[i][key] - there[i][key]) < 0.5);
  for (const one of [page, again]) {
    assert.deepEqual(one.errors, []);
    await one.close();
  }
});

test("its line in a slice turns it by drags; keys move in it; screen readers are told", async () => {
  const page = await open(write("turned", dims, Int16Array, (x, y, z) => x + y + z, lps));
  await page.evaluate("tagridViewer.actions.moveTo([50, 45, 30]); tagridViewer.sliceViews[0].canvas.focus()");
  await page.key("o");
  await set(page, "plane-tilt", "0");
  await pause(page);
  // In the sagittal view, left is the front and the head is above: a tilt lets the line fall to the back.
  const blueAt = (view, x, y) =>
    page.evaluate(`(() => { const view = tagridViewer.sliceViews[${view}];
      view.draw();
      const { data } = view.canvas.getContext("2d").getImageData(${Math.round(x)} - 2, ${Math.round(y)} - 2, 5, 5);
      let isBlue = false;
      for (let i = 0; i < data.length; i += 4) isBlue ||= data[i + 2] > 180 && data[i] < 160 && data[i + 1] > 140;
      return isBlue; })()`);
  const sagittal = await page.evaluate(`(() => { const view = tagridViewer.sliceViews[2], box = view.canvas.getBoundingClientRect();
    return { middle: view.pointIn(tagridViewer.state.plane.through), left: box.left, top: box.top }; })()`);
  const [mx, my] = sagittal.middle;
  const onPage = ([x, y]) => [sagittal.left + x, sagittal.top + y];
  const ray = (degrees, length) => [mx + length * Math.cos(radians(degrees)), my + length * Math.sin(radians(degrees))];
  assert.ok(await blueAt(2, ...ray(0, 60)));
  assert.ok(!(await blueAt(2, ...ray(25, 60))));
  // The handle is 110 pixels from the middle, or at the end of the line.
  await page.drag(onPage(ray(0, 105)), onPage(ray(25, 105)));
  const tilt = await page.evaluate("tagridViewer.state.plane.tilt");
  assert.ok(Math.abs(tilt - 25) < 0.7, `${tilt}`);
  assert.ok(await blueAt(2, ...ray(tilt, 60)));
  assert.ok(!(await blueAt(2, ...ray(0, 60))));
  // The cross hair has stayed, as has the plane through it.
  assert.deepEqual(await page.evaluate("tagridViewer.state.position"), [50, 45, 30]);
  await picture(page, "oblique-line");
  // Elsewhere, a drag moves the cross hair, and the plane with it.
  await page.drag(onPage([mx + 8, my - 30]), onPage([mx + 8, my - 40]));
  assert.notDeepEqual(await page.evaluate("tagridViewer.state.position"), [50, 45, 30]);
  assert.equal(await page.evaluate("tagridViewer.state.plane.tilt"), tilt);
  // Keys: along the plane and across it by the finest step, 0.5 mm.
  await page.evaluate("tagridViewer.actions.moveTo([50, 45, 30]); tagridViewer.planeView.canvas.focus()");
  await page.evaluate(`globalThis.told = []; new MutationObserver(() => told.push(document.getElementById("announcement").textContent))
    .observe(document.getElementById("announcement"), { childList: true, characterData: true, subtree: true })`);
  const [, downward, normal] = frame({ tilt });
  for (const [key, vector] of [["ArrowDown", downward], ["PageUp", normal]]) {
    const from = await page.evaluate("tagridViewer.state.plane.through");
    await page.key(key);
    const to = await page.evaluate("tagridViewer.state.plane.through");
    const change = inMillimeters(to.map((n, axis) => n - from[axis]));
    for (const axis of [0, 1, 2]) assert.ok(Math.abs(change[axis] - 0.5 * vector[axis]) < 1e-6, `${key}: ${change}`);
  }
  await page.until("told.length > 0");
  const at = (await page.evaluate("tagridViewer.state.plane.through")).map((n) => n - 0.5);
  const told = await page.evaluate("told.at(-1)");
  assert.match(told, /^oblique: axial, tilted [\d.]+°: value [\d.]+;/);
  assert.ok(Math.abs(Number(/value ([\d.]+)/.exec(told)[1]) - at[0] - at[1] - at[2]) < 1e-3, told);
  await page.key("R");
  await page.until(`told.at(-1).includes("turned")`);
  // In its own picture, the tool turns it as well.
  await page.key("8");
  const box = await page.evaluate(`(() => { const b = tagridViewer.planeView.canvas.getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; })()`);
  const before = await page.evaluate("tagridViewer.state.plane");
  await page.drag(box, [box[0] + 50, box[1]]);
  const turned = await page.evaluate("tagridViewer.state.plane");
  assert.notDeepEqual([turned.tilt, turned.turn, turned.spin], [before.tilt, before.turn, before.spin]);
  // Three names of slices are planes: a coronal one begins as a coronal slice.
  await set(page, "plane-base", "coronal");
  await pause(page);
  await page.until(isDone);
  const letters = await page.evaluate("tagridViewer.planeView.sides");
  assert.deepEqual(letters, { left: "R", right: "L", top: "H", bottom: "F" });
  // All controls have names.
  assert.deepEqual(await page.evaluate(`[...document.querySelectorAll("button, input, select")].filter((e) =>
    !(e.getAttribute("aria-label") || e.textContent.trim() || e.labels?.[0]?.textContent.trim() || e.ariaLabel)).map((e) => e.id || e.outerHTML)`), []);
  await page.key("o");
  assert.equal(await page.evaluate("document.querySelector('[data-view=plane]').hidden"), true);
  assert.deepEqual(page.errors, []);
  await page.close();
});
