"""TIFF: the samples are those that tifffile wrote, whatever the layout of the file."""

import itertools
import os
import shutil
import struct
import subprocess
import unittest

from other_readers import PROGRAM, Image, ReaderTest, main, numpy, random_samples, some, tifffile

TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"]


def volume(type, shape=(5, 37, 41)):
    """Any bits, but no NaN whose bits a conversion might change."""
    return random_samples(type, shape)


@unittest.skipIf(tifffile is None, "there is no tifffile on this machine")
class Tiff(ReaderTest):
    def write(self, name, samples, **options):
        tifffile.imwrite(self.folder / name, samples, photometric="minisblack", **options)
        return name

    def test_every_type_in_either_byte_order_and_size_of_file(self):
        for type, order, big in itertools.product(TYPES, "<>", (False, True)):
            truth = volume(type)
            name = self.write("a.tif", truth, byteorder=order, bigtiff=big)
            self.encodes(truth, name, what=f"{type} {order} {big}")

    def test_tiles_strips_and_compressions(self):
        for options in ({"tile": (16, 32)}, {"tile": (64, 64)}, {"rowsperstrip": 1}, {"rowsperstrip": 10}, {"compression": "deflate"},
                        {"compression": "deflate", "tile": (16, 16), "predictor": True}, {"compression": "deflate", "rowsperstrip": 7}):
            for type in ("uint16", "float32"):
                truth = volume(type)
                try:
                    name = self.write("a.tif", truth, **options)
                except (ValueError, KeyError) as error:  # predictors of floats need another library
                    self.assertIn("predictor", options, error)
                    continue
                self.encodes(truth, name, what=f"{options} {type}")

    @unittest.skipIf(shutil.which("tiffcp") is None, "there is no tiffcp on this machine (libtiff-tools)")
    def test_what_other_programs_compress(self):
        for options in ("-c lzw", "-c lzw:2", "-c zip:2 -t -w 16 -l 16", "-c packbits", "-c zstd", "-c zstd:2", "-c zip:3 -8",
                        "-B -c none -r 3", "-L -8 -c none"):
            type = "float32" if ":3" in options else "int16"
            truth = volume(type)
            self.write("a.tif", truth)
            run = subprocess.run(["tiffcp", *options.split(), "a.tif", "b.tif"], cwd=self.folder, stderr=subprocess.PIPE, text=True)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.encodes(truth, "b.tif", what=options)

    def test_a_folder_in_the_order_of_its_numbers(self):
        truth = volume("uint16", (12, 20, 30))
        (self.folder / "s").mkdir()
        for z in range(12):
            self.write(f"s/slice{z}.tif", truth[z])
        (self.folder / "s" / ".hidden.tif").write_text("nothing")
        (self.folder / "s" / "notes.txt").write_text("nothing")
        for path in ("s", "s/", self.folder / "s"):
            self.encodes(truth, path)
        self.ok("encode", "s/")
        self.assertTrue((self.folder / "s.tag").exists())
        self.ok("verify", "s.tag", "--against", "s")
        # Refused, as the tags of the files would be lost.
        self.assert_refused(64, "--strip drops its files", "encode", "s", "--rm", "-f", "--strip")

    def encoded_skyscan_folder(self, numbers, log):
        """What info says of slices with these numbers in their names, beside a log."""
        truth = volume("uint8", (len(numbers), 20, 30))
        (self.folder / "s").mkdir()
        for number, slice in zip(numbers, truth):
            self.write(f"s/mouse_rec{number:08}.tif", slice)
        (self.folder / "s" / "mouse_rec.log").write_text(log)
        info = self.encodes(truth, "s")
        return info

    def test_the_log_of_a_skyscan_folder(self):
        info = self.encoded_skyscan_folder(range(4), "[System]\nScanner=SkyScan1172\n[Acquisition]\nImage Pixel Size (um)= 34.5\n"
                                                         "Source Voltage (kV)= 59\n[Reconstruction]\nPixel Size (um)=17.25\n")
        self.assertEqual(info["geometry"]["spacing"], [17.25] * 3)
        self.assertEqual(info["geometry"]["units"], ["um"] * 3)
        self.assertEqual(info["source"]["pairs"]["skyscan_acquisition/source voltage (kv)"], "59")

    def test_the_log_is_one_of_the_source_files(self):
        self.encoded_skyscan_folder(range(4), "[Reconstruction]\nPixel Size (um)=17.25\n")
        (self.folder / "s" / "other.log").write_text("[Acquisition]\nImage Pixel Size (um)=3\n")
        self.write("s/mouse_rec_spr.tif", volume("uint8", (50, 60)))
        self.ok("encode", "s", "-o", "a.tag")
        self.ok("restore", "a.tag", "-o", "r")
        names = {path.name for path in (self.folder / "r").rglob("*") if path.is_file()}
        self.assertEqual(names, {f"mouse_rec{z:08}.tif" for z in range(4)} | {"mouse_rec.log"})
        self.ok("verify", "a.tag", "--against", "s")
        with open(self.folder / "s" / "mouse_rec.log", "a") as log:
            log.write("More=1\n")
        self.assert_refused(65, "mouse_rec.log", "verify", "a.tag", "--against", "s")
        # --rm removes what comes back, and nothing else.
        self.ok("encode", "s", "-o", "b.tag", "--rm")
        self.assertEqual({path.name for path in (self.folder / "s").iterdir()}, {"other.log", "mouse_rec_spr.tif"})

    def test_only_every_other_section_was_saved(self):
        info = self.encoded_skyscan_folder(range(400, 408, 2), "[Reconstruction]\nFirst Section=400\nLast Section=406\nSection to Section Step=2\n"
                                                               "Pixel Size (um)=17.25\n")
        self.assertEqual(info["geometry"]["spacing"], [17.25, 17.25, 34.5])

    def test_a_gap_is_refused_unless_it_is_accepted(self):
        truth = volume("uint8", (6, 9, 8))
        (self.folder / "s").mkdir()
        for z in (0, 1, 2, 4, 5):
            self.write(f"s/{z:03}.tif", truth[z])
        self.assertIn("--gaps-ok", self.assert_refused(65, "between 002.tif and 004.tif", "encode", "s"))
        self.encodes(truth[[0, 1, 2, 4, 5]], "s", "--gaps-ok")
        for z in (9, 13, 14):
            self.write(f"s/{z:03}.tif", truth[0])
        said = "s: between 002.tif and 004.tif, slices are missing according to their numbers: 3, 6 to 8, 10 to 12"
        self.assert_refused(65, said, "encode", "s")
        self.encoded("s", "--gaps-ok")
        self.assertEqual(self.messages.count(said), 1, self.messages)

    def test_what_is_no_tiff_file_and_what_ends_too_soon(self):
        (self.folder / "a.tif").write_text("see the other disk\n")
        self.assertEqual(self.assert_refused(65, "is not a TIFF", "encode", "a.tif"), "tagrid: a.tif: is not a TIFF file\n")
        for big in (False, True):
            tifffile.imwrite(self.folder / "whole.tif", volume("uint16", (6, 20, 30)), bigtiff=big, compression="zlib")
            whole = (self.folder / "whole.tif").read_bytes()
            for size in (6, 12, 60, len(whole) // 2):
                (self.folder / "cut.tif").write_bytes(whole[:size])
                self.assert_refused(65, "cut.tif: TIFF file: ", "encode", "cut.tif")
            for size in (12, len(whole) // 2):
                (self.folder / "cut.tif").write_bytes(whole[:size])
                self.assert_refused(65, "ends too soon", "encode", "cut.tif")

    def test_samples_that_end_too_soon_are_counted(self):
        for options in ({"rowsperstrip": 10}, {"tile": (16, 16)}, {"rowsperstrip": 10, "compression": "zlib"}):
            # The samples follow the tags, so the file ends within the last strip or tile.
            tifffile.imwrite(self.folder / "cut.tif", volume("uint16", (1, 20, 30))[0], **options)
            with tifffile.TiffFile(self.folder / "cut.tif") as file:
                page = file.pages[0]
                begin, count = page.dataoffsets[-1], page.databytecounts[-1]
            os.truncate(self.folder / "cut.tif", begin + count - 7)
            reason = f"ends too soon, within its samples: 7 of {count} bytes are missing"
            self.assert_refused(65, reason, "encode", "cut.tif")

    def test_files_that_may_be_slices_of_one_volume(self):
        for folder, names, said in (("case", ("s1.tif", "s2.TIF", "s3.tif", "s4.TIF"),
                                     "s#.TIF and s#.tif differ in upper and lower case only"),
                                    ("times", ("s1_T10.tif", "s2_T17.tif", "s3_T24.tif"),
                                     "s1_T10.tif and 2 other files differ in several numbers")):
            (self.folder / folder).mkdir()
            for name, slice in zip(names, volume("uint8", (4, 9, 8))):
                tifffile.imwrite(self.folder / folder / name, slice)
            self.assert_refused(64, f"  {said}; if they are", "encode", folder)
            warning = f"warning: {self.folder.resolve() / folder}: {said}; if they are"
            self.assertIn(warning, self.search(folder).stderr)

    def test_several_series_in_a_folder(self):
        truth = volume("uint8", (6, 9, 8))
        (self.folder / "s").mkdir()
        for z in range(3):
            self.write(f"s/a{z}.tif", truth[z])
            self.write(f"s/b{z}.tif", truth[3 + z])
        message = self.assert_refused(64, "holds 2 volumes", "encode", "s")
        self.assertRegex(message, r"\n\s*1  a#.tif  3 files\n\s*2  b#.tif  3 files")
        self.assertIn("--series", message)
        self.encodes(truth[:3], "s", "--series", "a#.tif")
        self.encodes(truth[3:], "s", "--series", "2")
        self.assert_refused(64, "has no series 3", "encode", "s", "--series", "3")

    def test_slices_that_differ_are_refused(self):
        (self.folder / "s").mkdir()
        self.write("s/1.tif", volume("uint8", (9, 8)))
        self.write("s/2.tif", volume("uint8", (9, 7)))
        self.assert_refused(65, "2.tif: TIFF file: slice 2 of 2 is 7 x 9 uint8, but the first one is 8 x 9 uint8", "encode", "s")

    def test_stacks_of_image_j(self):
        truth = volume("uint16", (6, 20, 30))
        name = self.write("a.tif", truth, imagej=True, resolution=(4, 2), metadata={"spacing": 1.5, "unit": "um", "axes": "ZYX"})
        info = self.encodes(truth, name)
        self.assertEqual(info["geometry"]["spacing"], [0.25, 0.5, 1.5])
        self.assertEqual(info["geometry"]["units"], ["um"] * 3)
        hyper = volume("uint16", (2 * 3 * 2, 20, 30)).reshape(2, 3, 2, 20, 30)
        name = self.write("h.tif", hyper, imagej=True, metadata={"axes": "TZCYX"})
        self.assert_refused(64, "holds 4 volumes", "encode", name)
        for t, c in itertools.product(range(2), range(2)):
            self.encodes(hyper[t, :, c], name, "--series", f"c{c + 1}t{t + 1}")

    def test_image_js_channels_or_frames_of_one_slice_are_slices_if_they_are_many(self):
        truth = volume("uint16", (20, 9, 11))
        for axis, what in (("C", "channels"), ("T", "frames")):
            name = self.write("a.tif", truth, imagej=True, metadata={"axes": axis + "YX", "spacing": 1.5, "unit": "mm"}, resolution=(4, 2))
            with tifffile.TiffFile(self.folder / name) as file:
                self.assertEqual(file.imagej_metadata[what], 20)
            info = self.encodes(truth, name)
            self.assertEqual((info["dims"], info["volumes"], info["geometry"]["spacing"]), ([11, 9, 20], 1, [0.25, 0.5, 1.5]))
            run = self.tagrid("encode", name, "-o", "said.tag", "-f")
            self.assertIn(f"ImageJ's description states 20 {what} with one slice each; they are read as 20 slices of one volume", run.stderr)
        # Few of them, or those of several slices, are what they are called.
        self.write("a.tif", truth[:8], imagej=True, metadata={"axes": "CYX"})
        self.assert_refused(64, "holds 8 volumes", "encode", "a.tif")
        self.write("a.tif", truth.reshape(2, 10, 9, 11), imagej=True, metadata={"axes": "ZCYX"})
        self.assert_refused(64, "holds 10 volumes", "encode", "a.tif")

    @unittest.skipIf(Image is None, "there is no Pillow on this machine (python3-pil)")
    def test_packed_samples_are_those_of_pillow(self):
        for bits, type in ((1, "uint8"), (2, "uint8"), (4, "uint8"), (12, "uint16"), (5, "uint8"), (15, "uint16")):
            for width in (13, 40):
                truth = volume(type, (19, width)) & ((1 << bits) - 1)
                for order in "><":
                    self.write_packed("a.tif", truth, bits, order)
                    samples, info = self.encoded("a.tif")
                    self.assert_same(samples[0], truth, f"{bits} {width} {order}")
                    self.assertFalse(info["restorable"])
                if bits in (2, 4, 12):
                    scale = {2: 85, 4: 17}.get(bits, 1)  # Pillow stretches greys to eight bits
                    with Image.open(self.folder / "a.tif") as image:
                        self.assertEqual((numpy.asarray(image) // scale).tolist(), truth.tolist(), f"{bits} {width}")
                if shutil.which("tiffcp"):
                    codecs = ["-c lzw -r 3", "-c zip -t -w 16 -l 16", "-c none -r 5", "-c none -t -w 32 -l 16", *(["-c g4", "-c g3"] if bits == 1 else [])]
                    for options in some(codecs, 2, first=width == 40):
                        run = subprocess.run(["tiffcp", *options.split(), "a.tif", "b.tif"], cwd=self.folder, stderr=subprocess.PIPE, text=True)
                        self.assertEqual(run.returncode, 0, run.stderr)
                        self.assert_same(self.encoded("b.tif")[0][0], truth, f"{bits} {width} {options}")
        # Bits in the other order, which fax machines have.
        truth = volume("uint8", (19, 13)) & 1
        self.write_packed("a.tif", truth, 1, "<", fill_order=2)
        self.assert_same(self.encoded("a.tif")[0][0], truth)
        for slice in range(3):
            Image.fromarray(volume("uint8", (9, 13)) > 100 + slice).save(self.folder / f"m{slice}.tif", compression="group4" if slice else None)
        with Image.open(self.folder / "m1.tif") as image:
            self.assert_same(self.encoded("m1.tif")[0][0], numpy.asarray(image).astype("uint8"))

    def write_packed(self, name, samples, bits, order, fill_order=1, meaning=1):
        height, width = samples.shape
        rows = (samples[..., None] >> numpy.arange(bits - 1, -1, -1)) & 1
        packed = numpy.packbits(rows.reshape(height, width * bits).astype("uint8"), axis=1, bitorder="big" if fill_order == 1 else "little").tobytes()
        tags = [(256, 3, 1, width), (257, 3, 1, height), (258, 3, 1, bits), (259, 3, 1, 1), (262, 3, 1, meaning), (266, 3, 1, fill_order), (273, 4, 1, 0),
                (277, 3, 1, 1), (278, 3, 1, height), (279, 4, 1, len(packed))]
        after = 8 + 2 + 12 * len(tags) + 4
        head = struct.pack(order + "2sHI", b"II" if order == "<" else b"MM", 42, 8) + struct.pack(order + "H", len(tags))
        for tag, type, count, value in tags:
            value = after if tag == 273 else value
            head += struct.pack(order + "HHI", tag, type, count) + (struct.pack(order + "HH", value, 0) if type == 3 else struct.pack(order + "I", value))
        (self.folder / name).write_bytes(head + struct.pack("<I", 0) + packed)

    def test_pages_that_are_to_be_turned_are_kept_as_stored_and_said(self):
        truth = volume("uint16")
        for orientation in (1, 2, 8):
            tifffile.imwrite(self.folder / "a.tif", truth, photometric="minisblack", metadata=None, extratags=[(274, "H", 1, orientation, False)])
            self.encodes(truth, "a.tif")
            self.assertEqual(f"a.tif: its pages are to be shown mirrored or turned (Orientation {orientation})" in self.messages, orientation != 1)

    def test_white_that_is_zero_is_said_and_kept(self):
        truth = volume("uint8", (19, 13)) & 15
        self.write_packed("a.tif", truth, 4, "<", meaning=0)
        self.assert_same(self.encoded("a.tif")[0][0], truth)
        self.assertIn("WhiteIsZero", self.messages)
        self.assertIn("WhiteIsZero", self.info("out.tag")["source"]["pairs"]["not understood"])
        self.assertIn("WhiteIsZero", self.ok("decode", "out.tag", "-o", "b.tif").stderr)
        # Of a directory, messages about all of it name the directory.
        (self.folder / "s").mkdir()
        for z in range(3):
            self.write_packed(f"s/{z}.tif", truth, 4, "<", meaning=0)
        self.encoded("s", says="warning: s: small numbers mean white")
        self.assert_refused(64, "tagrid: s: cannot be removed: its files could not be restored byte for byte", "encode",
                            "s", "--rm", "-o", "x.tag")
        self.assert_refused(64, "encoding, slice by slice, 13 x 19 x 3 uint8", "encode", "s", "-M", "1", "-o", "x.tag")
        self.write_packed("a.tif", truth, 4, "<", meaning=3)
        self.assert_refused(65, "Colormap", "encode", "a.tif")

    @unittest.skipIf(Image is None, "there is no Pillow on this machine (python3-pil)")
    def test_jpeg_is_read_and_its_loss_is_recorded(self):
        smooth = numpy.add.outer(numpy.arange(40), numpy.arange(50)).astype("uint8") * 2
        (self.folder / "s").mkdir()
        truth = []
        for z in range(3):
            Image.fromarray(smooth + z).save(self.folder / "s" / f"{z}.tif", compression="jpeg")
            with Image.open(self.folder / "s" / f"{z}.tif") as image:
                truth.append(numpy.asarray(image))
        samples, info = self.encoded("s")
        self.assert_same(samples, numpy.stack(truth))
        self.assertFalse((truth[0] == smooth).all())
        self.assertEqual(info["source"]["pairs"]["lossy source"], "TIFF, JPEG")
        if shutil.which("tiffcp"):
            for options in ("-c jpeg:100 -r 8", "-c jpeg:90 -t -w 16 -l 16"):
                self.write("a.tif", smooth)
                self.assertEqual(subprocess.run(["tiffcp", *options.split(), "a.tif", "b.tif"], cwd=self.folder).returncode, 0)
                with Image.open(self.folder / "b.tif") as image:
                    self.assert_same(self.encoded("b.tif")[0][0], numpy.asarray(image), options)
        whole = (self.folder / "s" / "1.tif").read_bytes()
        scan = whole.index(b"\xff\xda")
        broken = whole[:scan + 40] + bytes(60) + whole[scan + 100:]
        (self.folder / "s" / "1.tif").write_bytes(broken)
        self.assert_refused(65, "1.tif: TIFF file: its samples are damaged", "encode", "s")
        self.assertNotIn("lossy source", self.encoded(self.write("c.tif", smooth))[1]["source"]["pairs"])

    def image_j(self, name, samples, calibration):
        """As ImageJ describes a stack with a calibration of its numbers."""
        text = f"ImageJ=1.53t\nimages={len(samples)}\nslices={len(samples)}\nunit=mm\n{calibration}"
        tifffile.imwrite(self.folder / name, samples, photometric="minisblack", description=text, metadata=None)
        return name

    def test_signed_numbers_of_image_j_come_as_such(self):
        truth = volume("int16", (4, 9, 8))
        signed = "cf=0\nc0=-32768.0\nc1=1.0\nvunit=Gray Value\n"
        info = self.encodes(truth, self.image_j("a.tif", (truth.astype("int32") + 32768).astype("uint16"), signed))
        self.assertTrue(info["restorable"])
        self.assertFalse([key for key in info["source"]["pairs"] if key.startswith("rescale")])
        self.encoded("a.tif", "--max-error", "3")
        # Compressed ones are read by the program, and signed ones are what they are.
        tifffile.imwrite(self.folder / "b.tif", (truth.astype("int32") + 32768).astype("uint16"), photometric="minisblack", compression="deflate",
                         description=f"ImageJ=1.53t\nimages=4\nslices=4\n{signed}", metadata=None)
        self.encodes(truth, "b.tif")
        info = self.encodes(truth, self.image_j("c.tif", truth, signed))
        self.assertFalse([key for key in info["source"]["pairs"] if key.startswith("rescale")])
        # And in a directory of slices.
        (self.folder / "s").mkdir()
        for z, slice in enumerate(truth):
            self.image_j(f"s/{z}.tif", (slice.astype("int32") + 32768).astype("uint16")[None], signed)
        self.encodes(truth, "s")
        self.image_j("s/3.tif", truth[3:], "")
        self.assert_refused(65, "3.tif: TIFF file: has another calibration of ImageJ than", "encode", "s")

    def test_a_calibration_of_image_j_is_a_slope_and_an_intercept(self):
        truth = volume("uint16", (4, 9, 8))
        info = self.encodes(truth, self.image_j("a.tif", truth, "cf=0\nc0=-1000.0\nc1=0.5\nvunit=HU\n"))
        pairs = info["source"]["pairs"]
        self.assertEqual((float(pairs["rescale_slope"]), float(pairs["rescale_intercept"]), pairs["rescale_units"]), (0.5, -1000, "HU"))
        # Bounds are for values.
        samples, info = self.encoded("a.tif", "--max-error", "2")
        self.assertEqual(info["max_error"], 4)
        self.assertLessEqual(abs(samples.astype("int64") - truth).max(), 4)
        # Numbers that are signed in the file belong to the same line, shifted.
        pairs = self.encoded(self.image_j("b.tif", truth.view("int16"), "cf=0\nc0=-32768.0\nc1=2.0\nvunit=x\n"))[1]["source"]["pairs"]
        self.assertEqual((float(pairs["rescale_slope"]), float(pairs["rescale_intercept"])), (2, 32768))
        for calibration in ("cf=1\nc0=1\nc1=2\nc2=3\nvunit=x\n", "cf=21\nvunit=Uncalibrated OD\n", "cf=0\nc0=1\nc1=0\n", "cf=0\nc0=nan\nc1=1\n"):
            info = self.encodes(truth, self.image_j("c.tif", truth, calibration), says="numbers are kept as they are")
            self.assertNotIn("rescale_slope", info["source"]["pairs"])
        self.encoded(self.image_j("d.tif", truth, "cf=20\n"))
        self.assertNotIn("kept as they are", self.messages)

    def test_one_page_with_all_slices_behind_it(self):
        """As ImageJ writes stacks of more than 4 GB."""
        truth = volume("uint16", (6, 20, 30))
        (self.folder / "a.tif").write_bytes(one_page(truth, f"ImageJ=1.53t\nimages=6\nslices=6\n"))
        self.encodes(truth, "a.tif")
        self.assertNotIn("are read", self.messages)
        (self.folder / "b.tif").write_bytes(one_page(truth, f"ImageJ=1.53t\nimages=7\nslices=7\n"))
        self.assert_refused(65, "says 7 images, but there are bytes for 6", "encode", "b.tif")
        (self.folder / "c.tif").write_bytes(one_page(truth, f"ImageJ=1.53t\nimages=5\nslices=5\n"))
        self.encodes(truth[:5], "c.tif", says="says 5 images, but there are bytes for 6; only the first 5 are read")

    def test_ome_tiff_in_any_order_of_dimensions(self):
        for axes, shape in (("ZYX", (5, 20, 30)), ("CZYX", (2, 5, 20, 30)), ("ZCYX", (5, 2, 20, 30)), ("TCZYX", (2, 2, 3, 20, 30))):
            truth = volume("uint16", shape)
            name = self.write("a.ome.tif", truth, ome=True,
                              metadata={"axes": axes, "PhysicalSizeX": 0.5, "PhysicalSizeXUnit": "mm", "PhysicalSizeY": 0.25,
                                        "PhysicalSizeYUnit": "mm", "PhysicalSizeZ": 2, "PhysicalSizeZUnit": "mm"})
            for choice in itertools.product(*(range(n) for axis, n in zip(axes, shape) if axis in "CT")):
                names = dict(zip((axis for axis in axes if axis in "CT"), choice))
                series = "".join(f"{axis.lower()}{names[axis] + 1}" for axis in "CT" if axis in names)
                samples, info = self.encoded(name, *(["--series", series] if series else []))
                part = truth[tuple(names[axis] if axis in names else slice(None) for axis in axes)]
                self.assert_same(samples, part, f"{axes} {series}")
                self.assertEqual(info["geometry"]["spacing"], [0.5, 0.25, 2])

    def test_an_ome_tiff_that_was_copied_is_read_itself(self):
        one, two = volume("uint16", (2, 9, 8)), volume("uint16", (2, 9, 8)) ^ 5
        for name, truth in (("a.ome.tif", one), ("b.ome.tif", two)):
            planes = "".join(f'<TiffData FirstZ="{z}" IFD="{z}" PlaneCount="1"><UUID FileName="a.ome.tif">urn:uuid:1</UUID></TiffData>' for z in range(2))
            text = ('<OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image ID="Image:0"><Pixels ID="Pixels:0" DimensionOrder="XYZCT" '
                    f'Type="uint16" SizeX="8" SizeY="9" SizeZ="2" SizeC="1" SizeT="1">{planes}</Pixels></Image></OME>')
            tifffile.imwrite(self.folder / name, truth, description=text, metadata=None, photometric="minisblack")
            self.encodes(truth, name, what=name)

    def test_what_is_no_volume_is_refused_by_name(self):
        rgb = numpy.zeros((4, 20, 30, 3), "uint8")
        tifffile.imwrite(self.folder / "rgb.tif", rgb, photometric="rgb")
        self.assert_refused(65, "rgb.tif: TIFF file: ", "encode", "rgb.tif")
        self.write("half.tif", numpy.zeros((2, 9, 9), "float16"))
        self.assert_refused(65, "floats of 16 bits", "encode", "half.tif")
        self.write("a.tif", volume("uint8"))
        self.assert_refused(64, "leave out --dims", "encode", "a.tif", "--dims", "41,37,5", "--type", "uint8")
        with open(self.folder / "a.tif", "rb") as file:
            run = subprocess.run([PROGRAM, "encode", "-", "-o", "x.tag"], stdin=file, cwd=self.folder,
                                 capture_output=True, text=True)
        # A file as standard input can be sought in, but has no name that a reader could open.
        self.assertEqual(run.returncode, 64, run.stderr)
        self.assertIn("save it", run.stderr)

    def test_damaged_files_are_errors_or_other_samples_and_no_more(self):
        truth = volume("uint16", (4, 40, 30))
        random = numpy.random.default_rng(1)
        for options in ({}, {"tile": (16, 16)}, {"compression": "deflate"}):
            name = self.write("a.tif", truth, **options)
            whole = (self.folder / name).read_bytes()
            for i in range(25):
                broken = bytearray(whole[:random.integers(8, len(whole))] if i % 2 else whole)
                for _ in range(random.integers(0, 9)):
                    broken[random.integers(8, len(broken)) if i % 3 else -random.integers(1, 600)] = random.integers(0, 256)
                (self.folder / "broken.tif").write_bytes(broken)
                run = self.tagrid("encode", "broken.tif", "-o", "broken.tag", "-f", "-q")
                self.assertIn(run.returncode, (0, 64, 65), f"{options} {i}: {run.stderr}")
                self.assertEqual(run.returncode == 0, run.stderr == "", run.stderr)

    def test_memory_is_within_the_limit(self):
        truth = volume("uint16", (40, 300, 400))
        name = self.write("a.tif", truth, compression="deflate")
        run = self.tagrid("encode", name, "-M", "1")
        self.assertEqual(run.returncode, 64)
        least = run.stderr.split("give -M ")[-1].split()[0].rstrip(";,.")
        self.encodes(truth, name, "-M", least)


def one_page(samples, description):
    """A TIFF file of one page whose strip begins with the first slice, and all other slices behind it."""
    text = description.encode() + b"\0"
    z, y, x = samples.shape
    tags = [(256, 3, 1, x), (257, 3, 1, y), (258, 3, 1, samples.itemsize * 8), (259, 3, 1, 1), (262, 3, 1, 1),
            (270, 2, len(text), 0), (273, 4, 1, 0), (277, 3, 1, 1), (278, 3, 1, y), (279, 4, 1, x * y * samples.itemsize)]
    after = 8 + 2 + 12 * len(tags) + 4
    tags = [(tag, type, count, {270: after, 273: after + len(text)}.get(tag, value)) for tag, type, count, value in tags]
    head = struct.pack("<2sHI", b"II", 42, 8) + struct.pack("<H", len(tags))
    return head + b"".join(struct.pack("<HHII", *tag) for tag in tags) + struct.pack("<I", 0) + text + samples.astype("<u2").tobytes()


if __name__ == "__main__":
    main()
