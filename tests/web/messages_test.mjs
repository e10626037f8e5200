// What errors of the decoder say of addresses: where something is wrong and why, and nothing that is secret. It needs no
// WebAssembly: sources and files are opened as the package is in the source directory.
import assert from "node:assert/strict";
import { createServer } from "node:http";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { inspect } from "node:util";

const sources = join(dirname(fileURLToPath(import.meta.url)), "..", "..", "web", "decoder", "src");
const from = (name) => import(pathToFileURL(join(sources, name)));
const [{ openSource }, { shownAddress }, { compile, baseOf }, { Pool }, { TagridError }] = await Promise.all(
  ["source.js", "addresses.js", "files.js", "pool.js", "errors.js"].map(from),
);

// What each path of the server does with a request.
const answers = {
  "/forbidden": (_, response) => response.writeHead(403).end("no"),
  "/busy": (_, response) => response.writeHead(503).end("no"),
  "/all": (_, response) => response.writeHead(200).end("all of it"),
  "/cut": (_, response) => {
    response.writeHead(206, { "Content-Range": "bytes 0-65535/70000", "Content-Length": 65536 }).write("x");
    setTimeout(() => response.destroy(), 20);
  },
  "/moved": (_, response) => response.writeHead(302, { Location: "http://127.0.0.1:9/SECRETPLACE?sig=SECRETSIG" }).end(),
  "/loop": (request, response) => response.writeHead(302, { Location: request.url }).end(),
  "/page.wasm": (_, response) => response.writeHead(200, { "Content-Type": "text/html" }).end("<html>"),
};
const trickle = (response, bytes, ms) => {
  const timer = setInterval(() => response.write(Buffer.alloc(bytes)), ms);
  response.on("close", () => clearInterval(timer));
};
answers["/trickle"] = (_, response) => {
  response.writeHead(206, { "Content-Range": "bytes 0-65535/70000", "Content-Length": 65536 });
  trickle(response, 10, 50);
};
answers["/late-trickle"] = (_, response) => {
  response.writeHead(206, { "Content-Range": "bytes 0-65535/70000", "Content-Length": 65536 }).write(Buffer.alloc(40000));
  trickle(response, 10, 50);
};
answers["/slow"] = (request, response) => {
  const [, first, last] = /(\d+)-(\d+)/.exec(request.headers.range).map(Number);
  const length = Math.min(last, 69999) - first + 1;
  response.writeHead(206, { "Content-Range": `bytes ${first}-${first + length - 1}/70000`, "Content-Length": length });
  let left = length;
  const timer = setInterval(() => {
    const bytes = Math.min(left, 3277);
    left -= bytes;
    response.write(Buffer.alloc(bytes));
    if (left === 0) clearInterval(timer), response.end();
  }, 100);
};

let server, root, nobody;
before(async () => {
  server = createServer((request, response) => (answers[new URL(request.url, "http://x").pathname] ?? ((_, r) => r.writeHead(404).end()))(request, response));
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  root = `http://127.0.0.1:${server.address().port}`;
  // A port at which nobody listens.
  const other = createServer();
  await new Promise((resolve) => other.listen(0, "127.0.0.1", resolve));
  nobody = `http://127.0.0.1:${other.address().port}`;
  await new Promise((resolve) => other.close(resolve));
});
after(() => {
  server.closeAllConnections();
  server.close();
});

async function failureOf(promise) {
  try {
    await promise;
  } catch (error) {
    assert.ok(error instanceof TagridError, String(error.stack));
    return error;
  }
  return assert.fail("it did not fail");
}
/** All that an error shows when it is logged: message, stack, causes and properties, also hidden ones. */
const all = (error) => inspect(error, { depth: 20, showHidden: true });

