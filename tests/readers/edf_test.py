"""EDF files of the ESRF: those of Python's fabio, and headers made by the description of the format."""

import unittest

from other_readers import ReaderTest, fabio, main, numpy, random_samples

NAMES = {"uint8": "UnsignedByte", "int8": "SignedByte", "uint16": "UnsignedShort", "int16": "SignedShort", "uint32": "UnsignedInteger", "int32": "SignedInteger",
         "float32": "FloatValue", "float64": "DoubleValue"}


def frame(samples, order="<", block=512, fields=(), **changed):
    """A header and its samples: an array of up to three axes, the last of which is Dim_1."""
    names = {"HeaderID": "EH:000001:000000:000000", "Image": "1", "ByteOrder": "LowByteFirst" if order == "<" else "HighByteFirst",
             "DataType": NAMES[str(samples.dtype)], "Size": str(samples.nbytes)}
    names.update((f"Dim_{i + 1}", str(size)) for i, size in enumerate(samples.shape[::-1]))
    names.update(changed)
    names.update(fields)
    text = "{\n" + "".join(f"{name} = {value} ;\n" for name, value in names.items() if value is not None)
    size = (len(text) + 2 + block - 1) // block * block
    return text.encode().ljust(size - 2) + b"}\n" + samples.astype(samples.dtype.newbyteorder(order)).tobytes()


