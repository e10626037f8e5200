"""MRC maps: those of Python's mrcfile, and headers made by the description of MRC2014 and by that of IMOD."""

import struct
import unittest

from other_readers import ReaderTest, main, mrcfile, numpy, random_samples

MODES = {"int8": 0, "int16": 1, "float32": 2, "uint16": 6}
IMOD = 1146047817


def header(shape, mode, order="<", cell=None, intervals=None, first=(0, 0, 0), axes=(1, 2, 3), origin=(0, 0, 0), extended=0, flags=None, space_group=1,
           version=20140, limits=(0, -1), angles=(90, 90, 90), stamp=None, labels=(), word=b"MAP "):
    """The 1024 bytes of a map [z, y, x]."""
    nz, ny, nx = shape
    head = bytearray(1024)
    put = lambda format, at, *numbers: struct.pack_into(order + format, head, at, *numbers)
    put("4i", 0, nx, ny, nz, mode)
    put("3i", 16, *first)
    put("3i", 28, *(intervals or (nx, ny, nz)))
    put("3f", 40, *(cell or (0, 0, 0)))
    put("3f", 52, *angles)
    put("3i", 64, *axes)
    put("2f", 76, *limits)
    put("2i", 88, space_group, extended)
    put("i", 108, version)
    if flags is not None:
        put("2i", 152, IMOD, flags)
    put("3f", 196, *origin)
    head[208:212] = word
    head[212:216] = stamp if stamp is not None else b"DD\0\0" if order == "<" else b"\x11\x11\0\0"
    put("i", 220, len(labels))
    for number, label in enumerate(labels):
        head[224 + 80 * number:304 + 80 * number] = label.encode().ljust(80)
    return bytes(head)


def swapped(samples, order):
    return samples.astype(samples.dtype.newbyteorder(order)).tobytes()


