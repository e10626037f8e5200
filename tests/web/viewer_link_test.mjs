// What the viewer gives away, in headless Chromium: a link that shows the same, pictures, and words for screen readers.
import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { folder } from "./files.mjs";
import { browser, open, picture, server, write } from "./viewer_pages.mjs";
import { linkOf, shownBy } from "../../web/viewer/src/link.js";

const isDone = "tagridViewer.sliceViews.every((view) => !view.isShown || view.isSettled)";
const set = (page, id, value) =>
  page.evaluate(`{ const field = document.getElementById("${id}"); field.value = ${JSON.stringify(value)};
    field.dispatchEvent(new Event("input")); field.dispatchEvent(new Event("change")); }`);
/** What a page shows: all that a link must keep, and the pixels of the slices. */
const shownIn = (page) =>
  page.evaluate(`(() => { const { state, sliceViews, secondViews, second } = tagridViewer;
    for (const view of [...sliceViews, ...(second.volume ? secondViews : [])]) view.draw();
    // Means of blocks: the browser may draw edges of lines by the graphics card or the processor.
    const means = ({ canvas }) => {
      if (!canvas.width || !canvas.height) return [];
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      const columns = Math.ceil(canvas.width / 8), sums = new Array(columns * Math.ceil(canvas.height / 8)).fill(0);
      for (let i = 0; i < data.length; i += 4)
        sums[Math.floor(i / 4 / canvas.width / 8) * columns + Math.floor(((i / 4) % canvas.width) / 8)] += data[i] + data[i + 1] + data[i + 2];
      return sums.map((sum) => sum / 192); };
    return { position: state.position, low: state.shades.low, high: state.shades.high, slab: state.slab, grid: state.showsGrid,
      zoom: state.zoom, texts: [...document.querySelectorAll("#measures li")].map((e) => e.innerText),
      hidden: [...document.querySelectorAll("#views section")].map((e) => e.hidden), second: second.name,
      end: second.isDifference && second.shades.end, materials: document.getElementById("legend").innerText,
      pictures: [...sliceViews, ...secondViews].map(means) }; })()`);
/** Two pages show the same. */
function assertSame({ pictures, ...shown }, { pictures: others, ...expected }) {
  assert.deepEqual(shown, expected);
  for (const [view, means] of pictures.entries()) {
    assert.equal(means.length, others[view].length);
    const differences = means.map((mean, i) => Math.abs(mean - others[view][i]));
    assert.ok(Math.max(0, ...differences) < 6, `view ${view}: ${Math.max(...differences)}`);
  }
}
const dims = [70, 60, 50];
const sampleOf = (x, y, z) => Math.round(300 * Math.sin(x / 9) * Math.cos(y / 7) + 5 * z + ((x * 31 + y * 17 + z * 7) % 41));
const space = ["space: LPS", "space directions: (0.5,0,0) (0,0.5,0) (0,0,1)", "rescale_units:=HU"];
const pause = (page) => page.evaluate("new Promise((done) => setTimeout(done, 700))");
const settled = `${isDone} && tagridViewer.state.measures.every((m) => !/ellipse|rectangle/.test(m.kind) || m.statistics)`;

test("a link shows the same: place, zoom, window, slab, measurements and the second file", async () => {
  const file = write("linked", dims, Int16Array, sampleOf, space, "--max-error", "2");
  write("linked-b", dims, Int16Array, (...p) => sampleOf(...p) + (p[0] % 5 === 0 ? 7 : 0), space, "--max-error", "2");
  const page = await open(`${file}&materials=bone=250:`);
  await page.evaluate("tagridViewer.sliceViews[0].canvas.focus()");
  for (const [key, from, to] of [["4", [3, 4, 20], [33, 24, 20]], ["6", [20, 20, 20], [50, 44, 20]]]) {
    await page.key(key);
    for (const position of [from, to]) {
      await page.evaluate(`tagridViewer.actions.moveTo(${JSON.stringify(position)})`);
      await page.key("Enter");
    }
  }
  await page.key("Escape");
  await page.key("1");
  await page.evaluate("tagridViewer.actions.moveTo([22, 33, 20]); tagridViewer.actions.zoom(tagridViewer.sliceViews[0], 1.7, 60, 90)");
  await page.evaluate("tagridViewer.actions.window(-123.5, 400.25)");
  await set(page, "slab-kind", "maximum");
  await set(page, "slab-thickness", "3");
  await page.until(settled);
  await pause(page);
  await page.until(settled);
  const link = await page.evaluate("location.href");
  const before = await shownIn(page);
  assert.equal(before.texts.length, 2);
  const again = await browser.newPage(1280, 860);
  await again.goTo(link);
  await again.until(`tagridViewer.times.complete && ${settled}`);
  await pause(again);
  await again.until(settled);
  assertSame(await shownIn(again), before);
  // And it is the same link.
  assert.equal(await again.evaluate("location.href"), link);
  await again.close();
  // A second file, its difference and the ends of its colors; one view alone.
  await page.evaluate(`tagridViewer.actions.one("axial")`);
  const compared = new URL(await page.evaluate("location.href"));
  compared.searchParams.set("compare", "/made/linked-b.tag");
  compared.searchParams.set("compare-by", "difference");
  compared.hash = `${compared.hash.replace(/&slab=[^&]*/, "")}&view=axial&ends=9`;
  const isBoth = "tagridViewer.second.isDifference && tagridViewer.secondViews.every((view) => !view.isShown || view.isSettled)";
  const two = await browser.newPage(1280, 860);
  await two.goTo(compared.href);
  await two.until(`tagridViewer.times.complete && ${settled} && ${isBoth}`);
  await pause(two);
  const shown = await shownIn(two);
  assert.equal(shown.second, "linked-b.tag − linked.tag");
  assert.equal(shown.end, 9);
  assert.equal(shown.hidden.filter((hidden) => !hidden).length, 2);
  await picture(two, "linked");
  const third = await browser.newPage(1280, 860);
  await third.goTo(await two.evaluate("location.href"));
  await third.until(`tagridViewer.times.complete && ${settled} && ${isBoth}`);
  await pause(third);
  assertSame(await shownIn(third), shown);
  for (const one of [page, two, third]) {
    assert.deepEqual(one.errors, []);
    await one.close();
  }
});

