// Where the bytes of a file come from: a URL, a Blob, or an object of the caller.
import { perhaps, shownAddress, withoutSecrets, wordsOf } from "./addresses.js";
import { TagridError, require, unlessAborted } from "./errors.js";
import { isNode } from "./platform.js";

const firstBytes = 1 << 16;
// The end of a file has the index and, mostly, its coarsest overview: of small files less, of large ones more.
const lastBytes = (size) => Math.min(Math.max(size / 256, 256 << 10), 768 << 10);

/** Opens a source: `size`, and `read(offset, length, signal)`, which gives all of the bytes or fails. */
export async function openSource(given, options) {
  if (given instanceof Blob) return new CheckedSource(new BlobSource(given));
  if (typeof given === "string" || given instanceof URL) {
    const source = new UrlSource(urlOf(given), options);
    await source.open(options.signal);
    return source;
  }
  require(typeof given?.read === "function" && Number.isSafeInteger(given.size) && given.size >= 0,
    "a source is a URL, a Blob, or an object with a size and read()");
  return new CheckedSource(given);
}

function urlOf(given) {
  const shown = shownAddress(given);
  let url;
  try {
    url = new URL(given, globalThis.location?.href);
  } catch {
    throw new TagridError("invalid-argument", `${shown} is not a URL; ${insteadOfFiles}`);
  }
  if (!["http:", "https:", "blob:", "data:"].includes(url.protocol))
    throw new TagridError("invalid-argument", `${shown}: addresses begin with http: or https:, not with ${url.protocol}; ${insteadOfFiles}`);
  // fetch() does not send them, and its error would show them.
  if (url.username || url.password)
    throw new TagridError("invalid-argument", `${shownAddress(url.href)}: an address must not contain a user name or a password; ` +
      "pass the headers { Authorization: ... } to open()");
  return url;
}

const insteadOfFiles = isNode
  ? "for a file on this machine, pass the Blob of fs.openAsBlob() to open()"
  : "for a file on this machine, pass a File to open(), as from <input type=file>";

class BlobSource {
  #blob;
  constructor(blob) {
    this.#blob = blob;
    this.size = blob.size;
  }
  read(offset, length) {
    return this.#blob.slice(offset, offset + length).arrayBuffer();
  }
}

class CheckedSource {
  #source;
  constructor(source) {
    this.#source = source;
    this.size = source.size;
  }
  async read(offset, length, signal) {
    signal?.throwIfAborted();
    let bytes;
    try {
      bytes = await unlessAborted(Promise.resolve(this.#source.read(offset, length, signal)), signal);
    } catch (cause) {
      if (signal?.aborted || cause instanceof TagridError) throw cause;
      throw new TagridError("io-error", `cannot read ${length} bytes from byte ${offset} on: ${cause?.message ?? cause}`, { cause });
    }
    if (bytes instanceof ArrayBuffer) bytes = new Uint8Array(bytes);
    if (!(bytes instanceof Uint8Array) || bytes.length !== length)
      throw new TagridError("io-error", `the source gave ${bytes?.length} bytes in place of ${length} from byte ${offset} on`);
    return bytes;
  }
}

// A failure that may pass.
class Passing extends Error {}

class UrlSource {
  #url;
  #options;
  #kept = [];
  #first; // what the first answer said of the file
  #shared = { atOnce: 0, bytes: 0 }; // of the requests that share the connection: how many, and what they received
  #cleaned;
  size;

  constructor(url, options) {
    this.#url = url;
    this.#options = { retries: 3, timeout: 30000, fetch: globalThis.fetch, ...dropUndefined(options) };
    this.#cleaned = withoutSecrets(url, this.#options.headers);
    this.#options.ifMatch ??= isNode || url.origin === globalThis.location?.origin;
  }

  #fail(code, what, extra) {
    return new TagridError(code, `${shownAddress(this.#url.href)}: ${what}`, extra);
  }

  async open(signal) {
    if (this.#options.size !== undefined) {
      this.size = this.#options.size;
      if (this.size === 0) return;
    }
    this.#keep(0, await this.#range(0, Math.min(firstBytes, this.size ?? firstBytes), signal));
    const offset = Math.max(this.size - Math.floor(lastBytes(this.size)), firstBytes);
    if (offset < this.size) this.#keep(offset, await this.#range(offset, this.size - offset, signal));
  }

  #keep(offset, bytes) {
    this.#kept.push({ offset, bytes });
  }

