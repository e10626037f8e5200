"""JPEG 2000: slices that OpenJPEG's own program compresses.

    jp2_test.py PROGRAM
"""

import shutil
import subprocess
import unittest

import other_readers
from other_readers import ReaderTest

numpy = other_readers.library("numpy", "python3-numpy")


@unittest.skipIf(numpy is None or shutil.which("opj_compress") is None, "there is no opj_compress on this machine (libopenjp2-tools)")
class Jpeg2000(ReaderTest):
    def compress(self, samples, name, *options, bits=16, signed=False):
        (self.folder / name).parent.mkdir(exist_ok=True)
        samples.astype({8: "u1", 16: ">u2"}[8 if bits <= 8 else 16]).tofile(self.folder / "slice.raw")
        height, width = samples.shape
        run = subprocess.run(["opj_compress", "-i", "slice.raw", "-F", f"{width},{height},1,{bits},{'s' if signed else 'u'}", "-o", name, *options],
                             cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(run.returncode, 0, run.stdout)

    def volume(self, bits, signed=False, shape=(4, 40, 50)):
        low = -(1 << (bits - 1)) if signed else 0
        return numpy.random.default_rng(1).integers(low, low + (1 << bits), shape)

    def test_samples_of_all_kinds(self):
        for bits, signed, type in ((8, False, "uint8"), (8, True, "int8"), (5, False, "uint8"), (16, False, "uint16"), (16, True, "int16"),
                                   (12, False, "uint16"), (12, True, "int16")):
            truth = self.volume(bits, signed)
            for z, slice in enumerate(truth):
                self.compress(slice, f"s/slice{z + 8}.j2k", bits=bits, signed=signed)
            self.assert_same(self.encoded("s")[0], truth.astype(type), f"{bits} {signed}")

    def test_files_with_boxes_and_tiles(self):
        truth = self.volume(12)
        for z, slice in enumerate(truth):
            self.compress(slice, f"s/{z}.jp2", "-t", "16,16", "-n", "3", bits=12)
        samples, info = self.encoded("s")
        self.assert_same(samples, truth.astype("uint16"))
        self.assertNotIn("lossy source", info["source"]["pairs"])
        self.assert_same(self.encoded("s/2.jp2")[0], truth[2:3].astype("uint16"))

    def test_a_loss_is_recorded(self):
        for z, slice in enumerate(self.volume(12)):
            self.compress(slice, f"s/{z}.jp2", "-I", "-r", "10", bits=12)
        info = self.encoded("s")[1]
        self.assertIn("9-7", info["source"]["pairs"]["lossy source"])

    def test_what_is_no_volume_is_refused_by_name(self):
        truth = self.volume(8)
        for z, slice in enumerate(truth):
            self.compress(slice, f"s/{z}.jp2", bits=8)
        self.compress(truth[0][:, :-1], "s/4.jp2", bits=8)
        self.assert_refused(65, "4.jp2: JPEG 2000 file: has 49 x 40 samples of 8 bits", "encode", "s")
        (self.folder / "s" / "4.jp2").unlink()
        (self.folder / "s" / "1.jp2").unlink()
        self.assert_refused(65, "between 0.jp2 and 2.jp2", "encode", "s")
        whole = (self.folder / "s" / "2.jp2").read_bytes()
        (self.folder / "short.jp2").write_bytes(whole[:len(whole) // 2])
        self.assert_refused(65, "short.jp2: ", "encode", "short.jp2")

    def test_damaged_files_are_errors_or_other_samples_and_no_more(self):
        self.compress(self.volume(12)[0], "a.jp2", bits=12)
        whole = (self.folder / "a.jp2").read_bytes()
        random = numpy.random.default_rng(1)
        for i in range(40):
            broken = bytearray(whole[:random.integers(20, len(whole))] if i % 4 == 0 else whole)
            for _ in range(random.integers(1, 6)):
                broken[random.integers(12, len(broken) if i % 2 else 200)] = random.integers(0, 256)
            (self.folder / "broken.jp2").write_bytes(broken)
            run = self.tagrid("encode", "broken.jp2", "-o", "broken.tag", "-f", "-q")
            self.assertIn(run.returncode, (0, 64, 65, 74), f"{i}: {run.stderr}")


if __name__ == "__main__":
    other_readers.main()