test("another volume of a file is in the link; a file of this machine has none", async () => {
  const page = await open("golden/volumes_bounded_int16.tag");
  await page.evaluate(`{ const choice = document.getElementById("volume"); choice.value = "1"; choice.dispatchEvent(new Event("change")); }`);
  await page.until(`/volume=1/.test(location.hash)`);
  const link = await page.evaluate("location.href");
  const { low, high } = await page.evaluate("tagridViewer.state.volume.range");
  const again = await browser.newPage(1280, 860);
  await again.goTo(link);
  await again.until("tagridViewer.times.complete");
  assert.equal(await again.evaluate(`document.getElementById("volume").value`), "1");
  const range = await again.evaluate("tagridViewer.state.volume.range");
  assert.deepEqual([range.low, range.high], [low, high]);
  write("local", [20, 18, 16], Int16Array, (x) => x);
  await again.choose("#file", [join(folder, "local.tag")]);
  await again.until(`tagridViewer.state.name === "local.tag" && location.search === "" && location.hash === ""`);
  assert.deepEqual(again.errors, []);
  await again.close();
  // What is no place in the volume, or no measurement, is not shown.
  const wrong = await browser.newPage(900, 700);
  await wrong.goTo(server.url("viewer/index.html?src=/made/local.tag#at=99,-4,3.7&window=5,5&zoom=-1&measures=ruler:z3:1,2,3,4;ruler:z99:1,2,3,4;knife:z3:1,2,3,4;ruler:z3:1,2,3;angle:y2:1,1,1,1,900,1&slab=mean,0&plane=axial,1,2,3,4,5&space=cloud,7&map=jet&crop=9,9,9,3,3,3&turn=1,9,1&level=x&view=none&%E0%A4"));
  await wrong.until("tagridViewer.times.complete");
  await pause(wrong);
  assert.deepEqual(await wrong.evaluate("tagridViewer.state.position"), [19, 0, 3]);
  assert.deepEqual(await wrong.evaluate("tagridViewer.state.measures.map(({ kind, slice }) => kind + slice)"), ["ruler3"]);
  assert.equal(await wrong.evaluate("tagridViewer.state.slab.kind"), "none");
  assert.deepEqual(wrong.errors, []);
  await wrong.close();
  await page.close();
});

test("texts of links are read as they were written", () => {
  const measures = [
    { kind: "ruler", normal: 2, slice: 20, points: [[3.5, 4.125, 20.5], [33.5, 24, 20.5]] },
    { kind: "angle", normal: 0, slice: 7, points: [[7.5, 1, 2], [7.5, 3, 4], [7.5, 5, 6]] },
    { kind: "ellipse", normal: 1, slice: 0, points: [[0, 0.5, 1.5], [9, 0.5, 12]] },
    { kind: "ruler", plane: { isShown: true, base: "coronal", tilt: -7.5, turn: 0, spin: 90, through: [3, 4.25, 5] }, points: [[1, 2, 3], [4.5, 6, 7]] },
  ];
  const shown = {
    position: [30, 25, 20], window: [-160.125, 1e-7], zoom: 2.5, centers: [[1, 2], [3, 4], [5.5, 6]], view: "coronal", volume: 3,
    slab: { kind: "mean", thickness: 2.5, isInSlices: false },
    space: { kind: "fog", map: "viridis", opacity: { surface: 1, fog: 0.75 }, crop: { low: [1, 2, 3], high: [40, 50, 6] }, turn: { around: -1.25, up: 0.5 }, zoom: 2 },
    level: 300.5,
    plane: { isShown: true, base: "axial", tilt: 30, turn: -12.25, spin: 0, through: [30.5, 25.125, 20.5] }, measures, showsGrid: true, end: 0.25,
  };
  const text = linkOf(shown);
  assert.deepEqual(shownBy(`#${text}`), shown);
  // Nothing in it needs to be encoded: it can be read, and mailed.
  assert.match(text, /^[\w=&,:;.-]+$/);
});

