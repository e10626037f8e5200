// A server of files with ranges, that misbehaves as the query of a request says:
//   delay=MS            answers later                     hang=1       never answers
//   fail=N              every Nth request fails with 503  status=S     always answers S
//   cut=N               every Nth answer ends in the middle
//   ranges=no           ignores ranges                    shift=1      sends another range than asked for
//   change=N            from the Nth request on, it is another file, with another tag
//   tags=no             no entity tags and times          weak=1       a weak tag
//   size=N              claims that many bytes            expose=no    does not expose Content-Range to other origins
// Each value of `case` has its own count of requests.
import { createHash } from "node:crypto";
import { createReadStream } from "node:fs";
import { stat } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";

const kinds = { ".js": "text/javascript", ".mjs": "text/javascript", ".html": "text/html", ".wasm": "application/wasm",
  ".css": "text/css" };

export async function serve(folders, handlers = {}) {
  const cases = new Map();
  const seen = (name) => {
    if (!cases.has(name)) cases.set(name, { requests: 0, now: 0, most: 0, bytes: 0, ifMatch: 0 });
    return cases.get(name);
  };
  const server = createServer(async (request, response) => {
    const url = new URL(request.url, "http://server");
    const query = url.searchParams;
    const handler = handlers[url.pathname];
    if (handler) return handler(request, response);
    response.setHeader("Access-Control-Allow-Origin", "*");
    response.setHeader("Access-Control-Expose-Headers", query.get("expose") === "no" ? "ETag" : "Content-Range, ETag");
    const count = seen(query.get("case") ?? url.pathname);
    const number = ++count.requests;
    count.most = Math.max(count.most, ++count.now);
    response.on("close", () => --count.now);
    if (request.headers["if-match"]) ++count.ifMatch;
    try {
      await answer(request, response, url, number, count);
    } catch (error) {
      response.writeHead(error.code === "ENOENT" ? 404 : 500).end(error.message);
    }
  });

  async function answer(request, response, { pathname, searchParams: query }, number, count) {
    const [, first, ...rest] = pathname.split("/");
    if (!(first in folders)) return response.writeHead(404).end();
    if (query.has("hang")) return;
    if (query.has("delay")) await new Promise((resolve) => setTimeout(resolve, Number(query.get("delay"))));
    if (query.has("status")) return response.writeHead(Number(query.get("status"))).end("no");
    if (query.has("fail") && number % Number(query.get("fail")) === 0) return response.writeHead(503).end("busy");
    const path = join(folders[first], normalize(rest.join("/")));
    const { size: real, mtimeMs } = await stat(path);
    const size = Number(query.get("size") ?? real);
    const changed = query.has("change") && number >= Number(query.get("change"));
    const etag = `"${createHash("md5").update(`${path} ${mtimeMs} ${changed}`).digest("hex")}"`;
    if (query.get("tags") !== "no") {
      response.setHeader("ETag", query.has("weak") ? `W/${etag}` : etag);
      response.setHeader("Last-Modified", new Date(mtimeMs + (changed ? 1e6 : 0)).toUTCString());
    }
    response.setHeader("Content-Type", kinds[extname(path)] ?? "application/octet-stream");
    const wanted = request.headers["if-match"];
    if (wanted && wanted !== etag) return response.writeHead(412).end();
    const range = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range ?? "");
    if (!range || query.get("ranges") === "no") {
      response.writeHead(200, { "Content-Length": real });
      return createReadStream(path).pipe(response);
    }
    let [from, to] = [Number(range[1]), Math.min(range[2] ? Number(range[2]) : size - 1, size - 1)];
    if (query.has("shift")) [from, to] = [from + 1, to + 1];
    if (from >= size) return response.writeHead(416, { "Content-Range": `bytes */${size}` }).end();
    const length = to - from + 1;
    count.bytes += length;
    response.writeHead(206, { "Content-Range": `bytes ${from}-${to}/${size}`, "Content-Length": length });
    if (query.has("cut") && number % Number(query.get("cut")) === 0) {
      response.write(Buffer.alloc(Math.floor(length / 2)));
      return setTimeout(() => response.destroy(), 20);
    }
    if (from >= real) return response.end(Buffer.alloc(length));
    createReadStream(path, { start: from, end: Math.min(to, real - 1) }).pipe(response);
  }

  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const { port } = server.address();
  return {
    port,
    url: (path) => `http://127.0.0.1:${port}/${path}`,
    seen,
    close: () => {
      server.closeAllConnections?.();
      server.close();
    },
  };
}
