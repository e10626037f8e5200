// Bundlers find the files of the package: a page that is built by vite and by webpack, and one that vite serves while it
// is developed, reads the samples of the program, with workers. With vite, webpack and webpack-cli in the directory of
// TAGRID_NODE_MODULES; without them it says so, and only looks at the expressions that bundlers look for.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { createHash } from "node:crypto";
import { cpSync, copyFileSync, existsSync, mkdirSync, readFileSync, readdirSync, symlinkSync, writeFileSync } from "node:fs";
import { createServer } from "node:net";
import { dirname, join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { startChromium } from "./chromium.mjs";
import { decoded, folder, golden } from "./files.mjs";
import { serve } from "./server.mjs";

const web = join(dirname(fileURLToPath(import.meta.url)), "..", "..", "web");
const modules = process.env.TAGRID_NODE_MODULES ?? "/nonexistent";
const missing = (...names) => {
  const gone = names.filter((name) => !existsSync(join(modules, name)));
  if (gone.length > 0) return `TAGRID_NODE_MODULES has no ${gone.join(", ")}`;
  return process.env.TAGRID_CHROMIUM && existsSync(process.env.TAGRID_CHROMIUM) ? false : "there is no chromium";
};
const scan = "grid_bounded_uint16.tag";
const expected = () => createHash("sha256").update(decoded(join(golden, scan))).digest("hex");

test("the addresses of files are expressions that bundlers know", () => {
  const source = readFileSync(join(web, "decoder", "src", "files.js"), "utf8");
  assert.ok(source.includes('new Worker(new URL("./worker.js", import.meta.url), { type: "module" })'));
  const wasm = ["tagrid_simd", "tagrid_scalar", "tagrid_grid_simd", "tagrid_grid_scalar"];
  for (const name of wasm) assert.ok(source.includes(`new URL("./${name}.wasm", import.meta.url)`), name);
  assert.deepEqual(readdirSync(process.env.TAGRID_DIST).filter((name) => name.endsWith(".wasm")).sort(), wasm.map((name) => `${name}.wasm`).sort());
});

/** A project that uses the package as npm installs it. */
function project(name) {
  const at = join(folder, name);
  const decoder = join(at, "node_modules", "@tagrid", "decoder");
  mkdirSync(decoder, { recursive: true });
  copyFileSync(join(web, "decoder", "package.json"), join(decoder, "package.json"));
  cpSync(process.env.TAGRID_DIST, join(decoder, "dist"), { recursive: true });
  const niivue = join(at, "node_modules", "@tagrid", "niivue");
  mkdirSync(niivue);
  const { files } = JSON.parse(readFileSync(join(web, "niivue", "package.json"), "utf8"));
  for (const file of ["package.json", ...files]) copyFileSync(join(web, "niivue", file), join(niivue, file));
  mkdirSync(join(at, "public"));
  copyFileSync(join(golden, scan), join(at, "public", scan));
  for (const tool of ["vite", "webpack", "webpack-cli"])
    if (existsSync(join(modules, tool))) symlinkSync(join(modules, tool), join(at, "node_modules", tool));
  writeFileSync(join(at, "package.json"), '{ "name": "page", "private": true, "type": "module" }');
  writeFileSync(join(at, "index.html"), '<!doctype html><meta charset="utf-8"><title></title><script type="module" src="./main.js"></script>');
  writeFileSync(join(at, "main.js"), `
    import { open } from "@tagrid/decoder";
    import { chunkedSource } from "@tagrid/niivue";
    globalThis.started = 0;
    globalThis.Worker = class extends Worker { constructor(...given) { super(...given); ++started; } };
    async function read() {
      const volume = await open(new URL("${scan}", document.baseURI), { workers: 1 });
      const [source, samples] = [chunkedSource(volume), await volume.read()];
      const edges = await volume.edges({ axis: 2, box: { low: [0, 0, 0], high: [volume.dims[0], volume.dims[1], 1] } });
      const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", samples));
      return [[...digest].map((byte) => byte.toString(16).padStart(2, "0")).join(""), source.levels.length > 0, edges.length > 0, started > 0];
    }
    read().then((result) => { globalThis.result = result; }, (error) => { globalThis.result = [String(error.stack)]; });`);
  return at;
}

async function requireRead(url) {
  const browser = await startChromium();
  try {
    const page = await browser.newPage(400, 300);
    await page.goTo(url);
    let result;
    for (const end = Date.now() + 60000; !result && Date.now() < end; await new Promise((r) => setTimeout(r, 50)))
      result = await page.evaluate("globalThis.result");
    assert.deepEqual(result, [expected(), true, true, true], String(page.errors));
  } finally {
    await browser.close();
  }
}

const node = (at, ...arguments_) => execFileSync(process.execPath, arguments_, { cwd: at, stdio: "pipe" });
/** Serves a directory with ranges, below a path, as pages often are. */
async function requireReadFrom(at) {
  const server = await serve({ below: at });
  try {
    await requireRead(server.url("below/index.html"));
  } finally {
    server.close();
  }
}

test("vite builds a page", { skip: missing("vite") }, async () => {
  const at = project("vite-build");
  node(at, join(modules, "vite", "bin", "vite.js"), "build", "--base", "./");
  await requireReadFrom(join(at, "dist"));
});

test("vite serves a page that is developed", { skip: missing("vite") }, async () => {
  const at = project("vite-dev");
  const port = await new Promise((resolve) => {
    const server = createServer().listen(0, "127.0.0.1", () => {
      const { port: free } = server.address();
      server.close(() => resolve(free));
    });
  });
  const vite = spawn(process.execPath, [join(modules, "vite", "bin", "vite.js"), "--host", "127.0.0.1", "--port", String(port), "--strictPort"],
    { cwd: at, stdio: "ignore" });
  try {
    const url = `http://127.0.0.1:${port}/`;
    for (const end = Date.now() + 30000; Date.now() < end && !(await fetch(url).catch(() => false)); )
      await new Promise((resolve) => setTimeout(resolve, 100));
    await requireRead(url);
  } finally {
    vite.kill();
  }
});

test("webpack builds a page", { skip: missing("webpack", "webpack-cli") }, async () => {
  const at = project("webpack");
  node(at, join(modules, "webpack-cli", "bin", "cli.js"), "./main.js", "--mode", "production", "-o", "dist");
  copyFileSync(join(golden, scan), join(at, "dist", scan));
  writeFileSync(join(at, "dist", "index.html"), '<!doctype html><meta charset="utf-8"><title></title><script src="main.js"></script>');
  await requireReadFrom(join(at, "dist"));
});

test("esbuild builds a page that says where the files are", { skip: missing() }, async () => {
  const at = project("esbuild");
  const main = readFileSync(join(at, "main.js"), "utf8");
  writeFileSync(join(at, "main.js"), main.replace("{ workers: 1 }", '{ workers: 1, base: "tagrid/" }'));
  try {
    execFileSync("esbuild", ["main.js", "--bundle", "--format=esm", "--outdir=dist", "--log-level=error"], { cwd: at, stdio: "pipe" });
  } catch (error) {
    if (error.code === "ENOENT") return console.log("# there is no esbuild");
    throw error;
  }
  cpSync(join(at, "node_modules", "@tagrid", "decoder", "dist"), join(at, "dist", "tagrid"), { recursive: true });
  copyFileSync(join(golden, scan), join(at, "dist", scan));
  copyFileSync(join(at, "index.html"), join(at, "dist", "index.html"));
  await requireReadFrom(join(at, "dist"));
});
