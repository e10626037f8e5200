// What differs between browsers and Node.js.

export const isNode =
  typeof process === "object" && typeof process.versions?.node === "string" && typeof WorkerGlobalScope === "undefined" &&
  typeof window === "undefined";

// Bundlers for browsers must not look for these modules.
const nodeModule = (name) => import(/* @vite-ignore */ /* webpackIgnore: true */ `node:${name}`);

export async function cores() {
  if (!isNode) return globalThis.navigator?.hardwareConcurrency ?? 4;
  const { availableParallelism, cpus } = await nodeModule("os");
  return availableParallelism?.() ?? cpus().length;
}

/** The bytes of a file of this package, or the answer of a server, which can be compiled while it arrives. */
export async function packageFile(url) {
  if (url.protocol !== "file:") return fetch(url);
  const { readFile } = await nodeModule("fs/promises");
  return readFile(url);
}

/** A worker with `onMessage` and `onError`. It keeps the process alive only while it `works`. */
export async function startNodeWorker(url, { onMessage, onError }) {
  const { Worker } = await nodeModule("worker_threads");
  const worker = new Worker(url);
  worker.on("message", onMessage);
  worker.on("error", onError);
  return {
    post: (message) => worker.postMessage(message),
    works: (busy) => (busy ? worker.ref() : worker.unref()),
    end: () => worker.terminate(),
  };
}

/** The same in a browser. `make` makes the worker; the error of one that was not loaded has no message. */
export function startWebWorker(make, { onMessage, onError }) {
  const worker = make();
  worker.onmessage = (event) => onMessage(event.data);
  worker.onerror = (event) => onError(new Error(event.message ?? ""));
  worker.onmessageerror = () => onError(new Error("it cannot be given a message"));
  return { post: (message) => worker.postMessage(message), works: () => {}, end: () => worker.terminate() };
}

/** Serves messages in a worker. */
export function serve(answer) {
  if (isNode) {
    nodeModule("worker_threads").then(({ parentPort }) =>
      parentPort.on("message", (message) => answer(message, (reply, moved) => parentPort.postMessage(reply, moved))),
    );
  } else {
    self.onmessage = (event) => answer(event.data, (reply, moved) => self.postMessage(reply, moved));
  }
}