  async read(offset, length, signal) {
    return within(this.#kept, offset, length) ?? this.#range(offset, length, signal);
  }

  async #range(offset, length, signal) {
    for (let attempt = 0; ; ++attempt) {
      signal?.throwIfAborted();
      try {
        return await this.#request(offset, length, signal);
      } catch (error) {
        if (signal?.aborted) throw signal.reason;
        if (!(error instanceof Passing)) throw error;
        if (attempt >= this.#options.retries)
          throw this.#fail("io-error", `${error.message} (tried ${attempt + 1} times)`, { cause: error.cause, status: error.status });
        await pause(200 * 2 ** attempt, signal);
      }
    }
  }

  async #request(offset, length, signal) {
    const { fetch, headers, credentials, ifMatch, timeout } = this.#options;
    const sent = { ...headers, Range: `bytes=${offset}-${offset + length - 1}` };
    const etag = this.#first?.etag;
    if (ifMatch && etag && !etag.startsWith("W/")) sent["If-Match"] = etag;
    const watch = new Watch(timeout, signal, this.#shared);
    ++this.#shared.atOnce;
    try {
      // The caches of browsers let only one request for an address pass at a time.
      const response = await fetch(this.#url, { headers: sent, credentials, cache: "no-store", signal: watch.signal });
      if (!this.#accepts(response, offset, length)) return new Uint8Array(0);
      const bytes = await read(response, length, watch);
      if (bytes.length === length) return bytes;
      // Only of the first request, the size of the file is not known.
      if (offset + bytes.length === this.size && bytes.length < length) return bytes;
      throw new Passing(`the server sent ${bytes.length} bytes in place of ${length} from byte ${offset} on`);
    } catch (error) {
      if (error instanceof TagridError || error instanceof Passing || signal?.aborted) throw error;
      if (watch.isLate) throw new Passing(watch.inWords());
      const cause = this.#cleaned(error);
      throw new Passing(`the request failed: ${wordsOf(cause)}${perhaps(this.#url, error)}`, { cause });
    } finally {
      --this.#shared.atOnce;
      watch.end();
    }
  }

  /** Throws unless the answer has the bytes; false if the file is empty. */
  #accepts(response, offset, length) {
    const { status } = response;
    const drop = (error) => {
      response.body?.cancel().catch(() => {});
      return error;
    };
    if ([408, 425, 429, 500, 502, 503, 504].includes(status))
      throw drop(Object.assign(new Passing(`the server answered ${status}`), { status }));
    if (status === 412) throw drop(this.#fail("changed", "the file changed while it was open", { status }));
    if (status === 200)
      throw drop(this.#fail("no-ranges", "the server ignores ranges: it sends the whole file, or a page in its place", { status }));
    const range = /^bytes (?:(\d+)-(\d+)|\*)\/(\d+)$/.exec(response.headers.get("Content-Range") ?? "");
    if (status === 416 && this.#first) throw drop(this.#fail("changed", "the file became shorter while it was open", { status }));
    if (status === 416 && range?.[3] === "0") {
      this.size = 0;
      drop();
      return false;
    }
    if (status !== 206) throw drop(this.#fail("io-error", `the server answered ${status}`, { status }));
    const now = { etag: response.headers.get("ETag"), modified: response.headers.get("Last-Modified") };
    if (this.#first) {
      for (const key of ["etag", "modified"])
        if (now[key] !== null && this.#first[key] !== null && now[key] !== this.#first[key])
          throw drop(this.#fail("changed", "the file changed while it was open"));
    } else {
      if (range && !Number.isSafeInteger(Number(range[3])))
        throw drop(this.#fail("io-error", `the server says that the file has ${range[3]} bytes, which is too many`));
      this.size ??= range ? Number(range[3]) : undefined;
      if (this.size === undefined)
        throw drop(this.#fail("no-size", "the server does not say how large the file is; it must expose Content-Range, or " +
          "open() must be given the size"));
      this.#first = now;
    }
    if (range && Number(range[3]) !== this.size) throw drop(this.#fail("changed", "the size of the file changed while it was open"));
    if (range && (Number(range[1]) !== offset || Number(range[2]) !== Math.min(offset + length, this.size) - 1))
      throw drop(this.#fail("io-error", `the server sent the range ${range[0]} in place of ${length} bytes from byte ${offset} on`));
    return true;
  }
}

/** A range, if one of the pieces { offset, bytes } has it. */
export function within(pieces, offset, length) {
  const piece = pieces.find((p) => p.offset <= offset && offset + length <= p.offset + p.bytes.length);
  return piece && piece.bytes.subarray(offset - piece.offset, offset - piece.offset + length);
}

// The bytes per second that a server must send, on average over `timeout`. A longer timeout than usual lowers this rate.
const leastRate = 4096;
const usualTimeout = 30000;

/**
 * Ends a request if the caller aborts it, or if the server does not begin to send the file in time, or sends it too
 * slowly. A limit on silence alone would not be enough, because a server that sends a byte now and then is never silent.
 * A request without an answer is not late while others receive the file: browsers send only some requests at a time.
 */
class Watch {
  #controller = new AbortController();
  #timer;
  #outer;
  #stop;
  #shared;
  #before; // what all requests had received when the present time began
  #bytes = 0; // that arrived in the present time
  #mostAtOnce = 1; // meanwhile
  #hasBegun = false;
  isLate = false;

  constructor(timeout, outer, shared) {
    this.timeout = timeout;
    this.#outer = outer;
    this.#shared = shared;
    this.#stop = () => this.#controller.abort(outer.reason);
    outer?.addEventListener("abort", this.#stop, { once: true });
    this.#wait();
  }
  get signal() {
    return this.#controller.signal;
  }
  get #least() {
    return (leastRate * Math.min(this.timeout, usualTimeout)) / 1000;
  }
  took(bytes) {
    this.#bytes += bytes;
    this.#shared.bytes += bytes;
    this.#mostAtOnce = Math.max(this.#mostAtOnce, this.#shared.atOnce);
    if (this.#hasBegun || bytes === 0) return;
    this.#hasBegun = true;
    this.#wait();
  }
  #wait() {
    clearTimeout(this.#timer);
    this.#before = this.#shared.bytes;
    this.#timer = setTimeout(() => {
      if (!this.#hasBegun && this.#shared.bytes > this.#before) return this.#wait();
      if (this.#hasBegun && this.#bytes >= this.#least / this.#mostAtOnce) {
        this.#bytes = 0;
        this.#mostAtOnce = 1;
        return this.#wait();
      }
      this.isLate = true;
      this.#controller.abort(new Error("timeout"));
    }, this.timeout);
  }
  inWords() {
    if (!this.#hasBegun) return `the server sent nothing of the file for ${this.timeout} ms`;
    const rate = Math.round((1000 * this.#least) / this.timeout);
    return `the server sends less than ${rate} bytes per second; to wait longer, set \`timeout\` to more than ${Math.max(this.timeout, usualTimeout)} ms`;
  }
  end() {
    clearTimeout(this.#timer);
    this.#outer?.removeEventListener("abort", this.#stop);
  }
}

/** The bytes of an answer, no more than `length`. */
async function read(response, length, watch) {
  const bytes = new Uint8Array(length);
  let done = 0;
  const reader = response.body.getReader();
  for (;;) {
    const part = await reader.read();
    if (part.done) return done === length ? bytes : bytes.subarray(0, done);
    if (part.value.length > length - done) {
      reader.cancel().catch(() => {});
      throw new Passing(`the server sent more than ${length} bytes`);
    }
    bytes.set(part.value, done);
    done += part.value.length;
    watch.took(part.value.length);
  }
}

function pause(ms, signal) {
  return unlessAborted(new Promise((resolve) => setTimeout(resolve, ms)), signal);
}

function dropUndefined(options) {
  return Object.fromEntries(Object.entries(options).filter(([, value]) => value !== undefined));
}