test("addresses are shown without what is secret", () => {
  for (const [given, shown] of [
    ["https://host/a.tag", "https://host/a.tag"],
    ["HTTPS://host:8080/a%20b.tag", "HTTPS://host:8080/a%20b.tag"],
    ["https://user:secret@host/a.tag", "https://host/a.tag"],
    ["https://user:s@cret@host/a.tag", "https://host/a.tag"],
    ["https://user@host/a@b.tag", "https://host/a@b.tag"],
    ["https://host/a@b.tag", "https://host/a@b.tag"],
    ["https://host:80/a@b.tag", "https://host:80/a@b.tag"],
    ["https://user:se/cret@host/a.tag", "https://host/a.tag"],
    ["https://host/a.tag?X-Amz-Signature=abc", "https://host/a.tag"],
    ["https://host?key=abc", "https://host"],
    ["https://user:a?b@host/x", "https://host/x"],
    ["https://host:80/a?mail=a@b", "https://host:80/a"],
    ["https://[::1]:80/a", "https://[::1]:80/a"],
    ["https://[::1]/a@b", "https://[::1]/a@b"],
    ["https://[::1]:8/a@b", "https://[::1]:8/a@b"],
    ["https://host/a.tag#part", "https://host/a.tag"],
    ["//user:pw@host/a?b", "//host/a"],
    ["/scans/a.tag?token=abc", "/scans/a.tag"],
    ["a.tag#token", "a.tag"],
    ["data:text/plain,secret", "data:…"],
  ])
    assert.equal(shownAddress(given), shown);
});

test("no part of an error has a signature, a password or a header", async () => {
  const query = "?X-Amz-Credential=SECRETKEY%2F20261129&X-Amz-Signature=SECRETSIG#SECRETHASH";
  const options = { retries: 0, timeout: 300, headers: { Authorization: "Bearer SECRETTOKEN" } };
  const throwing = (make) => async (url) => {
    throw make(String(url));
  };
  const failures = [
    ...["/forbidden", "/busy", "/all", "/cut", "/moved", "/loop", "/trickle", "/none"].map((path) => [root + path + query, options]),
    [`${nobody}/x.tag${query}`, options],
    [`http://SECRETUSER:SECRETPW@127.0.0.1:9/x.tag`, options],
    ["http://SECRETUSER:SECRETPW@a:b:c/x.tag?SECRETSIG", options],
    [`http://a b/?${query}`, options],
    [`ftp://SECRETUSER:SECRETPW@host/x.tag?SECRETSIG`, options],
    [`file:///x.tag?SECRETSIG`, options],
    [root + "/forbidden" + query, { ...options, headers: { Authorization: "Bearer SECRETTOKEN\n\u0000" } }],
    // What a caller's own fetch() throws.
    [root + "/x" + query, { ...options, fetch: throwing((url) => new TypeError(`cannot load ${url}`)) }],
    [root + "/x" + query, { ...options, fetch: throwing((url) => Object.assign(new Error("no", { cause: new Error(url) }), { url, input: url, config: { headers: "SECRETTOKEN" } })) }],
    [root + "/x" + query, { ...options, fetch: throwing((url) => `plain text ${url}`) }],
    [root + "/x" + query, { ...options, fetch: throwing((url) => new Error(`signature ${decodeURIComponent(new URL(url).search)}`)) }],
  ];
  for (const [url, more] of failures) {
    const error = await failureOf(openSource(url, more));
    assert.doesNotMatch(all(error), /SECRET/, url);
    assert.doesNotMatch(JSON.stringify({ ...error, message: error.message, cause: { ...error.cause } }), /SECRET/);
  }
});

test("errors say where and why", async () => {
  const options = { retries: 0, timeout: 300 };
  for (const [url, code, words] of [
    [nobody + "/x.tag?s", "io-error", /^http:\/\/127\.0\.0\.1:\d+\/x\.tag: the request failed: .*ECONNREFUSED/],
    [root + "/forbidden?s", "io-error", /\/forbidden: the server answered 403/],
    [root + "/all", "no-ranges", /\/all: the server ignores ranges/],
    [root + "/cut", "io-error", /\/cut: the request failed: .+/],
    ["file:///home/x.tag", "invalid-argument", /^file:\/\/\/home\/x\.tag: addresses begin with http: or https:, not with file:.*openAsBlob/],
    ["s3://bucket/x.tag", "invalid-argument", /http: or https:, not with s3:/],
    ["x.tag", "invalid-argument", /^x\.tag is not a URL/],
    ["http://user:pw@host/x.tag", "invalid-argument", /^http:\/\/host\/x\.tag: .*must not contain a user name or a password.*Authorization/],
  ]) {
    const error = await failureOf(openSource(url, options));
    assert.equal(error.code, code, url);
    assert.match(error.message, words);
  }
});

