"""TIFF files with odd tags: read as tifffile and Pillow read them, refused by name, or said."""

import shutil
import struct
import subprocess
import unittest
import zlib

from other_readers import ReaderTest, main, numpy, tifffile

tiffcp = shutil.which("tiffcp")  # libtiff-tools
SHORT, LONG, RATIONAL, ASCII, LONG8 = 3, 4, 5, 2, 16
FORMS = {SHORT: "H", LONG: "I", LONG8: "Q"}


def value_bytes(type, values, order):
    if type == ASCII:
        return values.encode() + b"\0"
    if type == RATIONAL:
        return b"".join(struct.pack(order + "II", *pair) for pair in values)
    return struct.pack(f"{order}{len(values)}{FORMS[type]}", *values)


def tiff(pages, order="<", big=False, last=0):
    """The bytes of a TIFF file. A page is (tags by number, strips): a strip is bytes, or a pair of offset and count. `last` is
    where the last page says that the next one is."""
    place, count_form, entry_form = ("Q", "Q", "HHQ") if big else ("I", "H", "HHI")
    out = bytearray((b"II" if order == "<" else b"MM") + (struct.pack(order + "HHHQ", 43, 8, 0, 0) if big else struct.pack(order + "HI", 42, 0)))
    link = 8 if big else 4
    for i, (tags, strips) in enumerate(pages):
        tags, offsets, counts = dict(tags), [], []
        for strip in strips:
            if isinstance(strip, tuple):
                offsets.append(strip[0])
                counts.append(strip[1])
            else:
                out += bytes(-len(out) % 8)
                offsets.append(len(out))
                counts.append(len(strip))
                out += strip
        at_offsets, at_counts = (324, 325) if 322 in tags else (273, 279)
        tags.setdefault(at_offsets, (LONG, offsets))
        tags.setdefault(at_counts, (LONG, counts))
        entries = []
        for tag, entry in sorted(tags.items()):
            if entry is None:
                continue
            type, values = entry
            value = value_bytes(type, values, order)
            count = len(value) if type == ASCII else len(values)
            if len(value) > struct.calcsize(place):
                out += bytes(-len(out) % 8)
                value, content = struct.pack(order + place, len(out)), value
                out += content
            entries.append(struct.pack(order + entry_form, tag, type, count) + value.ljust(struct.calcsize(place), b"\0"))
        out += bytes(-len(out) % 8)
        struct.pack_into(order + place, out, link, len(out))
        out += struct.pack(order + count_form, len(entries)) + b"".join(entries)
        link = len(out)
        out += struct.pack(order + place, last if i == len(pages) - 1 else 0)
    return bytes(out)


def page(samples, more=None, rows=4, order="<", compress=None):
    """A page of greys, `rows` rows a strip."""
    height, width = samples.shape
    kind = {"u": 1, "i": 2, "f": 3}[samples.dtype.kind]
    tags = {256: (LONG, [width]), 257: (LONG, [height]), 258: (SHORT, [8 * samples.itemsize]), 259: (SHORT, [1]), 262: (SHORT, [1]), 277: (SHORT, [1]),
            278: (LONG, [rows]), 339: (SHORT, [kind])}
    stored = samples.astype(samples.dtype.newbyteorder(order))
    strips = [stored[y:y + rows].tobytes() for y in range(0, height, rows)]
    return tags | (more or {}), [compress(strip) for strip in strips] if compress else strips


def image_j(lines, images=3):
    return {270: (ASCII, f"ImageJ=1.53t\nimages={images}\nslices={images}\n{lines}")}


