// Follows the step of docs/tour.md in which a browser opens: draws what headless Chromium shows.
//
//     TAGRID_CHROMIUM=chromium node tools/research/pictures/tour_view.mjs PROGRAM FILE.tag PICTURE.png
//
// PROGRAM: one that finds the page of the viewer.
import { spawn } from "node:child_process";
import { createInterface } from "node:readline";
import { startChromium } from "../../../tests/web/chromium.mjs";

const [program, file, picture] = process.argv.slice(2);
const view = spawn(program, ["view", file, "--no-browser", "-q"], { stdio: ["ignore", "pipe", "inherit"] });
const { value: address } = await createInterface({ input: view.stdout })[Symbol.asyncIterator]().next();
if (!address) process.exit(1);
const browser = await startChromium();
try {
  const page = await browser.newPage(1180, 720);
  await page.goTo(address);
  await page.until("tagridViewer.times.complete && tagridViewer.spaceView.texture");
  await page.evaluate("new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))");
  await page.picture(picture);
} finally {
  await browser.close();
  view.kill();
}
