// Colors, opacity and the crop box of the picture in 3D, in headless Chromium. Pixels are compared with the colors of values
// that the test computes.
import assert from "node:assert/strict";
import { test } from "node:test";
import { browser, open, picture, write } from "./viewer_pages.mjs";
import { colorIn, mapNames } from "../../web/viewer/src/color_maps.js";

const set = (page, id, value) =>
  page.evaluate(`{ const field = document.getElementById("${id}"); field.value = ${JSON.stringify(String(value))};
    field.dispatchEvent(new Event("input")); field.dispatchEvent(new Event("change")); }`);
const kind = (page, name) =>
  page.evaluate(`{ const field = document.querySelector("[data-view=space] select"); field.value = "${name}"; field.dispatchEvent(new Event("change")); }`);
const fieldOf = (page, label, value) =>
  page.evaluate(`{ const field = document.querySelector("[aria-label='${label}']"); field.value = ${value}; field.dispatchEvent(new Event("input")); }`);
const frames = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))";
const pause = (page) => page.evaluate("new Promise((done) => setTimeout(done, 700))");
/** Pixels of the picture at points from -1 to 1: to the right and up. */
const pixelsAt = (page, points) =>
  page.evaluate(`${frames}.then(() => {
    const { canvas } = tagridViewer.spaceView, copy = document.createElement("canvas");
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0);
    return ${JSON.stringify(points)}.map(([x, y]) => [...context.getImageData(Math.floor(((x + 1) / 2) * copy.width), Math.floor(((1 - y) / 2) * copy.height), 1, 1).data.slice(0, 3)]);
  })`);
const opened = async (file) => {
  const page = await open(file, 840, 520);
  await page.evaluate("tagridViewer.actions.one('space')");
  await page.until("tagridViewer.spaceView.texture");
  return page;
};
const near = (pixel, expected, far, what) =>
  assert.ok(pixel.every((n, i) => Math.abs(n - expected[i]) <= far), `${what}: ${pixel} and ${expected.map(Math.round)}`);

test("maps become lighter in steps that are about equal", () => {
  const lightness = (color) => {
    const [r, g, b] = color.map((n) => (n / 255 <= 0.04045 ? n / 255 / 12.92 : ((n / 255 + 0.055) / 1.055) ** 2.4));
    const y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    return y > 0.008856 ? 116 * Math.cbrt(y) - 16 : 903.3 * y;
  };
  assert.deepEqual(mapNames, ["grey", "viridis", "cividis", "inferno"]);
  for (const name of mapNames) {
    const steps = Array.from({ length: 10 }, (_, i) => lightness(colorIn(name, (i + 1) / 10)) - lightness(colorIn(name, i / 10)));
    const mean = steps.reduce((sum, n) => sum + n, 0) / steps.length;
    // Grey is that of the screen; the first step of inferno is from black.
    for (const [i, step] of steps.entries()) assert.ok(step > (i === 0 ? 0.5 : 0.75) * mean && step < 1.3 * mean, `${name}: ${steps}`);
    assert.ok(mean > 7);
  }
});

const dims = [48, 40, 32];
const space = ["space: LPS", "space directions: (1,0,0) (0,1,0) (0,0,1.5)"];