test("a picture has the pixels of the view, and the name, the slice, the window and the bound", async () => {
  const page = await open(write("pictured", dims, Int16Array, sampleOf, space, "--max-error", "2"));
  await page.evaluate("tagridViewer.actions.window(-160, 240); tagridViewer.actions.moveTo([22, 33, 20])");
  await page.until(isDone);
  await page.evaluate(`{
    globalThis.saved = undefined;
    globalThis.written = [];
    const { fillText } = CanvasRenderingContext2D.prototype;
    CanvasRenderingContext2D.prototype.fillText = function (text, ...on) {
      if (!this.canvas.isConnected) written.push(text);
      return fillText.call(this, text, ...on);
    };
    const toBlob = HTMLCanvasElement.prototype.toBlob;
    HTMLCanvasElement.prototype.toBlob = function (done, ...type) {
      return toBlob.call(this, (blob) => { globalThis.blob = blob; done(blob); }, ...type);
    };
    HTMLAnchorElement.prototype.click = function () { globalThis.saved = { name: this.download, href: this.href }; };
    tagridViewer.sliceViews[1].canvas.focus();
  }`);
  await page.key("p");
  await page.until("globalThis.saved");
  assert.equal(await page.evaluate("saved.name"), "pictured.tag-Coronal-34.png");
  const found = await page.evaluate(`(async () => {
    const { canvas } = tagridViewer.sliceViews[1], bitmap = await createImageBitmap(blob);
    const copy = new OffscreenCanvas(bitmap.width, bitmap.height), context = copy.getContext("2d");
    context.drawImage(bitmap, 0, 0);
    const [a, b] = [context, canvas.getContext("2d")].map((c) => c.getImageData(0, 0, canvas.width, canvas.height).data);
    let differ = 0;
    for (let i = 0; i < a.length; ++i) differ += a[i] !== b[i];
    return { differ, type: blob.type, more: bitmap.height - canvas.height, isWide: bitmap.width === canvas.width }; })()`);
  assert.deepEqual([found.differ, found.type, found.isWide], [0, "image/png", true]);
  assert.ok(found.more > 60);
  assert.deepEqual(await page.evaluate("written"), [
    "pictured.tag",
    "coronal  slice 34 of 60 (y = 33)",
    "window: level 40 HU, width 400 HU (-160 HU to 240 HU)",
    "lossy: errors up to 2 HU",
  ]);
  if (process.env.TAGRID_PICTURES) {
    const { writeFileSync } = await import("node:fs");
    const bytes = await page.evaluate("blob.arrayBuffer().then((b) => [...new Uint8Array(b)])");
    writeFileSync(join(process.env.TAGRID_PICTURES, "saved.png"), Buffer.from(bytes));
  }
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("screen readers are told the slice and the value, politely and once", async () => {
  const page = await open(write("told", dims, Int16Array, sampleOf, space));
  assert.equal(await page.evaluate(`document.getElementById("announcement").getAttribute("aria-live")`), "polite");
  await page.evaluate(`globalThis.told = []; new MutationObserver(() => told.push(document.getElementById("announcement").textContent))
    .observe(document.getElementById("announcement"), { childList: true, characterData: true, subtree: true });
    tagridViewer.sliceViews[0].canvas.focus()`);
  const position = await page.evaluate("tagridViewer.state.position");
  for (let i = 0; i < 3; ++i) await page.key("PageUp");
  await page.key("ArrowRight");
  const place = [position[0] + 1, position[1], position[2] + 3];
  await page.until("told.length > 0");
  await pause(page);
  assert.deepEqual(await page.evaluate("told"), [
    `axial slice ${place[2] + 1} of 50: value ${sampleOf(...place)} HU; sample ${place.join(", ")}; ` +
      `position (units) ${[0.5 * place[0], 0.5 * place[1], place[2]].join(", ")}`,
  ]);
  // A pointer that passes says nothing.
  await page.move(300, 300);
  await pause(page);
  assert.equal(await page.evaluate("told.length"), 1);
  // What was measured.
  await page.key("4");
  await page.key("Enter");
  for (let i = 0; i < 6; ++i) await page.key("ArrowRight");
  await page.key("Enter");
  await page.until(`told.at(-1).includes("ruler")`);
  assert.equal(await page.evaluate("told.at(-1)"), `1: ruler 3.0 units (z = ${place[2]})`);
  await page.key("w");
  await page.until(`told.at(-1).includes("window")`);
  assert.equal(await page.evaluate("told.at(-1)"), "window brain: 0 to 80 HU");
  assert.deepEqual(page.errors, []);
  await page.close();
});