@unittest.skipIf(numpy is None, "there is no numpy on this machine")
class Mrc(ReaderTest):
    def write(self, name, *parts):
        (self.folder / name).write_bytes(b"".join(parts))
        return name

    def test_every_mode_in_both_byte_orders(self):
        for type, mode in MODES.items():
            truth = random_samples(type, (5, 7, 9))
            for order in "<>":
                self.write("a.mrc", header(truth.shape, mode, order, cell=(9 * 2.5, 7 * 3, 5 * 0.1)), swapped(truth, order))
                info = self.encodes(truth, "a.mrc", what=(type, order))
                self.assertEqual((self.messages, info["restorable"]), ("", True))
                self.assertEqual((info["geometry"]["spacing"], info["geometry"]["units"]), ([2.5, 3, 0.1], ["angstrom"] * 3))
                self.assertIsNone(info["geometry"]["origin"])

    def test_extended_headers_and_labels_come_back(self):
        truth = random_samples("int16", (5, 7, 9))
        extended = bytes(range(256)) * 3 + b"x" * 17
        for order in "<>":
            self.write("a.rec", header(truth.shape, 1, order, extended=len(extended), labels=("made by hand", "twice")), extended, swapped(truth, order))
            pairs = dict(self.encodes(truth, "a.rec")["source"]["pairs"])
            self.assertEqual((pairs["mrc_label_1"], pairs["mrc_label_2"]), ("made by hand", "twice"))

    def test_bytes_have_a_sign_or_not(self):
        signed, unsigned = random_samples("int8", (5, 7, 9)), random_samples("uint8", (5, 7, 9))
        for truth, options, said in ((signed, {"flags": 1}, ""), (unsigned, {"flags": 0}, ""), (signed, {"flags": 5, "version": 0}, ""), (signed, {}, ""),
                                     (unsigned, {"limits": (0, 255), "version": 0}, ""), (unsigned, {"limits": (0, 255)}, "read as uint8"),
                                     (signed, {"limits": (-128, 127), "version": 0}, ""), (signed, {"version": 0}, "does not state whether its bytes have a sign")):
            self.write("a.mrc", header(truth.shape, 0, **options), truth.tobytes())
            self.encodes(truth, "a.mrc", what=options, says=said)
            self.assertEqual(self.messages == "", said == "", options)
        self.write("a.mrc", header(signed.shape, 0, flags=16), signed.tobytes())
        self.assert_refused(65, "samples of 4 bits", "encode", "a.mrc")

    def test_positions(self):
        truth = random_samples("int16", (5, 7, 9))
        cell = (9, 14, 15)
        for options, origin in (({"origin": (10, 20, -30)}, [10, 20, -30]), ({"origin": (10, 0, 0), "flags": 4}, [10, 0, 0]), ({"origin": (10, 0, -3), "flags": 1}, [-10, 0, 3]),
                                ({"first": (5, -2, 1)}, [5, -4, 3]), ({"first": (5, 2, 1), "origin": (1, 1, 1)}, [1, 1, 1])):
            self.write("a.mrc", header(truth.shape, 1, cell=cell, **options), truth.tobytes())
            geometry = self.encodes(truth, "a.mrc", what=options)["geometry"]
            self.assertEqual((geometry["spacing"], geometry["origin"]), ([1, 2, 3], origin), options)

    def test_intervals_of_the_cell_are_not_samples(self):
        truth = random_samples("int16", (5, 7, 9))
        self.write("a.map", header(truth.shape, 1, cell=(90, 70, 100), intervals=(30, 35, 20)), truth.tobytes())
        self.assertEqual(self.encodes(truth, "a.map")["geometry"]["spacing"], [3, 2, 5])
        for options, spacing in (({"cell": (9, 0, 5)}, [1, None, 1]), ({"cell": (9, -7, 5)}, [1, None, 1]), ({"cell": (9, 7, 5), "intervals": (9, 0, 5)}, [1, None, 1])):
            self.write("a.map", header(truth.shape, 1, **options), truth.tobytes())
            self.assertEqual(self.encodes(truth, "a.map")["geometry"]["spacing"], spacing, options)
        self.write("a.map", header(truth.shape, 1, cell=(9, 7, 5), angles=(90, 90, 120)), truth.tobytes())
        self.encodes(truth, "a.map", says="the angles of its cell are 90, 90, 120")
        self.write("a.map", header(truth.shape, 1), truth.tobytes())
        self.assertIn("add it with --spacing", self.ok("encode", "a.map", "-o", "a.tag").stderr)

    def test_axes_in_another_order_are_directions(self):
        truth = random_samples("int16", (5, 7, 9))
        # Columns along y, rows along z, sections along x.
        self.write("a.map", header(truth.shape, 1, cell=(5 * 10, 9 * 20, 7 * 30), intervals=(5, 9, 7), axes=(2, 3, 1), first=(1, 2, 3)), truth.tobytes())
        geometry = self.encodes(truth, "a.map")["geometry"]
        self.assertEqual((geometry["spacing"], geometry["directions"], geometry["origin"]), ([20, 30, 10], [[0, 20, 0], [0, 0, 30], [10, 0, 0]], [30, 20, 60]))
        for axes in ((1, 2, 2), (1, 2, 4), (-1, 2, 3), (0, 1, 2), (1, -2, 3)):
            self.write("a.map", header(truth.shape, 1, axes=axes), truth.tobytes())
            self.assert_refused(65, "must be 1, 2 and 3", "encode", "a.map")
        self.write("a.map", header(truth.shape, 1, axes=(0, 0, 0), cell=(9, 7, 5)), truth.tobytes())
        self.assertEqual(self.encodes(truth, "a.map")["geometry"]["spacing"], [1, 1, 1])

    def test_stacks_of_volumes(self):
        truth = random_samples("int16", (6, 7, 9))
        self.write("a.mrc", header(truth.shape, 1, cell=(9, 7, 3), intervals=(9, 7, 3), space_group=401), truth.tobytes())
        for number in (1, 2):
            self.encodes(truth[3 * number - 3:3 * number], "a.mrc", "--series", number)
        self.ok("encode", "a.mrc", "-o", "all.tag")
        self.ok("decode", "all.tag", "-o", "all.npy", "--samples")
        self.assert_same(numpy.load(self.folder / "all.npy"), truth.reshape(2, 3, 7, 9))
        self.ok("restore", "all.tag", "-o", "back")
        self.assertEqual((self.folder / "back/a.mrc").read_bytes(), (self.folder / "a.mrc").read_bytes())
        self.write("a.mrc", header(truth.shape, 1, intervals=(9, 7, 4), space_group=401), truth.tobytes())
        self.assert_refused(65, "cannot be a stack", "encode", "a.mrc")

    def test_machine_stamps_may_be_wrong(self):
        truth = random_samples("uint16", (5, 7, 9))
        for order in "<>":
            for stamp in (b"\0\0\0\0", b"DA\0\0", b"\x11\x11\0\0", b"xxxx"):
                is_wrong = stamp[:1] == (b"\x11" if order == "<" else b"D")
                self.write("a.mrc", header(truth.shape, 6, order, stamp=stamp), swapped(truth, order))
                self.encodes(truth, "a.mrc", what=(order, stamp), says="machine stamp is wrong" if is_wrong else "")
                self.assertEqual(self.messages != "", is_wrong)
        self.write("a.mrc", header(truth.shape, 6, word=b"MAP\0"), truth.tobytes())
        self.encodes(truth, "a.mrc")
        self.write("a.st", header(truth.shape, 6, word=bytes(4)), truth.tobytes())
        self.encodes(truth, "a.st", "--from", "mrc")

    def test_other_modes_are_refused_by_name(self):
        for mode, text in ((3, "complex"), (4, "complex"), (12, "floats of 16 bits"), (16, "colors"), (101, "samples of 4 bits"), (7, "unknown type"), (-1, "unknown type")):
            self.write("a.mrc", header((5, 7, 9), mode), bytes(5 * 7 * 9 * 8))
            self.assert_refused(65, text, "encode", "a.mrc")

    def test_damaged_files_are_refused(self):
        truth = random_samples("int16", (5, 7, 9))
        whole = header(truth.shape, 1) + truth.tobytes()
        for size in (212, 216, 500, 1023, 1024, len(whole) - 1):
            self.write("a.mrc", whole[:size])
            self.assert_refused(65, "a.mrc", "encode", "a.mrc")
        self.write("a.mrc", whole, b"more")
        self.encodes(truth, "a.mrc", says="4 bytes follow the samples")
        for at, number in ((0, 0), (0, -1), (4, 0), (8, -7), (0, 0x7fffffff), (92, -1), (92, 0x7fffffff)):
            broken = bytearray(whole)
            struct.pack_into("<i", broken, at, number)
            self.write("a.mrc", bytes(broken))
            self.assert_refused(65, "a.mrc", "encode", "a.mrc")
        self.write("a.mrc", header((0x7fffffff,) * 3, 2), truth.tobytes())
        self.assert_refused(65, "a volume cannot have", "encode", "a.mrc")
        nan = float("nan")
        self.write("a.mrc", header(truth.shape, 1, cell=(nan, 7, 5), origin=(nan, 0, 0), angles=(nan, 0, 0), limits=(nan, nan)), truth.tobytes())
        self.assertEqual(self.encodes(truth, "a.mrc", says="not a number")["geometry"]["spacing"], [None, 1, 1])

    @unittest.skipIf(mrcfile is None, "there is no mrcfile on this machine")
    def test_maps_of_mrcfile(self):
        for type in MODES:
            truth = random_samples(type, (5, 7, 9))
            with mrcfile.new(self.folder / "a.mrc", overwrite=True) as file:
                file.set_data(truth)
                file.voxel_size = (1.5, 2.5, 3.5)
                file.header.origin = (4, 5, 6)
            with mrcfile.open(self.folder / "a.mrc") as file:
                self.assertTrue(numpy.array_equal(file.data, truth))
            geometry = self.encodes(truth, "a.mrc", what=type)["geometry"]
            self.assertEqual((geometry["spacing"], geometry["origin"]), ([1.5, 2.5, 3.5], [4, 5, 6]))
        with mrcfile.new(self.folder / "b.mrc") as file:
            file.set_data(random_samples("int16", (2, 5, 7, 9)))
            several = file.data.copy()
        self.encodes(several[1], "b.mrc", "--series", 2)
        with mrcfile.new(self.folder / "c.mrc") as file:
            file.set_data(truth.astype("complex64"))
        self.assert_refused(65, "complex", "encode", "c.mrc")


if __name__ == "__main__":
    main()
