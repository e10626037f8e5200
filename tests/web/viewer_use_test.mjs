// What somebody who diagnoses relies on, in headless Chromium: sides, numbers, the window, and that hands do what they mean.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { folder } from "./files.mjs";
import { edgesOf, meshOf } from "./mesh.mjs";
import { litPart, open, picture, pixelOf, pointOf, readout, write } from "./viewer_pages.mjs";

const state = (page, what) => page.evaluate(`tagridViewer.state.${what}`);
const isDone = "tagridViewer.sliceViews.every((view) => !view.isShown || view.isSettled)";
const frame = (page) =>
  page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
/** All texts that a view draws, with where. */
const textsOf = (page, view) =>
  page.evaluate(`(() => { const view = tagridViewer.sliceViews[${view}], context = view.canvas.getContext("2d"), texts = [];
    context.fillText = (text, x, y) => texts.push({ text, x, y });
    view.draw();
    delete context.fillText;
    view.draw();
    return texts; })()`);

test("a mark at the left, the front and the head is drawn where the letters say so", async () => {
  const dims = [40, 36, 32];
  const orientations = {
    usual: ["left-posterior-superior", [1, 0, 0], [0, 1, 0], [0, 0, 1.5]],
    "head first, in RAS": ["RAS", [1, 0, 0], [0, 1, 0], [0, 0, 1.5]],
    coronal: ["left-posterior-superior", [1, 0, 0], [0, 0, -1], [0, 1.5, 0]],
    sagittal: ["left-posterior-superior", [0, 1, 0], [0, 0, -1], [1.5, 0, 0]],
    mirrored: ["left-posterior-superior", [-1, 0, 0], [0, 0, 1], [0, -1.5, 0]],
    turned: ["left-anterior-superior", [0, 0, 1], [-1, 0, 0], [0, 2, 0]],
    oblique: ["left-posterior-superior", [0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, -1.5]],
  };
  for (const [name, [space, ...directions]] of Object.entries(orientations)) {
    // Where coordinates grow toward the left, the front and the head.
    const toward = [space.startsWith("l") ? 1 : -1, /posterior/.test(space) ? -1 : 1, 1];
    const isHigh = directions.map(
      (d) => d.reduce((most, n, i) => (Math.abs(n) > Math.abs(most) ? n * toward[i] : most), 0) > 0,
    );
    const mark = dims.map((n, axis) => (isHigh[axis] ? n - 6 : 5));
    const file = write(
      "side",
      dims,
      Int16Array,
      (...p) => (p.every((n, axis) => Math.abs(n - mark[axis]) < 3) ? 1000 : 100),
      [`space: ${space}`, `space directions: ${directions.map((d) => `(${d})`).join(" ")}`, "space origin: (3,4,5)"],
    );
    const page = await open(file);
    await page.evaluate(`tagridViewer.actions.moveTo(${JSON.stringify(mark)}); tagridViewer.actions.window(0, 1000)`);
    await page.until(isDone);
    for (const [view, plane] of ["axial", "coronal", "sagittal"].entries()) {
      const texts = await textsOf(page, view);
      assert.match(
        texts[0].text,
        new RegExp(`^${plane}${name === "oblique" ? " \\(oblique\\)" : ""}  slice \\d+ of \\d+`),
        name,
      );
      const { x, y, width, height } = await page.evaluate(`(() => { const { canvas } = tagridViewer.sliceViews[${view}];
        const { width, height } = canvas, { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
        let [count, x, y] = [0, 0, 0];
        for (let i = 0; i < data.length; i += 4) if (data[i] === 255 && data[i + 1] === 255 && data[i + 2] === 255)
          [count, x, y] = [count + 1, x + (i / 4) % width, y + Math.floor(i / 4 / width)];
        return { x: x / count, y: y / count, width, height }; })()`);
      const letters = texts.filter(({ text }) => /^[RLAPHF]{1,3}$/.test(text));
      assert.equal(letters.length, 4, name);
      const at = (distance) =>
        letters.reduce((best, letter) => (distance(letter) < distance(best) ? letter : best)).text;
      const edges = { left: at((l) => l.x), right: at((l) => -l.x), top: at((l) => l.y), bottom: at((l) => -l.y) };
      const [across, down] = [x < width / 2 ? "left" : "right", y < height / 2 ? "top" : "bottom"];
      for (const edge of [across, down])
        assert.match(edges[edge], /^[LAH]/, `${name}: ${plane} ${edge} of ${JSON.stringify(edges)}`);
      for (const edge of [across === "left" ? "right" : "left", down === "top" ? "bottom" : "top"])
        assert.match(edges[edge], /^[RPF]/);
      // As radiologists hang pictures.
      assert.deepEqual(
        [edges.left[0], edges.top[0]],
        { axial: ["R", "A"], coronal: ["R", "H"], sagittal: ["A", "H"] }[plane],
      );
    }
    // The values are still those of the samples.
    for (const view of [0, 1, 2]) {
      await page.move(...(await pointOf(page, view, mark)));
      const shown = await readout(page);
      assert.deepEqual([shown.sample, shown.value.trim()], [mark.join(", "), "1000"], name);
    }
    await picture(page, `sides-${name.replaceAll(/\W+/g, "-")}`);
    assert.deepEqual(page.errors, []);
    await page.close();
  }
});

