// The files of this package besides its modules: WebAssembly, and the worker.
import { TagridError } from "./errors.js";
import { perhaps, shownAddress, wordsOf } from "./addresses.js";
import { isNode, packageFile, startNodeWorker, startWebWorker } from "./platform.js";

// Bundlers find and move files whose addresses are these very expressions, so nothing here is computed.
const modules = {
  tagrid_simd: () => new URL("./tagrid_simd.wasm", import.meta.url),
  tagrid_scalar: () => new URL("./tagrid_scalar.wasm", import.meta.url),
  tagrid_grid_simd: () => new URL("./tagrid_grid_simd.wasm", import.meta.url),
  tagrid_grid_scalar: () => new URL("./tagrid_grid_scalar.wasm", import.meta.url),
};
const webWorker = () => new Worker(new URL("./worker.js", import.meta.url), { type: "module" });

// Bundlers for browsers need no second one.
const nodeWorker = () => new URL(/* @vite-ignore */ /* webpackIgnore: true */ "./worker.js", import.meta.url);

// A function that returns a vector: i32.const 0, i8x16.splat, i8x16.popcnt.
const withVectors = new Uint8Array([
  0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11,
]);

const compiled = new Map();

/** Where the files are: a URL, or undefined if they are beside this module, or where a bundler put them. */
export function baseOf(base) {
  if (base === undefined) return baseOfCopy();
  try {
    return new URL(base, globalThis.location?.href);
  } catch {
    throw new TagridError("invalid-argument", `base: ${shownAddress(base)} is not the URL of a folder`);
  }
}

// While a page is developed, Vite before 8 serves a copy of this module without the other files, which it serves as well.
function baseOfCopy() {
  try {
    const copied = /^(.*\/node_modules\/)\.vite\/deps\//.exec(modules.tagrid_simd().href);
    return copied ? new URL(`${copied[1]}@tagrid/decoder/dist/`) : undefined;
  } catch {
    return undefined;
  }
}

const whatToDo = (base) =>
  base
    ? `base, ${shownAddress(base)}, must be the folder with the files of @tagrid/decoder, with "/" at its end`
    : "a bundler may have moved @tagrid/decoder without its files: copy them, and pass their folder as `base` (see its README)";

const notLoaded = (what, why, base) => new TagridError("not-supported", `cannot load ${what}: ${why.replace(/\.$/, "")}; ${whatToDo(base)}`);

function urlOf(name, base) {
  try {
    return base ? new URL(`${name}.wasm`, base) : modules[name]();
  } catch {
    throw notLoaded(`${name}.wasm`, "its address is not known", base);
  }
}

/** A compiled module, which workers can be given: `tagrid` decodes samples, `tagrid_grid` also the grid. */
export async function compile(name, base, simd) {
  const url = urlOf(`${name}_${simd && WebAssembly.validate(withVectors) ? "simd" : "scalar"}`, base);
  let module = compiled.get(url.href);
  if (!module) {
    module = compileFrom(url, base).catch((error) => {
      compiled.delete(url.href);
      throw error;
    });
    compiled.set(url.href, module);
  }
  return module;
}

async function compileFrom(url, base) {
  const shown = shownAddress(url.href);
  if (typeof WebAssembly !== "object") throw new TagridError("not-supported", "there is no WebAssembly here");
  let bytes, type;
  try {
    const file = await packageFile(url);
    if (!(file instanceof Uint8Array) && !file.ok) throw new Error(`the server answered ${file.status}`);
    type = file.headers?.get("Content-Type");
    bytes = file instanceof Uint8Array ? file : new Uint8Array(await file.arrayBuffer());
  } catch (error) {
    throw notLoaded(shown, wordsOf(error).replaceAll(url.href, shown) + perhaps(url, error), base);
  }
  // Some servers do not know the type of the file, and some send a page instead of a file that is missing.
  if (String.fromCharCode(...bytes.subarray(0, 4)) !== "\0asm")
    throw notLoaded(shown, `it is not WebAssembly${type ? ` (the server says ${type})` : ""}`, base);
  try {
    return await WebAssembly.compile(bytes);
  } catch (error) {
    throw new TagridError("not-supported", `cannot compile ${shown}: ${error.message}`);
  }
}

/** A worker with `onMessage` and `onError`; see platform.js. */
export async function startWorker(base, on) {
  const url = base && new URL("worker.js", base);
  if (isNode) return startNodeWorker(url ?? nodeWorker(), on);
  return startWebWorker(() => (url ? new Worker(url, { type: "module" }) : webWorker()), on);
}

/** The error for a worker that failed before it worked. Browsers do not tell why. */
export async function workerNotLoaded(base, error) {
  const url = base && new URL("worker.js", base);
  return notLoaded(url ? shownAddress(url) : "worker.js", error.message || (await whyNot(url)), base);
}

async function whyNot(url) {
  try {
    const answer = await fetch(url);
    await answer.body?.cancel();
    if (!answer.ok) return `the server answered ${answer.status}`;
    const type = answer.headers.get("Content-Type") ?? "";
    if (!/javascript|ecmascript/i.test(type)) return `the server says that its type is ${type || "unknown"}, not text/javascript`;
  } catch {
    // It has another origin, or is forbidden.
  }
  return "it is missing, has another origin than the page, or is not allowed by the page's policy (worker-src)";
}
