"""OME-Zarr that `decode` writes, as zarrita.js reads it.

zarrita is looked for in the directory of the environment variable TAGRID_NODE_MODULES; see CONTRIBUTING.md."""

import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time
import unittest
import zipfile

from hdf5_files import OBLIQUE, placed
from other_readers import PROGRAM, ReaderTest, main, numpy

MODULES = pathlib.Path(os.environ.get("TAGRID_NODE_MODULES", "/nonexistent"))
NODE = shutil.which("node")
HAS_ZARRITA = NODE is not None and (MODULES / "zarrita").is_dir() and (MODULES / "@zarrita/storage").is_dir()
if not HAS_ZARRITA:
    print("skipped: node is missing, or zarrita in the directory of TAGRID_NODE_MODULES (npm install zarrita)", file=sys.stderr)
TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"]


class Written(ReaderTest):
    def encode(self, type="int16", shape=(70, 40, 150), fields="spacings: 0.25 0.5 2\nunits: \"um\" \"um\" \"um\"\n", options=()):
        random = numpy.random.default_rng(1)
        z, y, x = numpy.ogrid[0:9:shape[0] * 1j, 0:5:shape[1] * 1j, 0:3:shape[2] * 1j]
        samples = (numpy.sin(x + y + z) * 100 + 101 * (type != "int8") + random.uniform(-5, 5, shape)).astype(type)
        self.write_nrrd("a.nrrd", samples, fields)
        self.ok("encode", "a.nrrd", "-o", "a.tag", "-f", "--range", "auto", *options)
        return samples

    def decode(self, name, *options):
        return self.ok("decode", "a.tag", "-o", name, *options).stderr

    def group(self, name):
        return json.loads((self.folder / name / "zarr.json").read_text())["attributes"]

    def names(self):
        return sorted(path.name for path in self.folder.iterdir())


