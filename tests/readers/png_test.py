"""PNG: folders of gray slices, with Pillow's files and those of a writer of our own as the truth."""

import json
import struct
import time
import unittest
import zlib

from other_readers import Image, ReaderTest, main, numpy, random_samples

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def chunk(name, content):
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


def png(slice, *chunks, color=0, bits=None, interlaced=False, end=b""):
    """A file of a slice, with filter 0 in each row."""
    bits = bits or 8 * slice.dtype.itemsize
    passes = [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)] if interlaced else [(0, 0, 1, 1)]
    rows = []
    for x, y, step_x, step_y in passes:
        part = slice[y::step_y, x::step_x]
        if part.size:
            rows += [b"\0" + row.astype(row.dtype.newbyteorder(">")).tobytes() for row in part]
    head = struct.pack(">IIBBBBB", slice.shape[1], slice.shape[0], bits, color, 0, 0, int(interlaced))
    return SIGNATURE + chunk(b"IHDR", head) + b"".join(chunks) + chunk(b"IDAT", zlib.compress(b"".join(rows))) + chunk(b"IEND", b"") + end


def resolution(x, y, unit=1):
    return chunk(b"pHYs", struct.pack(">IIB", x, y, unit))


@unittest.skipIf(None in (numpy, Image), "libraries are missing")
class Png(ReaderTest):
    def write(self, name, content):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)

    def folder_of(self, truth, *chunks, folder="s", **options):
        for z, slice in enumerate(truth):
            self.write(f"{folder}/s{z + 8}.png", png(slice, *chunks, **options))

    def test_folders_and_files_of_both_depths(self):
        for type in ("uint8", "uint16"):
            truth = random_samples(type, (5, 19, 23))
            for z, slice in enumerate(truth):  # s8, s9, s10: a natural order
                (self.folder / "s").mkdir(exist_ok=True)
                Image.fromarray(slice if type == "uint8" else slice.astype("int32")).convert("L" if type == "uint8" else "I;16").save(self.folder / "s" / f"s{z + 8}.png")
            info = self.encodes(truth, "s", what=type)
            self.assertEqual((self.messages, info["restorable"], info["geometry"]["spacing"]), ("", False, None))
            self.assertEqual(info["source"]["pairs"]["slice files"], "s8.png to s12.png (5)")
            self.encodes(truth[2:3], "s/s10.png", what=type)
            self.folder_of(truth, interlaced=True)
            self.encodes(truth, "s", what=(type, "interlaced"))
            (self.folder / "s" / "s10.png").unlink()
            self.assertIn("--gaps-ok", self.assert_refused(65, "slices are missing", "encode", "s"))
            self.encodes(truth[[0, 1, 3, 4]], "s", "--gaps-ok", says="slices are missing")

    def test_the_resolution_is_the_spacing_within_a_slice(self):
        truth = random_samples("uint16", (3, 9, 8))
        for per_meter, spacing, said in (((200000, 100000), [0.005, 0.01, None], ""), ((1, 1), None, ""), ((11811, 11811), None, "print resolution"), ((0, 5), None, "")):
            self.folder_of(truth, resolution(*per_meter))
            info = self.encodes(truth, "s", what=per_meter, says=said)
            self.assertEqual(info["geometry"]["spacing"], spacing, per_meter)
            if spacing:
                self.assertEqual(info["geometry"]["units"], ["mm"] * 3)
        self.folder_of(truth, resolution(3, 1, unit=0))
        self.assertIsNone(self.encodes(truth, "s")["geometry"]["spacing"])
        self.folder_of(truth, resolution(200000, 100000))
        self.assertEqual(self.encodes(truth, "s", "--override-spacing", "1,2,3um")["geometry"]["spacing"], [1, 2, 3])
        self.write("s/s9.png", png(truth[1], resolution(5000, 5000)))
        self.assertIsNone(self.encodes(truth, "s", says="different resolutions")["geometry"]["spacing"])

    def test_what_is_no_gray_image_is_refused_by_name(self):
        gray = random_samples("uint8", (8, 9))
        for image, said in ((Image.fromarray(gray).convert("RGB"), "RGB"), (Image.fromarray(gray).convert("P"), "palette"), (Image.fromarray(gray).convert("LA"), "transparency"),
                            (Image.fromarray(gray).convert("RGBA"), "transparency"), (Image.fromarray(gray > 99), "1 bits")):
            image.save(self.folder / "a.png")
            self.assert_refused(65, said, "encode", "a.png", "-o", "a.tag")
            self.assertFalse((self.folder / "a.tag").exists())
        self.write("s/1.png", png(gray))
        self.write("s/2.png", png(gray[:7]))
        self.assert_refused(65, "2.png: PNG file: has 9 x 7 samples of 8 bits, but", "encode", "s")
        self.write("s/2.png", png(gray.astype("uint16")))
        self.assert_refused(65, "of 16 bits, but", "encode", "s")

    def test_what_is_not_read_is_said(self):
        truth = random_samples("uint8", (3, 8, 9))
        self.folder_of(truth, chunk(b"tRNS", b"\0\7"))
        self.encodes(truth, "s", says="s: 3 of 3 files say that samples of one value are transparent")
        self.folder_of(truth, chunk(b"acTL", struct.pack(">II", 2, 0)))
        doubt = self.encodes(truth, "s", says="s: 3 of 3 files are animations")["source"]["pairs"]["not understood"]
        self.assertNotIn("s8.png", doubt)
        self.folder_of(truth, end=b"notes")
        self.encodes(truth, "s", says="s8.png: 5 bytes follow the samples; they are not part of the volume; likewise in 2 other files")

    def test_damaged_files_are_refused(self):
        good = png(random_samples("uint16", (40, 50)))
        for size in (8, 20, 30, 40, 100, len(good) // 2, len(good) - 1, len(good) - 12):
            self.write("a.png", good[:size])
            self.assert_refused(65, "a.png: ", "encode", "a.png", "-o", "a.tag")
            self.assertFalse((self.folder / "a.tag").exists())
        for at in (60, 200, len(good) - 20, 17, 24):  # checksums tell, also those of chunks that need not be read
            broken = bytearray(good)
            broken[at] ^= 0x55
            self.write("a.png", bytes(broken))
            self.assert_refused(65, "a.png: ", "encode", "a.png", "-o", "a.tag")
        huge = bytearray(good)
        struct.pack_into(">II", huge, 16, 2**31 - 1, 2**31 - 1)
        huge[29:33] = struct.pack(">I", zlib.crc32(huge[12:29]))
        self.write("a.png", bytes(huge))
        self.assert_refused(65, "which cannot be those of 2147483647 x 2147483647", "encode", "a.png", "-o", "a.tag")
        few = png(random_samples("uint8", (8, 9)))
        few = few.replace(struct.pack(">II", 9, 8), struct.pack(">II", 9, 800), 1)
        few = few[:29] + struct.pack(">I", zlib.crc32(few[12:29])) + few[33:]
        self.write("a.png", few)
        self.assert_refused(65, "a.png: PNG file: is damaged", "encode", "a.png", "-o", "a.tag")

    def test_samples_beyond_the_last_row_are_refused(self):
        slice = random_samples("uint8", (8, 9))
        rows = b"".join(b"\0" + row.tobytes() for row in slice)
        good = zlib.compress(rows)
        head = SIGNATURE + chunk(b"IHDR", struct.pack(">IIBBBBB", 9, 8, 8, 0, 0, 0, 0))
        for data, is_right in ((good, True), (zlib.compress(rows + bytes(5000)), False), (good + bytes(50), False), (good[:-1] + bytes([good[-1] ^ 1]), False)):
            self.write("a.png", head + chunk(b"IDAT", data) + chunk(b"IEND", b""))
            if is_right:
                self.encodes(slice[None], "a.png")
            else:
                self.assert_refused(65, "a.png: PNG file: ", "encode", "a.png", "-o", "a.tag")
                self.assertFalse((self.folder / "a.tag").exists())

    def test_a_file_of_many_chunks_is_refused(self):
        slice = random_samples("uint8", (8, 9))
        text = chunk(b"tEXt", b"a\0b")
        self.write("a.png", png(slice, *[text] * 5000))
        self.encodes(slice[None], "a.png")
        self.write("a.png", png(slice, *[text] * 500000))
        start = time.monotonic()
        self.assert_refused(65, "a.png: PNG file: has more than", "encode", "a.png", "-o", "a.tag")
        self.assertLess(time.monotonic() - start, 20)
        # Samples may be in many chunks, as libpng writes them.
        large = random_samples("uint8", (600, 1000))
        whole = png(large)
        data = zlib.compress(b"".join(b"\0" + row.tobytes() for row in large))
        self.write("a.png", whole[:33] + b"".join(chunk(b"IDAT", data[i:i + 1024]) for i in range(0, len(data), 1024)) + chunk(b"IEND", b""))
        self.encodes(large[None], "a.png")

    def test_pictures_beside_slices_of_another_format_are_left_alone(self):
        truth = random_samples("uint8", (3, 8, 9))
        for z, slice in enumerate(truth):
            (self.folder / "s").mkdir(exist_ok=True)
            Image.fromarray(slice).save(self.folder / "s" / f"s{z}.bmp")
        self.write("s/a.png", png(truth[0]))
        Image.fromarray(truth[0]).convert("RGB").save(self.folder / "s" / "b.png")
        self.encodes(truth, "s")
        self.assertEqual(self.found(), ({"s": "series=s#.bmp"}, ["s: a.png: a picture, or a single slice", "s: b.png: is a PNG image, but not one of gray samples of 8 or 16 bits"]))
        # Pictures of the same slices, and a volume of its own.
        for z, slice in enumerate(truth):
            self.write(f"s/s{z}.png", png(slice))
            self.write(f"s/t{z}.png", png(slice))
        self.assertIn("s: s0.png, s1.png, s2.png: pictures of slices of another format", self.found()[1])
        self.assertEqual(self.series, ["series=s#.bmp", "series=t#.png"])

    def found(self):
        """The lines of a list of this directory by the paths in it, each with its series, and what was passed over. No warnings."""
        run = self.search(".")
        self.assertNotIn("warning", run.stderr)
        lines = [line.split("\t") for line in run.stdout.splitlines() if not line.startswith("#")]
        self.series = sorted(next((column for column in line if column.startswith("series=")), "") for line in lines)
        return {line[0].replace(f"{self.folder}/", ""): next((column for column in line if column.startswith("series=")), "") for line in lines}, \
            sorted(line.removeprefix("# passed over: ") for line in run.stdout.splitlines() if line.startswith("# passed over: ") and "out." not in line)

    def test_a_search_passes_over_pictures(self):
        slices = random_samples("uint8", (3, 8, 9))
        self.write("logo/logo.png", png(slices[0]))
        self.write("logo/b1.5.png", png(slices[0, :5]))
        for i, slice in enumerate(slices):
            self.write(f"mixed/figure{i}.png", png(slice[:8 - i]))
            self.write(f"mixed/deep{i}.png", png(slice if i else slice.astype("uint16")))
            self.write(f"scan/s{i}.png", png(slice))
        self.write("scan/photo.png", png(slices[0, :5]))
        self.assertEqual(self.found(), ({"scan": "series=s#.png"}, [
            "logo: b1.5.png, logo.png: a picture, or a single slice", "mixed: deep0.png, deep1.png, deep2.png, figure0.png, figure1.png and 1 more: pictures of several sizes",
            "scan: photo.png: a picture, or a single slice"]))
        self.assertEqual(self.encodes(slices[:1], "logo/logo.png")["dims"][2], 1)
        # Names with several numbers are those of slices, not of pictures.
        for i, slice in enumerate(slices):
            self.write(f"cut/cut{i}_T{1200 + 7 * i * i}.png", png(slice))
        run = self.search("cut")
        self.assertIn("differ in several numbers", run.stderr)
        # A damaged slice is reported, and no picture.
        self.write("scan/s1.png", png(slices[1])[:-20])
        self.assertIn("s1.png: PNG file: is truncated", self.search("scan").stderr)

    def test_a_list_has_the_slices(self):
        truth = random_samples("uint16", (3, 9, 8))
        self.folder_of(truth)
        run = self.search("s")
        self.assertEqual([line for line in run.stdout.splitlines() if not line.startswith("#")], [f"{self.folder}/s\tseries=s#.png\toutput=s#.png"])
        (self.folder / "list").write_text(run.stdout)
        self.ok("convert", "--manifest", "list", "--output-dir", "out")
        records = (self.folder / "out" / "results.jsonl").read_text().splitlines()
        self.assertEqual([json.loads(record)["status"] for record in records], ["ok"])


if __name__ == "__main__":
    main()
