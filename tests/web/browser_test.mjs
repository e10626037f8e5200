// The decoder in headless Chromium: the page gets a plan from this server, and reports to it.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { createHash } from "node:crypto";
import { statSync } from "node:fs";
import { dirname, join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { decoded, folder, golden, goldenFiles, made, part } from "./files.mjs";
import { serve } from "./server.mjs";

const sha256 = (bytes) => createHash("sha256").update(bytes).digest("hex");
const here = dirname(fileURLToPath(import.meta.url));

const path = made("served", [260, 200, 130], "int16", "--max-error", "1", "--overviews", "4,16");
const all = decoded(path);
const box = { low: [10, 20, 63], high: [250, 190, 65] };

test("in a browser, the samples of the program", async () => {
  const other = await serve({ made: folder });
  let plan;
  let reported;
  const report = new Promise((resolve) => {
    reported = resolve;
  });
  const server = await serve(
    { dist: process.env.TAGRID_DIST, golden, made: folder, page: here },
    {
      "/plan": (_, response) => response.end(JSON.stringify(plan.map(({ expected, ...entry }) => entry))),
      "/report": async (request, response) => {
        const parts = [];
        for await (const bytes of request) parts.push(bytes);
        response.end();
        reported(JSON.parse(Buffer.concat(parts)));
      },
    },
  );
  const digests = (file, ...options) => ({ digest: sha256(decoded(join(golden, file), ...options)) });
  plan = [
    ...goldenFiles.filter((file) => !file.startsWith("volumes")).map((file) => ({ url: `/golden/${file}`, expected: digests(file) })),
    { url: "/golden/volumes_bounded_int16.tag", volume: 1, expected: digests("volumes_bounded_int16.tag", "--volume", "1") },
    { url: "/made/served.tag", expected: { digest: sha256(all) } },
    { url: "/made/served.tag", options: { simd: false, workers: 0 }, expected: { digest: sha256(all) } },
    { url: "/made/served.tag", blob: true, expected: { digest: sha256(all) } },
    { url: "/made/served.tag?delay=20", read: { box }, expected: { digest: sha256(part(all, [260, 200, 130], 2, box)) } },
    { url: "/made/served.tag", read: { level: 2 }, expected: { digest: sha256(decoded(path, "--overview", "16")) } },
    { url: "/made/served.tag?fail=5", options: { retries: 6 }, expected: { digest: sha256(all) } },
    { url: "/made/served.tag?delay=200&case=aborted", abort: 100, expected: { code: "AbortError" } },
    { url: "/made/served.tag?change=3&case=changed", expected: { code: "changed" } },
    { url: "/made/served.tag?ranges=no", expected: { code: "no-ranges" } },
    { url: "/golden/second_decoder.json", expected: { code: "broken-input" } },
    { url: "/golden/none.tag", expected: { code: "io-error" } },
    // Of another origin, whose server exposes Content-Range, or does not.
    { url: other.url("made/served.tag"), expected: { digest: sha256(all) } },
    { url: other.url("made/served.tag?change=3&case=changed"), expected: { code: "changed" } },
    { url: other.url("made/served.tag?expose=no"), expected: { code: "no-size" } },
    { url: other.url("made/served.tag?expose=no"), options: { size: statSync(path).size },
      expected: { digest: sha256(all) } },
    { url: "/made/served.tag", options: { base: "/nothing/" }, expected: { code: "not-supported" } },
  ];
  const browser = spawn(process.env.TAGRID_CHROMIUM, ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
    `--user-data-dir=${join(folder, "profile")}`, "--no-first-run", server.url("page/browser.html")], { stdio: "ignore" });
  try {
    const late = new Promise((_, reject) => setTimeout(() => reject(new Error("the page does not report")), 150000).unref());
    const { agent, results } = await Promise.race([report, late]);
    console.log(`# ${agent}`);
    assert.equal(results.length, plan.length);
    for (const [i, { expected, ...entry }] of plan.entries()) {
      const { digest, code, message } = results[i];
      assert.equal(code ?? digest, expected.code ?? expected.digest, `${JSON.stringify(entry)}: ${message}`);
    }
  } finally {
    browser.kill();
    await new Promise((resolve) => (browser.exitCode === null && browser.signalCode === null ? browser.on("exit", resolve) : resolve()));
    server.close();
    other.close();
  }
});
