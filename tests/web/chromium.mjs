// Headless Chromium, told what to do through a pipe, in its own protocol.
import { spawn } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { folder } from "./files.mjs";

let browsers = 0;

export async function startChromium() {
  const process = spawn(
    globalThis.process.env.TAGRID_CHROMIUM,
    [
      "--headless=new",
      "--no-sandbox",
      "--disable-dev-shm-usage",
      "--no-first-run",
      "--hide-scrollbars",
      "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader",
      `--user-data-dir=${join(folder, `browser-${browsers++}`)}`,
      "--remote-debugging-pipe",
    ],
    { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] },
  );
  const [, , , input, output] = process.stdio;
  const waiting = new Map();
  const listeners = new Set();
  let number = 0;
  let rest = Buffer.alloc(0);
  output.on("data", (bytes) => {
    rest = Buffer.concat([rest, bytes]);
    for (let end; (end = rest.indexOf(0)) >= 0; rest = rest.subarray(end + 1)) {
      const message = JSON.parse(rest.subarray(0, end).toString());
      if (!message.id) for (const listener of listeners) listener(message);
      else if (message.error) waiting.get(message.id).reject(new Error(JSON.stringify(message.error)));
      else waiting.get(message.id).resolve(message.result);
    }
  });
  process.on("exit", () => {
    for (const { reject } of waiting.values()) reject(new Error("the browser ended"));
  });
  const send = (method, params = {}, sessionId = undefined) =>
    new Promise((resolve, reject) => {
      waiting.set(++number, { resolve, reject });
      input.write(`${JSON.stringify({ id: number, method, params, sessionId })}\0`);
    });
  return {
    pid: process.pid,
    newPage: (width, height, mobile = false) => newPage(send, listeners, width, height, mobile),
    close: async () => {
      process.kill();
      await new Promise((resolve) =>
        process.exitCode === null && process.signalCode === null ? process.on("exit", resolve) : resolve(),
      );
    },
  };
}

/** A page of its own. `errors` are the exceptions and messages of errors in it. */
async function newPage(send, listeners, width, height, mobile) {
  const { targetId } = await send("Target.createTarget", { url: "about:blank" });
  const { sessionId } = await send("Target.attachToTarget", { targetId, flatten: true });
  const call = (method, params) => send(method, params, sessionId);
  const errors = [];
  const workers = new Set();
  listeners.add(({ method, params, sessionId: of }) => {
    if (of !== sessionId) return;
    if (method === "Target.attachedToTarget" && params.targetInfo.type === "worker") workers.add(params.sessionId);
    if (method === "Target.detachedFromTarget") workers.delete(params.sessionId);
    if (method === "Runtime.exceptionThrown")
      errors.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === "Log.entryAdded" && params.entry.level === "error")
      errors.push(`${params.entry.text} ${params.entry.url ?? ""}`);
  });
  for (const domain of ["Page", "Runtime", "Log", "DOM", "Performance"]) await call(`${domain}.enable`);
  await call("Target.setAutoAttach", { autoAttach: true, waitForDebuggerOnStart: false, flatten: true });
  await call("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile });
  if (mobile) await call("Emulation.setTouchEmulationEnabled", { enabled: true, maxTouchPoints: 5 });

  async function evaluate(code) {
    const { result, exceptionDetails } = await call("Runtime.evaluate", {
      expression: code,
      awaitPromise: true,
      returnByValue: true,
    });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }
  const mouse = (type, x, y, more = {}) => call("Input.dispatchMouseEvent", { type, x, y, button: "none", ...more });
  return {
    errors,
    evaluate,
    goTo: (url) => call("Page.navigate", { url }),
    async until(code, seconds = 180) {
      for (const end = Date.now() + 1000 * seconds; Date.now() < end; await new Promise((r) => setTimeout(r, 50)))
        if (await evaluate(`Boolean(globalThis.tagridViewer && (${code}))`)) return;
      throw new Error(
        `never true: ${code}; the page says: ${await evaluate("document.body.innerText.slice(0, 400)")} ${errors}`,
      );
    },
    /** Numbers of the page by their names in the protocol. */
    async metrics() {
      const { metrics } = await call("Performance.getMetrics");
      return Object.fromEntries(metrics.map(({ name, value }) => [name, value]));
    },
    /** Bytes of the objects and ArrayBuffers of the page and its workers that are in use. */
    async memory() {
      let total = 0;
      for (const id of [sessionId, ...workers]) {
        for (let i = 0; i < 2; ++i) await send("HeapProfiler.collectGarbage", {}, id);
        const { usedSize, backingStorageSize } = await send("Runtime.getHeapUsage", {}, id);
        total += usedSize + backingStorageSize;
      }
      return total;
    },
    async picture(path) {
      const { data } = await call("Page.captureScreenshot", { format: "png" });
      writeFileSync(path, Buffer.from(data, "base64"));
    },
    async choose(selector, files) {
      const { root } = await call("DOM.getDocument");
      const { nodeId } = await call("DOM.querySelector", { nodeId: root.nodeId, selector });
      await call("DOM.setFileInputFiles", { nodeId, files });
    },
    move: (x, y) => mouse("mouseMoved", x, y),
    async drag(from, to, button = "left") {
      const buttons = { left: 1, right: 2, middle: 4 }[button];
      await mouse("mousePressed", ...from, { button, buttons, clickCount: 1 });
      for (let i = 1; i <= 5; ++i)
        await mouse("mouseMoved", ...from.map((a, axis) => a + ((to[axis] - a) * i) / 5), { button, buttons });
      await mouse("mouseReleased", ...to, { button, clickCount: 1 });
    },
    wheel: (x, y, deltaY, modifiers = 0) => mouse("mouseWheel", x, y, { deltaX: 0, deltaY, modifiers }),
    /** Fingers: "touchStart", "touchMove" or "touchEnd", and where all that are on the screen are then, by their ids. */
    touch: (type, points) =>
      call("Input.dispatchTouchEvent", { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) }),
    async key(key, modifiers = 0) {
      const text = key.length === 1 ? key : undefined;
      await call("Input.dispatchKeyEvent", { type: "keyDown", key, text, modifiers });
      await call("Input.dispatchKeyEvent", { type: "keyUp", key, modifiers });
    },
    /** In front of other pages, which hide it: then it draws nothing. */
    show: () => call("Page.bringToFront"),
    close: () => send("Target.closeTarget", { targetId }),
  };
}
