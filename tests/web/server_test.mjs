// A server with delays, errors and lies: the same samples, or the right code.
import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { bytesOf, decoded, folder, golden, made } from "./files.mjs";
import { serve } from "./server.mjs";

const { open, TagridError } = await import(pathToFileURL(join(process.env.TAGRID_DIST, "index.js")));

const path = made("served", [260, 200, 130], "int16", "--max-error", "1", "--overviews", "4,16");
const all = decoded(path);
let server;
before(async () => {
  server = await serve({ made: folder, golden });
});
after(() => server.close());

const code = async (promise) => {
  try {
    (await promise).close?.();
  } catch (error) {
    assert.ok(error instanceof TagridError, String(error.stack));
    return error.code;
  }
  return "none";
};

let cases = 0;
async function opened(query, options = {}) {
  const name = `${++cases}`;
  const volume = await open(server.url(`made/served.tag?case=${name}&${query}`), { workers: 1, retries: 2, ...options });
  return { volume, seen: server.seen(name) };
}

/** The code with which opening or reading ends. */
async function failure(query, options) {
  let volume;
  try {
    ({ volume } = await opened(query, options));
    const samples = await volume.read();
    assert.ok(bytesOf(samples).equals(all), "wrong samples");
    return "none";
  } catch (error) {
    assert.ok(error instanceof TagridError, String(error.stack));
    return error.code;
  } finally {
    volume?.close();
  }
}

test("opening takes two requests, and a slice few more", async () => {
  const { volume, seen } = await opened("");
  assert.equal(seen.requests, 2);
  assert.ok(seen.bytes <= (64 << 10) + (256 << 10));
  await volume.read({ box: { low: [0, 0, 64], high: [260, 200, 65] } });
  assert.ok(seen.requests <= 20, `${seen.requests} requests`);
  assert.ok(seen.ifMatch >= seen.requests - 1, "all requests but the first have If-Match");
  volume.close();
});

test("several ranges at once, as many as are allowed", async () => {
  for (const connections of [1, 3, 8]) {
    const { volume, seen } = await opened("delay=30", { connections });
    assert.ok(bytesOf(await volume.read()).equals(all));
    assert.ok(seen.most <= connections, `${seen.most} at once`);
    if (connections > 1) assert.ok(seen.most > 1);
    volume.close();
  }
});

test("failures that pass", async () => {
  assert.equal(await failure("fail=4", { retries: 5 }), "none");
  assert.equal(await failure("cut=4", { retries: 5 }), "none");
  assert.equal(await failure("weak=1"), "none");
  assert.equal(await failure("tags=no"), "none");
});

test("failures that stay", async () => {
  assert.equal(await failure("fail=1", { retries: 1 }), "io-error");
  assert.equal(await failure("cut=1", { retries: 1 }), "io-error");
  assert.equal(await failure("status=404"), "io-error");
  assert.equal(await failure("status=403"), "io-error");
  assert.equal(await failure("shift=1"), "io-error");
  assert.equal(await failure("hang=1", { retries: 0, timeout: 200 }), "io-error");
  assert.equal(await failure("ranges=no"), "no-ranges");
  assert.equal(await code(open("http://127.0.0.1:9/none.tag", { retries: 0 })), "io-error");
  const error = await open(server.url("made/none.tag")).catch((e) => e);
  assert.equal(error.status, 404);
});

test("a file that changes", async () => {
  for (const tags of ["", "&weak=1"]) {
    for (const change of [2, 3, 4]) assert.equal(await failure(`change=${change}${tags}`), "changed");
    assert.equal(await failure(`change=3${tags}`, { ifMatch: false }), "changed");
  }
});

test("a server that lies about the size", async () => {
  for (const size of [1, 100, 70000, 2 ** 32 + 10, 2 ** 45])
    assert.ok(["broken-input", "io-error", "changed"].includes(await failure(`size=${size}`)), `${size}`);
  assert.equal(await failure("size=99999999999999999999"), "io-error", "no safe integer");
});

test("not a .tag file", async () => {
  const text = await code(open(server.url("golden/second_decoder.json")));
  assert.equal(text, "broken-input");
});

test("an aborted read ends its requests", async () => {
  const { volume, seen } = await opened("delay=100", { connections: 2 });
  const controller = new AbortController();
  const reading = volume.read({ signal: controller.signal });
  await new Promise((resolve) => setTimeout(resolve, 150));
  controller.abort();
  await assert.rejects(reading, { name: "AbortError" });
  const { requests } = seen;
  await new Promise((resolve) => setTimeout(resolve, 300));
  assert.ok(seen.requests <= requests + 1);
  volume.close();
});

test("golden files by URL", async () => {
  for (const file of ["volumes_bounded_int16.tag", "parity_bounded_int16.tag", "pages_lossless_uint8.tag"]) {
    const volume = await open(server.url(`golden/${file}`), { workers: 1 });
    assert.ok(bytesOf(await volume.read()).equals(decoded(join(golden, file), ...(volume.volumes > 1 ? ["--volume", "0"] : []))));
    volume.close();
  }
});
