// Pages of the viewer in headless Chromium, and what they show.
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before } from "node:test";
import { startChromium } from "./chromium.mjs";
import { folder, golden, tagrid } from "./files.mjs";
import { serve } from "./server.mjs";

/** The folder of the page. */
export const viewer = process.env.TAGRID_VIEWER;
export let browser;
export let server;

before(async () => {
  browser = await startChromium();
  server = await serve({ viewer, made: folder, golden });
});
after(async () => {
  await browser.close();
  server.close();
});

const typeNames = {
  Uint8Array: "uint8",
  Uint16Array: "uint16",
  Int16Array: "int16",
  Int32Array: "int32",
  Uint32Array: "uint32",
  Float32Array: "float",
  Float64Array: "double",
};
/** A .tag file in made/ of samples that are a function of x, y, z, with these lines of a header. */
export function write(name, dims, Samples, sampleOf, lines = [], ...options) {
  const samples = new Samples(dims[0] * dims[1] * dims[2]);
  for (let z = 0, i = 0; z < dims[2]; ++z)
    for (let y = 0; y < dims[1]; ++y) for (let x = 0; x < dims[0]; ++x, ++i) samples[i] = sampleOf(x, y, z);
  const head = [
    "NRRD0004",
    `type: ${typeNames[Samples.name]}`,
    "dimension: 3",
    `sizes: ${dims.join(" ")}`,
    "encoding: raw",
    "endian: little",
    ...lines,
  ];
  const source = join(folder, `${name}.nrrd`);
  writeFileSync(source, Buffer.concat([Buffer.from(`${head.join("\n")}\n\n`), Buffer.from(samples.buffer)]));
  tagrid("encode", source, "-q", "-f", "-o", join(folder, `${name}.tag`), ...options);
  return `made/${name}.tag`;
}

/** A page with a file of made/ or golden/, once it shows all that it will. */
export async function open(file, width = 1280, height = 860, mobile = false) {
  const page = await browser.newPage(width, height, mobile);
  await page.goTo(server.url(`viewer/index.html?src=/${file}`));
  await page.until("tagridViewer.times.complete");
  return page;
}

/** Keeps a picture of the page in the folder of TAGRID_PICTURES. */
export const picture = async (page, name) => {
  if (process.env.TAGRID_PICTURES) await page.picture(join(process.env.TAGRID_PICTURES, `${name}.png`));
};

/** What the page says of the place under the pointer. */
export const readout = (page) =>
  page.evaluate(
    `Object.fromEntries([...document.querySelectorAll("#readout dt")].map((e) => [e.textContent, e.nextSibling.textContent]))`,
  );

/** Where a place of the volume is on the page. */
export const pointOf = (page, view, place) =>
  page.evaluate(`(() => { const view = tagridViewer.sliceViews[${view}], place = ${JSON.stringify(place)};
    const box = view.canvas.getBoundingClientRect();
    const [x, y] = view.pointOf([place[view.across] + 0.5, place[view.down] + 0.5]);
    return [box.left + x, box.top + y]; })()`);

/** The pixel of the picture there, away from the cross hair. */
export const pixelOf = (page, view, place) =>
  page.evaluate(`(() => { const view = tagridViewer.sliceViews[${view}], place = ${JSON.stringify(place)};
    view.draw();
    const [x, y] = view.pointOf([place[view.across] + 0.5, place[view.down] + 0.5]);
    return [...view.canvas.getContext("2d").getImageData(Math.floor(x), Math.floor(y), 1, 1).data]; })()`);

/** Which part of the picture in space is lit. */
export const litPart = (page) =>
  page.evaluate(`new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {
    const { canvas } = tagridViewer.spaceView, copy = document.createElement("canvas");
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0);
    const { data } = context.getImageData(0, 0, copy.width, copy.height);
    let count = 0;
    for (let i = 0; i < data.length; i += 4) count += data[i] > 40;
    done(count / (data.length / 4));
  })))`);
