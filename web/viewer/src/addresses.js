// Addresses of files, and the names that they have for people.

/** The address that a text is, which may be relative to the page. Fails with an Error. */
export function addressOf(text) {
  let url;
  try {
    url = new URL(text, location.href);
  } catch {
    throw new Error(`${text} is not an address`);
  }
  // Other schemes of addresses may run code, or read what only this page may.
  if (!/^https?:$/.test(url.protocol)) throw new Error("an address begins with http:// or https://");
  return url;
}

/** The name of the file at an address. Names that are no UTF-8 stay encoded. */
export function nameIn({ pathname, host }) {
  const name = pathname.split("/").at(-1);
  try {
    return decodeURIComponent(name) || host;
  } catch {
    return name;
  }
}

/** The name of the file at an address that is still a text. */
export function nameOf(text) {
  try {
    return nameIn(addressOf(text));
  } catch {
    return text;
  }
}
