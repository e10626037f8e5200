#!/usr/bin/env python3
"""Checks that all links in a folder of HTML pages lead somewhere: check_links.py FOLDER

Every href and src without a scheme must be a file in the folder, and every #anchor an id of its page. Nothing may be
loaded from elsewhere, and links to pages must name files, because pages are also opened without a server.
"""

import functools
import pathlib
import sys
from html.parser import HTMLParser
from urllib.parse import unquote, urlsplit

LOADED = {("script", "src"), ("img", "src"), ("link", "href"), ("iframe", "src"), ("source", "src"), ("video", "src"),
          ("object", "data")}


class Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.anchors, self.links = set(), []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name == "id" or (tag, name) == ("a", "name"):
                self.anchors.add(value)
            elif name in ("href", "src", "data") and value is not None:
                self.links.append((tag, name, value))


@functools.cache
def page(path):
    return Page(path.read_text())


def fault_of(path, folder, tag, attribute, link):
    """What is wrong with a link in the page `path`, or None."""
    parts = urlsplit(link)
    if parts.scheme == "data":
        return None
    if parts.scheme or parts.netloc:
        return "is loaded from elsewhere" if (tag, attribute) in LOADED else None
    target = path.parent / unquote(parts.path) if parts.path else path
    if not target.resolve().is_relative_to(folder):
        return "leads out of the site"
    if not target.is_file():
        return "is not a file"
    if parts.fragment and target.suffix == ".html" and unquote(parts.fragment) not in page(target.resolve()).anchors:
        return "has no such anchor"
    return None


def faults(folder):
    """The broken links of all pages below `folder`, and the number of links."""
    folder, found, count = folder.resolve(), [], 0
    for path in sorted(folder.rglob("*.html")):
        for tag, attribute, link in page(path).links:
            count += 1
            if fault := fault_of(path, folder, tag, attribute, link):
                found.append(f"{path.relative_to(folder)}: {link} {fault}")
    return found, count


if __name__ == "__main__":
    broken, links = faults(pathlib.Path(sys.argv[1]))
    print("\n".join(dict.fromkeys(broken)), file=sys.stderr, end="\n" if broken else "")
    print(f"{links} links, {len(broken)} broken")
    sys.exit(1 if broken or not links else 0)