@unittest.skipIf(None in (numpy, tifffile), "libraries are missing")
class OddTiff(ReaderTest):
    def volume(self, type="uint16", shape=(3, 12, 16)):
        random = numpy.random.default_rng(1)
        return (random.standard_normal(shape) * 1000).astype(type) if type.startswith("float") else random.integers(0, 120, shape, type)

    def write(self, pages, name="a.tif", **options):
        (self.folder / name).parent.mkdir(exist_ok=True)
        (self.folder / name).write_bytes(tiff(pages, **options))
        return name

    def pages(self, truth, more=None, **options):
        return [page(slice, more if z == 0 or more is None or 270 not in more else {tag: value for tag, value in more.items() if tag != 270}, **options)
                for z, slice in enumerate(truth)]

    def assert_said(self, text, name="a.tif"):
        """The text is a warning, and something that forbids the removal after a lossy encoding."""
        self.encoded(name, says=text)
        self.assert_refused(64, text, "encode", name, "-o", "x.tag", "--max-error", "5", "--rm")
        self.assertTrue((self.folder / name).exists())

    def assert_as_tifffile(self, name="a.tif"):
        samples, info = self.encoded(name)
        truth = tifffile.imread(self.folder / name)
        self.assert_same(samples, truth.reshape(samples.shape))
        return samples, info

    # Compressed strips and tiles

    def test_damaged_streams_are_refused(self):
        """libtiff stops when a strip is full, and does not see what comes then: the rest of a stream, and its checksum."""
        truth = self.volume(shape=(2, 24, 16))
        random = numpy.random.default_rng(3)
        for scheme in (8, 32946):
            whole = [page(slice, {259: (SHORT, [scheme])}, rows=8, compress=zlib.compress) for slice in truth]
            self.assert_same(self.encoded(self.write(whole))[0], truth)
            for kind in ("flip", "zeros", "checksum", "longer", "end"):
                for _ in range(4):
                    pages = [(tags, list(strips)) for tags, strips in whole]
                    stream = bytearray(pages[1][1][1])
                    if kind == "flip":
                        stream[random.integers(len(stream))] ^= 1 << random.integers(8)
                    elif kind == "zeros":
                        at = random.integers(2, len(stream) - 20)
                        stream[at:at + 20] = bytes(20)
                    elif kind == "checksum":
                        stream[-1] ^= 1
                    elif kind == "longer":
                        stream = zlib.compress(zlib.decompress(stream) + bytes(2))
                    else:
                        stream = stream[:-4]
                    pages[1][1][1] = bytes(stream)
                    self.assert_refused(65, "a.tif: TIFF file: ", "encode", self.write(pages))
        # The same with tools of libtiff: there, LZW and PackBits have no checksum, but streams have the bytes that are needed.
        if tiffcp is None:
            return
        for scheme in ("zip", "lzw", "packbits", "zip:2", "lzw:2", "zip -f lsb2msb", "lzw -f lsb2msb"):
            for shape in ((2, 24, 16), (1, 70, 300)):
                truth = self.volume(shape=shape) // 3
                tifffile.imwrite(self.folder / "b.tif", truth, photometric="minisblack", metadata=None)
                for layout in (["-r", "8"], ["-r", "50"], ["-t", "-w", "32", "-l", "16"]):
                    subprocess.run(["tiffcp", "-c", *scheme.split(), *layout, self.folder / "b.tif", self.folder / "a.tif"], check=True)
                    self.assert_same(self.encoded("a.tif")[0], truth, (scheme, layout))

    def test_streams_with_bytes_behind_them_and_full_last_strips_are_read(self):
        """Programs write both; tifffile reads both."""
        truth = self.volume(shape=(2, 12, 16))
        pages = self.pages(truth, {259: (SHORT, [8])}, rows=8, compress=zlib.compress)
        for tags, strips in pages:
            strips[0] += b"more"
            strips[1] = zlib.compress(zlib.decompress(strips[1]) + bytes(4 * 32))
        self.assert_same(self.assert_as_tifffile(self.write(pages))[0], truth)

    # Strips and tiles that nobody wrote

    def test_strips_that_were_never_written_are_zeros_and_said(self):
        for type in ("uint8", "uint16", "int16", "float32"):
            for compress in (None, zlib.compress):
                truth = self.volume(type)
                pages = self.pages(truth, {259: (SHORT, [8 if compress else 1])}, compress=compress)
                pages[0][1][1] = pages[2][1][0] = pages[2][1][2] = (0, 0)
                truth[0, 4:8] = truth[2, 0:4] = truth[2, 8:12] = 0
                for options in ({}, {"big": True}):
                    samples, info = self.assert_as_tifffile(self.write(pages, **options))
                    self.assert_same(samples, truth)
                    self.assertIn("a.tif: 3 of its 9 strips or tiles were never written; their samples are read as 0", self.messages)
                    self.assertFalse(info["restorable"])
                    self.assertIn("deflate" if compress else "never written", info["compression"])
        # What is not byte for byte does not replace the file.
        self.assert_refused(64, "cannot be removed", "encode", "a.tif", "-o", "x.tag", "--rm")

    def test_tiles_and_whole_pages_that_were_never_written(self):
        truth = self.volume("uint16", (2, 20, 40))
        tifffile.imwrite(self.folder / "a.tif", truth, tile=(16, 16), photometric="minisblack", metadata=None)
        data = bytearray((self.folder / "a.tif").read_bytes())
        with tifffile.TiffFile(self.folder / "a.tif") as file:
            for tag in ("TileOffsets", "TileByteCounts"):
                tag = file.pages[1].tags[tag]
                size = struct.calcsize(FORMS[int(tag.dtype)])
                data[tag.valueoffset + 4 * size:tag.valueoffset + 6 * size] = bytes(2 * size)
        (self.folder / "a.tif").write_bytes(data)
        truth[1, 16:, 16:] = 0
        self.assert_same(self.assert_as_tifffile()[0], truth)
        self.assertIn("2 of its 12 strips or tiles", self.messages)
        pages = self.pages(truth[:, :12, :16], rows=12)
        pages[1][1][0] = (0, 0)
        samples, _ = self.encoded(self.write(pages))
        self.assertEqual((samples[0].tobytes(), samples[1].any()), (truth[0, :12, :16].tobytes(), False))

    def test_what_was_never_written_is_what_gdal_says_of_no_data(self):
        for type, text, fill in (("int16", "-32768", -32768), ("uint8", "255", 255), ("float32", "-9999", -9999), ("float32", "nan", numpy.nan), ("uint8", "-1", 0)):
            truth = self.volume(type)
            pages = self.pages(truth, {42113: (ASCII, text)})
            pages[1][1][1] = (0, 0)
            truth[1, 4:8] = fill
            self.encodes(truth, self.write(pages), what=text)
            if text != "-1":
                self.assertIn(f"samples of {text} mean that there are no data", self.messages)
        self.write(self.pages(truth, {42113: (ASCII, "none")}))
        self.assert_said('GDAL_NODATA is "none", which is not a number')

    def test_a_strip_with_half_a_place_is_refused_by_its_number(self):
        truth = self.volume()
        for strip, said in (((0, 128), "strip 2 begins at byte 0 and has 128 bytes"), ((40, 0), "strip 2 begins at byte 40 and has 0 bytes"),
                            ((4, 128), "strip 2 begins at byte 4"), ((40, 100), "strip 2 has 100 bytes, but its samples need 128")):
            pages = self.pages(truth)
            pages[1][1][1] = strip
            self.assert_refused(65, said, "encode", self.write(pages))
        # Too few places are not places that were never written.
        pages = self.pages(truth)
        pages[1][1].pop()
        self.assert_refused(65, "has 3 strips or tiles, but tag 273 has 2 numbers", "encode", self.write(pages))

    def test_counts_that_cannot_be_meant_are_calculated_and_said(self):
        truth = self.volume()
        for counts in (None, (LONG, [0]), (LONG, [0xFFFFFFFF]), (LONG, [7])):
            for rows in ([12], [0xFFFFFFFF]):
                pages = self.pages(truth, {279: counts, 278: (LONG, rows)}, rows=12)
                self.assert_same(self.assert_as_tifffile(self.write(pages))[0], truth, f"{counts} {rows}")
                self.assertIn("its StripByteCounts are absent, or not what its samples need", self.messages)
        pages = self.pages(truth, {278: (LONG, [0xFFFFFFFF])}, rows=12)
        self.assert_same(self.assert_as_tifffile(self.write(pages))[0], truth)
        self.assertNotIn("warning", self.messages)

    # Pages

    def test_pages_that_lead_in_circles_are_refused(self):
        truth = self.volume()
        data = tiff(self.pages(truth))
        first = struct.unpack_from("<I", data, 4)[0]
        self.write(self.pages(truth), last=first)
        self.assert_refused(65, "its pages lead in circles", "encode", "a.tif")
        self.write(self.pages(truth), last=2**31)
        self.assert_refused(65, "a.tif: TIFF file: ", "encode", "a.tif")

    def test_previews_are_no_slices_and_full_pages_that_claim_to_be_are_said(self):
        truth = self.volume()
        for tag, type, value in ((254, LONG, 1), (255, SHORT, 2)):
            pages = self.pages(truth)
            pages.insert(1, page(truth[0, ::2, ::2], {tag: (type, [value])}))
            self.encodes(truth, self.write(pages), what=tag)
            self.assertNotIn("warning", self.messages)
            if tag == 255:  # libtiff does not know this old tag, so it counts only for small pages
                continue
            pages[3] = page(truth[2], {tag: (type, [value])})
            self.write(pages)
            self.assert_said("1 of its pages are previews or masks by their SubfileType, but not smaller than slices")
            self.encodes(truth[:2], "a.tif")
        # A smaller page that says nothing of being a preview is no slice of this volume.
        self.assert_refused(65, "slice 2 of 2 is 8 x 6 uint16, but the first one is 16 x 12 uint16", "encode",
                            self.write([page(truth[0]), page(truth[0, ::2, ::2])]))
        self.assert_refused(65, "slice 2 of 2 is 16 x 12 uint16 (WhiteIsZero), but", "encode", self.write([page(truth[0]), page(truth[1], {262: (SHORT, [0])})]))

    def test_images_below_pages_are_copies_or_said(self):
        truth = self.volume("uint16", (1, 32, 32))
        for below, is_said in ((truth[0, ::2, ::2], False), (truth[0], True)):
            with tifffile.TiffWriter(self.folder / "a.tif") as file:
                file.write(truth[0], subifds=1, photometric="minisblack", metadata=None)
                file.write(below, subfiletype=1, photometric="minisblack", metadata=None)
            self.encodes(truth, "a.tif")
            if is_said:
                self.assert_said("there are images below its pages (SubIFDs) that are no smaller copies")
            else:
                self.assertNotIn("warning", self.messages)

    def test_arrays_of_tifffile_with_more_axes_are_said(self):
        truth = self.volume("uint16", (2, 3, 12, 16))
        tifffile.imwrite(self.folder / "a.tif", truth, photometric="minisblack")
        self.encodes(truth.reshape(6, 12, 16), "a.tif")
        self.assert_said("its description says that its pages are an array of 2 x 3")
        tifffile.imwrite(self.folder / "a.tif", truth[0], photometric="minisblack", metadata={"axes": "CYX"})
        self.assert_said("its description says that its pages are an array of 3 (\"CYX\")")
        for metadata in ({}, {"axes": "ZYX"}):
            tifffile.imwrite(self.folder / "a.tif", truth[0], photometric="minisblack", metadata=metadata)
            self.assert_as_tifffile()
            self.assertNotIn("warning", self.messages)
        # Only the first one has a page.
        tifffile.imwrite(self.folder / "a.tif", truth[0], photometric="minisblack", truncate=True)
        self.encodes(truth[0], "a.tif")

    def test_a_folder_of_slices_takes_no_file_of_several_images(self):
        truth = self.volume()
        for z in range(3):
            self.write([page(truth[z])], f"s/{z}.tif")
        self.encodes(truth, "s")
        self.write([page(truth[2], image_j("", 3), rows=12)], "s/2.tif")
        self.assert_refused(65, "2.tif: TIFF file: its description speaks of several images", "encode", "s")

    def test_two_slices_with_the_same_number_are_refused_and_the_advice_helps(self):
        truth = self.volume()
        for z, name in enumerate(("a1", "a2", "a3")):
            self.write([page(truth[z])], f"s/{name}.tif")
        self.write([page(truth[0])], "s/a01.tif")
        for options in ((), ("--gaps-ok",)):
            message = self.assert_refused(65, "a01.tif and a1.tif have the same number", "encode", "s", *options)
            self.assertNotIn("--gaps-ok", message)
        self.assertIn("move one of them to another directory", message)
        run = self.search("s")
        self.assertIn("# not listed: ", run.stdout)
        (self.folder / "t").mkdir()
        (self.folder / "s/a01.tif").rename(self.folder / "t/a01.tif")
        self.encodes(truth, "s")

    def test_slices_have_the_spacing_within_them_that_all_of_them_give(self):
        truth = self.volume()
        for z in range(3):
            self.write([page(truth[z], {282: (RATIONAL, [(4, 1)]), 283: (RATIONAL, [(2, 1)])} | image_j("unit=mm\nspacing=7\n", 1))], f"s/{z}.tif")
        self.assertEqual(self.encoded("s")[1]["geometry"]["spacing"], [0.25, 0.5, None])
        self.assertNotIn("warning", self.messages)
        self.write([page(truth[2], {282: (RATIONAL, [(4000001, 1000000)]), 283: (RATIONAL, [(2, 1)])} | image_j("unit=mm\n", 1))], "s/2.tif")
        self.assertEqual(self.encoded("s")[1]["geometry"]["spacing"], [0.25, 0.5, None])
        self.write([page(truth[2], {282: (RATIONAL, [(4004, 1000)]), 283: (RATIONAL, [(2, 1)])} | image_j("unit=mm\n", 1))], "s/2.tif")
        self.assertIsNone(self.encoded("s")[1]["geometry"]["spacing"])
        self.assertIn("s: its slices have different spacings, so the spacing is unknown", self.messages)

    def test_stacks_whose_slices_share_a_page_are_refused_by_name(self):
        self.write([page(self.volume()[0], {33629: (RATIONAL, [(1, 1)] * 5)})])
        self.assert_refused(65, "is a stack of MetaMorph (STK) with 5 slices in one page", "encode", "a.tif")
        for tag, program in ((34412, "Zeiss LSM"), (34361, "FluoView"), (51123, "Micro-Manager"), (291, "GrayResponseCurve")):
            self.write(self.pages(self.volume(), {tag: (SHORT, [1, 2, 3, 4])}))
            self.assert_said(program)

    # What samples mean

    def test_colors_and_masks_are_refused_by_name(self):
        slice = self.volume("uint8")[0]
        for meaning, said in ((2, "colors (RGB)"), (4, "a mask of transparency"), (5, "colors (CMYK)"), (8, "colors (Lab)"), (32803, "color filter"), (999, "PhotometricInterpretation 999")):
            self.assert_refused(65, said, "encode", self.write([page(slice, {262: (SHORT, [meaning])})]))
        self.assert_refused(65, "its pixels have 2 samples each", "encode",
                            self.write([page(slice, {277: (SHORT, [2]), 258: (SHORT, [8, 8]), 339: (SHORT, [1, 1]), 256: (LONG, [8])})]))
        self.assert_refused(65, "colors of a palette", "encode", self.write([page(slice, {320: (SHORT, [0] * 768), 262: (SHORT, [3])})]))
        self.assert_refused(65, "colors of a palette", "encode", self.write([page(slice, {346: (SHORT, [1])})]))

    def test_samples_of_other_formats_and_compressions_are_refused_by_name(self):
        slice = self.volume("float32")[0]
        for more, said in (({339: (SHORT, [5])}, "complex numbers of 32 bits"), ({339: (SHORT, [6]), 258: (SHORT, [64]), 256: (LONG, [8])}, "complex numbers of 64 bits"),
                           ({339: (SHORT, [3]), 258: (SHORT, [16]), 256: (LONG, [32])}, "floats of 16 bits"), ({259: (SHORT, [34887])}, "LERC"),
                           ({259: (SHORT, [50002])}, "JPEG XL"), ({259: (SHORT, [34712])}, "JPEG 2000"), ({259: (SHORT, [6])}, "JPEG of old TIFF files"),
                           ({259: (SHORT, [12345])}, "scheme 12345")):
            self.assert_refused(65, said, "encode", self.write([page(slice, more)]))
        self.write(self.pages(self.volume("uint16"), {339: (SHORT, [4])}))
        self.assert_said("SampleFormat says that nothing is known of its samples")
        self.write(self.pages(self.volume("uint16"), {317: (SHORT, [2])}))
        self.assert_said("it has a Predictor, but no compression to which one belongs")

    def gdal(self, scale, offset):
        items = "".join(f'<Item name="{role.upper()}" sample="0" role="{role}">{text}</Item>' for role, text in (("scale", scale), ("offset", offset)) if text is not None)
        return {42112: (ASCII, f'<GDALMetadata>{items}<Item name="UNITTYPE" sample="0" role="unittype">HU</Item></GDALMetadata>')}

    def test_a_scale_of_gdal_is_slope_and_intercept(self):
        truth = self.volume()
        for scale, offset, values in (("0.5", "-1000", (0.5, -1000)), ("2", None, (2, 0)), ("0,5", "-1000", (0.5, -1000))):
            info = self.encodes(truth, self.write(self.pages(truth, self.gdal(scale, offset))))
            pairs = info["source"]["pairs"]
            self.assertEqual((float(pairs["rescale_slope"]), float(pairs["rescale_intercept"]), pairs["rescale_units"]), (*values, "HU"))
            self.assertEqual("with a decimal comma" in self.messages, "," in scale)
        for scale, offset in (("half", "-1000"), ("", "-1000"), ("0", "-1000"), ("0.5", "1,000"), ("nan", "0")):
            self.write(self.pages(truth, self.gdal(scale, offset)))
            self.encodes(truth, "a.tif", says="of values in GDAL's metadata is")
            self.assert_refused(64, "cannot be converted to stored samples", "encode", "a.tif", "-o", "x.tag",
                                "--max-error", "5")
        pages = self.pages(truth, self.gdal("0.5", "0"))
        pages[2] = page(truth[2], self.gdal("0.25", "0"))
        self.assert_refused(65, "slice 3 of 3 has another scale of values (GDAL)", "encode", self.write(pages))

    # ImageJ

    def test_a_spacing_of_image_j_that_cannot_be_read_is_said_and_unknown(self):
        truth = self.volume()
        resolution = {282: (RATIONAL, [(4, 1)]), 283: (RATIONAL, [(2, 1)])}
        for line, spacing, said in (("spacing=1.5", 1.5, ""), ("spacing=1,5", 1.5, "with a decimal comma; it is read as 1.5"), ("spacing=abc", None, "ImageJ's spacing is \"abc\""),
                                    ("spacing=", None, "ImageJ's spacing is empty"), ("spacing=1,024", None, "which is not a number"), ("spacing=0", None, "which is no distance"),
                                    ("spacing=-1.5", 1.5, "ImageJ's spacing is -1.5; it is read as 1.5"), ("spacing=inf", None, "which is not a number"), ("", None, "")):
            info = self.encodes(truth, self.write(self.pages(truth, resolution | image_j(f"unit=mm\n{line}\n"))))
            self.assertEqual((info["geometry"]["spacing"], info["geometry"]["units"]), ([0.25, 0.5, spacing], ["mm"] * 3), line)
            self.assertIn(said, self.messages)
            self.assertEqual(said == "", "warning" not in self.messages, self.messages)
        for x in ((0, 0), (4, 0), (0, 1)):
            self.write(self.pages(truth, resolution | {282: (RATIONAL, [x])} | image_j("unit=mm\nspacing=1.5\n")))
            self.assertEqual(self.encoded("a.tif")[1]["geometry"]["spacing"], [None, 0.5, 1.5])
            self.assertIn("XResolution is", self.messages)
        self.write(self.pages(truth, resolution | image_j("unit=mm\nzunit=um\nspacing=1500\n")))
        self.assertEqual(self.encoded("a.tif")[1]["geometry"]["spacing"], [0.25, 0.5, 1.5])
        self.write(self.pages(truth, resolution | image_j("unit=mm\nzunit=section\nspacing=1500\n")))
        self.assertEqual(self.encoded("a.tif")[1]["geometry"]["spacing"], [0.25, 0.5, None])
        self.assertIn('ImageJ\'s spacing has the unit "section"', self.messages)
        self.write(self.pages(truth, resolution | image_j("spacing=1.5\n")))
        self.assertIsNone(self.encoded("a.tif", says="its resolution of 4 x 2 has no unit")[1]["geometry"]["spacing"])

    def test_a_resolution_of_another_type_is_said(self):
        self.write(self.pages(self.volume(), {282: (ASCII, "four"), 283: (RATIONAL, [(2, 1)])} | image_j("unit=mm\nspacing=1.5\n")))
        self.assert_said("a tag of it cannot be read (")
        self.assertEqual(self.encoded("a.tif")[1]["geometry"]["spacing"], [None, 0.5, 1.5])

    def test_coefficients_of_image_j_that_cannot_be_read_leave_no_bound(self):
        truth = self.volume()
        for lines, said in (("c0=abc\nc1=2", 'the coefficient c0 = "abc", which is not a number'), ("c0=-1000\nc1=", 'the coefficient c1 = ""'), ("c0=1,000\nc1=2", "c0"),
                            ("c0=5", "has no coefficient c1"), ("c1=5", "has no coefficient c0"), ("c0=1\nc1=0", "has the coefficients 1 and 0"), ("c0=inf\nc1=1", "c0")):
            self.write(self.pages(truth, image_j(f"cf=0\n{lines}\nvunit=HU\n")))
            info = self.encodes(truth, "a.tif", says=said)
            self.assertNotIn("rescale_slope", info["source"]["pairs"])
            self.assert_refused(64, "cannot be converted to stored samples", "encode", "a.tif", "-o", "x.tag",
                                "--max-error", "5")
        self.write(self.pages(truth, image_j("cf=straight\nc0=1\nc1=2\n")))
        self.assert_refused(64, 'the function of ImageJ\'s calibration is "straight"', "encode", "a.tif", "-o", "x.tag", "--max-error", "5")
        pairs = self.encoded(self.write(self.pages(truth, image_j("cf=0\nc0=-102,5\nc1=2,50\nvunit=HU\n"))))[1]["source"]["pairs"]
        self.assertEqual((float(pairs["rescale_slope"]), float(pairs["rescale_intercept"])), (2.5, -102.5))
        self.assertIn("with a decimal comma", self.messages)
        self.write(self.pages(truth, image_j("cf=3\nc0=1\nc1=2\nc2=3\nvunit=OD\n")))
        self.assert_said("ImageJ's calibration is not a straight line (function 3)")

    # A table of what may be odd, judged by tifffile

    def test_odd_files_are_read_as_tifffile_reads_them_or_refused(self):
        truth, bytes_ = self.volume(), self.volume("uint8")
        delta = numpy.diff(truth, axis=2, prepend=numpy.zeros((3, 12, 1), "uint16")).astype("uint16")
        tile = {322: (SHORT, [16]), 323: (SHORT, [16]), 278: None}
        tiled = [(page(slice)[0] | tile, [numpy.pad(slice, ((0, 4), (0, 0)), constant_values=7).tobytes()]) for slice in truth]
        files = {
            "reversed bits": self.pages(bytes_, {266: (SHORT, [2])}),
            "counts and places of 16 bits": [(tags | {279: (SHORT, [128] * 3)}, strips) for tags, strips in self.pages(truth)],
            "one row a strip": self.pages(truth, rows=1),
            "a strip longer than its samples": [(tags, [strips[0], strips[1], strips[2] + bytes(9)]) for tags, strips in self.pages(truth)],
            "difference of neighbors": [page(slice, {317: (SHORT, [2]), 259: (SHORT, [8])}, compress=zlib.compress) for slice in delta],
            "other number of deflate": self.pages(truth, {259: (SHORT, [32946])}, compress=zlib.compress),
            "planes apart": self.pages(truth, {284: (SHORT, [2])}),
            "no sample format": self.pages(truth, {339: None}),
            "tiles beyond the edge": tiled,
            "white is zero": self.pages(truth, {262: (SHORT, [0])}),
            "an orientation": self.pages(truth, {274: (SHORT, [3])}),
            "a color map beside greys": self.pages(bytes_, {320: (SHORT, list(range(256)) * 3)}),
            "an extra sample that is none": self.pages(truth, {338: (SHORT, [0])}),
            "no photometric": self.pages(truth, {262: None}),
            "tags that nobody knows": self.pages(truth, {65000: (ASCII, "abc"), 60001: (SHORT, [1, 2, 3])}),
            "least and largest sample": self.pages(truth, {280: (SHORT, [5]), 281: (SHORT, [6])}),
            "pages of another type": [*self.pages(truth[:2]), page(truth[2].astype("int16"))],
            "no bits": self.pages(bytes_, {258: None}),
            "no rows a strip": self.pages(truth, {278: (LONG, [0])}, rows=12),
            "an odd number of rows a strip": self.pages(truth, rows=5),
        }
        read = 0
        for name, pages in files.items():
            for options in ({}, {"big": True}):
                self.write(pages, **options)
                run = self.tagrid("encode", "a.tif", "-o", "out.tag", "-f")
                if run.returncode == 65:
                    self.assertIn("a.tif: TIFF file: ", run.stderr, name)
                    continue
                self.assertEqual(run.returncode, 0, f"{name}: {run.stderr}")
                try:
                    judged = tifffile.imread(self.folder / "a.tif")
                except Exception:  # It needs another library for this.
                    judged = None
                samples = self.encoded("a.tif")[0]
                if judged is not None:
                    read += 1
                    if judged.dtype == bool:
                        judged = judged.astype("uint8")
                    self.assert_same(samples, judged.reshape(samples.shape), name)
        self.assertGreater(read, 30)


if __name__ == "__main__":
    main()
