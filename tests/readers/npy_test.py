"""NumPy's .npy files: arrays that numpy saved, and arrays that numpy loads."""

import io
import struct
import subprocess
import unittest

from other_readers import PROGRAM, ReaderTest, main, numpy, random_samples

TYPES = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64")


def npy(array, version=None):
    file = io.BytesIO()
    numpy.lib.format.write_array(file, array, version)
    return file.getvalue()


def with_header(text, samples=b"", version=1):
    length = struct.pack("<H" if version == 1 else "<I", len(text))
    return b"\x93NUMPY" + bytes((version, 0)) + length + text.encode() + samples


@unittest.skipIf(numpy is None, "there is no numpy on this machine")
class Npy(ReaderTest):
    def write(self, name, content):
        (self.folder / name).write_bytes(content)
        return name

    def test_every_type_version_and_order_of_bytes_and_axes(self):
        versions = ((1, 0), (2, 0), (3, 0))
        for number, type in enumerate(TYPES):
            truth = random_samples(type, (5, 7, 9))
            for order in "<>":
                array = truth.astype(truth.dtype.newbyteorder(order))
                for name, shown in (("c.npy", array), ("fortran.npy", numpy.asfortranarray(array.T))):
                    self.write(name, npy(shown, versions[number % 3]))
                    info = self.encodes(truth, name, what=(type, order, name))
                    self.assertEqual((self.messages, info["restorable"]), ("", True))
                    self.assertIsNone(info["geometry"]["spacing"])

    def test_fewer_and_more_axes(self):
        truth = random_samples("int16", (5, 7, 9))
        self.write("row.npy", npy(truth[0, 0]))
        self.encodes(truth[:1, :1], "row.npy")
        self.write("slice.npy", npy(truth[0]))
        self.encodes(truth[:1], "slice.npy")
        self.write("slice.npy", npy(numpy.asfortranarray(truth[0].T)))
        self.encodes(truth[:1], "slice.npy")
        several = random_samples("int16", (3, 5, 7, 9))
        for name, array in (("c.npy", several), ("fortran.npy", numpy.asfortranarray(several.T))):
            self.write(name, npy(array))
            self.assert_refused(64, "holds 3 volumes", "encode", name, "--series", "4")
            for number in (1, 2, 3):
                self.encodes(several[number - 1], name, "--series", number)
            self.ok("encode", name, "-o", "all.tag", "-f")
            self.ok("decode", "all.tag", "-o", "back.npy", "-f")
            self.assert_same(numpy.load(self.folder / "back.npy"), several)
            self.ok("restore", "all.tag", "-o", "back")
            self.assertEqual((self.folder / "back" / name).read_bytes(), (self.folder / name).read_bytes())

    def test_numpy_loads_what_is_decoded(self):
        for type in TYPES:
            truth = random_samples(type, (5, 7, 9))
            self.write("a.npy", npy(truth))
            self.ok("encode", "a.npy", "-o", "a.tag", "-f")
            run = self.ok("decode", "a.tag", "-o", "b.npy", "-f")
            self.assertEqual(run.stderr, "")
            loaded = numpy.load(self.folder / "b.npy", mmap_mode="r")
            self.assert_same(loaded, truth)
            self.assertEqual(loaded.offset % 64, 0)
            self.assertTrue(loaded.flags.c_contiguous)
            self.assertEqual((self.folder / "b.npy").read_bytes()[:loaded.offset], npy(truth)[:loaded.offset])
            self.encodes(truth, "b.npy")
            self.ok("decode", "a.tag", "--region", "1:4,2:7,3:5", "-o", "part.npy", "-f")
            self.assert_same(numpy.load(self.folder / "part.npy"), truth[3:5, 2:7, 1:4])
        piped = subprocess.run([PROGRAM, "decode", "a.tag", "-o", "-", "--format", "npy"], cwd=self.folder, stdout=subprocess.PIPE)
        self.assertEqual(piped.stdout, (self.folder / "b.npy").read_bytes())

    def test_what_an_array_loses_is_said(self):
        truth = random_samples("int16", (5, 7, 9)) // 64
        self.write_nrrd("a.nrrd", truth, "space: left-posterior-superior\nspace directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (1,2,3)\n")
        self.ok("encode", "a.nrrd", "--strip", "-o", "a.tag")
        said = self.ok("decode", "a.tag", "-o", "a.npy").stderr
        self.assertIn("NumPy arrays have no place for the voxel size, position, directions", said)
        self.assert_refused(64, "NumPy arrays have no place", "decode", "a.tag", "-o", "b.npy", "--rm")
        self.write_nrrd("b.nrrd", truth, "rescale_slope:=0.5\nrescale_intercept:=3\n")
        self.ok("encode", "b.nrrd", "-o", "b.tag")
        self.assertIn("slope", self.ok("decode", "b.tag", "-o", "b.npy").stderr)
        self.ok("decode", "b.tag", "-o", "b.npy", "--values", "-f")
        self.assert_same(numpy.load(self.folder / "b.npy"), (truth * 0.5 + 3).astype("float32"))

    def test_headers_of_other_programs(self):
        truth = random_samples("uint16", (5, 7, 9))
        samples = truth.tobytes()
        for text in ("{'shape':(5,7,9),'fortran_order':False,'descr':'<u2'}", '{"descr": "<u2", "fortran_order": False, "shape": (5, 7, 9)}\n',
                     "{'descr': '<u2', 'fortran_order': False, 'shape': (5L, 7L, 9L), }   \n", "{ 'descr' : '<u2' , 'fortran_order' : False , 'shape' : ( 5 , 7 , 9 , ) }"):
            for version in (1, 2, 3):
                self.write("a.npy", with_header(text, samples, version))
                self.encodes(truth, "a.npy", what=text)

    def test_what_is_no_volume_is_refused_by_name(self):
        good = numpy.zeros((5, 7, 9))
        for array, text in ((good.astype("f2"), "floats of 16 bits"), (good.astype("?"), "booleans"), (good.astype("c8"), "complex numbers"),
                            (good.astype("c16"), "complex numbers"), (good.astype("i8"), "integers of 64 bits"), (good.astype("u8"), "integers of 64 bits"),
                            (numpy.zeros((2, 3), "u1,u2"), "records"), (good.astype("S3"), "only integers"), (numpy.zeros(()), "0 axes"),
                            (numpy.zeros((1, 1, 2, 3, 4)), "5 axes"), (numpy.zeros((3, 0, 4)), "must be positive")):
            self.write("a.npy", npy(array))
            self.assert_refused(65, text, "encode", "a.npy")
        for kind, text in (("'|u2'", "byte order"), ("'=i2'", "byte order"), ("'u2'", "only integers"), ("''", "only integers"), ("3", "records")):
            self.write("a.npy", with_header(f"{{'descr': {kind}, 'fortran_order': False, 'shape': (5, 7, 9)}}", bytes(630)))
            self.assert_refused(65, text, "encode", "a.npy")

    def test_damaged_headers_are_refused(self):
        truth = random_samples("uint16", (5, 7, 9))
        whole = npy(truth)
        for size in (6, 7, 8, 9, 10, 11, 60, 127, 128, len(whole) - 1):
            self.write("a.npy", whole[:size])
            self.assert_refused(65, "a.npy", "encode", "a.npy")
        self.write("a.npy", whole + b"more")
        self.encodes(truth, "a.npy", says="4 bytes follow the samples")
        self.write("a.npy", whole[:6] + b"\4" + whole[7:])
        self.assert_refused(65, "version 4", "encode", "a.npy")
        self.write("a.npy", b"\x93NUMPY\2\0" + struct.pack("<I", 1 << 31) + bytes(2000))
        self.assert_refused(65, "its header has", "encode", "a.npy")
        good = "{'descr': '<u2', 'fortran_order': False, 'shape': (5, 7, 9), }"
        for old, new, text in (("9", "10000000000", "beyond all memory"), ("(5, 7, 9)", "(-5, 7, 9)", "positive"), ("(5, 7, 9)", "(5, , 9)", "positive"),
                               ("(5, 7, 9)", "[5, 7, 9]", "tuple"), ("False", "false", "True or False"), (", }", "", "no end"), ("'shape'", "shape", "no key"),
                               ("'shape'", "'descr'", "given twice"), ("'shape'", "'other'", "unknown"), (", 'shape': (5, 7, 9)", "", "must have"),
                               ("}", "} more", "follows"), ("{", "", "not a dictionary"), ("9)", "99999999999999999999)", "positive"),
                               ("(5, 7, 9)", "(4294967296, 4294967296, 4294967296)", "beyond all memory"), ("(5, 7, 9)", "(4611686018427387904, 4, 4, 4)", "beyond all memory")):
            self.assertIn(old, good)
            self.write("a.npy", with_header(good.replace(old, new, 1), truth.tobytes()))
            self.assert_refused(65, text, "encode", "a.npy")

    def test_it_is_found_and_recognized_by_content(self):
        truth = random_samples("uint16", (5, 7, 9))
        self.write("array.dat", npy(truth))
        self.encodes(truth, "array.dat")
        self.assertIn("array.dat", self.search(".").stdout)
        self.write("array.npy", b"x" * 100)
        self.assert_refused(65, "its name says that it is a NumPy array", "encode", "array.npy")


if __name__ == "__main__":
    main()
