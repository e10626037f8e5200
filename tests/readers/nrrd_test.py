"""NRRD: what teem writes is read, compressed or with other than three axes, and places samples where teem places them.

    nrrd_test.py PROGRAM
"""

import bz2
import shutil
import subprocess
import unittest

import other_readers
from other_readers import ReaderTest

numpy = other_readers.library("numpy", "python3-numpy")
UNU = shutil.which("teem-unu")


def volume(shape=(5, 37, 41)):
    return numpy.random.default_rng(1).integers(-2000, 2000, shape, "int16")


@unittest.skipIf(numpy is None, "there is no numpy on this machine")
class Nrrd(ReaderTest):
    def write(self, name, samples, fields="", encoding="raw", stored=None):
        sizes = " ".join(map(str, reversed(samples.shape)))
        header = f"NRRD0005\ntype: short\ndimension: {samples.ndim}\nsizes: {sizes}\nencoding: {encoding}\nendian: little\n{fields}\n"
        (self.folder / name).write_bytes(header.encode() + (samples.tobytes() if stored is None else stored))
        return name

    def unu(self, *arguments):
        run = subprocess.run([UNU, *arguments], cwd=self.folder, stderr=subprocess.PIPE, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)

    @unittest.skipIf(UNU is None, "there is no teem-unu on this machine (teem-apps)")
    def test_what_teem_compresses(self):
        truth = volume()
        self.write("a.nrrd", truth)
        for name, *options in (("b.nrrd", "-f", "nrrd", "-e", "bz2"), ("b.nhdr", "-f", "nrrd", "-e", "bz2"), ("b.nrrd", "-f", "nrrd", "-e", "gz"),
                               ("b.nrrd", "-f", "nrrd", "-e", "bz2:9", "-en", "big")):
            self.unu("save", *options, "-i", "a.nrrd", "-o", name)
            self.assertIn(b"encoding: " + (b"gz" if "gz" in options else b"bz"), (self.folder / name).read_bytes()[:300])
            samples, info = self.encoded(name)
            self.assert_same(samples, truth, name)
            self.assertFalse(info["restorable"])
            self.assertEqual(self.tagrid("verify", "out.tag", "--against", name).returncode, 0)

    def test_bounds_are_for_values_in_what_decode_writes_too(self):
        truth = volume()
        for pairs, bound, range in (("rescale_slope:=-2.5\nrescale_intercept:=100\n", 4, "-900:100"),
                                    ("slice_slopes:=1 2 -2.5 1 1\nslice_intercepts:=0 0 0 0 9\n", 4, "0:1000"), ("rescale_slope:=0\n", 10, "0:400")):
            self.write("a.nrrd", truth, pairs)
            for name in ("a.nrrd", "a.nhdr", "a.h5", "a.vdb"):
                if name != "a.nrrd":
                    self.assertEqual(self.tagrid("decode", "first.tag", "-o", name, "-f").returncode, 0)
                self.assertEqual(self.tagrid("encode", name, "-o", "first.tag", "-f").returncode, 0)
                info = self.encoded(name, "--max-error", "10", "--surface-error", "5", "--range", range)[1]
                self.assertEqual((info["max_error"], info["surface_error"]), (bound, bound // 2), (name, pairs))
                low, high = info["range"]
                self.assertEqual((high - low), 400, (name, pairs))
        with open(self.folder / "a.nrrd", "rb") as pipe:
            self.write("a.nrrd", truth, "rescale_slope:=2.5\n")
            run = subprocess.run([other_readers.PROGRAM, "encode", "-", "-o", "pipe.tag", "--max-error", "10"], cwd=self.folder, stdin=pipe)
        self.assertEqual(run.returncode, 0)
        self.assertIn("bound 4,", self.tagrid("info", "pipe.tag").stdout)

    def test_bzip2_in_every_way_that_raw_samples_can_lie(self):
        truth = volume((6, 9, 11))
        samples = truth.tobytes()
        # Parallel compressors write many streams.
        streams = b"".join(bz2.compress(samples[at:at + 100]) for at in range(0, len(samples), 100))
        for stored, fields in ((bz2.compress(samples), ""), (streams, ""), (bz2.compress(b"abc" + samples), "byte skip: 3\n"),
                               (b"a line\n" + bz2.compress(samples), "line skip: 1\n")):
            self.assert_same(self.encoded(self.write("a.nrrd", truth, fields, "bzip2", stored))[0], truth, fields)
        for z in range(6):
            (self.folder / f"s{z}.bz2").write_bytes(bz2.compress(truth[z].tobytes()))
        self.assert_same(self.encoded(self.write("a.nhdr", truth, "data file: s%d.bz2 0 5 1\n", "bz2", b""))[0], truth)
        # From the beginning for every part; and from a pipe, once.
        wide = volume((4, 300, 500))
        self.write("wide.nrrd", wide, "", "bzip2", bz2.compress(wide.tobytes()))
        self.assert_same(self.encoded("wide.nrrd", "--resume")[0], wide)
        run = subprocess.run([other_readers.PROGRAM, "encode", "-", "-o", "-"], input=(self.folder / "wide.nrrd").read_bytes(), capture_output=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        (self.folder / "pipe.tag").write_bytes(run.stdout)
        self.assertEqual(self.tagrid("verify", "pipe.tag", "--against", "wide.nrrd").returncode, 0)

    def test_bzip2_that_is_damaged_is_refused(self):
        truth = volume((6, 30, 40))
        packed = bz2.compress(truth.tobytes())
        middle = len(packed) // 2
        damaged = packed[:middle] + bytes([packed[middle] ^ 1]) + packed[middle + 1:]
        for stored, text in ((damaged, "the bzip2 stream is damaged"), (packed[:middle], "the bzip2 stream ends too soon"), (b"", "ends too soon"),
                             (b"x" + packed, "is not a bzip2 stream"), (packed + b"x", "bytes after the end of the bzip2 stream"),
                             (packed + b"BZ", "ends too soon"), (bz2.compress(truth.tobytes()[:-2]), "but it ends after 14398"),
                             (bz2.compress(truth.tobytes() + b"x"), "but more are present"), (truth.tobytes(), "is not a bzip2 stream")):
            self.assert_refused(65, text, "encode", self.write("a.nrrd", truth, "", "bzip2", stored), "-o", "a.tag")
            self.assertFalse((self.folder / "a.tag").exists())
        # Nothing is allocated for samples that cannot be there.
        header = b"NRRD0005\ntype: short\ndimension: 3\nsizes: 2000000 2000000 2000\nencoding: bz2\nendian: little\n\n"
        (self.folder / "a.nrrd").write_bytes(header + packed[:100])
        self.assert_refused(65, "bytes of bzip2 cannot hold", "encode", "a.nrrd")

    @unittest.skipIf(UNU is None, "there is no teem-unu on this machine (teem-apps)")
    def test_axes_of_one_sample_are_those_that_teem_inserts(self):
        truth = volume()
        fields = "space: left-posterior-superior\nspace directions: (0.5,0,0) (0,0.25,0) (0,0,2)\nspace origin: (1,2,3)\nkinds: space space space\n"
        _, wanted = self.encoded(self.write("a.nrrd", truth, fields))
        for axis in range(4):
            self.unu("axinsert", "-a", str(axis), "-i", "a.nrrd", "-o", "b.nrrd")
            self.assertIn(b"dimension: 4", (self.folder / "b.nrrd").read_bytes())
            samples, info = self.encoded("b.nrrd")
            self.assert_same(samples, truth, axis)
            self.assertEqual(info["geometry"], wanted["geometry"])
            self.assertTrue(info["restorable"])
        # A slice that teem takes is a volume of one slice.
        self.unu("slice", "-a", "2", "-p", "3", "-i", "a.nrrd", "-o", "b.nrrd")
        self.assertIn(b"dimension: 2", (self.folder / "b.nrrd").read_bytes())
        samples, info = self.encoded("b.nrrd")
        self.assert_same(samples, truth[3:4])
        self.assertEqual(info["geometry"]["origin"], [1, 2, 9])
        self.assertEqual(info["geometry"]["spacing"][:2], [0.5, 0.25])
        # Of a volume of colors, the message says how many axes there are.
        self.write("c.nrrd", volume((5, 6, 7, 3)))
        self.assert_refused(65, "this file has 4 with more than one sample", "encode", "c.nrrd")


if __name__ == "__main__":
    other_readers.main()
