"""BMP: folders of slices as SkyScan's programs write them, with Pillow's files as the truth."""

import json
import shutil
import struct
import unittest

from other_readers import Image, ReaderTest, main, numpy

LOG = "[System]\nScanner=SkyScan1272\n[Acquisition]\nImage Pixel Size (um)= 34.5\n[Reconstruction]\nPixel Size (um)=17.25\n"


@unittest.skipIf(None in (numpy, Image), "libraries are missing")
class Bmp(ReaderTest):
    def volume(self, shape=(5, 19, 23)):
        return numpy.random.default_rng(1).integers(0, 256, shape, "uint8")

    def write(self, name, slice):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        Image.fromarray(slice).save(path)
        return path

    def turned(self, path):
        """Makes the upper row the first one in the file. REQUIRES: rows are not filled up."""
        data = bytearray(path.read_bytes())
        width, height = struct.unpack_from("<2i", data, 18)
        struct.pack_into("<i", data, 22, -height)
        data[-width * height:] = numpy.frombuffer(data[-width * height:], "uint8").reshape(height, width)[::-1].tobytes()
        path.write_bytes(data)

    def test_a_skyscan_folder(self):
        for width in (20, 21, 22, 23):  # rows are filled up to multiples of four
            shutil.rmtree(self.folder / "s", ignore_errors=True)
            truth = self.volume((5, 19, width))
            for z, slice in enumerate(truth):
                self.write(f"s/mouse_rec{z + 98:08}.bmp", slice)
            self.write("s/mouse_rec_spr.bmp", self.volume((1, 40, 50))[0])
            (self.folder / "s" / "mouse_rec.log").write_text(LOG)
            info = self.encodes(truth, "s")
            self.assertEqual(info["geometry"]["spacing"], [17.25] * 3)
            self.assertEqual(info["geometry"]["units"], ["um"] * 3)
            self.assertEqual(info["source"]["pairs"]["skyscan_system/scanner"], "SkyScan1272")
            self.assertTrue(info["restorable"])  # and all bytes came back
        self.encodes(truth[1:2], "s/mouse_rec00000099.bmp")
        self.ok("verify", "out.tag", "--against", "s/mouse_rec00000099.bmp")

    def test_files_come_back_with_their_rows_from_the_bottom_up(self):
        truth = self.volume((3, 19, 22))
        for z, slice in enumerate(truth):
            path = self.write(f"s/a{z}.bmp", slice)
            data = bytearray(path.read_bytes())
            for y in range(19):  # what fills rows up is no sample, and may be anything
                data[1078 + 24 * y + 22:1078 + 24 * y + 24] = bytes([z, y])
            path.write_bytes(data + b"notes")
        before = {path.name: path.read_bytes() for path in (self.folder / "s").iterdir()}
        self.encodes(truth, "s")
        self.ok("encode", "s", "-o", "a.tag", "--max-error", "9")
        self.ok("restore", "a.tag", "-o", "r")
        for z, slice in enumerate(truth):
            now = numpy.asarray(Image.open(self.folder / "r" / f"a{z}.bmp")).astype(int)
            self.assertTrue(0 < numpy.abs(now - slice).max() <= 9)
            again = (self.folder / "r" / f"a{z}.bmp").read_bytes()
            self.assertEqual((again[:1078], again[1078 + 22:1078 + 24], again[-5:]), (before[f"a{z}.bmp"][:1078], bytes([z, 0]), b"notes"))
        self.ok("encode", "s", "-o", "b.tag", "--resume", "--rm")
        self.assertFalse(any((self.folder / "s").iterdir()))
        self.ok("restore", "b.tag", "-o", "s")
        self.assertEqual({path.name: path.read_bytes() for path in (self.folder / "s").iterdir()}, before)

    def test_bytes_after_the_samples_are_said_and_come_back(self):
        truth = self.volume((3, 19, 24))
        for z, slice in enumerate(truth):
            path = self.write(f"s/a{z}.bmp", slice)
            if z > 0:
                path.write_bytes(path.read_bytes() + b"notes" * z)
        self.encodes(truth, "s", says="a1.bmp: 5 bytes follow the samples; they are not part of the volume; likewise in another file")
        before = {path.name: path.read_bytes() for path in (self.folder / "s").iterdir()}
        self.ok("encode", "s", "-o", "b.tag", "--rm", "--max-error", "5")
        self.ok("restore", "b.tag", "-o", "s")
        for name, whole in before.items():
            self.assertEqual((self.folder / "s" / name).read_bytes()[1078 + 19 * 24:], whole[1078 + 19 * 24:])
        # A color profile lies there, too, and is no surprise.
        plain = self.write("a.bmp", truth[0]).read_bytes()
        header = bytearray(124)
        header[:40] = struct.pack("<I", 124) + plain[18:54]
        profile, end = b"profile!", 14 + 124 + 1024 + 19 * 24
        header[112:120] = struct.pack("<II", end - 14, len(profile))
        start = plain[:10] + struct.pack("<I", 14 + 124 + 1024)
        (self.folder / "a.bmp").write_bytes(start + header + plain[54:] + profile)
        with Image.open(self.folder / "a.bmp") as image:
            self.assertTrue((numpy.asarray(image) == truth[0]).all())
        self.encodes(truth[:1], "a.bmp")
        self.assertNotIn("follow the samples", self.messages)

    def test_numbers_of_a_log_that_cannot_be_read_are_said(self):
        for z, slice in enumerate(self.volume((3, 8, 8))):
            self.write(f"s/a{z}.bmp", slice)
        for size, step, spacing, said in (("17,25", "1", [17.25] * 3, "with a decimal comma; it is read as 17.25"), ("abc", "1", None, 'Pixel Size (um) is "abc", which is not a number; the spacing is unknown'),
                                          ("", "1", None, "Pixel Size (um) is empty"), ("0", "1", None, "Pixel Size (um) is 0; the spacing is unknown"), ("-2", "1", None, "Pixel Size (um) is -2"),
                                          ("17.25", "two", [17.25, 17.25, None], "Section to Section Step is \"two\""), ("17.25", "0", [17.25, 17.25, None], "the distance between slices is unknown")):
            (self.folder / "s" / "a.log").write_text(f"[Reconstruction]\nPixel Size (um)={size}\nSection to Section Step={step}\n")
            self.assertEqual(self.encoded("s")[1]["geometry"]["spacing"], spacing, size)
            self.assertIn(said, self.messages)
            self.assertIn("a.log: ", self.messages)

    def test_the_upper_row_may_come_first(self):
        truth = self.volume((3, 19, 24))
        for z, slice in enumerate(truth):
            self.turned(self.write(f"s/a{z}.bmp", slice))
        (self.folder / "s" / "a.log").write_text(LOG)
        samples, info = self.encoded("s")
        self.assert_same(samples, truth)
        # Such samples lie as in the volume, so all files come back, the log with them.
        self.assertTrue(info["restorable"])
        self.ok("restore", "out.tag", "-o", "r")
        self.assertEqual({path.name for path in (self.folder / "r").rglob("*") if path.is_file()}, {"a0.bmp", "a1.bmp", "a2.bmp", "a.log"})

    def test_each_log_belongs_to_the_slices_of_its_name(self):
        truth = self.volume((4, 8, 8))
        for z in range(2):
            self.write(f"s/a{z}.bmp", truth[z])
            self.write(f"s/ab{z}.bmp", truth[2 + z])
        for name, size in (("a", "5"), ("ab", "7")):
            (self.folder / "s" / f"{name}.log").write_text(LOG.replace("17.25", size))
        for name, size in (("a", 5), ("ab", 7)):
            self.assertEqual(self.encoded("s", "--series", f"{name}#.bmp")[1]["geometry"]["spacing"][0], size)
        # Which of two logs is meant cannot be known.
        for name in ("a", "ab"):
            (self.folder / "s" / f"{name}.log").rename(self.folder / "s" / f"x{name}.log")
        self.assertIsNone(self.encoded("s", "--series", "1")[1]["geometry"]["spacing"])

    def test_what_is_no_grey_image_is_refused_by_name(self):
        truth = self.volume((1, 8, 9))[0]
        good = self.write("a.bmp", truth).read_bytes()
        for image, text in ((Image.fromarray(truth).convert("1"), "1 bits a sample"), (Image.fromarray(truth).convert("RGB"), "24 bits a sample"),
                            (Image.fromarray(255 - truth).convert("P", palette=Image.ADAPTIVE),
                             "not the ramp of grays")):
            image.save(self.folder / "a.bmp")
            self.assert_refused(65, text, "encode", "a.bmp")
            self.assert_refused(65, "a.bmp: BMP file: ", "encode", "a.bmp")
        for at, form, value, text in ((30, "<I", 1, "is compressed"), (18, "<i", 0, "cannot have 0 x 8"), (22, "<i", 800, "should end at byte"), (18, "<i", -9, "cannot have"),
                                      (46, "<I", 257, "palette of 257 colors"), (46, "<I", 200, "but its palette has 200 colors"), (10, "<I", 60, "within its header"),
                                      (54 + 4 * 7, "<B", 8, "color 7 is (7, 7, 8)"), (22, "<i", -2**31, "should end"), (18, "<i", 2**31 - 1, "should end")):
            broken = bytearray(good)
            struct.pack_into(form, broken, at, value)
            (self.folder / "a.bmp").write_bytes(broken)
            self.assert_refused(65, text, "encode", "a.bmp", "-o", "a.tag")
            self.assertFalse((self.folder / "a.tag").exists())
        for size in (17, 30, 60, 500, len(good) - 1):
            (self.folder / "a.bmp").write_bytes(good[:size])
            self.assert_refused(65, "a.bmp: ", "encode", "a.bmp")
        self.write("s/1.bmp", truth)
        self.write("s/2.bmp", truth[:7])
        self.assert_refused(65, "2.bmp: BMP file: has 9 x 7 samples, but", "encode", "s")

    def test_a_list_has_the_slices_and_no_preview(self):
        for z, slice in enumerate(self.volume((3, 9, 8))):
            self.write(f"s/mouse_rec{z}.bmp", slice)
        self.write("s/mouse_rec_spr.bmp", self.volume((1, 40, 50))[0])
        (self.folder / "s" / "mouse_rec.log").write_text(LOG)
        run = self.search("s")
        self.assertEqual([line for line in run.stdout.splitlines() if not line.startswith("#")], [f"{self.folder}/s\tseries=mouse_rec#.bmp\toutput=mouse_rec#.bmp"])
        (self.folder / "list").write_text(run.stdout)
        for i in range(3):
            self.ok("convert", "--manifest", "list", "--output-dir", "out", "--skip-done", "-f")
            if i == 1:  # a changed log is a changed volume
                (self.folder / "s" / "mouse_rec.log").write_text(LOG + "More=1\n")
        records = (self.folder / "out" / "results.jsonl").read_text().splitlines()
        self.assertEqual([json.loads(record)["status"] for record in records], ["ok", "skipped", "ok"])


if __name__ == "__main__":
    main()
