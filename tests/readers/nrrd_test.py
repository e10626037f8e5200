"""NRRD: what teem writes is read, compressed or with other than three axes, and places samples where teem places them."""

import bz2
import gzip
import shutil
import subprocess
import unittest

from other_readers import PROGRAM, ReaderTest, main, numpy

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
            info = self.encodes(truth, name, what=name)
            self.assertFalse(info["restorable"])
            self.ok("verify", "out.tag", "--against", name)

    def test_bounds_are_for_values_in_what_decode_writes_too(self):
        truth = volume()
        for pairs, bound, range in (("rescale_slope:=-2.5\nrescale_intercept:=100\n", 4, "-900:100"),
                                    ("slice_slopes:=1 2 -2.5 1 1\nslice_intercepts:=0 0 0 0 9\n", 4, "0:1000"), ("rescale_slope:=0\n", 10, "0:400")):
            self.write("a.nrrd", truth, pairs)
            for name in ("a.nrrd", "a.nhdr", "a.h5", "a.vdb"):
                if name != "a.nrrd":
                    self.ok("decode", "first.tag", "-o", name, "-f")
                self.ok("encode", name, "-o", "first.tag", "-f")
                info = self.encoded(name, "--max-error", "10", "--surface-error", "5", "--range", range)[1]
                self.assertEqual((info["max_error"], info["surface_error"]), (bound, bound // 2), (name, pairs))
                low, high = info["range"]
                self.assertEqual((high - low), 400, (name, pairs))
        with open(self.folder / "a.nrrd", "rb") as pipe:
            self.write("a.nrrd", truth, "rescale_slope:=2.5\n")
            run = subprocess.run([PROGRAM, "encode", "-", "-o", "pipe.tag", "--max-error", "10"], cwd=self.folder,
                                 stdin=pipe)
        self.assertEqual(run.returncode, 0)
        self.assertIn("bound 4,", self.tagrid("info", "pipe.tag").stdout)

    def test_bzip2_in_every_way_that_raw_samples_can_lie(self):
        truth = volume((6, 9, 11))
        samples = truth.tobytes()
        # Parallel compressors write many streams.
        streams = b"".join(bz2.compress(samples[at:at + 100]) for at in range(0, len(samples), 100))
        for stored, fields in ((bz2.compress(samples), ""), (streams, ""), (bz2.compress(b"abc" + samples), "byte skip: 3\n"),
                               (b"a line\n" + bz2.compress(samples), "line skip: 1\n")):
            self.encodes(truth, self.write("a.nrrd", truth, fields, "bzip2", stored), what=fields)
        for z in range(6):
            (self.folder / f"s{z}.bz2").write_bytes(bz2.compress(truth[z].tobytes()))
        self.encodes(truth, self.write("a.nhdr", truth, "data file: s%d.bz2 0 5 1\n", "bz2", b""))
        # From the beginning for every part; and from a pipe, once.
        wide = volume((4, 300, 500))
        self.write("wide.nrrd", wide, "", "bzip2", bz2.compress(wide.tobytes()))
        self.encodes(wide, "wide.nrrd", "--resume")
        run = subprocess.run([PROGRAM, "encode", "-", "-o", "-"], input=(self.folder / "wide.nrrd").read_bytes(),
                             capture_output=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        (self.folder / "pipe.tag").write_bytes(run.stdout)
        self.ok("verify", "pipe.tag", "--against", "wide.nrrd")

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
            info = self.encodes(truth, "b.nrrd", what=axis)
            self.assertEqual(info["geometry"], wanted["geometry"])
            self.assertTrue(info["restorable"])
        # A slice that teem takes is a volume of one slice.
        self.unu("slice", "-a", "2", "-p", "3", "-i", "a.nrrd", "-o", "b.nrrd")
        self.assertIn(b"dimension: 2", (self.folder / "b.nrrd").read_bytes())
        info = self.encodes(truth[3:4], "b.nrrd")
        self.assertEqual(info["geometry"]["origin"], [1, 2, 9])
        self.assertEqual(info["geometry"]["spacing"][:2], [0.5, 0.25])
        # Of a volume of colors, the message says how many axes there are.
        self.write("c.nrrd", volume((5, 6, 7, 3)))
        self.assert_refused(65, "this file has 4 with more than one sample", "encode", "c.nrrd")

    @unittest.skipIf(UNU is None, "there is no teem-unu on this machine (teem-apps)")
    def test_odd_headers_are_refused_or_read_as_teem_does(self):
        truth = volume((5, 7, 9))
        space = "space: left-posterior-superior\n"
        compared = 0
        for fields, code in (("spacings: 0.5 0.6 nan\n", 0), ("spacings: 0.5 inf 1\n", 0), ("spacings: 0,5 0,6 1\n", 0), ("spacings: 0 1 1\n", 0), ("spacings: 1 1\n", 0),
                             ("thicknesses: x 1 1\nspacings: 1 2 3\n", 0), ("axis mins: 0 inf 0\n", 0), ("axis mins: 0 1 2\naxis maxs: nan 3 x\n", 0),
                             (space + "space directions: (1,0,0) (1,0,0) (0,0,1)\n", 0), (space + "space directions: (1,0,0) (0,x,0) (0,0,1)\n", 0),
                             (space + "space directions: (1,0,0) (0,1,0)\n", 0), (space + "space directions: (1,0,0) (0,1,0) none\n", 65),
                             (space + "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (1,nan,3)\n", 0),
                             (space + "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (nan,nan,nan)\n", 0),
                             (space + "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (1,2)\n", 0),
                             ("old min: -1000\nold max: 3000\n", 0), ("old min: x\n", 0), ("kinds: vector domain domain\n", 65), ("kinds: complex domain domain\n", 65),
                             ("kinds: list domain domain\n", 65), ("centers: node cell node\nspacings: 1 1 1\naxis mins: 0 0 0\n", 0), ("block size: 4\n", 0),
                             ("byte skip: -1\n", 0), ("byte skip: -2\n", 65), ("byte skip: x\n", 65), ("line skip: -1\n", 65)):
            with self.subTest(fields):
                self.write("a.nrrd", truth, fields)
                for name in ("teem.nrrd", "a.tag"):
                    (self.folder / name).unlink(missing_ok=True)
                ours = self.tagrid("encode", "a.nrrd", "-o", "a.tag")
                self.assertEqual(ours.returncode, code, ours.stderr)
                teem = subprocess.run([UNU, "save", "-f", "nrrd", "-e", "raw", "-i", "a.nrrd", "-o", "teem.nrrd"], cwd=self.folder, capture_output=True)
                if code:
                    continue
                self.ok("decode", "a.tag", "-o", "ours.nrrd", "-f")
                # What is written is a file that teem reads, whatever was read.
                self.unu("save", "-f", "nrrd", "-e", "raw", "-i", "ours.nrrd", "-o", "again.nrrd")
                if teem.returncode:
                    self.assertIn("warning", ours.stderr)
                    continue
                compared += 1
                for name in ("teem.nrrd", "again.nrrd"):
                    self.assertEqual((self.folder / name).read_bytes().partition(b"\n\n")[2], truth.tobytes(), name)
                for field in (b"spacings: ", b"space directions: ", b"space origin: "):
                    said = [[line for line in (self.folder / name).read_bytes().splitlines() if line.startswith(field)] for name in ("teem.nrrd", "again.nrrd")]
                    if "warning" not in ours.stderr:
                        self.assertEqual(*said)
        self.assertGreater(compared, 5)

    def test_quantized_values_are_said_and_kept(self):
        truth = volume()
        self.write("a.nrrd", truth, "old min: -1000\nold max: 3000\n")
        self.encodes(truth, "a.nrrd", says="old min \"-1000\" says that samples are quantized values")
        run = self.tagrid("encode", "a.nrrd", "--max-error", "5", "--rm")
        self.assertNotEqual(run.returncode, 0)
        self.assertTrue((self.folder / "a.nrrd").exists())

    def test_segments_of_slicer_are_labels_and_said_once(self):
        truth = volume() % 3
        header = "Segment{0}_ID:=Segment_{0}\nSegment{0}_LabelValue:={1}\n"
        self.write("a.seg.nrrd", truth, header.format(0, 1) + header.format(12, 2))
        self.encodes(truth, "a.seg.nrrd")
        self.assertEqual(self.messages.count("says that samples are labels"), 1)
        self.assertIn("Segment0_LabelValue", self.messages)
        self.assert_refused(64, "says that samples are labels", "encode", "a.seg.nrrd", "-f", "--max-error", "1", "--rm")
        self.write("z.seg.nrrd", truth, header.format(0, 1), "gzip", gzip.compress(truth.tobytes()))  # the weaker reason is that it is compressed
        self.assert_refused(64, "says that samples are labels", "encode", "z.seg.nrrd", "-f", "--max-error", "1", "--rm")
        self.assert_refused(64, "its samples are compressed", "encode", "z.seg.nrrd", "-f", "--rm")
        self.write("a.nrrd", truth, "SegmentX_LabelValue:=1\nSegment_LabelValue:=1\nSegment0_Name:=LabelValue\n")
        self.encodes(truth, "a.nrrd")
        self.assertNotIn("labels", self.messages)

    def test_slopes_that_do_not_fit_the_slices_allow_no_bound(self):
        truth = volume()
        for pairs in ("slice_slopes:=1 2 3\n", "slice_slopes:=1 2 x 3 4\n", "slice_slopes:=1 2 3 4 5\nslice_intercepts:=0 0\n"):
            self.write("a.nrrd", truth, pairs)
            self.encodes(truth, "a.nrrd", says="what values samples mean is unknown")
            self.assert_refused(64, "--max-error", "encode", "a.nrrd", "--max-error", "5")

    def test_what_does_not_fit_in_several_files_is_said_once(self):
        truth = volume((6, 9, 11))
        for z in range(6):
            (self.folder / f"s{z}.raw").write_bytes(truth[z].tobytes() + b"abc" * (z > 1))
        self.encodes(truth, self.write("a.nhdr", truth, "data file: s%d.raw 0 5 1\n", "raw", b""))
        self.assertIn("s2.raw: 3 bytes follow the samples", self.messages)
        self.assertIn("it is so in 4 of the 6 files", self.messages)


if __name__ == "__main__":
    main()
