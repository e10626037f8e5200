"""`tagrid serve` gives volumes as OME-Zarr to programs of this machine that know the address, and to no page unless it
is named.

zarrita is looked for as tests/readers/zarr_written_test.py does."""

import html
import json
import math
import os
import shutil
import subprocess
import threading
import unittest
from pathlib import Path
from urllib.parse import unquote, urlsplit

from local_server import LocalServer
from program import TAGRID, ProgramTest, numpy

import scans

NODE = shutil.which("node")
MODULES = Path(os.environ.get("TAGRID_NODE_MODULES", "/nonexistent"))
NEUROGLANCER = "https://neuroglancer-demo.appspot.com"


class Server(LocalServer):
    """A running `tagrid serve` of so many files. `roots`: the paths of their images."""

    def __init__(self, test, *arguments, files=1):
        super().__init__(test, "serve", *arguments)
        self.addresses = [self.line() for _ in range(files)]
        for address in self.addresses:
            test.assertRegex(address, r"^http://127\.0\.0\.1:\d+/[0-9a-f]{32}/[^/]+\.zarr/$")
        self.port = urlsplit(self.addresses[0]).port
        self.roots = [urlsplit(address).path for address in self.addresses]
        self.root = self.roots[0]

    def json(self, key, root=None):
        answer = self.ask((root or self.root) + key)
        self.test.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "application/json"), key)
        return json.loads(answer.content)

    def peak_memory(self):
        """Bytes that it has had at most."""
        lines = Path(f"/proc/{self.process.pid}/status").read_text().splitlines()
        return 1024 * int(next(line.split()[1] for line in lines if line.startswith("VmHWM:")))

    def array(self, level, root=None):
        """All samples of an array, from its chunks, without a library of Zarr."""
        about = self.json(f"{level}/zarr.json", root)
        shape, chunk = about["shape"], about["chunk_grid"]["configuration"]["chunk_shape"]
        self.test.assertEqual(about["codecs"], [{"name": "bytes", "configuration": {"endian": "little"}}])
        dtype = numpy.dtype(about["data_type"]).newbyteorder("<")
        samples = numpy.empty(shape, dtype)
        for index in numpy.ndindex(*(math.ceil(n / c) for n, c in zip(shape, chunk))):
            answer = self.ask(f"{root or self.root}{level}/c/{'/'.join(map(str, index))}")
            self.test.assertEqual(answer.status, 200)
            whole = numpy.frombuffer(answer.content, dtype).reshape(chunk)
            places = tuple(slice(i * c, min((i + 1) * c, n)) for i, c, n in zip(index, chunk, shape))
            inside = tuple(slice(place.stop - place.start) for place in places)
            samples[places] = whole[inside]
            outside = numpy.ones(chunk, bool)
            outside[inside] = False
            self.test.assertFalse(whole[outside].any())
        return samples


