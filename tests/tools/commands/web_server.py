"""A server of files on this machine for tests: it answers as servers should, or misbehaves as told, and counts.

All that it does wrong is a function of `WebServer.misbehave`, which may answer a request itself.
"""

import hashlib
import re
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def setup(self):
        super().setup()
        self.server.connections += 1

    def do_GET(self):
        with self.server.lock:
            self.server.requests.append((self.path, dict(self.headers)))
            number = len(self.server.requests)
        try:
            if not self.server.misbehave(self, number):
                self.answer()
        except (BrokenPipeError, ConnectionResetError):
            self.close_connection = True

    def do_HEAD(self):
        content = self.content()
        self.send_response(404 if content is None else 200)
        self.send_header("Content-Length", str(len(content or b"")))
        self.send_header("Accept-Ranges", "bytes")
        self.end_headers()

    def respond(self, status, headers=(), body=b"", length=None):
        """All of an answer. `length`: what is announced, if not the length of the body."""
        self.send_response(status)
        for name, value in dict(headers).items():
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(body) if length is None else length))
        self.end_headers()
        self.wfile.write(body)
        if length is not None:
            self.close_connection = True

    def content(self):
        return self.server.files.get(self.path, self.server.files.get(self.path.split("?")[0]))

    def wanted(self):
        """The range of the request: first byte and the byte after the last one."""
        found = re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range", ""))
        size = len(self.content())
        return (int(found[1]), min(int(found[2] or size - 1) + 1, size)) if found else None

    def version(self, content):
        return {"ETag": '"' + hashlib.md5(content).hexdigest() + '"', "Last-Modified": "Wed, 25 Nov 2026 10:00:00 GMT"}

    def answer(self, status=206, start=0, size=None, body=None, length=None, version=None, conditions=True, **headers):
        """The right answer, but for what is given: `start` moves its Content-Range, which says `size` of the file."""
        content = self.content()
        if content is None:
            return self.respond(404, {}, b"<html>nothing here</html>")
        version = self.version(content) if version is None else version
        asked = self.headers.get("If-Match")
        if conditions and asked and asked != version.get("ETag"):
            return self.respond(412, version)
        since = self.headers.get("If-Unmodified-Since")
        if conditions and since and since != version.get("Last-Modified"):
            return self.respond(412, version)
        span = self.wanted()
        if span is None:
            return self.respond(200, version, content)
        if span[0] >= len(content):
            return self.respond(416, {"Content-Range": f"bytes */{len(content)}"})
        named = {"Content-Range": f"bytes {span[0] + start}-{span[1] - 1 + start}/{size or len(content)}",
                 "Content-Type": "application/octet-stream", "Accept-Ranges": "bytes"}
        named.update(version)
        named.update({name.replace("_", "-"): value for name, value in headers.items()})
        return self.respond(status, named, content[slice(*span)] if body is None else body, length)


class WebServer(ThreadingHTTPServer):
    """`files`: contents by path. `requests`: path and headers of each, in order. Ends with the block of `with`."""
    daemon_threads = True

    def __init__(self, files, misbehave=lambda handler, number: False):
        super().__init__(("127.0.0.1", 0), Handler)
        self.files, self.misbehave = dict(files), misbehave
        self.requests, self.connections, self.lock = [], 0, threading.Lock()
        self.url = f"http://127.0.0.1:{self.server_port}"

    def __enter__(self):
        threading.Thread(target=self.serve_forever, args=(0.02,), daemon=True).start()
        return self

    def __exit__(self, *_):
        self.shutdown()
        self.server_close()

    def handle_error(self, *_):
        """A client that has seen enough hangs up."""

    def ranges(self):
        return [headers["Range"] for _, headers in self.requests]


# Each of these answers in one way that is wrong, and returns True.


def without_ranges(handler, _):
    content = handler.content()
    handler.respond(200, handler.version(content), content)
    return True


def part_as_200(handler, _):
    handler.answer(status=200)
    return True


def page(handler, _):
    handler.respond(200, {"Content-Type": "text/html; charset=utf-8"}, b"<html>Please log in</html>")
    return True


def page_as_part(handler, _):
    text = (b"<html>Please log in</html>" * 4000)[:len(handler.content())]
    span = handler.wanted()
    handler.answer(body=text[slice(*span)].ljust(span[1] - span[0], b" "), Content_Type="text/html")
    return True


def gzipped(handler, _):
    handler.answer(Content_Encoding="gzip")
    return True


def silent(handler, _):
    time.sleep(20)
    return True


def silent_in_body(handler, _):
    span = handler.wanted()
    handler.answer(body=handler.content()[span[0]:span[0] + 100], length=span[1] - span[0])
    time.sleep(20)
    return True


def trickle(handler, piece, seconds=0.25):
    """Sends pieces as long as someone listens: never silent, and never done."""
    handler.close_connection = True
    while True:
        handler.wfile.write(piece)
        time.sleep(seconds)


def trickled_body(handler, _):
    span = handler.wanted()
    handler.answer(body=b"", length=span[1] - span[0])
    trickle(handler, b"T" * 60)


def late_trickle(handler, _):
    """Half of the part at once, and then little now and then."""
    span = handler.wanted()
    middle = (span[0] + span[1]) // 2
    handler.answer(body=handler.content()[span[0]:middle], length=span[1] - span[0])
    trickle(handler, b"T" * 200, 1.5)


def trickled_headers(handler, _):
    handler.wfile.write(b"HTTP/1.1 206 Partial Content\r\n")
    trickle(handler, b"X-More: 1\r\n")


def trickled_status(handler, _):
    trickle(handler, b"HTTP/1.1 100 Continue\r\n\r\n")


def endless_headers(handler, _):
    handler.wfile.write(b"HTTP/1.1 206 Partial Content\r\n")
    trickle(handler, b"X-More: " + b"x" * 8000 + b"\r\n", 0)


def slow_redirections(handler, number):
    time.sleep(0.9)
    handler.respond(302, {"Location": f"/hop{number}/scan.tag"})
    return True


def slow_link(handler, _):
    """A right answer, at 32 KiB a second."""
    span = handler.wanted()
    content = handler.content()[slice(*span)]
    handler.answer(body=b"", length=len(content))
    for at in range(0, len(content), 8192):
        handler.wfile.write(content[at:at + 8192])
        time.sleep(0.25)
    return True


def of_another_protocol(handler, _):
    handler.wfile.write(b"SSH-2.0-x\r\n")
    handler.close_connection = True
    return True


def short(handler, _):
    span = handler.wanted()
    handler.answer(body=handler.content()[span[0]:(span[0] + span[1]) // 2], length=span[1] - span[0])
    return True


def redirected_to(url):
    def redirect(handler, _):
        handler.respond(302, {"Location": url})
        return True
    return redirect


def after(count, other):
    """Right answers to `count` requests, then wrong ones."""
    return lambda handler, number: number > count and other(handler, number)


def until(count, other):
    """Wrong answers to `count` requests, then right ones."""
    return lambda handler, number: number <= count and other(handler, number)
