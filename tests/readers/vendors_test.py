"""Volumes as scanners' own programs write them: VGStudio, Nikon, Scanco, and folders of samples alone.

    vendors_test.py PROGRAM
"""

import shutil
import struct
import subprocess
import unittest

import other_readers
from other_readers import ReaderTest

numpy = other_readers.library("numpy", "python3-numpy")

VGI = """{{volume1}}
[representation]
size = 23 19 7
datatype = {type}
datarange = -1 0
bitsperelement = {bits}
[file1]
SkipHeader = {skip}
FileFormat = raw
Size = 23 19 7
Name = {name}
Datatype = {type}
BitsPerElement = {bits}
{{volumeprimitive1}}
[geometry]
resolution = 0.05 0.06 0.07
unit = mm
"""


def volume(type="uint16", shape=(7, 19, 23)):
    random = numpy.random.default_rng(1)
    if type.startswith("float"):
        return random.standard_normal(shape).astype(type)
    return random.integers(numpy.iinfo(type).min, numpy.iinfo(type).max, shape, type, endpoint=True)


@unittest.skipIf(numpy is None, "there is no numpy on this machine")
class Vendors(ReaderTest):
    def test_vgstudio(self):
        for type, words, bits in (("uint8", "unsigned integer", 8), ("uint16", "unsigned integer", 16), ("int16", "signed integer", 16),
                                  ("float32", "float", 32), ("uint32", "Unsigned Integer", 32)):
            truth = volume(type)
            for skip, name, line in ((0, "scan.vol", "\n"), (17, "D:\\data\\scan.vol", "\r\n")):
                (self.folder / "scan.vol").write_bytes(bytes(skip) + truth.tobytes())
                (self.folder / "a.vgi").write_text(VGI.format(type=words, bits=bits, skip=skip, name=name).replace("\n", line), newline="")
                samples, info = self.encoded("a.vgi")
                self.assert_same(samples, truth, f"{type} {skip}")
                self.assertEqual(info["geometry"]["spacing"], [0.05, 0.06, 0.07])
                self.assertEqual(info["geometry"]["units"], ["mm"] * 3)

    def test_nikon(self):
        for type in ("uint8", "uint16", "float32"):
            truth = volume(type)
            (self.folder / "scan.vol").write_bytes(truth.tobytes())
            (self.folder / "scan.xtekct").write_text("[XTekCT]\nName=scan\nVoxelsX=23\nVoxelsY=19\nVoxelsZ=7\nVoxelSizeX=0.05\n"
                                                     "VoxelSizeY=0.05\nVoxelSizeZ=0.06\nXraykV=120\n[Xrays]\nXraykV=120\n")
            samples, info = self.encoded("scan.xtekct")
            self.assert_same(samples, truth, type)
            self.assertEqual(info["geometry"]["spacing"], [0.05, 0.05, 0.06])
            self.assertEqual(info["source"]["pairs"]["xtekct_xtekct/xraykv"], "120")

    def isq(self, truth, blocks=3):
        header = bytearray(512 * blocks)
        header[:16] = b"CTDATA-HEADER_V1"
        struct.pack_into("<3i3i", header, 44, 23, 19, 7, 23 * 82, 19 * 82, 7 * 90)
        struct.pack_into("<i", header, 16, 3)
        struct.pack_into("<2i", header, 20, len(header) + truth.nbytes, (len(header) + truth.nbytes) // 512)
        struct.pack_into("<i", header, 88, 8192)
        header[128:136] = b"Bone 17 "
        struct.pack_into("<2i", header, 168, 55000, 145)
        struct.pack_into("<i", header, 508, blocks - 1)
        return bytes(header) + truth.tobytes()

    def test_scanco(self):
        truth = volume("int16")
        (self.folder / "a.isq").write_bytes(self.isq(truth))
        samples, info = self.encoded("a.isq")
        self.assert_same(samples, truth)
        numpy.testing.assert_allclose(info["geometry"]["spacing"], [0.082, 0.082, 0.09])
        pairs = info["source"]["pairs"]
        self.assertEqual((float(pairs["rescale_slope"]), pairs["rescale_units"], pairs["isq_name"], pairs["isq_energy"]),
                         (1 / 8192, "1/cm", "Bone 17", "55000"))
        # A bound is for attenuations.
        self.encoded("a.isq", "--max-error", "0.001")
        self.assertIn("one of 8.19", self.messages)
        if shutil.which("scancodump"):
            run = subprocess.run(["scancodump", "a.isq"], cwd=self.folder, stdout=subprocess.PIPE, text=True)
            self.assertIn("8192", run.stdout)
        else:
            print("not compared with scancodump, which is not on this machine (vtk-dicom-tools)")

    def test_folders_of_samples_alone(self):
        truth = volume("int16", (12, 20, 30))
        for parts in (12, 4, 1):
            for order in "<>":
                shutil.rmtree(self.folder / "s", ignore_errors=True)
                (self.folder / "s").mkdir()
                for i, part in enumerate(numpy.split(truth, parts)):
                    (self.folder / "s" / f"slice{i + 8}.raw").write_bytes(b"head" + part.astype(order + "i2").tobytes())
                options = ["--dims", "30,20,12", "--type", "int16", "--offset", "4", "--endian", "little" if order == "<" else "big"]
                self.assert_same(self.encoded("s", *options)[0], truth)
                run = self.tagrid("verify", "out.tag", "--against", "s", *options)
                self.assertEqual(run.returncode, 0, run.stderr)
        (self.folder / "s" / "slice9.raw").write_bytes(b"")
        self.assert_refused(65, "bytes, but 7200 are expected", "encode", "s", "--dims", "30,20,12", "--type", "int16")
        (self.folder / "s" / "slice9.raw").unlink()
        (self.folder / "s" / "slice8.raw").write_bytes(truth.tobytes())
        (self.folder / "s" / "other.txt").write_bytes(b"")
        options = ["--dims", "30,20,12", "--type", "int16"]
        self.assert_refused(64, "holds 2 series of files; choose one with --series", "encode", "s", *options)
        for series in ("slice8.raw", "2"):
            self.assert_same(self.encoded("s", *options, "--series", series)[0], truth)
        self.assert_refused(64, "has no series 3", "encode", "s", *options, "--series", "3")
        self.assert_refused(64, "need --dims and --type", "encode", "s/slice8.raw", "--from", "raw")
        self.assert_refused(64, "leave out --dataset", "encode", "s/slice8.raw", *options, "--dataset", "x")

    def test_what_is_no_volume_is_refused_by_name(self):
        truth = volume()
        good = VGI.format(type="unsigned integer", bits=16, skip=0, name="scan.vol")
        (self.folder / "scan.vol").write_bytes(truth.tobytes())
        for old, new, code, text in (("Size = 23 19 7\nName", "Size = 23 19\nName", 65, "3 numbers"), ("Size = 23 19 7\nName", "Size = 23 19 8\nName", 65, "scan.vol"),
                                     ("Name = scan.vol", "Name = /dev/zero", 65, "stream or a device"), ("Name = scan.vol", "Name = none", 74, "none"),
                                     ("Name = scan.vol\n", "", 65, "name is missing in section [file1]"), ("BitsPerElement = 16", "BitsPerElement = 12", 65, "12 bits"),
                                     ("FileFormat = raw", "FileFormat = tiff", 65, "tiff"), ("SkipHeader = 0", "SkipHeader = -1", 65, "SkipHeader"),
                                     ("Size = 23 19 7\nName", "Size = 9000000000 9000000000 9\nName", 65, "cannot have")):
            self.assertIn(old, good)
            (self.folder / "a.vgi").write_text(good.replace(old, new))
            self.assert_refused(code, text, "encode", "a.vgi")
        (self.folder / "a.xtekct").write_text("[XTekCT]\nVoxelsX=23\nVoxelsY=19\nVoxelsZ=7\n")
        (self.folder / "a.vol").write_bytes(bytes(99))
        self.assert_refused(65, "a.vol: has 99 bytes", "encode", "a.xtekct")
        whole = self.isq(volume("int16"))
        for at, value in ((16, 2), (44, 0), (44, -5), (508, -1), (508, 2**31 - 1), (52, 8)):
            broken = bytearray(whole)
            struct.pack_into("<i", broken, at, value)
            (self.folder / "a.isq").write_bytes(broken)
            self.assert_refused(65, "a.isq: ", "encode", "a.isq")
        (self.folder / "a.isq").write_bytes(whole[:100])
        self.assert_refused(65, "ends within its header", "encode", "a.isq")


if __name__ == "__main__":
    other_readers.main()