class Serve(ProgramTest):
    program = TAGRID

    def make(self, name, *options, dims="90,80,70", type="int16"):
        self.tagrid("phantom", "--dims", dims, "--type", type, "-o", "a.nrrd", "-q", "-f")
        self.tagrid("encode", "a.nrrd", "-o", name, "-q", "-f", *options)

    def serve(self, *arguments, **options):
        return Server(self, *arguments, **options)

    def decoded(self, name, dtype, *options):
        self.tagrid("decode", name, "-o", "b.raw", "-q", "-f", *options)
        return numpy.fromfile(self.folder / "b.raw", dtype)

    def test_every_type_and_overview_has_the_samples_that_decode_writes(self):
        for type in ("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"):
            self.make("a.tag", "--overviews", "4,16", "--range", "auto", "--max-error", "1", dims="130,70,66", type=type)
            server = self.serve("a.tag")
            for level, options in enumerate([(), ("--overview", "4"), ("--overview", "16")]):
                samples = server.array(level)
                self.assertEqual(samples.dtype, type)
                self.assertEqual(samples.tobytes(), self.decoded("a.tag", type, *options).tobytes(), (type, level))
            server.end()

    def test_a_chunk_is_a_brick(self):
        self.make("a.tag", dims="200,150,90")
        server = self.serve("a.tag")
        grid = server.json("0/zarr.json")["chunk_grid"]["configuration"]
        self.assertEqual(grid["chunk_shape"], [64, 64, 64])
        # The bricks of a file without a lead begin one sample later.
        for options in (("--lead", "0"), ("--brick", "1"), ("--psnr", "45")):
            self.make("b.tag", *options, dims="200,150,90")
            self.assertEqual(self.serve("b.tag").array(0).tobytes(), self.decoded("b.tag", "int16").tobytes(), options)

    def test_a_slice_and_a_small_volume(self):
        for dims, chunk in (("70,65,1", [1, 64, 64]), ("5,3,2", [2, 3, 5])):
            self.make("a.tag", dims=dims)
            server = self.serve("a.tag")
            self.assertEqual(server.json("0/zarr.json")["chunk_grid"]["configuration"]["chunk_shape"], chunk)
            self.assertEqual(server.array(0).tobytes(), self.decoded("a.tag", "int16").tobytes())

    def test_the_metadata_is_that_of_decode(self):
        samples = numpy.arange(60 * 70 * 80, dtype="<u2").reshape(60, 70, 80)
        fields = 'spacings: 0.25 0.5 2\nunits: "um" "um" "um"\nrescale_slope:=1\nrescale_intercept:=-1024\n'
        (self.folder / "a.nrrd").write_bytes(scans.nrrd(samples % 4000, fields))
        self.tagrid("encode", "a.nrrd", "-o", "a.tag", "-q", "--overviews", "4,16")
        self.tagrid("decode", "a.tag", "-o", "a.ome.zarr", "-q")
        server = self.serve("a.tag")
        written = json.loads((self.folder / "a.ome.zarr/zarr.json").read_text())
        self.assertEqual(server.json("zarr.json"), written)
        scale, translation = written["attributes"]["ome"]["multiscales"][0]["datasets"][1]["coordinateTransformations"]
        self.assertEqual((scale["scale"], translation["translation"]), ([8, 2, 1], [3, .75, .375]))
        # Values, as decode writes them.
        values = server.array(0)
        self.assertEqual(values.dtype, "int16")
        self.assertTrue((values == (samples % 4000).astype(int) - 1024).all())
        self.assertEqual(server.array(1).tobytes(), self.decoded("a.tag", "int16", "--values", "--overview", "4").tobytes())

    def test_what_viewers_cannot_know_is_said(self):
        for fields, words in (("rescale_slope:=2.5\n", "stored samples"),
                              ("space: left-posterior-superior\nspace directions: (0,1,0) (1,0,0) (0,0,1)\n", "directions")):
            (self.folder / "a.nrrd").write_bytes(scans.nrrd(numpy.arange(120, dtype="uint8").reshape(6, 5, 4), fields))
            self.tagrid("encode", "a.nrrd", "-o", "a.tag", "-q", "-f")
            server = self.serve("a.tag")
            self.assertEqual(server.array(0).ravel().tolist(), list(range(120)))
            server.end()
            self.assertIn(words, server.process.stderr.read())

    @unittest.skipUnless(NODE and (MODULES / "zarrita").is_dir(), "there is no zarrita on this machine")
    def test_zarrita_reads_it(self):
        self.make("my scan%.tag", "--overviews", "4", dims="130,70,66")
        server = self.serve("my scan%.tag")
        shutil.copy(Path(__file__).resolve().parents[2] / "readers" / "zarr_read.mjs", self.folder)
        os.symlink(MODULES.resolve(), self.folder / "node_modules")
        for level, options in enumerate([(), ("--overview", "4")]):
            run = subprocess.run([NODE, "zarr_read.mjs", server.addresses[0], f"/{level}", "samples"], cwd=self.folder,
                                 text=True, capture_output=True, check=False)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertEqual((self.folder / "samples").read_bytes(), self.decoded("my scan%.tag", "int16", *options).tobytes())
            self.assertEqual(json.loads(run.stdout)["names"], ["z", "y", "x"])

    def test_several_files(self):
        self.make("a.tag")
        self.make("b.tag", dims="40,30,20", type="uint8")
        server = self.serve("a.tag", "b.tag", files=2)
        for root, name, dtype in zip(server.roots, ("a.tag", "b.tag"), ("int16", "uint8")):
            self.assertEqual(server.array(0, root).tobytes(), self.decoded(name, dtype).tobytes())
        (self.folder / "c").mkdir()
        shutil.copy(self.folder / "a.tag", self.folder / "c")
        self.tagrid("serve", "a.tag", "c/a.tag", code=64)

    def test_one_of_several_volumes(self):
        (self.folder / "a.nii").write_bytes(scans.nifti(numpy.arange(120, dtype="uint8").reshape(2, 3, 4, 5)))
        self.tagrid("encode", "a.nii", "-o", "a.tag", "-q")
        server = self.serve("a.tag", "--volume", "1")
        self.assertEqual(server.array(0).ravel().tolist(), list(range(60, 120)))
        self.tagrid("serve", "a.tag", "--volume", "2", code=64)

    def test_nothing_else(self):
        self.make("a.tag", "--overviews", "4")
        server = self.serve("a.tag")
        (self.folder / "secret").write_text("secret")
        token = server.root.split("/")[1]
        for path in ("/", f"/{token}", f"/{token}/.", server.root[:-1], server.root + "/",
                     "/" + "0" * 32 + "/a.zarr/zarr.json", "/a.zarr/zarr.json", f"/{token}/b.zarr/zarr.json", f"/{token}/a.tag", f"/{token}/../secret"):
            self.assertEqual(server.ask(path).status, 404, path)
        for key in ("../secret", "%2e%2e/secret", "0", "0/", "0/c", "0/c/", "0/c/0", "0/c/0/0", "0/c/0/0/", "0/c/0/0/0/0",
                    "0/c/0/0/2", "0/c/2/0/0", "0/c/-1/0/0", "0/c/+0/0/0", "0/c/00/0/0", "0/c/0x0/0/0", "0/c/%200/0/0", "0/c/0//0",
                    "0/c/99999999999999999999/0/0", "0/c/9223372036854775807/0/0", "2/zarr.json", "2/c/0/0/0", "00/zarr.json",
                    "-0/zarr.json", "18446744073709551616/zarr.json", "0/zarr.jsonx", "0/0/0/0", "0/.zarray", ".zgroup", "/zarr.json",
                    "zarr.json/", "0/c/0/0/0%00", "0/c/0/0/0/"):
            self.assertEqual(server.ask(server.root + key).status, 404, key)
        self.assertEqual(server.ask(server.root + "zarr.json", host=f"example.org:{server.port}").status, 403)
        self.assertEqual(server.ask(server.root + "zarr.json", "PUT").status, 405)
        self.assertEqual(server.ask(server.root + "zarr.json", "OPTIONS").status, 405)
        self.assertEqual(server.listening(), [f"0100007F:{server.port:04X}"])

    def test_parts_of_chunks(self):
        """view_test.py has all kinds of ranges, which the same server gives."""
        self.make("a.tag")
        server = self.serve("a.tag")
        path = server.root + "0/c/1/0/0"
        whole = server.ask(path).content
        answer = server.ask(path, Range="bytes=70001-70004")
        self.assertEqual((answer.status, answer.content), (206, whole[70001:70005]))

    def test_pages_read_only_if_they_are_named(self):
        self.make("a.tag")
        path = "zarr.json"
        server = self.serve("a.tag", "--origin", NEUROGLANCER, "--origin", "http://localhost:8080")
        for origin in (NEUROGLANCER, "http://localhost:8080"):
            answer = server.ask(server.root + path, Origin=origin)
            self.assertEqual((answer.status, answer.headers["Access-Control-Allow-Origin"]), (200, origin))
            answer = server.ask(server.root + "0/c/9/9/9", Origin=origin)  # viewers tell a missing chunk from a refusal
            self.assertEqual((answer.status, answer.headers["Access-Control-Allow-Origin"]), (404, origin))
            answer = server.ask(server.root + path, "OPTIONS", Origin=origin, Access_Control_Request_Method="GET",
                                Access_Control_Request_Headers="range")
            self.assertEqual((answer.status, answer.content, answer.headers["Access-Control-Allow-Headers"]), (200, b"", "Range"))
        unnamed = self.serve("a.tag")
        for server, origin in ((server, "https://example.org"), (server, NEUROGLANCER + ".example.org"), (server, NEUROGLANCER + ":444"),
                               (server, "null"), (server, ""), (unnamed, NEUROGLANCER), (unnamed, "null"), (unnamed, "*")):
            answer = server.ask(server.root + path, Origin=origin)
            self.assertEqual([name for name in answer.headers if name.lower().startswith("access-control")], [], origin)
            self.assertEqual(server.ask(server.root + path, "OPTIONS", Origin=origin).status, 405)
        twice = f"GET {server.root}zarr.json HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n" + f"Origin: {NEUROGLANCER}\r\n" * 2
        self.assertEqual(server.raw((twice + "\r\n").encode())[:12], "HTTP/1.1 400")
        for origin in ("*", "null", "", "https://", "ftp://a", "https://a/", "https://a/b", "https://a b", "https://A", "https://a\r\nb: c",
                       "https://a?b", "https://user@a", "https://a:", "https://a:b", "https://a:0",
                       "https://a:0443", "https://a:65536", "https://a:1:2", "https://[::1", "https://:1", "https://" + 120000 * "a"):
            self.tagrid("serve", "a.tag", "--origin", origin, code=64)

    def test_an_origin_with_the_port_that_it_has_anyway(self):
        """Browsers leave that port out."""
        self.make("a.tag")
        given = ("https://x.org:443", "http://y.org:80", "https://z.org:80", "http://[::1]:80")
        server = self.serve("a.tag", *(word for origin in given for word in ("--origin", origin)))
        for origin in ("https://x.org", "http://y.org", "https://z.org:80", "http://[::1]"):
            answer = server.ask(server.root + "zarr.json", Origin=origin)
            self.assertEqual(answer.headers["Access-Control-Allow-Origin"], origin)
        server.end()
        self.assertIn("https://x.org/#!", server.process.stderr.read())

    def test_a_page_for_people(self):
        self.make("a.tag", "--overviews", "4", dims="90,80,70")
        self.make("<b>&.tag", dims="40,30,20")
        server = self.serve("a.tag", "<b>&.tag", "--origin", NEUROGLANCER, files=2)
        for path in (f"/{server.root.split('/')[1]}/", *server.roots):
            answer = server.ask(path)
            self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "text/html; charset=utf-8"))
            text = answer.content.decode()
            self.assertNotIn("<b>", text)
            shown = html.unescape(text)
            for words in (*server.addresses, "a, 90 x 80 x 70 samples, levels: 2",
                          "<b>&, 40 x 30 x 20 samples, levels: 1", f'"{NEUROGLANCER}/#!'):
                self.assertIn(words, shown)
        headers = server.ask(server.root, Origin="https://example.org").headers
        self.assertIsNone(headers["Access-Control-Allow-Origin"])

    def test_the_address_for_neuroglancer(self):
        self.make("my scan.tag")
        server = self.serve("my scan.tag", "--origin", NEUROGLANCER)
        server.end()
        address = next(word for word in server.process.stderr.read().split() if word.startswith(NEUROGLANCER + "/#!"))
        layers = json.loads(unquote(address.partition("#!")[2]))["layers"]
        samples = self.decoded("my scan.tag", "int16")
        self.assertEqual(layers, [{"type": "image", "name": "my scan", "source": "zarr://" + server.addresses[0],
                                   "shaderControls": {"normalized": {"range": [samples.min(), samples.max()]}}}])
        unnamed = self.serve("my scan.tag")
        unnamed.end()
        self.assertIn("--origin " + NEUROGLANCER, unnamed.process.stderr.read())
        quiet = self.serve("my scan.tag", "-q")
        self.assertEqual(quiet.end()[0], 0)
        self.assertEqual(quiet.process.stderr.read(), "")

    def test_many_at_once(self):
        self.make("a.tag", dims="200,200,130")
        server = self.serve("a.tag")
        expected = {(z, y, x): server.ask(f"{server.root}0/c/{z}/{y}/{x}").content
                    for z in range(3) for y in range(4) for x in range(4)}
        wrong = []

        def read(seed):
            for i in range(20):
                index = list(expected)[(seed * 17 + i * 29) % len(expected)]
                if server.ask(f"{server.root}0/c/{'/'.join(map(str, index))}").content != expected[index]:
                    wrong.append(index)

        threads = [threading.Thread(target=read, args=(seed,)) for seed in range(12)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])

    @unittest.skipIf(b"__asan_init" in TAGRID.read_bytes(), "a sanitizer takes memory of its own")
    def test_requests_that_wait_take_no_memory(self):
        self.make("a.tag", "--brick", "4", "--max-error", "50", "--grid", "derived", dims="130,130,130")
        processors = os.sched_getaffinity(0)
        os.sched_setaffinity(0, {min(processors)})
        try:
            server = self.serve("a.tag")
        finally:
            os.sched_setaffinity(0, processors)
        path = server.root + "0/c/0/0/0"
        before = server.peak_memory()
        chunk = len(server.ask(path).content)
        self.assertEqual(chunk, 2 * 128 ** 3)
        statuses = []
        threads = [threading.Thread(target=lambda: statuses.append(server.ask(path).status)) for _ in range(24)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(statuses, [200] * 24)
        # One is decoded, and some are being sent.
        self.assertLess(server.peak_memory() - before, 12 * chunk)

    def test_a_damaged_brick_is_an_error_and_the_others_are_not(self):
        self.make("a.tag", dims="130,60,60")
        data = bytearray((self.folder / "a.tag").read_bytes())
        data[len(data) // 2] ^= 1
        (self.folder / "a.tag").write_bytes(data)
        server = self.serve("a.tag")
        statuses = [server.ask(f"{server.root}0/c/0/0/{x}").status for x in range(3)]
        self.assertEqual(sorted(statuses), [200, 200, 500])
        self.assertEqual(server.ask(server.root + "zarr.json").status, 200)

    def test_a_damaged_overview_is_left_out(self):
        self.make("a.tag", "--overviews", "4,16", dims="130,70,66")
        sound = (self.folder / "a.tag").read_bytes()
        expected = [self.decoded("a.tag", "int16", *options).tobytes()
                    for options in ((), ("--overview", "4"), ("--overview", "16"))]
        # The header of an overview is where its content begins.
        starts = [at for at in range(1, len(sound)) if sound.startswith(sound[:8], at)]
        self.assertEqual(len(starts), 2)
        for broken, left in ((0, [0, 2]), (1, [0, 1])):
            data = bytearray(sound)
            data[starts[broken] + 12] ^= 1
            (self.folder / "a.tag").write_bytes(data)
            server = self.serve("a.tag")
            levels = server.json("zarr.json")["attributes"]["ome"]["multiscales"][0]["datasets"]
            self.assertEqual([level["path"] for level in levels], ["0", "1"])
            self.assertEqual([server.array(level).tobytes() for level in (0, 1)], [expected[number] for number in left])
            self.assertEqual(levels[1]["coordinateTransformations"][0]["scale"], [4 if broken else 16] * 3)
            self.assertEqual(server.ask(server.root + "2/zarr.json").status, 404)
            server.end()
            self.assertRegex(server.process.stderr.read(), "a.tag: an overview is not served: .*overview.*damaged")

    def test_what_cannot_be_served(self):
        (self.folder / "text.tag").write_text("text")
        for name, code in [("text.tag", 65), ("none.tag", 74), (".", 64), ("-", 64)]:
            run = self.tagrid("serve", name, code=code, stdin=subprocess.DEVNULL)
            self.assertEqual(run.stdout, b"", name)
        self.tagrid("serve", code=64)


if __name__ == "__main__":
    unittest.main()
