// Addresses in messages and errors, without their secrets.
import { isNode } from "./platform.js";

/**
 * An address for a message: without the name and the password of a user, and without what follows a question mark or a
 * hash, which is often a signature. It need not be a right address.
 */
export function shownAddress(given) {
  const [, scheme, rest] = /^((?:[a-z][a-z0-9+.-]*:)?\/\/)?(.*)$/is.exec(String(given));
  if (/^(data|blob|javascript):/i.test(rest)) return `${rest.slice(0, rest.indexOf(":"))}:…`;
  if (scheme === undefined) return rest.replace(/[?#].*$/s, "");
  // A password that contains one of these characters seems to end there, but the rest must not be shown either.
  const host = rest.replace(/[/?#].*$/s, "");
  const hasPort = /(^[^:]*|:\d*|\])$/.test(host.slice(host.lastIndexOf("@") + 1));
  const at = hasPort || host.includes("@") ? host.lastIndexOf("@") : rest.lastIndexOf("@");
  return scheme + rest.slice(at + 1).replace(/[?#].*$/s, "");
}

/** The parts of an address, and of the headers of requests, that no message may contain; longer ones first. */
function secretsOf(url, headers) {
  const parts = [url.href, url.search, url.hash, url.username, url.password, ...[...url.searchParams.values()].filter(isLong)];
  for (const value of headersOf(headers)) parts.push(value, ...value.split(/\s+/).filter(isLong));
  const decoded = parts.map((part) => {
    try {
      return decodeURIComponent(part);
    } catch {
      return part;
    }
  });
  return [...new Set([...parts, ...decoded])].filter((part) => part.length > 1).sort((a, b) => b.length - a.length);
}

// Shorter ones may be ordinary words of a message.
const isLong = (text) => text.length >= 8;

function headersOf(headers) {
  try {
    return [...new Headers(headers ?? {}).values()];
  } catch {
    return Object.values(headers ?? {}).map(String);
  }
}

/**
 * A function of errors of a request: the same error without secrets, as a new one that has its name, message, code and
 * causes and nothing else, because others, such as `input` of Node.js, may have the whole address.
 */
export function withoutSecrets(url, headers) {
  const secrets = secretsOf(url, headers);
  const shown = shownAddress(url.href);
  const hidden = (text) => secrets.reduce((rest, secret) => rest.replaceAll(secret, secret === url.href ? shown : "…"), String(text));
  const cleaned = (error, depth = 0) => {
    if (!(error instanceof Error) && !(typeof error === "object" && error !== null && "message" in error))
      return new Error(hidden(error));
    const more = error.cause !== undefined && depth < 4 ? { cause: cleaned(error.cause, depth + 1) } : undefined;
    const other = new Error(hidden(error.message), more);
    other.name = hidden(error.name ?? "Error");
    if (error.code !== undefined) other.code = typeof error.code === "number" ? error.code : hidden(error.code);
    return other;
  };
  return cleaned;
}

/** What an error says, with what caused it: "fetch failed: connect ECONNREFUSED 127.0.0.1:80". */
export function wordsOf(error) {
  const words = [];
  for (let one = error, depth = 0; one && depth < 5; one = one.cause, ++depth)
    // If several attempts failed, such as with IPv4 and IPv6, only the code is reported.
    words.push(one.message || one.code || one.name);
  return words.filter(Boolean).filter((word, i) => !words.slice(0, i).some((before) => before?.includes?.(word))).join(": ");
}

/** The likely cause of an error of fetch(). Browsers do not reveal it, so that pages cannot explore a network. */
export function perhaps(url, error) {
  const page = globalThis.location;
  if (isNode || !page || !(error instanceof TypeError) || url.origin === page.origin || url.protocol === "blob:") return "";
  if (page.protocol === "https:" && url.protocol === "http:" && !/^(localhost|127\.|\[::1\])/.test(url.hostname))
    return "; a page of https: may not read http:";
  return `; the server was not reached, or does not allow pages of ${page.origin} to read it (CORS)`;
}
