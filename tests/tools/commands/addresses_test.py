"""Files on servers are read as files of this machine are, in few requests; and a server that misbehaves is an error that
says so, after which nothing is left.

    addresses_test.py TAGRID
"""

import hashlib
import hmac
import os
import re
import shutil
import signal
import ssl
import subprocess
import time
import unittest
import urllib.parse

from program import ProgramTest, TAGRID, numpy
from web_server import (WebServer, after, endless_headers, gzipped, late_trickle, of_another_protocol, page, page_as_part,
                        part_as_200, redirected_to, short, silent, silent_in_body, slow_link, slow_redirections,
                        trickled_body, trickled_headers, trickled_status, until, without_ranges)

IS_SANITIZED = b"__asan_init" in TAGRID.read_bytes()
# Servers of this machine are not reached through a proxy.
ENVIRONMENT = {name: value for name, value in os.environ.items()
               if not name.lower().endswith("_proxy") and not name.startswith("AWS_")}


class Addresses(ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        random = numpy.random.default_rng(3)
        z, y, x = numpy.ogrid[:200, :200, :260]
        volume = 300 * numpy.sin(x / 9) * numpy.cos(y / 7) + 3 * z + random.normal(0, 12, (200, 200, 260))
        cls.raw = volume.astype("<i2").tobytes()
        arguments = [TAGRID, "encode", "-", "--dims", "260,200,200", "--type", "int16", "--cube", "32", "-o", "-"]
        cls.data = subprocess.run([*arguments, "--overviews", "4", "--max-error", "1"], input=cls.raw, check=True,
                                  capture_output=True).stdout
        assert len(cls.data) > 5000000, len(cls.data)
        small = [TAGRID, "phantom", "--dims", "40,30,20", "-o", "-"]
        phantom = subprocess.run(small, check=True, capture_output=True).stdout
        cls.small = subprocess.run([*arguments[:3], "--dims", "40,30,20", "--type", "int16", "-o", "-"], input=phantom,
                                   check=True, capture_output=True).stdout

    def setUp(self):
        super().setUp()
        (self.folder / "local.tag").write_bytes(self.data)
        (self.folder / "scan.tag").write_bytes(self.data)
        (self.folder / "small.tag").write_bytes(self.small)
        self.environment = dict(ENVIRONMENT, TAGRID_HTTP_TIMEOUT="2", HOME=str(self.folder))

    def tagrid(self, *arguments, **options):
        return super().tagrid(*arguments, env=self.environment, **options)

    def refused(self, words, *arguments, code=74, outputs=()):
        """Runs the program, which fails with these words and leaves nothing."""
        before = sorted(os.listdir(self.folder))
        message = self.tagrid(*arguments, code=code).stderr.decode()
        for word in words.split("|"):
            self.assertIn(word, message)
        self.assertEqual(sorted(os.listdir(self.folder)), sorted([*before, *outputs]))
        return message

    def server(self, *misbehave, **files):
        return WebServer({"/scan.tag": self.data, "/small.tag": self.small, **files}, *misbehave)

    # Right servers.

    def test_every_command_gives_what_it_gives_for_the_file(self):
        with self.server() as server:
            url = server.url + "/scan.tag"
            commands = {
                "info --json": "info {} --json",
                "info": "info {}",
                "decode": "decode {} -o {}.nrrd",
                "decode -": "decode {} -o -",
                "region": "decode {} --region 70:200,:,33:150 -o {}.nrrd",
                "step": "decode {} --step 4 --region :,:,10:90 -o {}.nrrd",
                "overview": "decode {} --overview 4 -o {}.nrrd",
                "volume": "decode {} --volume 0 -o {}.nii",
                "salvage": "decode {} --salvage -o {}.mha",
                "preview": "preview {} -o {}.png",
                "slice": "preview {} --slice z=77 --window -100:600 -o {}.png",
                "mesh": "mesh {} --level 6 -o {}.vtu",
                "part of the mesh": "mesh {} --region 30:120,40:90,50:100 -o {}.msh",
                "surface": "surface {} --iso 350.5 -o {}.ply",
                "part of the surface": "surface {} --iso 350.5 --region 30:120,40:90,50:100 -o {}.stl",
                "verify": "verify {}",
                "verify against": "verify {} --against original.raw --dims 260,200,200 --type int16",
            }
            (self.folder / "original.raw").write_bytes(self.raw)
            for number, (name, command) in enumerate(commands.items()):
                if IS_SANITIZED and number % 4:
                    continue
                with self.subTest(name):
                    results = []
                    for source in ("scan.tag", url):
                        run = self.tagrid(*command.format(source, "out").split())
                        files = {path.name: path.read_bytes() for path in self.folder.glob("out.*")}
                        for file in files:
                            (self.folder / file).unlink()
                        results.append((run.stdout.replace(url.encode(), b"scan.tag"), run.stderr, files))
                    self.assertTrue(results[0] == results[1], results[1][:2])
                    self.assertEqual(len(results[0][2]), " -o out" in command.format("", "out"))

    def test_restore_gives_the_source_files_back(self):
        self.tagrid("phantom", "--dims", "90,80,70", "-o", "scan.nhdr")
        self.tagrid("encode", "scan.nhdr", "-o", "kept.tag")
        with self.server(**{"/kept.tag": (self.folder / "kept.tag").read_bytes()}) as server:
            self.tagrid("restore", server.url + "/kept.tag", "-o", "back")
        for name in ("scan.nhdr", "scan.raw"):
            self.assertEqual((self.folder / "back" / name).read_bytes(), (self.folder / name).read_bytes())

    def test_parity_and_damage_are_seen(self):
        self.tagrid("protect", "local.tag", "--parity", "5%")
        whole = (self.folder / "local.tag").read_bytes()
        damaged = bytearray(whole)
        damaged[2000000:2000100] = bytes(100)
        (self.folder / "damaged.tag").write_bytes(damaged)
        with self.server(**{"/whole.tag": whole, "/damaged.tag": bytes(damaged)}) as server:
            self.assertIn(b"parity: intact", self.tagrid("verify", server.url + "/whole.tag").stdout)
            local = self.tagrid("verify", "damaged.tag", code=65).stdout.decode()
            far = self.tagrid("verify", server.url + "/damaged.tag", code=65).stdout.decode()
            self.assertIn("repairable", far)
            self.assertEqual(far.replace(server.url + "/", ""), local)
            for name, source in (("near", "damaged.tag"), ("far", server.url + "/damaged.tag")):
                self.tagrid("decode", source, "--salvage", "--fill", "7", "-o", name + ".nrrd", code=65)
            self.assertEqual((self.folder / "near.nrrd").read_bytes(), (self.folder / "far.nrrd").read_bytes())
            self.refused("damaged.tag: brick", "decode", server.url + "/damaged.tag", "-o", "x.nrrd", code=65)

    def test_a_small_file_is_one_request(self):
        self.assertLess(len(self.small), 64 << 10)
        with self.server() as server:
            far = self.tagrid("decode", server.url + "/small.tag", "-o", "-").stdout
            self.assertEqual(server.ranges(), ["bytes=0-65535"])
        self.assertEqual(far, self.tagrid("decode", "small.tag", "-o", "-").stdout)

    def test_opening_is_two_requests_and_a_brick_at_most_two_more(self):
        with self.server() as server:
            url = server.url + "/scan.tag"
            self.tagrid("info", url, "--json", "--no-levels")
            size = len(self.data)
            self.assertEqual(server.ranges()[:2], ["bytes=0-65535", f"bytes={size - (256 << 10)}-{size - 1}"])
            opening = len(server.requests)
            # The header of the overview.
            self.assertLessEqual(opening, 3)
            for region, most in [("64:128,64:128,64:128", 1), ("0:64,0:64,0:64", 1), ("192:256,128:192,128:192", 1),
                                 # Two bricks along x lie side by side; rows and layers do not.
                                 ("70:134,64:128,64:128", 1), ("70:134,70:134,70:134", 3)]:
                server.requests.clear()
                arguments = ["--region", region, "-o", "-"]
                far = self.tagrid("decode", url, *arguments).stdout
                self.assertEqual(far, self.tagrid("decode", "local.tag", *arguments).stdout)
                self.assertLessEqual(len(server.requests) - 2, most, (region, server.ranges()))

    def test_reading_front_to_back_takes_few_requests_and_connections(self):
        with self.server() as server:
            self.tagrid("decode", server.url + "/scan.tag", "-o", "-")
            # 64 KiB, and then 128, 256 ... up to 2 MiB.
            self.assertLessEqual(len(server.requests), 7 + len(self.data) // (2 << 20))
            self.assertLessEqual(server.connections, 2)
            sent = sum(int(last) - int(first) + 1 for first, last in
                       (text.split("=")[1].split("-") for text in server.ranges()))
            self.assertLess(sent, 1.1 * len(self.data))

    def test_bricks_that_are_larger_than_what_is_kept_come_in_parts(self):
        self.tagrid("encode", "-", "--dims", "260,200,200", "--type", "int16", "--brick", "6", "-o", "large.tag",
                    input=self.raw)
        data = (self.folder / "large.tag").read_bytes()
        with self.server(**{"/large.tag": data}) as server:
            for arguments in ([], ["--region", "10:250,20:180,30:70"]):
                self.assertEqual(self.tagrid("decode", server.url + "/large.tag", *arguments, "-o", "-").stdout,
                                 self.tagrid("decode", "large.tag", *arguments, "-o", "-").stdout)

    def test_all_requests_after_the_first_one_want_its_version(self):
        with self.server() as server:
            self.tagrid("decode", server.url + "/scan.tag", "-o", "-")
            tag = '"' + hashlib.md5(self.data).hexdigest() + '"'
            self.assertEqual([headers.get("If-Match") for _, headers in server.requests],
                             [None] + [tag] * (len(server.requests) - 1))
            self.assertEqual({headers["Accept-Encoding"] for _, headers in server.requests}, {"identity"})
        date = {"Last-Modified": "Wed, 25 Nov 2026 10:00:00 GMT"}
        for version in (date, {"ETag": 'W/"weak"', **date}):
            with self.server(lambda handler, _, version=version: handler.answer(version=version) or True) as server:
                self.tagrid("decode", server.url + "/scan.tag", "-o", "-")
                wanted = [(headers.get("If-Match"), headers.get("If-Unmodified-Since"))
                          for _, headers in server.requests]
                self.assertEqual(wanted, [(None, None)] + [(None, date["Last-Modified"])] * (len(wanted) - 1))

    def test_what_passes_is_tried_again(self):
        def busy(status, **headers):
            return lambda handler, _: handler.respond(status, headers, b"busy") or True

        def hang_up(handler, _):
            handler.close_connection = True
            return True

        local = self.tagrid("decode", "local.tag", "-o", "-").stdout
        for name, wrong in [("503", busy(503)), ("429", busy(429, **{"Retry-After": "1"})), ("500", busy(500)),
                            ("short", short), ("no answer", hang_up), ("silent", silent_in_body)]:
            for misbehave in (until(1, wrong),
                              lambda handler, number, wrong=wrong: number == 3 and wrong(handler, number)):
                if IS_SANITIZED and name != "503":
                    continue
                with self.subTest(name), self.server(misbehave) as server:
                    begin = time.monotonic()
                    self.assertEqual(self.tagrid("decode", server.url + "/scan.tag", "-o", "-").stdout, local)
                    if name == "429":
                        self.assertGreater(time.monotonic() - begin, 1)
        with self.server(busy(503)) as server:
            self.refused("scan.tag: the server answers 503 (busy) (4 requests)", "info", server.url + "/scan.tag")
            self.assertEqual(len(server.requests), 4)

    def test_redirections_are_followed(self):
        with self.server() as target, self.server(redirected_to(target.url + "/scan.tag")) as server:
            region = ["--region", "0:64,0:64,0:64", "-o", "-"]
            self.assertEqual(self.tagrid("decode", server.url + "/here", *region).stdout,
                             self.tagrid("decode", "local.tag", *region).stdout)
            self.assertEqual(len(target.requests), len(server.requests))

    def test_a_secret_is_sent_but_not_shown(self):
        def guarded(handler, _):
            if handler.headers.get("Authorization") == "Basic dXNlcjpzZWNyZXQ=":  # user:secret
                return False
            handler.respond(401, {"WWW-Authenticate": 'Basic realm="x"'})
            return True

        with self.server(guarded) as server:
            host = server.url.removeprefix("http://")
            arguments = ["decode", f"http://user:secret@{host}/small.tag?X-Signature=abc", "--json", "run.json", "-v"]
            run = self.tagrid(*arguments, "-o", "a.nrrd")
            self.assertEqual(server.requests[-1][0], "/small.tag?X-Signature=abc")
            self.assertEqual(self.statistics("run.json")["input"], server.url + "/small.tag")
            shown = run.stdout + run.stderr + (self.folder / "run.json").read_bytes()
            self.assertFalse(re.search(rb"secret|Signature", shown))
            for address, code in [(f"http://user:wrong@{host}/small.tag?X-Signature=abc", 74),
                                  (f"http://user:sec/ret@{host}/small.tag?X-Signature=abc", 74),
                                  (f"http://user:sec@{host}:x/small.tag?X-Signature=abc", 74)]:
                message = self.refused("small.tag: ", "info", address, code=code)
                self.assertFalse(re.search(r"wrong|sec|ret@|Signature", message), message)
            message = self.refused("small.tag: ", "encode", f"http://user:secret@{host}/small.tag?X=secret", code=64)
            self.assertNotIn("secret", message)
            self.refused("401 (name and password are wanted", "info", server.url + "/small.tag")
            (self.folder / ".netrc").write_text("machine 127.0.0.1 login user password secret\n")
            self.tagrid("info", server.url + "/small.tag")

    def test_proxies_are_those_of_curl(self):
        with self.server(lambda handler, _: handler.respond(418) or True) as proxy:
            self.environment["http_proxy"] = proxy.url
            self.refused("418", "info", "http://nowhere.invalid/scan.tag")
            self.assertEqual(proxy.requests[0][0], "http://nowhere.invalid/scan.tag")

    def test_https_wants_a_certificate_that_is_known(self):
        if shutil.which("openssl") is None:
            self.skipTest("there is no openssl on this machine")
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", "key.pem", "-out",
                        "cert.pem", "-days", "2", "-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1"],
                       cwd=self.folder, check=True, capture_output=True)
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(self.folder / "cert.pem", self.folder / "key.pem")
        with self.server() as plain, self.server(lambda handler, _: handler.path == "/down" and
                                                 redirected_to(plain.url + "/scan.tag")(handler, 0)) as server:
            server.socket = context.wrap_socket(server.socket, server_side=True)
            url = server.url.replace("http", "https")
            self.refused("certificate", "info", url + "/scan.tag")
            self.environment["CURL_CA_BUNDLE"] = str(self.folder / "cert.pem")
            self.assertEqual(self.tagrid("decode", url + "/scan.tag", "-o", "-").stdout,
                             self.tagrid("decode", "local.tag", "-o", "-").stdout)
            self.refused("is redirected to an address that is not https", "info", url + "/down")
            self.assertEqual(plain.requests, [])

    def test_memory_stays_within_its_limit(self):
        if IS_SANITIZED:
            self.skipTest("sanitizers take memory of their own")
        with self.server() as server:
            url = server.url + "/scan.tag"
            message = self.tagrid("decode", url, "-M", "40M", "-o", "a.nrrd", code=64).stderr.decode()
            limit = re.search(r"give -M (\d+)M", message)[1]
            self.assertGreater(int(limit), 40)
            for arguments in (["decode"], ["decode", "--region", "0:200,10:190,0:200"], ["surface", "--iso", "350.5"]):
                name = "out.nrrd" if arguments[0] == "decode" else "out.ply"
                smallest = self.tagrid(*arguments, url, "-M", "20M", "-o", name, code=64).stderr.decode()
                limit = re.search(r"give -M (\d+)M", smallest)[1]
                self.tagrid(*arguments, url, "-M", limit + "M", "-T", "4", "-o", name, "-f", "--json", "run.json")
                self.assertLess(self.statistics("run.json")["peak_memory"], int(limit) << 20)
                (self.folder / "run.json").unlink()

    # Wrong servers.

    def test_a_server_that_misbehaves_is_an_error(self):
        def answers(**wrong):
            return lambda handler, _: handler.answer(**wrong) or True

        def several(handler, _):
            handler.respond(206, {"Content-Type": "multipart/byteranges; boundary=x"}, b"--x\r\n\r\n--x--")
            return True

        def long(handler, _):
            span = handler.wanted()
            handler.answer(body=handler.content()[span[0]:span[1]] + b"more", length=span[1] - span[0] + 4)
            return True

        for name, wrong, words in [
                ("no ranges", without_ranges, "the server does not give parts of the file (it answers 200"),
                ("200 for a part", part_as_200, "the server does not give parts of the file (it answers 200"),
                ("a page", page, "the server answers with a page (text/html), not with a file"),
                ("another part", answers(start=1), "the server sends bytes 1 to 65536 instead of 0 to 65535"),
                ("no part", answers(Content_Range="bytes"), "does not say which part"),
                ("an unknown size", answers(Content_Range="bytes 0-65535/*"), "does not say how long"),
                ("a size below the part", answers(size=1000), "does not say which part"),
                ("a huge size", answers(size=1 << 62), "the server sends less than was asked for"),
                ("a size beyond numbers", answers(size=1 << 64), "does not say which part"),
                ("gzip", gzipped, "the server compresses what it sends (Content-Encoding: \"gzip\")"),
                ("several parts", several, "does not say which part"),
                ("more", long, "the server sends more than it announces"),
                ("short answers", short, "the connection ended before all of the answer (4 requests)"),
                ("another protocol", of_another_protocol, "HTTP/0.9"),
                ("silence", silent, "the server does not answer in time"),
                ("silence in the body", silent_in_body, "the server does not answer in time"),
                ("a trickle", trickled_body, "sends less than 4096 bytes per second; to wait longer, set TAGRID_HTTP_TIMEOUT to more"),
                ("a trickle after half", late_trickle, "sends less than 4096 bytes per second"),
                ("a trickle of headers", trickled_headers, "for 2 seconds (TAGRID_HTTP_TIMEOUT)"),
                ("a trickle of statuses", trickled_status, "for 2 seconds (TAGRID_HTTP_TIMEOUT)"),
                ("slow redirections", slow_redirections, "for 2 seconds (TAGRID_HTTP_TIMEOUT)"),
                ("endless headers", endless_headers, "headers"),
                ("a loop", redirected_to("/scan.tag"), "is redirected again and again"),
                ("a redirection to a file", redirected_to(f"file://{self.folder}/local.tag"), "neither http nor https"),
                ("a redirection to ftp", redirected_to("ftp://127.0.0.1/scan.tag"), "neither http nor https"),
                ("403", lambda handler, _: handler.respond(403) or True, "the server answers 403 (not allowed)"),
                ("404", lambda handler, _: handler.respond(404) or True, "the server answers 404 (not found)")]:
            with self.subTest(name), self.server(wrong) as server:
                begin = time.monotonic()
                self.refused(f"{server.url}/scan.tag: |{words}", "decode", server.url + "/scan.tag", "-o", "a.nrrd")
                self.assertLess(time.monotonic() - begin, 15)
                self.assertLess(len(server.requests), 20)
        with self.server(answers(size=1 << 62)) as server:
            self.refused("the server is wrong about its size", "info", server.url + "/scan.tag")

    def test_content_that_is_no_tag_file_is_broken_input(self):
        with self.server(page_as_part) as server:
            self.refused("is not a .tag file", "info", server.url + "/scan.tag", code=65)
        truncated = self.data[:len(self.data) // 2]
        with self.server(**{"/cut.tag": truncated, "/empty.tag": b"", "/text.tag": b"no"}) as server:
            for name in ("cut", "empty", "text"):
                (self.folder / f"{name}.tag").write_bytes(server.files[f"/{name}.tag"])
                for command in ("info", "verify"):
                    local = self.tagrid(command, f"{name}.tag", code=65).stderr.decode()
                    self.refused(local.removeprefix("tagrid: ").strip(), command, f"{server.url}/{name}.tag", code=65)

    def test_an_object_that_changes_is_noticed(self):
        other = bytearray(self.data)
        other[3000000] ^= 1
        other = bytes(other)

        def changes_after(count, **answer):
            """From then on, another content of the same length; `answer` says what the server shows of that."""
            def misbehave(handler, number):
                if number > count:
                    handler.server.files["/scan.tag"] = other
                handler.answer(**answer)
                return True
            return misbehave

        date = {"Last-Modified": "Wed, 25 Nov 2026 10:00:00 GMT"}
        for count in (1, 2, 4):
            with self.subTest(count):
                with self.server(changes_after(count)) as server:
                    self.refused("scan.tag: was changed while it was being read", "decode", server.url + "/scan.tag", "-o",
                                 "a.nrrd")
                    self.assertEqual(len(server.requests), count + 1)
                with self.server(changes_after(count, conditions=False)) as server:
                    self.refused("was changed while it was being read", "decode", server.url + "/scan.tag", "-o",
                                 "a.nrrd")
                # Nothing shows it: then the checksums do.
                with self.server(changes_after(count, version={})) as server:
                    self.refused("scan.tag: brick", "decode", server.url + "/scan.tag", "-o", "a.nrrd", code=65)

        def later(handler, number):
            handler.answer(version={**date} if number < 3 else {"Last-Modified": "Thu, 26 Nov 2026 10:00:00 GMT"})
            return True

        def longer(handler, number):
            if number > 2:
                handler.server.files["/scan.tag"] = self.data + b"more"
            handler.answer(version={})
            return True

        def shorter(handler, number):
            if number > 2:
                handler.server.files["/scan.tag"] = self.data[:70000]
            handler.answer(version={})
            return True

        for misbehave in (later, longer, shorter):
            with self.server(misbehave) as server:
                self.refused("while it was being read", "decode", server.url + "/scan.tag", "-o", "a.nrrd")

    def test_wrong_answers_in_the_middle_leave_nothing(self):
        for wrong, words in [(without_ranges, "does not give parts"), (page, "a page"), (gzipped, "compresses"),
                             (redirected_to("file:///etc/passwd"), "neither http nor https")]:
            for command in (["decode", "-o", "a.nrrd"], ["surface", "--iso", "300.5", "-o", "a.ply"],
                            ["preview", "-o", "a.png"]):
                with self.server(after(2, wrong)) as server:
                    self.refused(words, *command, server.url + "/scan.tag")

    def test_servers_that_are_not_there(self):
        with self.server() as server:
            url = server.url
        begin = time.monotonic()
        self.refused("scan.tag: ", "info", url + "/scan.tag")
        self.refused("resolve", "info", "http://nowhere.invalid/scan.tag")
        self.assertLess(time.monotonic() - begin, 20)

    def test_a_run_that_waits_can_be_interrupted(self):
        self.environment["TAGRID_HTTP_TIMEOUT"] = "60"
        with self.server(after(3, silent)) as server:
            before = sorted(os.listdir(self.folder))
            run = subprocess.Popen([TAGRID, "decode", server.url + "/scan.tag", "-o", "a.nrrd"], cwd=self.folder,
                                   env=self.environment, stderr=subprocess.DEVNULL)
            while len(server.requests) < 4:
                self.assertIsNone(run.poll())
                time.sleep(0.05)
            run.send_signal(signal.SIGINT)
            self.assertEqual(run.wait(10), -signal.SIGINT)
            self.assertEqual(sorted(os.listdir(self.folder)), before)

    # Commands that do not read addresses, and names that are none.

    def test_what_needs_a_file_refuses_an_address(self):
        with self.server() as server:
            url = server.url + "/small.tag"
            (self.folder / "list.tsv").write_text(f"{url}\n")
            for words, *arguments in [("only .tag files are read from servers", "encode", url),
                                      ("curl URL | tagrid encode - -o FILE.tag", "encode", url, "-o", "a.tag"),
                                      ("curl URL | tagrid estimate -", "estimate", url),
                                      ("only .tag files are read from servers", "verify", "small.tag", "--against",
                                       url),
                                      ("only .tag files are read from servers", "convert", "--manifest", "list.tsv",
                                       "--output-dir", "out"),
                                      ("download it first", "convert", "--manifest", url, "--output-dir", "out"),
                                      ("download it first", "convert", "--find", url),
                                      ("download it first", "repair", url, "-o", "a.tag"),
                                      ("download it first", "protect", url, "--parity", "5%"),
                                      ("it is an address", "decode", url, "--rm", "-o", "a.nrrd"),
                                      ("give -o FILE", "decode", url), ("give -o FILE", "preview", url),
                                      ("give -o FILE", "mesh", url), ("give -o", "restore", url)]:
                with self.subTest(arguments):
                    self.refused(words, *arguments, code=64)
            self.assertEqual(server.requests, [])

    def test_a_file_never_chooses_an_address(self):
        with self.server() as server:
            (self.folder / "a.nhdr").write_text("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nencoding: raw\n"
                                                f"data file: {server.url}/small.tag\n")
            self.tagrid("encode", "a.nhdr", code=74)
            self.assertEqual(server.requests, [])
        folder = self.folder / "http:" / "x"
        folder.mkdir(parents=True)
        shutil.copy(self.folder / "small.tag", folder / "small.tag")
        self.tagrid("info", "./http://x/small.tag")

    def test_a_slow_server_is_waited_for(self):
        with self.server(slow_link) as server:
            begin = time.monotonic()
            run = self.tagrid("info", server.url + "/scan.tag", "--json").stdout
            self.assertGreater(time.monotonic() - begin, 5)
        self.assertEqual(run.replace(server.url.encode() + b"/scan.tag", b"local.tag"),
                         self.tagrid("info", "local.tag", "--json").stdout)

    def test_addresses_that_look_alike_are_not_one_file(self):
        with self.server(**{"/get?file=1": self.data, "/get?file=2": self.small}) as server:
            self.tagrid("info", server.url + "/get?file=2", "--no-levels")
            self.refused("two addresses differ only", "serve", server.url + "/get?file=1", server.url + "/get?file=2",
                         code=64)

    def test_no_message_has_a_secret_and_no_output_is_an_address(self):
        self.tagrid("phantom", "--dims", "8,8,8", "-o", "a.nrrd")
        self.environment["NO_COLOR"] = "1"
        for address in ("http://SECRETUSER:SECRETPW@127.0.0.1:9/x.tag?X-Amz-Signature=SECRETSIG#SECRET",
                        "s3://SECRETKEY:SECRETPW@bucket/x.tag?X-Amz-Signature=SECRETSIG",
                        "gs://bucket/x.tag?X-Goog-Signature=SECRET", "ftp://ann:SECRETPW@host/x.tag", "http:/ann:SECRETPW@host/x.tag"):
            (self.folder / "list.tsv").write_text(f"a.nrrd\n{address}\n")
            for command in ("info @", "info @ x", "info @ --json", "info --frob=@", "decode @ -o o.nrrd", "decode small.tag -o @",
                            "decode small.tag @", "decode small.tag --region @ -o x.nrrd", "decode small.tag --volume @ -o -",
                            "preview small.tag -o @", "mesh small.tag -o @", "surface small.tag --iso 1 -o @", "view @",
                            "view small.tag @", "serve @", "verify small.tag --against @", "restore small.tag -o @", "restore @ -o d",
                            "encode @", "encode a.nrrd -o @", "encode a.nrrd @", "encode a.nrrd -o z.tag --json @",
                            "encode a.nrrd -o z.tag --spool @", "estimate @", "convert @", "convert --find @",
                            "convert --manifest list.tsv --output-dir @", "convert --manifest @ --output-dir d", "repair @",
                            "repair small.tag -o @", "protect @ --parity 5%", "formats @", "phantom -o @", "frobnicate @", "@"):
                with self.subTest(command, address=address):
                    before = sorted(os.listdir(self.folder))
                    run = subprocess.run([TAGRID, *(word.replace("@", address) if "@" in word else word for word in command.split())],
                                         cwd=self.folder, env=self.environment, capture_output=True, check=False)
                    self.assertIn(run.returncode, (64, 65, 74), run)
                    self.assertNotIn(b"SECRET", run.stdout + run.stderr)
                    self.assertEqual(sorted(os.listdir(self.folder)), before)

    def test_other_schemes_are_refused_unless_a_directory_has_the_name(self):
        for address, shown in (("gs://bucket/x.tag?s", "gs://bucket/x.tag"), ("sftp://ann:pw@host/x.tag", "sftp://host/x.tag"),
                               ("http:/ann:pw@host/x.tag", "http:/host/x.tag"), ("file:///home/x.tag", "file:///home/x.tag")):
            for command in ("info", "verify", "decode", "encode", "estimate"):
                self.refused(f"{shown}: |addresses begin with http://, https:// or s3://", command, address, code=64)
        (self.folder / "gs:").mkdir()
        (self.folder / "gs:" / "x?.tag").write_bytes(self.small)
        self.tagrid("verify", "gs:/x?.tag")
        self.tagrid("decode", "gs://x?.tag", "-o", "gs:/x.nrrd")

    # Object stores.

    def signed(self, secret, token=""):
        """A server that answers only requests with the right signature, which it computes itself."""
        def check(handler, _):
            headers = {name.lower(): value.strip() for name, value in handler.headers.items()}
            found = re.fullmatch(r"AWS4-HMAC-SHA256 Credential=(\w+)/(\d{8})/([\w-]+)/s3/aws4_request, ?"
                                 r"SignedHeaders=([\w;-]+), ?Signature=([0-9a-f]{64})",
                                 headers.get("authorization", ""))
            handler.server.wrong = ""
            if not found:
                handler.server.wrong = headers.get("authorization", "no signature")
                return handler.respond(403, {}, b"<Error><Code>AccessDenied</Code></Error>") or True
            key, day, region, names, signature = found.groups()
            lines = [f"{name}:{headers[name]}" for name in names.split(";")]
            path = urllib.parse.quote(urllib.parse.unquote(handler.path), safe="/-_.~")
            canonical = "\n".join(["GET", path, "", *lines, "", names, headers["x-amz-content-sha256"]])
            scope = f"{day}/{region}/s3/aws4_request"
            text = "\n".join(["AWS4-HMAC-SHA256", headers["x-amz-date"], scope,
                              hashlib.sha256(canonical.encode()).hexdigest()])
            signing = ("AWS4" + secret).encode()
            for part in (day, region, "s3", "aws4_request"):
                signing = hmac.new(signing, part.encode(), hashlib.sha256).digest()
            right = hmac.new(signing, text.encode(), hashlib.sha256).hexdigest()
            is_right = (signature == right and key == "KEY" and headers.get("x-amz-security-token", "") == token and
                        ("x-amz-security-token" in names.split(";")) == bool(token) and "host" in names.split(";") and
                        headers["x-amz-content-sha256"] == hashlib.sha256(b"").hexdigest())
            handler.server.region = region
            if is_right:
                handler.path = urllib.parse.unquote(handler.path)
                return False
            handler.server.wrong = canonical
            return handler.respond(403, {}, b"<Error><Code>SignatureDoesNotMatch</Code></Error>") or True
        return check

    def test_objects_are_read_with_a_right_signature(self):
        local = self.tagrid("decode", "local.tag", "-o", "-").stdout
        key = "scans/a b+c=d&~(1)/\u00e4.tag"
        for token in ("", "a/session+token=="):
            secret = "wJalrXUtnFEMI/K7MDENG+bPxRfiCYEXAMPLEKEY"
            files = {f"/bucket.x/{key}": self.data}
            with self.subTest(token), self.server(self.signed(secret, token), **files) as server:
                self.environment.update(AWS_ACCESS_KEY_ID="KEY", AWS_SECRET_ACCESS_KEY=secret, AWS_SESSION_TOKEN=token,
                                        AWS_ENDPOINT_URL=server.url + "/", AWS_REGION="eu-central-1")
                run = self.tagrid("decode", f"s3://bucket.x/{key}", "-o", "-", "-v")
                self.assertEqual((run.stdout, server.wrong, server.region), (local, "", "eu-central-1"))
                del self.environment["AWS_REGION"]
                self.environment["AWS_DEFAULT_REGION"] = "us-west-2"
                self.tagrid("info", f"s3://bucket.x/{key}", "--no-levels")
                self.assertEqual((server.wrong, server.region), ("", "us-west-2"))
                del self.environment["AWS_DEFAULT_REGION"]
                self.environment["AWS_SECRET_ACCESS_KEY"] = "another"
                message = self.refused(f"s3://bucket.x/{key}: the server answers 403 (SignatureDoesNotMatch)", "info",
                                       f"s3://bucket.x/{key}")
                self.assertNotIn("another", message)
                self.assertEqual(server.region, "us-east-1")

    def test_keys_are_not_paths(self):
        """Each key names its own object, and no other: those beside it hold another volume."""
        keys = ["a/../b.tag", "../other/x.tag", "a/./b.tag", "..", ".", "a//b.tag", "/b.tag", "%2e%2e/other/x.tag",
                "a?b.tag", "a#b.tag", "100%.tag", "a b.tag", "\u20ac/\u00e4.tag", "a/", "..%2fother/x.tag", "a&b=c+d.tag"]
        others = {f"/{bucket}/{key}": self.data for bucket in ("good", "other")
                  for key in ("b.tag", "x.tag", "a/b.tag", "a", "", "other/x.tag")}
        small = self.tagrid("decode", "small.tag", "-o", "-").stdout
        for key in keys:
            for secret in ("", "secret"):
                misbehave = self.signed(secret) if secret else lambda handler, _: setattr(
                    handler, "path", urllib.parse.unquote(handler.path))
                with self.subTest(key, secret=secret), self.server(
                        misbehave, **{**others, f"/good/{key}": self.small}) as server:
                    self.environment.update(AWS_ENDPOINT_URL=server.url)
                    if secret:
                        self.environment.update(AWS_ACCESS_KEY_ID="KEY", AWS_SECRET_ACCESS_KEY=secret)
                    self.assertEqual(self.tagrid("decode", f"s3://good/{key}", "-o", "-").stdout, small)
                    self.assertEqual({path for path, _ in server.requests},
                                     {"/good/" + urllib.parse.quote(key, safe="/-_.~")})
                    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
                        self.environment.pop(name, None)
        for bucket in ("..", "...", "a..b", ".good", "%2e%2e", "good%2f..%2fother"):
            self.refused("must be s3://BUCKET/KEY", "info", f"s3://{bucket}/x.tag", code=64)

    def test_an_object_has_no_user_and_no_signature(self):
        self.environment["AWS_ENDPOINT_URL"] = "http://127.0.0.1:9"
        for address in ("s3://KEY:SECRET@bucket/scan.tag", "s3://bucket/scan.tag?X-Amz-Signature=SECRET"):
            self.assertNotIn("SECRET", self.refused("s3://bucket/scan.tag", "info", address, code=64))

    def test_objects_without_keys_are_read_without_a_signature(self):
        with self.server(**{"/bucket/scan.tag": self.data}) as server:
            self.environment["AWS_ENDPOINT_URL"] = server.url
            self.tagrid("info", "s3://bucket/scan.tag", "--no-levels")
            self.assertFalse(any("Authorization" in headers for _, headers in server.requests))
        with self.server(self.signed("x")) as server:
            self.environment["AWS_ENDPOINT_URL"] = server.url
            self.refused("403 (AccessDenied); AWS_ACCESS_KEY_ID is not set", "info", "s3://bucket/scan.tag")
        elsewhere = {"x-amz-bucket-region": "eu-west-3"}
        with self.server(lambda handler, _: handler.respond(301, elsewhere) or True) as server:
            self.environment["AWS_ENDPOINT_URL"] = server.url
            self.refused('its bucket is in the region "eu-west-3"; set AWS_REGION', "info", "s3://bucket/scan.tag")
        self.environment["AWS_ENDPOINT_URL"] = "file:///"
        self.refused("AWS_ENDPOINT_URL", "info", "s3://bucket/scan.tag", code=64)
        self.refused("must be s3://BUCKET/KEY", "info", "s3://bucket", code=64)


if __name__ == "__main__":
    unittest.main()