test("a fog has the colors of the map, and hides more with more opacity; a surface lets through what its opacity leaves", async () => {
  // A block of one value in air.
  const isIn = (x, y, z) => x > 8 && x < 40 && y > 8 && y < 32 && z > 6 && z < 26;
  const page = await opened(write("fog", dims, Int16Array, (...p) => (isIn(...p) ? 700 : 0), space));
  await page.evaluate("tagridViewer.actions.window(0, 1000)");
  await kind(page, "fog");
  await set(page, "space-opacity", 100);
  for (const name of mapNames) {
    await set(page, "space-map", name);
    const [pixel] = await pixelsAt(page, [[0, 0]]);
    // The edge of the block, where values lie between, comes first, and takes a little.
    near(pixel, colorIn(name, 0.7), 30, name);
  }
  await picture(page, "fog");
  const brightness = [];
  for (const opacity of [0, 25, 50]) {
    await set(page, "space-opacity", opacity);
    brightness.push((await pixelsAt(page, [[0, 0]]))[0].reduce((sum, n) => sum + n, 0));
  }
  assert.ok(brightness[0] < 60 && brightness.every((n, i) => i === 0 || n > brightness[i - 1]), `${brightness}`);
  // A surface: its color is that of its value; half of it is there with half of the opacity.
  await kind(page, "surface");
  assert.equal(await page.evaluate(`document.getElementById("space-opacity").value`), "100");
  await fieldOf(page, "Value of the surface", 350);
  const [whole] = await pixelsAt(page, [[0, 0]]);
  await set(page, "space-opacity", 50);
  const [half] = await pixelsAt(page, [[0, 0]]);
  near(half, whole.map((n) => n / 2), 3, "half");
  const ratio = (a) => a[2] / a[0];
  const tint = colorIn("inferno", 0.35);
  assert.ok(whole[0] > whole[2] === tint[0] > tint[2], `${whole} ${ratio(tint)}`);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("the crop box leaves the samples between six numbers, and cut faces have the colors of their values", async () => {
  const sampleOf = (x, y, z) => 100 + 3 * x + 8 * y + 5 * z;
  const page = await opened(write("crop", dims, Int16Array, sampleOf, space));
  await page.evaluate("tagridViewer.actions.window(0, 800)");
  // From the left: the back is on the right, the head above.
  await page.evaluate("tagridViewer.state.space.turn = { around: Math.PI / 2, up: 0 }; tagridViewer.spaceView.draw()");
  await fieldOf(page, "Value of the surface", 50);
  await set(page, "space-map", "viridis");
  await fieldOf(page, "Last sample along x", 23);
  await fieldOf(page, "First sample along y, slider", 10);
  await fieldOf(page, "Last sample along z", 23);
  assert.deepEqual(await page.evaluate("tagridViewer.state.space.crop"), { low: [0, 10, 0], high: [24, 40, 24] });
  const lengths = [48, 40, 48];
  const { width, height, zoom } = await page.evaluate("({ width: tagridViewer.spaceView.canvas.width, height: tagridViewer.spaceView.canvas.height, zoom: tagridViewer.state.space.zoom })");
  const most = Math.hypot(...lengths);
  const span = 0.5 / zoom;
  const pointOf = (y, z) => [(y - 20) / most / (span * (width / height)), (z * 1.5 - 24) / most / span];
  const places = [[12, 5], [20, 12], [30, 4], [36, 20], [15, 21]];
  const pixels = await pixelsAt(page, places.map(([y, z]) => pointOf(y, z)));
  // Sample i reaches from i to i + 1, and the face is between two of them.
  for (const [i, [y, z]] of places.entries())
    near(pixels[i], colorIn("viridis", sampleOf(23.5, y - 0.5, z - 0.5) / 800), 4, `${[y, z]}`);
  await picture(page, "crop");
  // What is cut off is not there.
  for (const pixel of await pixelsAt(page, [[9, 10], [4, 20], [20, 26], [30, 30]].map(([y, z]) => pointOf(y, z)))) near(pixel, [0, 0, 0], 0, "cut off");
  // The edges of the box are drawn, and an end moves the other one rather than cross it.
  assert.match(await page.evaluate(`document.querySelector(".box path").getAttribute("d")`), /^M.*L/);
  await fieldOf(page, "First sample along x", 30);
  assert.deepEqual(await page.evaluate("tagridViewer.state.space.crop"), { low: [30, 10, 0], high: [31, 40, 24] });
  await page.evaluate(`document.getElementById("space-whole").click()`);
  assert.equal(await page.evaluate("tagridViewer.state.space.crop"), undefined);
  assert.equal(await page.evaluate(`document.querySelector(".box path").getAttribute("d") === "" || ${frames}.then(() => document.querySelector(".box path").getAttribute("d") === "")`), true);
  // Without a cut, the front has the light of a surface.
  const [front] = await pixelsAt(page, [pointOf(20, 12)]);
  assert.notDeepEqual(front.map(Math.round), colorIn("viridis", sampleOf(47, 19.5, 11.5) / 800).map(Math.round));
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("bars show the values of the window and the colors of the map; a phone has room for the picture", async () => {
  const page = await opened(write("bars", dims, Int16Array, (x, y, z) => x + y + z, [...space, "rescale_units:=HU"]));
  await page.evaluate("tagridViewer.actions.window(-160, 240.5)");
  const texts = ["window-low", "window-high"].map((id) => page.evaluate(`document.getElementById("${id}").textContent`));
  assert.deepEqual(await Promise.all(texts), ["-160 HU", "240.5 HU"]);
  await set(page, "space-map", "viridis");
  const bar = await page.evaluate(`getComputedStyle(document.getElementById("space-bar")).backgroundImage`);
  assert.ok(bar.includes(`rgb(${colorIn("viridis", 0).map(Math.round).join(", ")})`) && bar.includes(`rgb(${colorIn("viridis", 1).map(Math.round).join(", ")})`), bar);
  // Numbers of the crop box are not cut off.
  assert.deepEqual(await page.evaluate(`[...document.querySelectorAll(".crop input[type=number], .angles input")].filter((e) => e.scrollWidth > e.clientWidth).length`), 0);
  assert.deepEqual(page.errors, []);
  await page.close();
  const phone = await open("made/bars.tag", 390, 844, true);
  const { top, wide, small } = await phone.evaluate(`(() => ({
    top: document.getElementById("views").getBoundingClientRect().top,
    wide: document.documentElement.scrollWidth,
    small: [...document.querySelectorAll("header button, header select")].filter((e) => e.offsetParent && (e.offsetHeight < 44 || e.offsetWidth < 44)).length }))()`);
  assert.ok(top < 280 && wide <= 390 && small === 0, `${top} ${wide} ${small}`);
  // All tools can be reached.
  const isReached = await phone.evaluate(`(() => { const button = document.querySelector("[data-tool=tilt]");
    button.scrollIntoView();
    const box = button.getBoundingClientRect();
    return document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2) === button; })()`);
  assert.ok(isReached);
  await picture(phone, "phone");
  assert.deepEqual(phone.errors, []);
  await phone.close();
});

test("a link shows the same picture in 3D", async () => {
  const sampleOf = (x, y, z) => Math.round(500 * Math.exp(-((x - 24) ** 2 + (y - 20) ** 2 + (1.5 * z - 24) ** 2) / 200)) + ((x * 7 + y * 3 + z) % 5);
  const page = await opened(write("linked-3d", dims, Int16Array, sampleOf, space));
  await page.evaluate("tagridViewer.actions.window(0, 450)");
  await set(page, "space-map", "cividis");
  await fieldOf(page, "Value of the surface", 222.5);
  await set(page, "space-opacity", 80);
  await fieldOf(page, "Last sample along y", 19);
  await fieldOf(page, "First sample along z", 4);
  await page.evaluate("tagridViewer.spaceView.canvas.focus()");
  for (const key of ["ArrowLeft", "ArrowLeft", "ArrowUp", "+"]) await page.key(key);
  const blocks = (one) =>
    one.evaluate(`${frames}.then(() => {
      const { canvas } = tagridViewer.spaceView, copy = document.createElement("canvas");
      [copy.width, copy.height] = [32, 32];
      copy.getContext("2d").drawImage(canvas, 0, 0, 32, 32);
      return { size: [canvas.width, canvas.height], data: [...copy.getContext("2d").getImageData(0, 0, 32, 32).data] };
    })`);
  const isSame = async (fogged) => {
    await pause(page);
    const link = await page.evaluate("location.href");
    // Before another page hides this one: then it draws nothing.
    const here = await blocks(page);
    const again = await browser.newPage(840, 520);
    await again.goTo(link);
    await again.until("tagridViewer.spaceView.texture");
    await pause(again);
    const there = await blocks(again);
    assert.deepEqual(there.size, here.size);
    assert.ok(here.data.filter((n, i) => i % 4 === 1 && n > 30).length > 30);
    const most = Math.max(...here.data.map((n, i) => Math.abs(n - there.data[i])));
    assert.ok(most < 8, `${fogged}: ${most}`);
    assert.equal(await again.evaluate("location.href"), link);
    const texts = (one) => one.evaluate(`[...document.querySelectorAll("#space-crop input, #space-map, #space-opacity, [data-view=space] input")].map((e) => e.value)`);
    assert.deepEqual(await texts(again), await texts(page));
    if (fogged === "surface") await picture(again, "linked-3d");
    assert.deepEqual(again.errors, []);
    await again.close();
    await page.show();
    return link;
  };
  assert.match(await isSame("surface"), /space=surface,0\.8&level=222\.5&map=cividis&crop=0,0,4,48,20,32&turn=/);
  await kind(page, "fog");
  await set(page, "space-opacity", 65);
  assert.match(await isSame("fog"), /space=fog,0\.65&/);
  assert.deepEqual(page.errors, []);
  await page.close();
});