test("a server that trickles is given up, and a slow one is not", async () => {
  for (const path of ["/trickle", "/late-trickle"]) {
    const begin = Date.now();
    const error = await failureOf(openSource(root + path, { retries: 0, timeout: 300 }));
    assert.equal(error.code, "io-error");
    assert.match(error.message, /less than 4096 bytes per second; to wait longer, set `timeout` to more than 30000 ms/);
    assert.ok(Date.now() - begin < 2000);
  }
  // 32 KiB a second.
  assert.equal((await openSource(root + "/slow", { retries: 0, timeout: 300 })).size, 70000);
});

// Browsers let some requests to a server pass at a time; the other ones wait in the browser.
test("a request that waits for others is not given up, unless the server is silent for all", async () => {
  let turn = Promise.resolve();
  const oneAtATime = (url, init) => {
    const answered = turn.then(async () => {
      const response = await fetch(url, init);
      return new Response(await response.arrayBuffer(), response);
    });
    turn = answered.catch(() => {});
    return answered;
  };
  let isSilent = false;
  answers["/turns"] = (request, response) => {
    const [first, last] = /(\d+)-(\d+)/.exec(request.headers.range).slice(1).map(Number);
    const answer = () => response.writeHead(206, { "Content-Range": `bytes ${first}-${last}/1000000` }).end(Buffer.alloc(last - first + 1, 7));
    if (!isSilent) setTimeout(answer, last - first + 1 === 5000 ? 250 : 0);
  };
  const source = await openSource(root + "/turns", { retries: 0, timeout: 400, fetch: oneAtATime });
  const readAll = () => Promise.allSettled([0, 1, 2, 3].map((i) => source.read(100000 + 5000 * i, 5000)));
  // The last one begins after 750 ms.
  for (const { value, reason } of await readAll()) assert.deepEqual(value, new Uint8Array(5000).fill(7), reason);
  isSilent = true;
  const begin = Date.now();
  for (const { reason } of await readAll()) assert.match(reason.message, /the server sent nothing of the file for 400 ms/);
  assert.ok(Date.now() - begin < 2000);
});

test("files of the package that cannot be loaded: what, where and what to do", async () => {
  const load = (base) => failureOf(compile("page", baseOf(base), false));
  for (const [base, words] of [
    [`${root}/none/?sig=SECRET`, /cannot load http:.*\/none\/page_scalar\.wasm: the server answered 404; base, http:[^ ]*\/none\/, must be the folder/],
    [nobody + "/?SECRET", /page_scalar\.wasm: .*ECONNREFUSED.*; base,/],
    ["file:///none/", /cannot load file:\/\/\/none\/page_scalar\.wasm: ENOENT.*; base, file:\/\/\/none\/, must/],
  ]) {
    const error = await load(base);
    assert.equal(error.code, "not-supported");
    assert.match(error.message, words);
    assert.doesNotMatch(all(error), /SECRET/);
  }
  answers["/page_scalar.wasm"] = answers["/page.wasm"];
  assert.match((await load(root)).message, /it is not WebAssembly \(the server says text\/html\); base/);
  assert.throws(() => baseOf("http://user:SECRET@a:b/"), (e) => e.code === "invalid-argument" && !/SECRET/.test(all(e)));

  // A worker that is not there, for the read that waits and for the next one.
  const pool = new Pool(undefined, baseOf("file:///none/"), 1);
  for (let i = 0; i < 2; ++i) {
    const error = await failureOf(pool.run({ stream: 0, kind: "decode", brick: {} }, () => true));
    assert.equal(error.code, "not-supported");
    assert.match(error.message, /cannot load file:\/\/\/none\/worker\.js: .*; base, file:\/\/\/none\/, must be the folder/);
  }
  pool.close();
});
