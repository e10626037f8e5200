"""`tagrid view` gives the page and the file to a browser of this machine, and nothing to anybody else."""

import http.client
import os
import re
import select
import signal
import socket
import subprocess
import threading
import time
import unittest
from pathlib import Path
from urllib.parse import parse_qs, urljoin, urlsplit

from local_server import LocalServer
from program import TAGRID, ProgramTest


class Viewer(LocalServer):
    """A running `tagrid view`."""

    def __init__(self, test, *arguments, environment=None):
        super().__init__(test, "view", *arguments, environment=environment)
        self.address = self.line()
        test.assertRegex(self.address, r"^http://127\.0\.0\.1:\d+/[0-9a-f]{32}/\?src=")
        parts = urlsplit(self.address)
        self.port = parts.port
        self.root = parts.path
        self.file = urlsplit(urljoin(self.address, parse_qs(parts.query)["src"][0])).path


class View(ProgramTest):
    def setUp(self):
        super().setUp()
        # The page of this test, beside a program that is the same.
        place = self.folder / "place"
        (place / "viewer" / "decoder").mkdir(parents=True)
        self.program = place / "tagrid"
        try:
            os.link(TAGRID, self.program)
        except OSError:
            self.program.write_bytes(TAGRID.read_bytes())
            self.program.chmod(0o755)
        self.page = {"index.html": b"<!DOCTYPE html>", "viewer.js": b"1;", "decoder/worker.js": b"2;",
                     "decoder/a.wasm": b"\0asm"}
        for name, content in self.page.items():
            (place / "viewer" / name).write_bytes(content)
        self.tagrid("phantom", "--dims", "90,80,70", "-o", "a.nrrd", "-q")
        self.tagrid("encode", "a.nrrd", "--max-error", "3", "-o", "my scan%.tag", "-q")
        self.bytes = (self.folder / "my scan%.tag").read_bytes()

    def view(self, *arguments, **options):
        return Viewer(self, "my scan%.tag", "--no-browser", *arguments, **options)

    def test_the_page_and_the_file(self):
        viewer = self.view()
        types = {".html": "text/html; charset=utf-8", ".js": "text/javascript", ".wasm": "application/wasm"}
        for name, content in self.page.items():
            answer = viewer.ask(viewer.root + name)
            self.assertEqual((answer.status, answer.content), (200, content))
            self.assertEqual(answer.headers["Content-Type"], types[Path(name).suffix])
        self.assertEqual(viewer.ask(viewer.root + "?src=x").content, self.page["index.html"])
        self.assertTrue(viewer.file.endswith("/file/my%20scan%25.tag"))
        answer = viewer.ask(viewer.file)
        self.assertEqual((answer.status, answer.content), (200, self.bytes))

    def query(self, *arguments):
        viewer = self.view(*arguments)
        return viewer, parse_qs(urlsplit(viewer.address).query, strict_parsing=True)

    def test_materials_and_labels_are_in_the_address(self):
        text = "air=:-200,soft=-200:300.5,bone=300.5:"
        _, query = self.query("--materials", text)
        self.assertEqual((query["materials"], len(query)), ([text], 2))
        self.assertNotIn("materials", self.query()[1])
        (self.folder / "labels.raw").write_bytes(bytes(i % 3 for i in range(90 * 80 * 70)))
        self.tagrid("encode", "labels.raw", "--dims", "90,80,70", "--type", "uint8", "-o", "the labels.tag", "-q")
        names = "1=left & right,2=bone+"
        for labels in ("all", names):
            query = self.query("--label-volume", "the labels.tag", "--labels", labels)[1]
            self.assertEqual(query["labels"], [labels])
        # Files are served, too.
        (self.folder / "names.csv").write_text("1,soft\n2,bone\n")
        viewer, query = self.query("--labels", "names.csv", "--label-volume", "the labels.tag")
        self.assertEqual(viewer.ask(viewer.root + query["labels"][0]).content, b"1,soft\n2,bone\n")
        self.assertEqual(viewer.ask(viewer.root + query["label-volume"][0]).content,
                         (self.folder / "the labels.tag").read_bytes())
        self.assertEqual(viewer.ask(viewer.file).content, self.bytes)

    def test_a_second_file_is_compared(self):
        self.tagrid("encode", "a.nrrd", "-o", "other & one.tag", "-q")
        viewer, query = self.query("other & one.tag", "--materials", "bone=300:")
        self.assertEqual(sorted(query), ["compare", "materials", "src"])
        other = viewer.ask(viewer.root + query["compare"][0])
        self.assertEqual((other.status, other.content), (200, (self.folder / "other & one.tag").read_bytes()))
        self.assertEqual(viewer.ask(viewer.file).content, self.bytes)
        # Files of the same name are two.
        (self.folder / "d").mkdir()
        self.tagrid("encode", "a.nrrd", "-o", "d/my scan%.tag", "-q")
        viewer, query = self.query("d/my scan%.tag")
        self.assertEqual(viewer.ask(viewer.root + query["compare"][0]).content,
                         (self.folder / "d" / "my scan%.tag").read_bytes())
        (self.folder / "text.tag").write_text("text")
        for arguments, code, words in [
                (("text.tag",), 65, "text.tag"), (("none.tag",), 74, "none.tag"), (("-",), 64, "standard input"),
                (("other & one.tag", "d/my scan%.tag"), 64, "d/my scan%.tag: one file can be viewed")]:
            run = subprocess.run([self.program, "view", "my scan%.tag", *arguments, "--no-browser"], cwd=self.folder,
                                 capture_output=True, check=False, text=True, stdin=subprocess.DEVNULL)
            self.assertEqual((run.returncode, run.stdout), (code, ""), run.stderr)
            self.assertIn(words, run.stderr)

    def test_materials_and_labels_that_cannot_be_understood_are_refused(self):
        self.tagrid("phantom", "--dims", "90,80,71", "-o", "b.nrrd", "-q")
        self.tagrid("encode", "b.nrrd", "-o", "b.tag", "-q")
        for arguments, code, words in [
                (("--materials", "bone=300"), 64, "'bone=300' is not NAME=LOW:HIGH"),
                (("--materials", "bone=300:", "--labels", "all"), 64, "cannot be combined"),
                (("--materials", "a=1:5,b=2:8"), 64, "b begins at 2, but another one ends at 5"),
                (("--labels", "all"), 64, "labels must be from 0 to 65535"),
                (("--labels", "none.csv"), 74, "none.csv"),
                (("--label-volume", "none.tag"), 74, "none.tag"),
                (("--label-volume", "b.tag"), 64, "b.tag: has 90 x 80 x 71 labels, but my scan%.tag has 90 x 80 x 70")]:
            run = subprocess.run([self.program, "view", "my scan%.tag", "--no-browser", *arguments], cwd=self.folder,
                                 capture_output=True, check=False, text=True)
            self.assertEqual((run.returncode, run.stdout), (code, ""), run.stderr)
            self.assertIn(words, run.stderr)

    def test_ranges(self):
        viewer = self.view()
        size = len(self.bytes)
        for text, first, end in [("0-0", 0, 1), ("0-99", 0, 100), ("100-", 100, size), ("-7", size - 7, size),
                                 (f"-{size + 5}", 0, size), (f"5-{size + 5}", 5, size), (f"{size - 1}-", size - 1, size),
                                 ("5-18446744073709551615", 5, size), ("5-99999999999999999999", 5, size),
                                 ("-99999999999999999999", 0, size)]:
            answer = viewer.ask(viewer.file, Range=f"bytes={text}")
            self.assertEqual((answer.status, answer.content), (206, self.bytes[first:end]), text)
            self.assertEqual(answer.headers["Content-Range"], f"bytes {first}-{end - 1}/{size}")
            self.assertEqual(int(answer.headers["Content-Length"]), end - first)
        self.assertEqual(viewer.ask(viewer.file, Range="BYTES=0-1").content, self.bytes[:2])
        for text in (f"{size}-", f"{size}-{size + 1}", "-0", "99999999999999999999-"):
            answer = viewer.ask(viewer.file, Range=f"bytes={text}")
            self.assertEqual((answer.status, answer.headers["Content-Range"]), (416, f"bytes */{size}"), text)
        # What is no range, and several ranges, may be ignored.
        for text in ("bytes=9-3", "bytes=a-b", "bytes=0-1,5-6", "bytes=", "bytes=-", "lines=1-2", "bytes=+1-2"):
            self.assertEqual(viewer.ask(viewer.file, Range=text).status, 200, text)
        answer = viewer.ask(viewer.file, "HEAD", Range="bytes=10-19")
        self.assertEqual((answer.status, answer.content, answer.headers["Content-Length"]), (206, b"", "10"))
        self.assertEqual(viewer.ask(viewer.file, "HEAD").headers["Content-Length"], str(size))

    def test_an_address(self):
        """What a second one serves comes from the first."""
        first = self.view()
        environment = {name: value for name, value in os.environ.items() if not name.lower().endswith("_proxy")}
        second = Viewer(self, f"http://127.0.0.1:{first.port}{first.file}", "--no-browser", environment=environment)
        self.assertEqual(second.ask(second.file).content, self.bytes)

    def test_a_connection_takes_many_requests_and_others_work_beside_it(self):
        viewer = self.view()
        idle = [socket.create_connection(("127.0.0.1", viewer.port)) for _ in range(20)]
        self.addCleanup(lambda: [connection.close() for connection in idle])
        failures = []

        def many(seed):
            connection = http.client.HTTPConnection("127.0.0.1", viewer.port, timeout=20)
            for i in range(50):
                first = (seed * 7919 + i * 104729) % (len(self.bytes) - 100)
                connection.request("GET", viewer.file, headers={"Range": f"bytes={first}-{first + 99}"})
                if connection.getresponse().read() != self.bytes[first:first + 100]:
                    failures.append((seed, i))
            connection.close()

        threads = [threading.Thread(target=many, args=(seed,)) for seed in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])

    def test_connections_that_are_not_used_make_room(self):
        viewer = self.view()
        idle = [socket.create_connection(("127.0.0.1", viewer.port)) for _ in range(70)]
        self.addCleanup(lambda: [connection.close() for connection in idle])
        begin = time.monotonic()
        self.assertEqual(viewer.ask(viewer.file).content, self.bytes)
        self.assertLess(time.monotonic() - begin, 15)
        # Some made room, and the last one can be used still.
        ended = select.select(idle, [], [], 0)[0]
        self.assertGreaterEqual(len(ended), 7)
        self.assertEqual({connection.recv(1) for connection in ended}, {b""})
        idle[-1].settimeout(20)
        idle[-1].sendall(f"HEAD {viewer.file} HTTP/1.1\r\nHost: 127.0.0.1:{viewer.port}\r\n\r\n".encode())
        self.assertEqual(idle[-1].recv(12), b"HTTP/1.1 200")

    def test_a_list_of_connection_options(self):
        viewer = self.view()
        for value, ends in (("close", True), ("foo, close", True), ("Close ,foo", True), ("foo", False),
                            ("closed", False), ("keep-alive", False)):
            with socket.create_connection(("127.0.0.1", viewer.port), timeout=20) as connection:
                connection.sendall(f"HEAD {viewer.file} HTTP/1.1\r\nHost: 127.0.0.1:{viewer.port}\r\n"
                                   f"Connection: {value}\r\n\r\n".encode())
                head = connection.recv(4096)
                while not head.endswith(b"\r\n\r\n"):
                    head += connection.recv(4096)
                self.assertIn(b"Connection: close" if ends else b"Connection: keep-alive", head, value)
                if ends:
                    self.assertEqual(connection.recv(1), b"", value)

    def test_nothing_without_the_token(self):
        viewer = self.view()
        other = "/" + "0" * 32 + "/"
        name = viewer.file.rpartition("/")[2]
        for path in ("/", "/index.html", f"/file/{name}", other, other + f"file/{name}", viewer.root[:-1],
                     viewer.root.upper(), viewer.root[:-2] + "/"):
            self.assertEqual(viewer.ask(path).status, 404, path)

    def test_no_other_file(self):
        viewer = self.view()
        (self.folder / "secret").write_text("secret")
        for path in ("../secret", "../../secret", "%2e%2e/secret", "..%2fsecret", "file/../../../secret", "file/secret",
                     "decoder/../../tagrid", "//etc/passwd", "/etc/passwd", "file/", "decoder", "decoder/",
                     "index.html/", "index.html%00"):
            self.assertEqual(viewer.ask(viewer.root + path).status, 404, path)

    def test_no_other_host_and_no_other_origin(self):
        viewer = self.view()
        for host in ("", "example.org", f"example.org:{viewer.port}", "127.0.0.1", f"127.0.0.1:{viewer.port + 1}",
                     f"127.0.0.1:{viewer.port}.example.org", f"[::1]:{viewer.port}"):
            self.assertEqual(viewer.ask(viewer.file, host=host).status, 403, host)
        self.assertEqual(viewer.ask(viewer.file, host=f"localhost:{viewer.port}").status, 200)
        self.assertEqual(viewer.raw(f"GET {viewer.file} HTTP/1.0\r\n\r\n".encode()), "HTTP/1.1 403 Forbidden")
        answer = viewer.ask(viewer.file, Origin="https://example.org")
        self.assertEqual([name for name in answer.headers if name.lower().startswith("access-control")], [])
        self.assertEqual(answer.headers["Cross-Origin-Resource-Policy"], "same-origin")
        self.assertIn("default-src 'none'", answer.headers["Content-Security-Policy"])

    def test_only_this_machine(self):
        viewer = self.view()
        self.assertEqual(viewer.listening(), [f"0100007F:{viewer.port:04X}"])

    def test_what_is_no_request(self):
        viewer = self.view()
        host = f"Host: 127.0.0.1:{viewer.port}\r\n"
        for text, status in [("GARBAGE\r\n\r\n", 400), (f"GET {viewer.file}\r\n\r\n", 400),
                             (f"GET {viewer.file} HTTP/3\r\n{host}\r\n", 400),
                             (f"GET http://127.0.0.1{viewer.file} HTTP/1.1\r\n{host}\r\n", 400),
                             (f"GET {viewer.file} HTTP/1.1\r\n\r\n", 400),
                             (f"GET {viewer.file} HTTP/1.1\r\n{host}{host}\r\n", 400),
                             (f"GET {viewer.file} HTTP/1.1\r\nHost:\r\n{host}\r\n", 400),
                             (f"GET {viewer.file} HTTP/1.1\r\nHost:\r\n\r\n", 403),
                             (f"GET {viewer.file} HTTP/1.1\r\n{host}Range : bytes=0-1\r\n\r\n", 400),
                             (f"GET {viewer.file} HTTP/1.1\r\n{host}A: \0\r\n\r\n", 400),
                             (f"POST {viewer.file} HTTP/1.1\r\n{host}Content-Length: 3\r\n\r\nabc", 413),
                             (f"PUT {viewer.file} HTTP/1.1\r\n{host}Content-Length: 0\r\n\r\n", 405),
                             ("A" * 40000, 400)]:
            self.assertEqual(viewer.raw(text.encode())[:12], f"HTTP/1.1 {status}", text[:80])
        self.assertEqual(viewer.ask(viewer.root).status, 200)

    def test_signals_end_it_cleanly(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            viewer = self.view()
            idle = socket.create_connection(("127.0.0.1", viewer.port))
            viewer.ask(viewer.root)
            code, seconds = viewer.end(number)
            idle.close()
            self.assertEqual(code, 0)
            self.assertLess(seconds, 5)
            with self.assertRaises(OSError):
                socket.create_connection(("127.0.0.1", viewer.port), timeout=5).close()
        self.assertIn("Ctrl-C", viewer.process.stderr.read())

    def test_the_browser_gets_an_address_that_works_once(self):
        programs = self.folder / "programs"
        programs.mkdir()
        browser = programs / "xdg-open"
        browser.write_text(f'#!/bin/sh\necho "$1" > "{self.folder}/opened.part"\n'
                           f'mv "{self.folder}/opened.part" "{self.folder}/opened"\n')
        browser.chmod(0o755)
        viewer = Viewer(self, "my scan%.tag", environment={**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"})
        for _ in range(200):
            if (self.folder / "opened").exists():
                break
            time.sleep(0.05)
        opened = urlsplit((self.folder / "opened").read_text().strip())
        self.assertNotIn(viewer.root.strip("/"), opened.path)
        answers = [viewer.ask(opened.path) for _ in range(2)]
        self.assertEqual([answer.status for answer in answers], [302, 404])
        self.assertEqual(urljoin(viewer.address, answers[0].headers["Location"]), viewer.address)

    def test_without_a_browser_it_says_so(self):
        empty = self.folder / "empty"
        empty.mkdir()
        viewer = Viewer(self, "my scan%.tag", environment={**os.environ, "PATH": str(empty)})
        self.assertEqual(viewer.ask(viewer.root).status, 200)
        viewer.end()
        self.assertIn("xdg-open", viewer.process.stderr.read())

    def test_ports(self):
        viewer = self.view("--quiet")
        run = subprocess.run([self.program, "view", "my scan%.tag", "--no-browser", "--port", str(viewer.port)],
                             cwd=self.folder, capture_output=True, check=False, text=True)
        self.assertEqual(run.returncode, 74)
        self.assertIn(str(viewer.port), run.stderr)
        viewer.end()
        self.assertEqual(viewer.process.stderr.read(), "")
        again = self.view("--port", viewer.port)
        self.assertEqual(again.port, viewer.port)
        self.assertNotEqual(again.root, viewer.root)
        for port in ("-1", "65536", "x"):
            self.tagrid("view", "my scan%.tag", "--no-browser", "--port", port, code=64)

    def test_what_cannot_be_viewed(self):
        (self.folder / "text.tag").write_text("text")
        for name, code in [("text.tag", 65), ("none.tag", 74), (".", 64), ("-", 64)]:
            run = subprocess.run([self.program, "view", name, "--no-browser"], cwd=self.folder, capture_output=True,
                                 check=False, text=True, stdin=subprocess.DEVNULL)
            self.assertEqual((run.returncode, run.stdout), (code, ""), (name, run.stderr))
        (self.program.parent / "viewer" / "index.html").unlink()
        run = subprocess.run([self.program, "view", "my scan%.tag", "--no-browser"], cwd=self.folder,
                             capture_output=True, check=False, text=True)
        self.assertEqual((run.returncode, run.stdout), (74, ""))
        self.assertTrue(re.search("viewer is not installed .*install the Debian package", run.stderr), run.stderr)


if __name__ == "__main__":
    unittest.main()