@unittest.skipIf(numpy is None, "there is no numpy on this machine")
class Edf(ReaderTest):
    def write(self, name, *parts):
        (self.folder / name).write_bytes(b"".join(parts))
        return name

    def test_every_type_in_both_byte_orders_as_one_frame_and_as_many(self):
        for type in NAMES:
            truth = random_samples(type, (5, 7, 9))
            for order in "<>":
                self.write("one.edf", frame(truth, order))
                info = self.encodes(truth, "one.edf", what=(type, order))
                self.assertEqual((self.messages, info["restorable"]), ("", True))
                self.write("many.edf", *(frame(slice, order, Image=number) for number, slice in enumerate(truth)))
                info = self.encodes(truth, "many.edf", what=(type, order))
                self.assertEqual((self.messages, info["restorable"]), ("", True))

    def test_headers_and_blocks_of_other_sizes(self):
        truth = random_samples("uint16", (5, 7, 9))
        self.write("a.edf", *(frame(slice, block=512 * (1 + number % 3)) for number, slice in enumerate(truth)))
        self.encodes(truth, "a.edf")
        self.write("a.edf", *(frame(slice, "<>"[number % 2], fields={f"motor_{i}": i for i in range(number * 150)}) for number, slice in enumerate(truth)))
        self.encodes(truth, "a.edf")
        # Samples with bytes after them, as EDF_BinarySize and Size say.
        for name in ("EDF_BinarySize", "Size"):
            self.write("a.edf", *(frame(slice, fields={"Size": None, name: 256}) + bytes(256 - slice.nbytes) for slice in truth))
            self.encodes(truth, "a.edf", what=name)
        general = "{\nEDF_DataFormatVersion = 2.40 ;\nEDF_DataBlocks = 5 ;\nEDF_BlockBoundary = 512 ;\n".encode().ljust(510) + b"}\n"
        self.write("a.edf", general, *map(frame, truth))
        self.encodes(truth, "a.edf")
        self.write("a.edf", frame(truth).replace(b"}\n", b"}\r\n", 1))
        self.encodes(truth, "a.edf")
        self.write("slice.edf", frame(truth[0]))
        self.encodes(truth[:1], "slice.edf")
        self.write("a.edf", frame(truth).replace(b"HeaderID", b"hEADERid").replace(b"ByteOrder", b"BYTEORDER").replace(b"Dim_2", b"DIM_2"))
        self.encodes(truth, "a.edf")

    def test_what_a_header_says(self):
        truth = random_samples("uint16", (5, 7, 9)) // 64
        self.write("a.edf", frame(truth, fields={"PSize_1": "1.5e-06", "PSize_2": "2e-06", "Title": "a } foot", "Dummy": -10}))
        info = self.encodes(truth, "a.edf")
        self.assertEqual((info["geometry"]["spacing"], info["geometry"]["units"][:2]), ([1.5e-06, 2e-06, None], ["m", "m"]))
        pairs = dict(info["source"]["pairs"])
        self.assertEqual((pairs["edf_title"], pairs["edf_dummy"]), ("a } foot", "-10"))
        self.write("a.edf", frame(truth, fields={"PSize_1": "many"}))
        self.encodes(truth, "a.edf", says='PSize_1 is "many", which is not a number')
        self.write("a.edf", frame(truth, fields={"DataValueOffset": 100}))
        self.ok("encode", "a.edf", "-o", "a.tag")
        self.ok("decode", "a.tag", "-o", "a.npy", "--values")
        self.assertTrue(numpy.array_equal(numpy.load(self.folder / "a.npy"), truth + 100.0))
        for fields, text in (({"RasterOrientation": 3}, 'rasterorientation is "3"'), ({"ByteOrder": None}, "does not state its byte order")):
            self.write("a.edf", frame(truth, fields=fields))
            self.encodes(truth, "a.edf", says=text)

    def test_what_is_not_supported_is_refused(self):
        truth = random_samples("uint16", (5, 7, 9))
        for fields, text in (({"Compression": "GzipCompression"}, "Compression"), ({"EDF_BinaryFileName": "b.dat"}, "another file"), ({"DataType": "Unsigned64"}, "DataType"),
                             ({"DataType": None}, "DataType"), ({"Dim_1": None}, "Dim_1"), ({"Dim_1": 0}, "Dim_1"), ({"Dim_2": "x"}, "Dim_2"), ({"Dim_4": 2}, "Dim_4"),
                             ({"ByteOrder": "Middle"}, "ByteOrder"), ({"Size": 10}, "Size"), ({"EDF_DataBlockID": "1.Image.Error"}, "errors of samples"),
                             ({"Dim_1": 1 << 40, "Dim_2": 1 << 40}, "a volume cannot have"), ({"Dim_3": 6}, "expected"), ({"Dim_3": 1 << 30}, "expected")):
            self.write("a.edf", frame(truth, fields=fields))
            self.assert_refused(65, text, "encode", "a.edf")
        for second in (truth[1, :-1], truth[1, :, :-1], truth[1].astype("int16"), truth[:2]):
            self.write("a.edf", frame(truth[0]), frame(second))
            self.assert_refused(65, "frame 2 has", "encode", "a.edf")
        self.write("a.edf", frame(truth), frame(truth[0]))
        self.assert_refused(65, "frame 2 has", "encode", "a.edf")

    def test_damaged_files_are_refused(self):
        truth = random_samples("uint16", (5, 7, 9))
        whole = b"".join(map(frame, truth))
        one = len(frame(truth[0]))
        for size in (12, 300, 511, 512, one - 1, one + 1, one + 100, one + 511, one + 512, len(whole) - 1):
            self.write("a.edf", whole[:size])
            self.assert_refused(65, "a.edf", "encode", "a.edf")
        self.write("a.edf", whole[:one], b"what is this")
        self.encodes(truth[:1], "a.edf", says="12 bytes follow the samples")
        self.write("a.edf", b"{\nDim_1 = 9 ;\n" + b"x" * (3 << 20))
        self.assert_refused(65, "has no end", "encode", "a.edf")
        self.write("a.edf", b"no header")
        self.assert_refused(65, "its name says that it is an EDF file", "encode", "a.edf")

    def write_folder(self, truth, order="<", folder="s", **options):
        (self.folder / folder).mkdir(exist_ok=True)
        for z, slice in enumerate(truth):  # s8, s9, s10: a natural order
            self.write(f"{folder}/s{z + 8}.edf", frame(slice, order, **options))

    def test_a_folder_of_slices(self):
        for type in ("uint16", "float32"):
            truth = random_samples(type, (5, 7, 9))
            for order in "<>":
                self.write_folder(truth, order, fields={"PSize_1": "1e-06", "PSize_2": "2e-06", "Title": "a foot"})
                info = self.encodes(truth, "s", what=(type, order))
                self.assertEqual((self.messages, info["restorable"]), ("", True))  # byte for byte
                self.assertEqual((info["geometry"]["spacing"], dict(info["source"]["pairs"])["edf_title"]), ([1e-06, 2e-06, None], "a foot"))
        # Byte orders may differ, and the header may be longer in one of them.
        self.write("s/s9.edf", frame(truth[1], "<", block=1024))
        self.encodes(truth, "s", "--override-spacing", "1,2,3mm", says="another size of pixels than")
        self.assertEqual(self.info("out.tag")["geometry"]["spacing"], [1, 2, 3])
        self.write_folder(truth)
        self.ok("encode", "s", "-o", "a.tag", "--rm")
        self.assertFalse(list((self.folder / "s").iterdir()))
        self.ok("restore", "a.tag", "-o", "s")
        self.encodes(truth, "s")

    def test_folders_with_several_series_and_gaps(self):
        truth = random_samples("uint16", (5, 7, 9))
        self.write_folder(truth)
        (self.folder / "s" / "notes.txt").write_text("notes")
        (self.folder / "s" / "s10.edf").unlink()
        self.assertIn("--gaps-ok", self.assert_refused(65, "slices are missing", "encode", "s"))
        self.encodes(truth[[0, 1, 3, 4]], "s", "--gaps-ok", says="slices are missing")
        self.write_folder(truth)
        self.write("s/dark0000.edf", frame(truth[0]))
        self.assertIn("s#.edf", self.assert_refused(64, "2 series", "encode", "s"))
        self.encodes(truth, "s", "--series", "s#.edf")
        lines = [line for line in self.search("s").stdout.splitlines() if not line.startswith("#")]
        self.assertEqual(len(lines), 2, lines)
        (self.folder / "list").write_text("\n".join(lines) + "\n")
        self.ok("convert", "--manifest", "list", "--output-dir", "out")

    def test_folders_that_are_no_volume_are_refused(self):
        truth = random_samples("uint16", (3, 7, 9))
        for other, text in ((frame(truth[1, :-1]), "has 9 x 6 x 1"), (frame(truth[1].astype("int16")), "int16"), (frame(truth), "has 3 slices"),
                            (frame(truth[1])[:-2], "expected"), (b"{\n", "has no end"), (frame(truth[1], fields={"DataValueOffset": 5}), "DataValueOffset")):
            self.write_folder(truth)
            self.write("s/s9.edf", other)
            self.assertIn("s9.edf", self.assert_refused(65, text, "encode", "s", "-o", "a.tag"))
            self.assertFalse((self.folder / "a.tag").exists())

    @unittest.skipIf(fabio is None, "there is no fabio on this machine")
    def test_files_of_fabio(self):
        for type in NAMES:
            truth = random_samples(type, (5, 7, 9))
            image = fabio.edfimage.EdfImage(data=truth[0], header={"Title": "a foot", "PSize_1": "1e-06"})
            for slice in truth[1:]:
                image.append_frame(data=slice, header={"Title": "a foot"})
            image.write(str(self.folder / "a.edf"))
            with fabio.open(str(self.folder / "a.edf")) as read:
                self.assertEqual(read.nframes, 5)
            self.encodes(truth, "a.edf", what=type)
        for z, slice in enumerate(truth):
            (self.folder / "f").mkdir(exist_ok=True)
            fabio.edfimage.EdfImage(data=slice, header={"Title": "a foot"}).write(str(self.folder / "f" / f"s_{z:04}.edf"))
        self.encodes(truth, "f")
        # Ours are read by it.
        self.write("b.edf", *(frame(slice, ">", fields={"motor": 3}) for slice in truth))
        with fabio.open(str(self.folder / "b.edf")) as read:
            self.assertTrue(all(numpy.array_equal(read.get_frame(i).data, truth[i]) for i in range(5)))


if __name__ == "__main__":
    main()