@unittest.skipUnless(HAS_ZARRITA, "there is no zarrita on this machine")
class ByZarrita(Written):
    def read(self, name, array):
        """The samples as zarrita has them, and what it says of them."""
        shutil.copy(pathlib.Path(__file__).parent / "zarr_read.mjs", self.folder)
        if not (self.folder / "node_modules").exists():
            os.symlink(MODULES.resolve(), self.folder / "node_modules")
        run = subprocess.run([NODE, "zarr_read.mjs", name, array, "samples"], cwd=self.folder, text=True, capture_output=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        facts = json.loads(run.stdout)
        return numpy.fromfile(self.folder / "samples", numpy.dtype(facts["type"])).reshape(facts["shape"]), facts

    def assert_shown(self, shown, samples, scale):
        """That ome-zarr.js, if it is there, finds the level and draws its first slice."""
        if shown is None:
            return
        self.assertEqual((shown["version"], shown["axes"], shown["shape"], shown["scale"]),
                         (3, ["z", "y", "x"], list(samples.shape), scale))
        height, width = (min(n, m) for n, m in zip(samples.shape[1:], (shown["height"], shown["width"])))
        grey = numpy.array(shown["grey"]).reshape(shown["height"], shown["width"])[:height, :width]
        low, high = shown["ends"]
        expected = 255 * (samples[0, :height, :width] - low) / (high - low)
        self.assertLess(abs(grey - expected).max(), 1.01)

    def test_every_type(self):
        for type in TYPES:
            truth = self.encode(type, fields="")
            for name in ("a.ome.zarr", "a.ozx"):
                self.decode(name, "-f")
                samples, facts = self.read(name, "/0")
                self.assert_same(samples, truth, (type, name))
                self.assertEqual(facts["chunks"], [64, 64, 64])

    def test_volumes_beyond_a_shard_and_a_layer(self):
        truth = self.encode("uint8", (130, 70, 1100))
        self.decode("a.ome.zarr")
        samples, facts = self.read("a.ome.zarr", "/0")
        self.assert_same(samples, truth)
        chunks = self.folder / "a.ome.zarr/0/c"
        self.assertEqual(sorted(str(path.relative_to(chunks)) for path in chunks.rglob("*") if path.is_file()),
                         [f"{z}/0/{x}" for z in range(3) for x in range(2)])
        truth = self.encode("uint8", (3, 1100, 20))
        self.decode("b.ozx")
        self.assert_same(self.read("b.ozx", "/0")[0], truth)

    def test_levels_are_the_overviews(self):
        self.encode("float32", (70, 90, 150), options=("--overviews", "4,16", "--max-error", "0.5"))
        for name in ("a.ome.zarr", "a.ozx"):
            self.decode(name)
            for number, factor in enumerate((4, 16), 1):
                self.ok("decode", "a.tag", "--overview", factor, "-o", "level.nrrd", "-f")
                self.ok("decode", "a.tag", "--overview", factor, "-o", "level.raw", "-f")
                self.ok("encode", "level.nrrd", "-o", "level.tag", "-f", "--range", "auto")
                geometry = self.info("level.tag")["geometry"]
                samples, facts = self.read(name, f"/{number}")
                self.assertEqual(samples.tobytes(), (self.folder / "level.raw").read_bytes())
                scale, translation = facts["attributes"]["ome"]["multiscales"][0]["datasets"][number]["coordinateTransformations"]
                self.assertEqual(scale["scale"], geometry["spacing"][::-1])
                self.assert_shown(facts["shown"], samples, scale["scale"])
                # The centers of the blocks: ngff-spec#125.
                self.assertEqual(translation["translation"], [(factor - 1) / 2 * s for s in (2, .5, .25)])
                self.assertEqual(self.ok("encode", name, "--dataset", number, "-o", "one.tag", "-f", "--range", "auto").returncode, 0)
                self.assertEqual(self.info("one.tag")["geometry"]["spacing"], geometry["spacing"])

    def test_a_region_lies_where_it_was(self):
        truth = self.encode()
        self.decode("a.ome.zarr", "--region", "10:100,3:30,20:")
        samples, facts = self.read("a.ome.zarr", "/0")
        self.assert_same(samples, truth[20:, 3:30, 10:100])
        self.assertEqual(facts["attributes"]["ome"]["multiscales"][0]["datasets"][0]["coordinateTransformations"],
                         [{"type": "scale", "scale": [2, .5, .25]}, {"type": "translation", "translation": [40, 1.5, 2.5]}])

    def test_chunks_of_zeros_are_not_stored(self):
        truth = numpy.zeros((70, 130, 130), "uint16")
        truth[65, 1, 129] = 5
        self.write_nrrd("a.nrrd", truth)
        self.ok("encode", "a.nrrd", "-o", "a.tag", "--range", "auto")
        self.decode("a.ome.zarr")
        self.assert_same(self.read("a.ome.zarr", "/0")[0], truth)
        self.assertEqual((self.folder / "a.ome.zarr/0/c/0/0/0").stat().st_size, 16 * 256 + 4)
        self.encodes(truth, "a.ome.zarr")
        # Nothing tells a reader whether they were left out on purpose.
        self.assertIn("17 of 18 chunks are missing; their samples are the fill value", self.messages)


class ByTagrid(Written):
    def assert_comes_back(self, name):
        """Every header line, and every voxel."""
        self.ok("decode", "a.tag", "-o", "before.nrrd", "-f", "--samples")
        self.ok("encode", name, "-o", "again.tag", "-f", "--range", "auto")
        self.ok("decode", "again.tag", "-o", "after.nrrd", "-f", "--samples")
        self.assertEqual((self.folder / "before.nrrd").read_bytes(), (self.folder / "after.nrrd").read_bytes(), name)

    def test_every_header_line_comes_back(self):
        oblique = "space: left-posterior-superior\nspace directions: (0.4,0.3,0) (-0.3,0.4,0) (0,0,2.5)\n" + \
            "space origin: (10,-20,30.5)\nspace units: \"mm\" \"mm\" \"mm\"\n"
        for fields in ("", "spacings: 0.25 0.5 2\n", oblique, "spacings: 1 2 3\nunits: \"mm\" \"um\" \"mm\"\n",
                       "spacings: 1 2 3\nunits: \"s\" \"s\" \"s\"\n", "content: head\nowner:=J. Doe\\n\u00b5\n# a remark\n", "spacings: nan nan 2\n"):
            self.encode(fields=fields, shape=(5, 6, 7))
            for name in ("a.ome.zarr", "a.ozx"):
                said = self.decode(name, "-f")
                self.assertEqual("has no directions of axes" in said, fields == oblique)
                self.assert_comes_back(name)

    def test_what_somebody_changed_counts(self):
        self.encode(shape=(5, 6, 7))
        self.decode("a.ome.zarr")
        path = self.folder / "a.ome.zarr/zarr.json"
        metadata = json.loads(path.read_text())
        metadata["attributes"]["ome"]["multiscales"][0]["datasets"][0]["coordinateTransformations"][0]["scale"] = [9, 8, 7]
        path.write_text(json.dumps(metadata))
        self.assertEqual(self.encoded("a.ome.zarr")[1]["geometry"]["spacing"], [7, 8, 9])

    def test_what_samples_mean_stays_where_places_are_others(self):
        self.encode(fields=placed(OBLIQUE) + "rescale_slope:=2\nrescale_intercept:=-1024\nlossy source:=JPEG\n", options=("--overviews", "4"))
        self.decode("a.ome.zarr", "--samples")
        path = self.folder / "a.ome.zarr/zarr.json"
        metadata = json.loads(path.read_text())
        metadata["attributes"]["ome"]["multiscales"][0]["datasets"][0]["coordinateTransformations"][0]["scale"] = [9, 8, 7]
        path.write_text(json.dumps(metadata))
        for level in "01":
            pairs = self.encoded("a.ome.zarr", "--dataset", level, says="its directions and coordinate system are left out")[1]["source"]["pairs"]
            self.assertEqual([pairs[key] for key in ("rescale_slope", "rescale_intercept", "lossy source")], ["2", "-1024", "JPEG"], level)

    def test_attributes(self):
        truth = self.encode(options=("--max-error", "3"))
        said = self.decode("a.ome.zarr")
        self.assertIn("a.ome.zarr: has the finest level alone", said)
        attributes = self.group("a.ome.zarr")
        info = self.info("a.tag")
        self.assertEqual((attributes["tagrid"]["max_error"], attributes["tagrid"]["achieved_max_error"]), (3, info["achieved"]["max_error"]))
        ome = attributes["ome"]
        self.assertEqual(ome["version"], "0.5")
        self.assertEqual([axis["unit"] for axis in ome["multiscales"][0]["axes"]], ["micrometer"] * 3)
        window = ome["omero"]["channels"][0]["window"]
        self.assertEqual((window["min"], window["max"]), (truth.min(), truth.max()))
        with open(self.folder / "a.tag", "rb") as file:
            subprocess.run([PROGRAM, "decode", "-", "-o", "pipe.ome.zarr"], stdin=file, cwd=self.folder, check=True, capture_output=True)
        attributes = self.group("pipe.ome.zarr")["tagrid"]
        self.assertEqual((attributes["max_error"], attributes["achieved_max_error"]), (3, None))

    def test_values_are_written_where_they_fit(self):
        truth = self.encode(shape=(5, 6, 7), fields="rescale_slope:=1\nrescale_intercept:=-1024\n")
        self.decode("a.ome.zarr")
        self.assert_same(self.encoded("a.ome.zarr")[0], truth - 1024)
        self.encode(shape=(5, 6, 7), fields="rescale_slope:=0.5\nrescale_intercept:=1\n")
        self.assertIn("OME-Zarr has no place for slope and intercept", self.decode("a.ome.zarr", "-f"))

    def test_a_zip_file_is_as_rfc_9_recommends(self):
        self.encode("uint8", (70, 40, 150), options=("--overviews", "4,16"))
        self.decode("a.ozx")
        with zipfile.ZipFile(self.folder / "a.ozx") as file:
            self.assertIsNone(file.testzip())
            self.assertEqual([member.filename for member in file.infolist()][:4], ["zarr.json"] + [f"{i}/zarr.json" for i in range(3)])
            self.assertEqual({member.compress_type for member in file.infolist()}, {zipfile.ZIP_STORED})
            self.assertEqual(json.loads(file.comment.rstrip(b"\0")), {"ome": {"version": "0.5"}})
            self.assertEqual([member.header_offset for member in file.infolist()], sorted(member.header_offset for member in file.infolist()))
            self.decode("a.ome.zarr")
            for member in file.infolist():
                if member.filename != "zarr.json":
                    self.assertEqual(file.read(member), (self.folder / "a.ome.zarr" / member.filename).read_bytes(), member.filename)

    def test_the_same_bytes_each_time(self):
        self.encode(options=("--overviews", "4"))
        for threads in (1, 3):
            (self.folder / str(threads)).mkdir()
            self.decode(f"{threads}/a.ozx", "-T", threads)
        self.assertEqual((self.folder / "1/a.ozx").read_bytes(), (self.folder / "3/a.ozx").read_bytes())

    def test_an_existing_directory(self):
        truth = self.encode(shape=(5, 6, 7))
        self.decode("a.ome.zarr")
        before = self.names()
        self.assert_refused(64, "already exists", "decode", "a.tag", "-o", "a.ome.zarr")
        (self.folder / "a.ome.zarr/left over").write_text("x")
        self.decode("a.ome.zarr", "-f")
        self.assertFalse((self.folder / "a.ome.zarr/left over").exists())
        self.encodes(truth, "a.ome.zarr")
        (self.folder / "b.ome.zarr").mkdir()
        (self.folder / "b.ome.zarr/thesis").write_text("x")
        self.assert_refused(64, "is a directory of other files, which is not replaced", "decode", "a.tag", "-o", "b.ome.zarr", "-f")
        self.assertTrue((self.folder / "b.ome.zarr/thesis").exists())
        (self.folder / "c.ome.zarr").write_text("x")
        self.assert_refused(64, "is a file", "decode", "a.tag", "-o", "c.ome.zarr", "-f")
        self.assert_refused(64, "not written to the standard output", "decode", "a.tag", "-o", "-", "--format", "zarr")
        self.assert_refused(74, "cannot create", "decode", "a.tag", "-o", "nowhere/a.ome.zarr")
        self.assertEqual([name for name in self.names() if name.startswith(".")], [])
        self.assertIn("a.ome.zarr", before)

    def test_a_damaged_file_leaves_what_was_there(self):
        self.encode("int16", (130, 40, 50))
        self.decode("a.ome.zarr")
        before = (self.folder / "a.ome.zarr/zarr.json").read_bytes()
        content = bytearray((self.folder / "a.tag").read_bytes())
        content[len(content) // 2] ^= 1
        (self.folder / "a.tag").write_bytes(content)
        self.assert_refused(65, "a.tag", "decode", "a.tag", "-o", "a.ome.zarr", "-f")
        self.assert_refused(65, "a.tag", "decode", "a.tag", "-o", "b.ozx")
        self.assertEqual((self.folder / "a.ome.zarr/zarr.json").read_bytes(), before)
        self.assertEqual([name for name in self.names() if name.startswith(".") or name == "b.ozx"], [])

    def test_a_signal_leaves_nothing_and_a_kill_is_cleaned_up(self):
        self.encode("int16", (200, 300, 300), options=("--max-error", "2"))
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGKILL):
            run = subprocess.Popen([PROGRAM, "decode", "a.tag", "-o", "a.ome.zarr", "-T", "1"], cwd=self.folder, stderr=subprocess.DEVNULL)
            for _ in range(2000):
                if any(path.is_file() for path in self.folder.glob(".a.ome.zarr.part*/0/c/0/0/0")):
                    break
                time.sleep(0.002)
            run.send_signal(number)
            run.wait()
            if run.returncode == 0:
                self.skipTest("this machine decodes faster than it is told to stop")
            left = [name for name in self.names() if "ome.zarr" in name]
            self.assertEqual(len(left), 1 if number == signal.SIGKILL else 0, (number, left))
        self.decode("a.ome.zarr")
        self.assertEqual([name for name in self.names() if "ome.zarr" in name], ["a.ome.zarr"])

    def test_memory_is_limited(self):
        """A layer of chunks waits in a file: 1000 x 1000 x 64 samples are 128 MB."""
        self.ok("phantom", "--dims", "1000,1000,80", "-o", "p.nrrd")
        self.ok("encode", "p.nrrd", "-o", "a.tag", "--max-error", "5", "--overviews", "none")
        self.decode("a.ozx", "-M", "60M", "-T", "1", "--spool", ".")
        self.ok("decode", "a.tag", "-o", "a.raw")
        self.ok("encode", "a.ozx", "-o", "again.tag", "--range", "auto")
        self.ok("decode", "again.tag", "-o", "again.raw")
        self.assertEqual((self.folder / "a.raw").read_bytes(), (self.folder / "again.raw").read_bytes())


if __name__ == "__main__":
    main()