test("the picture is true to scale, and keys follow it", async () => {
  // Slices across the columns: the picture is turned against the samples.
  const file = write("scale", [20, 30, 40], Int16Array, (x, y, z) => x + 20 * y + 600 * (z % 8), [
    "space: LPS",
    "space directions: (0,0,-2) (0,0.5,0) (-1,0,0)",
  ]);
  const page = await open(file);
  await page.evaluate("tagridViewer.actions.zoom(tagridViewer.sliceViews[0], 1)");
  const zoom = await state(page, "zoom");
  const from = await pointOf(page, 1, [5, 10, 20]);
  const [right, up] = [await pointOf(page, 1, [5, 10, 17]), await pointOf(page, 1, [2, 10, 20])];
  // Three samples to the left of the patient are 3 mm, and three to the head 6 mm.
  assert.ok(Math.abs(right[0] - from[0] - 3 * zoom) < 1e-6 && Math.abs(right[1] - from[1]) < 1e-6);
  assert.ok(Math.abs(from[1] - up[1] - 6 * zoom) < 1e-6 && Math.abs(up[0] - from[0]) < 1e-6);
  await page.evaluate("tagridViewer.actions.moveTo([10, 15, 20]); tagridViewer.sliceViews[1].canvas.focus()");
  await page.key("ArrowRight");
  assert.deepEqual(await state(page, "position"), [10, 15, 19]);
  await page.key("ArrowUp");
  assert.deepEqual(await state(page, "position"), [9, 15, 19]);
  await page.evaluate("tagridViewer.actions.window(0, 5000)");
  await page.until(isDone);
  // Each sample is where its place says, with its grey.
  const sampleOf = ([x, y, z]) => x + 20 * y + 600 * (z % 8);
  for (const [view, places] of [
    [
      0,
      [
        [9, 4, 30],
        [9, 25, 7],
      ],
    ],
    [
      1,
      [
        [3, 15, 31],
        [17, 15, 6],
      ],
    ],
    [
      2,
      [
        [2, 7, 19],
        [16, 22, 19],
      ],
    ],
  ])
    for (const place of places) {
      const grey = Math.round((sampleOf(place) * 255) / 5000);
      assert.deepEqual(await pixelOf(page, view, place), [grey, grey, grey, 255], `${view} ${place}`);
    }
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("the grid lies over the samples, also where the picture is turned", async () => {
  const file = write(
    "turned",
    [64, 50, 40],
    Int16Array,
    (x, y, z) => (Math.hypot(x - 30, y - 25, z - 20) < 15 ? 900 : 3 * x + y),
    ["space: LPS", "space directions: (0,0,-1) (0,1,0) (-1,0,0)"],
    "--max-error",
    "2",
  );
  const page = await open(file);
  await page.evaluate(
    `tagridViewer.actions.one("coronal"); tagridViewer.actions.grid(); tagridViewer.actions.moveTo([5, 25, 3])`,
  );
  await page.until(`tagridViewer.sliceViews[1].gridState === "shown"`);
  await frame(page);
  await picture(page, "grid-turned");
  // In the only view that is shown, the sample at the cross hair has its value.
  assert.ok(Math.abs(Number((await readout(page)).value) - 40) <= 2);
  const mesh = meshOf(join(folder, "turned.tag"));
  // The mesh is in the world.
  for (const [tag, [a, b, c]] of mesh.points) mesh.points.set(tag, [-c, b, -a]);
  assert.equal(await page.evaluate("tagridViewer.sliceViews[1].normal"), 1);
  const edges = edgesOf(mesh, 1, 25).map((text) => text.split(" ").map(Number));
  const middles = edges
    .map(([a, b, c, d]) => [(a + c) / 2, 25, (b + d) / 2])
    .filter(([x, , z]) => x > 12 && x < 52 && z > 8 && z < 34);
  const blue =
    await page.evaluate(`(() => { const view = tagridViewer.sliceViews[1], context = view.canvas.getContext("2d"), places = ${JSON.stringify(middles)};
    view.draw();
    return places.filter((place) => {
      const [x, y] = view.pointOf([place[view.across] + 0.5, place[view.down] + 0.5]);
      const { data } = context.getImageData(Math.round(x) - 1, Math.round(y) - 1, 3, 3);
      let most = 0;
      for (let i = 0; i < data.length; i += 4) most = Math.max(most, data[i + 2] - data[i]);
      return most > 40;
    }).length; })()`);
  assert.ok(middles.length > 100 && blue > 0.97 * middles.length, `${blue} of ${middles.length}`);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("without directions, planes are named by their axes", async () => {
  const page = await open(write("nameless", [32, 30, 28], Int16Array, (x) => x, ["spacings: 1 1 2"]));
  const texts = (await Promise.all([0, 1, 2].map((view) => textsOf(page, view)))).map((list) =>
    list.map(({ text }) => text),
  );
  assert.deepEqual(
    texts.map((list) => list[0]),
    ["x–y  slice 15 of 28 (z = 14)", "x–z  slice 16 of 30 (y = 15)", "y–z  slice 17 of 32 (x = 16)"],
  );
  assert.ok(texts.every((list) => list[1] === "directions unknown" && !list.some((text) => /^[RLAPHF]+$/.test(text))));
  assert.match(await page.evaluate(`document.getElementById("facts").innerText`), /directions unknown/);
  assert.deepEqual(await page.evaluate(`[...document.querySelectorAll("[data-tab]")].map((e) => e.textContent)`), [
    "All",
    "x–y",
    "x–z",
    "y–z",
    "Oblique",
    "3D",
  ]);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("numbers have all digits that are stored", async () => {
  const at = [3, 4, 5];
  for (const [Samples, sample, lines, value, stored] of [
    [Int32Array, 1234567, [], "1234567"],
    [Uint32Array, 4294967295, [], "4294967295"],
    [
      Int32Array,
      -1234567,
      ["rescale_slope:=0.25", "rescale_intercept:=-1024", "rescale_units:=HU"],
      "-309665.75 HU",
      "-1234567",
    ],
    [Float32Array, Math.fround(123456.789), [], "123456.79"],
    [Float32Array, Math.fround(0.1), [], "0.1"],
    [Float64Array, 123456.78901234567, [], "123456.78901234567"],
  ]) {
    const page = await open(
      write("digits", [9, 9, 9], Samples, (x, y, z) => (x === 3 && y === 4 && z === 5 ? sample : 1), [
        "spacings: 0.001234 0.1 2",
        'units: "mm" "mm" "mm"',
        ...lines,
      ]),
    );
    await page.evaluate(`tagridViewer.actions.moveTo(${JSON.stringify(at)})`);
    await page.until(isDone);
    const shown = await readout(page);
    assert.equal(shown.value.trim(), value);
    assert.equal(shown["stored sample"], stored);
    assert.equal(shown["position (mm)"], "0.003702, 0.4, 10");
    assert.match(
      await page.evaluate(`document.getElementById("facts").innerText`),
      /spacing\s+0\.001234 × 0\.1 × 2 mm/,
    );
    assert.deepEqual(page.errors, []);
    await page.close();
  }
});

const windowOf = (page) => page.evaluate(`["low", "high"].map((end) => tagridViewer.state.shades[end])`);
test("the window is that of the header or chosen once, and only the user changes it", async () => {
  // Brighter from slice to slice.
  const page = await open(
    write("drift", [64, 64, 40], Int16Array, (x, y, z) => (x < 8 ? 0 : ((x + y) % 100) * z), ["spacings: 1 1 1"]),
  );
  const first = await windowOf(page);
  assert.ok(first[0] >= 0 && first[1] > 1000);
  for (const step of [10, -20, 28, -38]) {
    await page.evaluate(`tagridViewer.actions.step(2, ${step})`);
    await page.until(isDone);
    await frame(page);
    assert.deepEqual(await windowOf(page), first);
  }
  // The user may ask for the slices that are shown, or type one number: the other keeps all its digits.
  await page.evaluate("tagridViewer.actions.window(0, 10)");
  await page.evaluate(`document.getElementById("auto").click()`);
  assert.ok((await windowOf(page))[1] > 1000);
  await page.evaluate("tagridViewer.actions.window(1 / 3, 2000 / 3)");
  await page.evaluate(
    `{ const field = document.getElementById("window-level"); field.value = 500; field.dispatchEvent(new Event("input")); }`,
  );
  const [low, high] = await windowOf(page);
  assert.ok(Math.abs(high - low - 1999 / 3) < 1e-9 && Math.abs(high + low - 1000) < 1e-9);
  // What is no window is not left in a field, and a wheel that passes over one changes nothing.
  const width = `document.getElementById("window-width")`;
  await page.evaluate(`{ ${width}.focus(); ${width}.value = -7; ${width}.dispatchEvent(new Event("input")); }`);
  const { x, y } = await page.evaluate(`${width}.getBoundingClientRect().toJSON()`);
  await page.wheel(x + 9, y + 9, 100);
  await page.evaluate(`${width}.blur()`);
  assert.equal(await page.evaluate(`${width}.value`), "666.33");
  assert.deepEqual(await windowOf(page), [low, high]);
  assert.deepEqual(page.errors, []);
  await page.close();
  const named = await open(
    write("window", [64, 64, 40], Int16Array, (x, y, z) => x + y + z, ["window_center:=40", "window_width:=400"]),
  );
  assert.deepEqual(await windowOf(named), [-160, 240]);
  await named.close();
  const pairs = ["dicom_WindowCenter:=40\\\\300", "dicom_WindowWidth:=400\\\\1500", "dicom_PhotometricInterpretation:=MONOCHROME1"];
  const ofDicom = await open(write("dicom", [64, 64, 40], Int16Array, (x, y, z) => x + y + z, pairs));
  assert.deepEqual(await windowOf(ofDicom), [-160, 240]);
  assert.match(await ofDicom.evaluate(`document.body.textContent`), /low values mean white in the source/);
  await ofDicom.close();
  // The slices in the middle are air.
  const empty = await open(write("empty", [40, 40, 40], Int16Array, (x, y, z) => (Math.max(x, y, z) < 15 ? 900 : 100)));
  assert.deepEqual(await windowOf(empty), [100, 900]);
  await empty.close();
});

test("another volume of a file keeps the window and the place", async () => {
  const page = await open("golden/volumes_bounded_int16.tag");
  const { low, high } = await state(page, "volume.range");
  await page.evaluate(`tagridViewer.actions.window(${low}, ${(low + high) / 2})`);
  await page.evaluate("tagridViewer.actions.moveTo([1, 2, 3])");
  await page.evaluate(`globalThis.before = tagridViewer.state.volume; { const choice = document.getElementById("volume");
    choice.value = "1"; choice.dispatchEvent(new Event("change")); }`);
  await page.until(`tagridViewer.state.volume !== before && ${isDone}`);
  assert.deepEqual(await windowOf(page), [low, (low + high) / 2]);
  assert.deepEqual(await state(page, "position"), [1, 2, 3]);
  assert.match(
    await page.evaluate(`document.getElementById("volume").selectedOptions[0].textContent`),
    /^2 of \d+ \(number 1\)$/,
  );
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("where slices have slopes of their own, values are those of each slice, and views say so", async () => {
  const page = await open(
    write("slopes", [20, 20, 3], Int16Array, (x) => x, ["slice_slopes:=1 0.5 0.1", "slice_intercepts:=0 -3 1"]),
  );
  for (const [z, value] of [
    [0, "7"],
    [1, "0.5"],
    [2, "1.7"],
  ]) {
    await page.evaluate(`tagridViewer.actions.moveTo([7, 5, ${z}])`);
    await page.until(isDone);
    const shown = await readout(page);
    assert.deepEqual([shown.value.trim(), shown["stored sample"]], [value, "7"]);
  }
  assert.match((await textsOf(page, 0))[1].text, /slopes differ by slice/);
  await page.close();
});

test("a notch is a slice, and a wheel with Ctrl only zooms", async () => {
  const page = await open(write("wheel", [64, 64, 90], Int16Array, (x, y, z) => x + z));
  const [x, y] = await pointOf(page, 0, [20, 20, 45]);
  let z = 45;
  for (const notch of [100, 100, 120, 53, -100, -120, 300]) {
    await page.wheel(x, y, notch);
    z += Math.sign(notch);
    await page.until(`tagridViewer.state.position[2] === ${z}`);
  }
  // Events as of other browsers.
  const turn = (deltaY, deltaMode, count = 1) =>
    page.evaluate(`for (let i = 0; i < ${count}; ++i) tagridViewer.sliceViews[0].canvas.dispatchEvent(new WheelEvent("wheel",
      { deltaY: ${deltaY}, deltaMode: ${deltaMode}, cancelable: true })); tagridViewer.state.position[2]`);
  assert.equal(await turn(3, 1), ++z);
  assert.equal(await turn(1, 2), ++z);
  assert.equal(await turn(4, 0, 25), ++z);
  const zoom = await state(page, "zoom");
  await page.wheel(x, y, -100, 2);
  await page.until(`tagridViewer.state.zoom > ${zoom}`);
  assert.equal(await state(page, "position[2]"), z);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("fingers: a pinch changes nothing but the picture's place, a swipe goes through slices", async () => {
  const file = write("touch", [90, 80, 70], Int16Array, (x, y, z) => x + y + z, [
    "space: LPS",
    "space directions: (1,0,0) (0,1,0) (0,0,1)",
  ]);
  const page = await open(file, 390, 844, true);
  await frame(page);
  await picture(page, "phone-sides");
  const seen = () =>
    page.evaluate(`JSON.stringify([tagridViewer.state.position, tagridViewer.state.shades.low, tagridViewer.state.shades.high,
    scrollX, scrollY, visualViewport.scale])`);
  const placeAt = ([x, y]) =>
    page.evaluate(`(() => { const view = tagridViewer.sliceViews[0], box = view.canvas.getBoundingClientRect();
    return view.placeAt(${x} - box.left, ${y} - box.top); })()`);
  const before = await seen();
  const zoom = await state(page, "zoom");
  const [x, y] = await pointOf(page, 0, [40, 35, 35]);
  const held = await placeAt([x + 20, y + 10]);
  for (const tool of ["move", "window", "pan"]) {
    await page.evaluate(`tagridViewer.actions.tool("${tool}"); tagridViewer.actions.fit()`);
    // The first finger comes alone, and moves a little.
    await page.touch("touchStart", [[x, y]]);
    await page.touch("touchMove", [[x - 4, y - 3]]);
    await page.touch("touchMove", [[x, y - 12]]);
    await page.touch("touchMove", [[x, y]]);
    await page.touch("touchStart", [
      [x, y],
      [x + 40, y + 20],
    ]);
    for (let i = 1; i <= 10; ++i)
      await page.touch("touchMove", [
        [x - 4 * i, y - 3 * i],
        [x + 40 + 4 * i, y + 20 + 3 * i],
      ]);
    assert.equal(await seen(), before, tool);
    if (tool !== "pan") {
      assert.ok((await state(page, "zoom")) > 1.5 * zoom);
      const now = await placeAt([x + 20, y + 10]);
      assert.ok(Math.hypot(now[0] - held[0], now[1] - held[1]) < 0.02, `${held} ${now}`);
    }
    // Both move together: the picture follows them.
    const under = await placeAt([x + 20, y + 10]);
    for (let i = 1; i <= 5; ++i)
      await page.touch("touchMove", [
        [x - 40 + 3 * i, y - 30 + 2 * i],
        [x + 80 + 3 * i, y + 50 + 2 * i],
      ]);
    await frame(page);
    const moved = await placeAt([x + 35, y + 20]);
    assert.ok(Math.hypot(moved[0] - under[0], moved[1] - under[1]) < 0.02, `${under} ${moved}`);
    // A third finger, and the one that stays: nothing.
    await page.touch("touchStart", [
      [x - 25, y - 20],
      [x + 95, y + 60],
      [x, y + 60],
    ]);
    await page.touch("touchMove", [
      [x - 60, y - 20],
      [x + 95, y + 90],
      [x, y + 30],
    ]);
    await page.touch("touchEnd", [[x - 60, y - 20]]);
    await page.touch("touchMove", [[x - 60, y + 60]]);
    await page.touch("touchEnd", []);
    assert.equal(await seen(), before, tool);
  }
  await page.evaluate(`tagridViewer.actions.tool("move"); tagridViewer.actions.fit()`);
  // A swipe up: the next slices, and nothing else.
  const swipe = async (dx, dy) => {
    await page.touch("touchStart", [[x, y]]);
    for (let i = 1; i <= 12; ++i) await page.touch("touchMove", [[x + (dx * i) / 12, y + (dy * i) / 12]]);
    await page.touch("touchEnd", []);
  };
  await swipe(0, -60);
  assert.deepEqual(await state(page, "position"), [45, 40, 40]);
  await swipe(0, 120);
  assert.deepEqual(await state(page, "position"), [45, 40, 30]);
  await swipe(90, 0);
  assert.deepEqual(await state(page, "position"), [45, 40, 30]);
  assert.equal(await page.evaluate("scrollY"), 0);
  // A tap: the cross hair.
  const [tx, ty] = await pointOf(page, 0, [60, 20, 30]);
  await page.touch("touchStart", [[tx, ty]]);
  await page.touch("touchEnd", []);
  assert.deepEqual(await state(page, "position"), [60, 20, 30]);
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("on a phone, whatever is touched has 44 pixels", async () => {
  for (const [width, height] of [
    [390, 844],
    [844, 390],
  ]) {
    const page = await open(
      write("targets", [90, 80, 70], Int16Array, (x, y, z) => x + y + z),
      width,
      height,
      true,
    );
    await page.evaluate(`document.querySelector("[data-tab=space]").click()`);
    await page.until("tagridViewer.spaceView.texture");
    for (const tab of ["space", "axial"]) {
      await page.evaluate(`document.querySelector("[data-tab=${tab}]").click()`);
      assert.deepEqual(
        await page.evaluate(`[...document.querySelectorAll("button, label.button, select, input:not([type=file]), summary")]
        .filter((e) => e.checkVisibility()).map((e) => [e.outerHTML.slice(0, 80), e.getBoundingClientRect()])
        .filter(([, { width, height }]) => width < 44 || height < 44).map(([text, { width, height }]) => text + " " + width + " x " + height)`),
        [],
      );
    }
    assert.equal(await page.evaluate("document.documentElement.scrollWidth"), width);
    await page.close();
  }
});

test("a graphics card that is lost is said, and the picture comes back", async () => {
  const page = await open(
    write("lost", [60, 60, 60], Int16Array, (x, y, z) => (Math.hypot(x - 30, y - 30, z - 30) < 20 ? 1000 : 0), [
      "space: LPS",
      "space directions: (1,0,0) (0,1,0) (0,0,1)",
    ]),
  );
  await page.until("tagridViewer.spaceView.texture");
  const lit = () => litPart(page);
  const says = () =>
    page.evaluate(
      `document.querySelector("[data-view=space] .middle").checkVisibility() && document.querySelector("[data-view=space] .middle").innerText`,
    );
  const setLevel = `{ const field = document.querySelector(".over input[type=number]"); field.value = 700; field.dispatchEvent(new Event("input")); }`;
  await page.evaluate(setLevel);
  const before = await lit();
  assert.ok(before > 0.01);
  const sides = `[...document.querySelectorAll(".sides span")].filter((e) => !e.hidden).map((e) => e.textContent).sort().join("")`;
  assert.equal(await page.evaluate(sides), "AHL");
  for (let round = 0; round < 2; ++round) {
    await page.evaluate(
      `globalThis.card = tagridViewer.spaceView.canvas.getContext("webgl2").getExtension("WEBGL_lose_context"); card.loseContext()`,
    );
    await page.until(`document.querySelector("[data-view=space] .middle").checkVisibility()`);
    assert.match(await says(), /graphics card/);
    assert.equal(await page.evaluate(sides), "");
    // Nothing else is disturbed.
    await page.evaluate("tagridViewer.actions.step(2, 1)");
    await page.until(isDone);
    await page.evaluate("card.restoreContext()");
    await page.until("tagridViewer.spaceView.texture");
    assert.ok(Math.abs((await lit()) - before) < 0.002);
    assert.equal(await says(), false);
    assert.equal(await page.evaluate(`document.querySelector(".over input[type=number]").value`), "700");
  }
  assert.deepEqual(
    page.errors.filter((text) => !/CONTEXT_LOST/.test(text)),
    [],
  );
  await page.close();
});

test("what has no value, and what cannot be read, is not drawn as air", async () => {
  const nan = await open(write("nan", [40, 40, 40], Float32Array, (x, y) => (x < 10 ? NaN : y), []));
  await nan.until(isDone);
  const [r, g, b] = await pixelOf(nan, 0, [4, 10, 20]);
  assert.ok(r > 80 && g === 0 && b > 100);
  await nan.close();
  // A damaged brick, in the row of a whole one.
  const file = write(
    "damaged",
    [200, 60, 60],
    Int16Array,
    (x, y, z) => 500 + ((x * 7919 + y * 104729 + z * 1299709) % 401),
    [],
  );
  const path = join(folder, "damaged.tag");
  const bytes = readFileSync(path);
  bytes[Math.floor(bytes.length / 2)] ^= 0xff;
  writeFileSync(path, bytes);
  const page = await open(file);
  await page.until(isDone);
  const seen = await page.evaluate(
    `[...Array(4)].map((_, i) => tagridViewer.state.tiles.get(0, 2, 30, i, 0) ? "read" : "lost")`,
  );
  assert.equal(seen.filter((text) => text === "lost").length, 1, `${seen}`);
  assert.notEqual(await page.evaluate(`document.getElementById("status").textContent`), "");
  await picture(page, "damaged");
  const grey = async (i) => pixelOf(page, 0, [[20, 90, 150, 196][i], 12, 30]);
  await page.move(...(await pointOf(page, 0, [[20, 90, 150, 196][seen.indexOf("lost")], 12, 30])));
  assert.equal((await readout(page)).value, "cannot be read");
  const isGrey = ([red, green, blue]) => red === green && green === blue;
  for (let i = 0; i < 4; ++i) assert.equal(isGrey(await grey(i)), seen[i] === "read", `${i} ${await grey(i)}`);
  await page.close();
});

test("what the samples are worth is written over the slices", async () => {
  const page = await open(
    write(
      "lossy",
      [80, 80, 80],
      Int16Array,
      (x, y, z) => (x * y * z) % 997,
      ["rescale_slope:=0.5", "rescale_units:=HU"],
      "--max-error",
      "4",
    ),
  );
  for (const view of [0, 1, 2])
    assert.ok((await textsOf(page, view)).some(({ text }) => text === "lossy: errors up to 4 HU"));
  await page.close();
  const exact = await open("made/nan.tag");
  assert.ok(!(await textsOf(exact, 0)).some(({ text }) => /lossy/.test(text)));
  await exact.close();
});
