"""Files whose samples are compressed come back as the same data set, uncompressed, with all their tags and attributes.

What comes back is read by other people's libraries. See restored_test.py for NRRD, NIfTI and MetaImage in gzip and for JPEG in DICOM.
"""

import bz2
import json
import os
import shutil
import struct
import subprocess
import unittest

from other_readers import Image, PROGRAM, ReaderTest, h5py, main, numpy, pydicom, tifffile
from scans import data_set

# Tags of TIFF that say how samples are stored.
BITS, COMPRESSION, STRIPS, ROWS, COUNTS = 258, 259, 273, 278, 279
STORAGE = {COMPRESSION, 266, STRIPS, ROWS, COUNTS, 292, 293, 317, 322, 323, 324, 325, 347}
without_tiffcp = unittest.skipIf(shutil.which("tiffcp") is None, "there is no tiffcp on this machine (libtiff-tools)")


@unittest.skipIf(None in (numpy, pydicom, tifffile, h5py), "libraries are missing")
class PlainForms(ReaderTest):
    def volume(self, shape=(5, 19, 23), type="uint16", seed=1):
        return numpy.random.default_rng(seed).integers(0, 4000 if type != "uint8" else 200, shape).astype(type)

    def back(self, path, compression, *options):
        """Encodes a file or directory, and restores it below back/. That tagrid reads the same volume again, encoded() has shown."""
        samples, info = self.encoded(path, *options)
        self.assertEqual((info["restorable"], info["compression"]), (False, compression), path)
        shutil.rmtree(self.folder / "back", ignore_errors=True)
        run = self.ok("restore", "out.tag", "-o", "back")
        self.assertIn(f"samples were compressed ({compression}), and now are not", run.stderr)
        loss = info["source"]["pairs"].get("lossy source")
        self.assertEqual("the restored files may not" in run.stderr, loss is not None)
        self.assertEqual("already compressed with loss" in self.ok("info", "out.tag").stdout, loss is not None)
        self.ok("verify", "out.tag", "--against", path, *options)
        return samples

    def why_not(self, path, text, *options):
        run = self.ok("encode", path, "-o", "none.tag", "-f", "-v", *options)
        self.assertIn(text, run.stderr)
        self.assert_refused(64, "holds no source files", "restore", "none.tag", "-o", "none")

    # TIFF

    def write_tiff(self, name, volume, order="<", big=False, **options):
        tags = [(34675, 7, 700, bytes(range(175)) * 4, True), (65000, "H", 3, (1, 2, 3), True), (65001, "s", 0, "somebody's own text", True),
                (65002, "d", 2, (1.5, -2.5), True), (65003, "B", 1, 7, True), (305, "s", 0, "a program", True)]
        with tifffile.TiffWriter(self.folder / name, bigtiff=big, byteorder=order) as file:
            for z, slice in enumerate(volume):
                file.write(slice, photometric="minisblack", contiguous=False, metadata=None, description=f"page {z}: \xb5m".encode("latin1"),
                           resolution=(100, 200), extratags=tags, **options)

    def assert_same_tiff(self, name, truth, changed=STORAGE):
        """Pages of back/NAME have the samples, and the tags of NAME but for those of storage."""
        with tifffile.TiffFile(self.folder / name) as before, tifffile.TiffFile(self.folder / "back" / name) as after:
            self.assertEqual((len(before.pages), before.byteorder), (len(after.pages), after.byteorder), name)
            at = None
            for z, (page, plain) in enumerate(zip(before.pages, after.pages)):
                numpy.testing.assert_array_equal(plain.asarray(), truth[z], name)
                then, now = ({tag.code: (tag.dtype, tag.count, tag.value) for tag in tags.tags.values()} for tags in (page, plain))
                self.assertEqual({code: value for code, value in then.items() if code not in changed},
                                 {code: value for code, value in now.items() if code not in changed}, name)
                self.assertEqual((plain.compression, plain.predictor, plain.is_tiled, len(plain.dataoffsets)), (1, 1, False, 1), name)
                self.assertTrue(at is None or plain.dataoffsets[0] == at, name)  # one after the other
                at = plain.dataoffsets[0] + plain.databytecounts[0]

    def test_tiff_pages_keep_all_tags_but_those_of_storage(self):
        truth = self.volume((3, 67, 71))
        for compression, options in (("deflate", {"compression": "deflate"}), ("deflate", {"compression": "deflate", "order": ">", "tile": (32, 32)}),
                                     ("deflate", {"compression": "deflate", "order": ">", "big": True, "rowsperstrip": 7}),
                                     ("tiles", {"tile": (32, 16)}), ("LZMA", {"compression": "lzma", "rowsperstrip": 5})):
            self.write_tiff("a.tif", truth, **options)
            self.assert_same(self.back("a.tif", compression), truth)
            self.assert_same_tiff("a.tif", truth)
            run = subprocess.run(["tiffinfo", "-D", self.folder / "back" / "a.tif"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            self.assertEqual((run.returncode, [line for line in run.stderr.splitlines() if "Unknown field" not in line]), (0, []))

    @without_tiffcp
    def test_tiff_of_all_codecs(self):
        for type, shape in (("uint16", (3, 67, 71)), ("int8", (2, 20, 31)), ("float32", (2, 33, 20))):
            truth = self.volume(shape, type)
            tifffile.imwrite(self.folder / "u.tif", truth, photometric="minisblack")
            for compression, options in (("LZW", "-c lzw:2 -B"), ("zstd", "-c zstd"), ("PackBits", "-c packbits -r 7"), ("deflate", "-c zip:2 -t -w 32 -l 16 -B"),
                                         ("deflate", "-8 -c zip:3 -L" if type == "float32" else "-8 -c zip -L"), ("LZW", "-c lzw -r 3 -L")):
                if type == "float32" and ":2" in options:
                    continue
                subprocess.run(["tiffcp", *options.split(), "u.tif", "a.tif"], cwd=self.folder, check=True, stderr=subprocess.DEVNULL)
                self.assert_same(self.back("a.tif", compression), truth, options)
                self.assert_same_tiff("a.tif", truth)

    @without_tiffcp
    def test_packed_samples_and_faxes_get_whole_bytes(self):
        for bits, options in ((1, "-c g4"), (1, "-c g3"), (4, "-c lzw"), (12, "-c zip"), (12, "-c none -r 5")):
            truth = numpy.random.default_rng(bits).integers(0, 1 << bits, (13, 21)).astype("uint8" if bits < 8 else "uint16")
            packed = numpy.packbits((truth[..., None] >> numpy.arange(bits)[::-1] & 1).reshape(13, 21 * bits).astype("uint8"), axis=1).tobytes()
            fields = [(256, 4, 21), (257, 4, 13), (258, 3, bits), (259, 3, 1), (262, 3, 1), (273, 4, 200), (277, 3, 1), (278, 4, 13), (279, 4, len(packed))]
            head = struct.pack("<2sHIH", b"II", 42, 8, len(fields)) + b"".join(struct.pack("<HHII", *field[:2], 1, field[2]) for field in fields)
            (self.folder / "u.tif").write_bytes(head.ljust(200, b"\0") + packed)
            subprocess.run(["tiffcp", *options.split(), "u.tif", "a.tif"], cwd=self.folder, check=True, stderr=subprocess.DEVNULL)
            compression = {"g4": "CCITT fax", "g3": "CCITT fax", "lzw": "LZW", "zip": "deflate", "none": "packed samples of 12 bits"}[options.split()[1]]
            self.assert_same(self.back("a.tif", compression)[0], truth, options)
            self.assert_same_tiff("a.tif", truth[None], STORAGE | {BITS})
            # No number beyond the bits comes of a loss.
            self.ok("encode", "a.tif", "-o", "a.tag", "-f", "--max-error", "3")
            self.ok("restore", "a.tag", "-o", "lossy", "-f")
            now = tifffile.imread(self.folder / "lossy" / "a.tif").astype(int)
            self.assertLessEqual(numpy.abs(now - truth).max(), 3)
            self.assertLess(now.max(), 1 << bits)

    @without_tiffcp
    @unittest.skipIf(Image is None, "there is no Pillow on this machine (python3-pil)")
    def test_jpeg_in_tiff_comes_back_as_the_samples_that_it_decodes_to(self):
        """tifffile does not decode JPEG here: Pillow says what the samples are, by libtiff as well."""
        smooth = (numpy.add.outer(numpy.add.outer(numpy.arange(3) * 9, numpy.arange(61)), numpy.arange(77)) + self.volume((3, 61, 77)) % 7).astype("uint8")
        self.write_tiff("u.tif", smooth)
        for options in ("-c jpeg", "-c jpeg:30 -r 16 -B", "-c jpeg:90 -t -w 32 -l 16", "-c jpeg:75 -8 -L"):
            subprocess.run(["tiffcp", *options.split(), "u.tif", "a.tif"], cwd=self.folder, check=True, stderr=subprocess.DEVNULL)
            truth = []
            with Image.open(self.folder / "a.tif") as image, tifffile.TiffFile(self.folder / "a.tif") as file:
                self.assertIn(347, file.pages[0].tags, options)  # JPEGTables
                for z in range(3):
                    image.seek(z)
                    truth.append(numpy.asarray(image))
            truth = numpy.stack(truth)
            self.assertFalse((truth == smooth).all())
            self.assert_same(self.back("a.tif", "JPEG"), truth, options)
            self.assertIn("already compressed with loss: TIFF, JPEG", self.ok("info", "out.tag").stdout)
            run = self.ok("restore", "out.tag", "-o", "back", "-f", "--json", "run.json")
            self.assertIn("some were compressed with loss (TIFF, JPEG), which the .tag file records, but the restored files may not", run.stderr)
            self.assertEqual(json.loads((self.folder / "run.json").read_text())["settings"]["lossy_source"], "TIFF, JPEG")
            self.assert_same_tiff("a.tif", truth)
            self.assert_refused(64, "and come back uncompressed", "encode", "a.tif", "--rm", "-f", "-o", "x.tag")
        # Small numbers that mean white still do, and slices that have no loss stay as they are.
        os.mkdir(self.folder / "s")
        for z in range(3):
            tifffile.imwrite(self.folder / "s" / f"{z}.tif", smooth[z], photometric="miniswhite", metadata=None)
        for z in range(2):
            subprocess.run(["tiffcp", "-c", "jpeg:60", f"s/{z}.tif", f"{z}.tif"], cwd=self.folder, check=True)
            shutil.move(self.folder / f"{z}.tif", self.folder / "s" / f"{z}.tif")
        samples = self.back("s", "JPEG")
        self.assert_same(samples[2], smooth[2])
        for z in range(3):
            with tifffile.TiffFile(self.folder / "back" / f"{z}.tif") as file:
                self.assertEqual(file.pages[0].photometric, 0)
                numpy.testing.assert_array_equal(file.pages[0].asarray(), samples[z])
        self.assertEqual((self.folder / "back" / "2.tif").read_bytes(), (self.folder / "s" / "2.tif").read_bytes())
        # A preview in JPEG keeps its tables.
        with tifffile.TiffWriter(self.folder / "p.tif") as file:
            file.write(self.volume((61, 77)), photometric="minisblack", compression="deflate", metadata=None)
        subprocess.run(["tiffcp", "-a", "-c", "jpeg:60", "u.tif,1", "p.tif"], cwd=self.folder, check=True, stderr=subprocess.DEVNULL)
        subprocess.run(["tiffset", "-d", "1", "-s", "254", "1", "p.tif"], cwd=self.folder, check=True)
        self.back("p.tif", "deflate")
        with Image.open(self.folder / "p.tif") as before, Image.open(self.folder / "back" / "p.tif") as after:
            before.seek(1)
            after.seek(1)
            numpy.testing.assert_array_equal(numpy.asarray(before), numpy.asarray(after))

    def test_slices_in_folders_and_other_images_of_a_file(self):
        truth = self.volume((4, 20, 30))
        os.mkdir(self.folder / "s")
        for z, slice in enumerate(truth):  # one of them is plain already
            tifffile.imwrite(self.folder / "s" / f"{z}.tif", slice, compression=None if z == 2 else "deflate")
        self.assert_same(self.back("s", "deflate"), truth)
        for z, slice in enumerate(truth):
            numpy.testing.assert_array_equal(tifffile.imread(self.folder / "back" / f"{z}.tif"), slice)
        self.assertEqual((self.folder / "back" / "2.tif").read_bytes(), (self.folder / "s" / "2.tif").read_bytes())
        # Previews and pyramids stay as they are stored.
        small = self.volume((5, 6), seed=2)
        with tifffile.TiffWriter(self.folder / "a.tif") as file:
            for slice in truth:
                file.write(slice, compression="deflate", subifds=2, metadata=None, photometric="minisblack")
                for i in range(2):
                    file.write(small[i:], compression="deflate", tile=(16, 16), subfiletype=1, metadata=None, photometric="minisblack")
            file.write(small, subfiletype=1, compression="lzma", metadata=None, photometric="minisblack")
        self.assert_same(self.back("a.tif", "deflate"), truth)
        with tifffile.TiffFile(self.folder / "back" / "a.tif") as file:
            for page, slice in zip(file.pages, truth):
                numpy.testing.assert_array_equal(page.asarray(), slice)
                for i in range(2):
                    numpy.testing.assert_array_equal(page.pages[i].asarray(), small[i:])
                    self.assertEqual(page.pages[i].compression, 32946)
            numpy.testing.assert_array_equal(file.pages[4].asarray(), small)
            self.assertEqual(file.pages[4].compression, 34925)
        channels = numpy.stack([truth, truth[::-1] + 1])
        tifffile.imwrite(self.folder / "c.ome.tif", channels, compression="deflate", metadata={"axes": "CZYX"}, photometric="minisblack")
        # Many programs would misread pages of which some are compressed.
        self.why_not("c.ome.tif", "c.ome.tif: it has samples of other volumes, which are compressed", "--series", "1")

    def test_a_plain_tiff_file_of_more_than_4_gib_is_big(self):
        """What the reader says: nothing of this size is written but holes."""
        side = 70000
        for order in "<>":
            tifffile.imwrite(self.folder / "a.tif", self.volume((9, 9), "uint8"), compression="deflate", description="a text", byteorder=order, metadata=None)
            with tifffile.TiffFile(self.folder / "a.tif", mode="r+") as file:
                for tag in ("ImageWidth", "ImageLength", "RowsPerStrip"):
                    file.pages[0].tags[tag].overwrite(side)
            requests = [{"request": "describe", "path": str(self.folder / "a.tif"), "options": {}}, {"request": "plain file", "file": 0}]
            run = subprocess.run([PROGRAM.parent / "tagrid-read-tiff"], input="".join(json.dumps(request) + "\n" for request in requests), stdout=subprocess.PIPE, text=True)
            plain = json.loads(run.stdout.splitlines()[-1])
            self.assertEqual((plain["answer"], plain["places"][0]["offset"]), ("plain file", 16), plain)
            source = (self.folder / "a.tif").read_bytes()
            with open(self.folder / "b.tif", "wb") as file:
                for piece in plain["pieces"]:
                    if "samples" in piece:
                        self.assertEqual(piece["samples"], side * side)
                        file.seek(piece["samples"], os.SEEK_CUR)
                    else:
                        file.write(bytes.fromhex(piece["hex"]) if "hex" in piece else source[piece["from"]:piece["to"]])
            with tifffile.TiffFile(self.folder / "b.tif") as file:
                page = file.pages[0]
                self.assertTrue(file.is_bigtiff)
                self.assertEqual((page.shape, page.description, page.dataoffsets, page.databytecounts), ((side, side), "a text", (16,), (side * side,)))
            (self.folder / "b.tif").unlink()

    def test_tiff_that_has_no_plain_form(self):
        tifffile.imwrite(self.folder / "lsm.tif", self.volume((32, 32)), compression="deflate", extratags=[(34412, "B", 8, bytes(8), True)])
        self.why_not("lsm.tif", "lsm.tif: its tag 34412 holds places in the file")
        tifffile.imwrite(self.folder / "two.tif", self.volume((2, 9, 9)), compression="deflate", photometric="minisblack", metadata=None,
                         extratags=[(65001, "s", 0, "a text", False)])
        good = (self.folder / "two.tif").read_bytes()
        with tifffile.TiffFile(self.folder / "two.tif") as file:
            tag = file.pages[1].tags[65001]
            at = tag.offset
        for position, form, value, text in ((at + 2, "<H", 15, "unknown type"), (at + 8, "<I", 1 << 30, "lies beyond its end")):
            broken = bytearray(good)
            struct.pack_into(form, broken, position, value)
            (self.folder / "two.tif").write_bytes(broken)
            run = self.tagrid("encode", "two.tif", "-o", "none.tag", "-f", "-v")
            self.assertTrue(run.returncode == 65 or text in run.stderr, run.stderr)

    def test_samples_that_lie_over_the_directory_do_not_change_it_and_over_the_header_there_are_none(self):
        image = self.volume((40, 50), "uint8")
        tags = [(256, 3, 50), (257, 3, 40), (258, 3, 8), (259, 3, 1), (262, 3, 1), (273, 4, 8), (277, 3, 1), (278, 3, 40), (279, 4, 2000)]
        for place, directory in ((8, 2008), (8, 1000), (0, 2000), (4, 2008)):
            entries = b"".join(struct.pack("<HHII", tag, type, 1, place if tag == 273 else value) for tag, type, value in tags)
            data = bytearray(image.tobytes()) + bytes(200)
            data[:8] = struct.pack("<2sHI", b"II", 42, directory)
            data[directory:directory + 6 + len(entries)] = struct.pack("<H", len(tags)) + entries + bytes(4)
            (self.folder / "over.tif").write_bytes(data)
            if place < 8:
                run = self.tagrid("encode", "over.tif", "-o", "none.tag", "-f")
                self.assertEqual(run.returncode, 65)
                self.assertIn(f"strip 1 begins at byte {place} and has 2000 bytes", run.stderr)
                continue
            self.ok("encode", "over.tif", "-o", "out.tag", "-f", "--max-error", "9")
            self.ok("restore", "out.tag", "-o", "back", "-f")
            back = tifffile.imread(self.folder / "back/over.tif").astype(int)
            self.assertLessEqual(abs(back - numpy.frombuffer(data[8:2008], "uint8").reshape(40, 50)).max(), 9)

    # HDF5

    def write_hdf5(self, name, volume, refers=True, libver="earliest", userblock_size=0, track_order=False, **options):
        with h5py.File(self.folder / name, "w", libver=libver, userblock_size=userblock_size, track_order=track_order) as file:
            file.attrs["title"], file.attrs["numbers"] = "scan \xe9", numpy.arange(5, dtype=">i4")
            instrument = file.create_group("entry/instrument")
            instrument.attrs["NX_class"] = "NXinstrument"
            data = file.create_dataset("entry/data", data=volume, **options)
            data.attrs["b units"], data.attrs["a flag"] = "1/cm", True
            data.attrs["texts"] = numpy.array(["a", "bcd"], dtype=h5py.string_dtype())
            x = file.create_dataset("entry/x", data=numpy.arange(float(volume.shape[-1])))
            if refers:
                x.make_scale("x")
                data.dims[2].attach_scale(x)
                file.attrs["reference"] = data.ref
                instrument.attrs["all"] = numpy.array([x.ref, instrument.ref], dtype=h5py.ref_dtype)
            file["entry/energy"], file["entry/names"] = 12.5, numpy.array(["q", "rr"], dtype=h5py.string_dtype())
            file["entry/rows"] = numpy.zeros(3, dtype=[("a", "i4"), ("b", "f8")])
            file["entry/same"], file["entry/soft"], file["other"] = x, h5py.SoftLink("/entry/data"), h5py.ExternalLink("other.h5", "/x")
            file["again"], file["type"] = data, numpy.dtype("i4")
            file.create_dataset("entry/packed", data=numpy.arange(1000), compression="gzip", shuffle=True)
        if userblock_size:
            with open(self.folder / name, "r+b") as file:
                file.write(b"a user block")

    def content(self, name):
        """All objects and links of a file, with attributes; what is stored how, but for the volume; objects by one of their names."""
        all = {}
        with h5py.File(self.folder / name) as file:
            def plainly(value):
                if isinstance(value, h5py.Reference):
                    names = {file[value].name, *(["/again", "/entry/data"] if file[value] == file["again"] else ["/entry/same", "/entry/x"] if file[value] == file["entry/x"] else [])}
                    return sorted(names)
                if isinstance(value, numpy.ndarray) and value.dtype.kind in "OV" or isinstance(value, (numpy.void, tuple)):
                    return [plainly(part) for part in value]
                return repr(value)

            def add(name, thing):
                all[name] = {key: (plainly(thing.attrs[key]), str(thing.attrs.get_id(key).dtype)) for key in thing.attrs}
                if isinstance(thing, h5py.Dataset):
                    is_volume = thing == file["entry/data"]
                    stored = None if is_volume else (thing.compression, thing.shuffle, thing.chunks, thing.maxshape)
                    all[name] |= {"": (thing.shape, str(thing.dtype), plainly(thing[()]) if thing.dtype.kind == "O" else thing[()].tobytes(), stored,
                                       None if thing.dtype.kind == "O" else str(thing.fillvalue))}
                if isinstance(thing, h5py.Group):
                    for key in thing:
                        link = thing.get(key, getlink=True)
                        if isinstance(link, h5py.HardLink):
                            add(f"{name}/{key}", thing[key])
                        else:
                            all[f"{name}/{key}"] = (type(link).__name__, link.path, getattr(link, "filename", ""))
            add("", file)
            data = file["entry/data"]
            layout = (data.chunks, data.compression, data.id.get_offset() is not None)
        return all, list(all), layout

    def test_hdf5_comes_back_with_a_contiguous_data_set(self):
        for compression, options in (("deflate", {"compression": "gzip"}), ("shuffle, deflate, fletcher32", {"compression": "gzip", "shuffle": True, "fletcher32": True}),
                                     ("deflate", {"compression": "gzip", "libver": "latest", "track_order": True}),
                                     ("chunks", {"chunks": (2, 5, 7), "maxshape": (None, None, 23), "userblock_size": 512, "fillvalue": 7}),
                                     ("deflate", {"compression": "gzip", "userblock_size": 1024, "refers": False})):
            truth = self.volume().astype(">u2" if "track_order" in options else "<u2")
            self.write_hdf5("a.h5", truth, **options)
            samples = self.back("a.h5", compression, "--dataset", "/entry/data")
            self.assert_same(samples, truth)
            before, after = self.content("a.h5"), self.content("back/a.h5")
            self.assertEqual(before[:2], after[:2], options)
            self.assertEqual(after[2], (None, None, True))
            if "userblock_size" in options:
                self.assertEqual((self.folder / "back" / "a.h5").read_bytes()[:12], b"a user block")
            first = (self.folder / "out.tag").read_bytes()
            self.ok("encode", "a.h5", "-o", "out.tag", "-f", "--dataset", "/entry/data")
            self.assertEqual((self.folder / "out.tag").read_bytes(), first)

    def test_hdf5_that_has_no_plain_form(self):
        truth = self.volume()
        with h5py.File(self.folder / "a.h5", "w") as file:
            file.create_dataset("a", data=truth, compression="gzip")
            file.create_dataset("b", data=numpy.random.default_rng(2).integers(0, 9999, (70, 100, 200)), chunks=(10, 20, 20))
        self.why_not("a.h5", "a.h5: it has more than 2 MiB besides these samples", "--dataset", "a")
        with h5py.File(self.folder / "b.h5", "w") as file:
            data = file.create_dataset("a", data=truth, compression="gzip")
            file.attrs["region"] = data.regionref[1:2]
        self.why_not("b.h5", "b.h5: it has references to regions")
        with h5py.File(self.folder / "c.h5", "w") as file:
            data = file.create_dataset("a", data=truth, compression="gzip")
            file["references"] = numpy.array([data.ref], dtype=h5py.ref_dtype)
        self.why_not("c.h5", "c.h5: it has data sets of references")
        # Groups that hold each other are copied once.
        with h5py.File(self.folder / "d.h5", "w") as file:
            file.create_dataset("g/a", data=truth, compression="gzip")
            file["g/h"] = file["/"]
        self.assert_same(self.back("d.h5", "deflate"), truth)

    def test_an_hdf5_file_that_links_to_another_one(self):
        truth = self.volume()
        with h5py.File(self.folder / "a.h5", "w") as file:
            file.create_dataset("deep/data", data=truth, compression="gzip")
        with h5py.File(self.folder / "b.h5", "w") as file:
            file["volume"] = h5py.ExternalLink("a.h5", "/deep/data")
        self.ok("encode", "b.h5", "-o", "b.tag", "--dataset", "/volume")
        self.ok("restore", "b.tag", "-o", "back")
        self.assertEqual((self.folder / "back" / "b.h5").read_bytes(), (self.folder / "b.h5").read_bytes())
        with h5py.File(self.folder / "back" / "b.h5") as file:
            numpy.testing.assert_array_equal(file["volume"][()], truth)

    # DICOM, NRRD

    def write_deflated(self, folder, truth):
        os.makedirs(self.folder / folder, exist_ok=True)
        for z, slice in enumerate(truth):
            file = data_set(slice, instance=f"1.2.{z}", position=(0, 0, z))
            file.private_block(0x0009, "SOMEBODY", create=True).add_new(1, "OB", bytes(range(200)))
            file.ProcedureCodeSequence = pydicom.Sequence([pydicom.Dataset()])
            self.save("a.dcm", file)
            subprocess.run(["dcmconv", "+td", "a.dcm", f"{folder}/{z}.dcm"], cwd=self.folder, check=True)

    @unittest.skipIf(shutil.which("dcmconv") is None, "there is no dcmconv on this machine (dcmtk)")
    def test_deflated_dicom_comes_back_inflated(self):
        for shape in ((3, 19, 23), (2, 20, 30)):
            truth = self.volume(shape)
            shutil.rmtree(self.folder / "s", ignore_errors=True)
            self.write_deflated("s", truth)
            self.assert_same(self.back("s", "Deflated Explicit VR Little Endian"), (truth - 1024).astype("int16"))
            for z in range(shape[0]):
                then, now = (pydicom.dcmread(self.folder / folder / f"{z}.dcm") for folder in ("s", "back"))
                self.assertEqual(now.file_meta.TransferSyntaxUID, pydicom.uid.ExplicitVRLittleEndian)
                numpy.testing.assert_array_equal(now.pixel_array, truth[z])
                self.assertEqual(then, now)
                self.assertEqual(then.PixelData, now.PixelData)
                self.assertEqual(then[0x0009, 0x1001].value, now[0x0009, 0x1001].value)

    def test_nrrd_in_bzip2_comes_back_raw(self):
        samples = self.volume().astype(">u2").tobytes()
        head = b"NRRD0004\n# \xff\ntype: ushort\ndimension: 3\nsizes: 23 19 5\nendian: big\nencoding: %s\nkey:=value\n"
        (self.folder / "a.nrrd").write_bytes(head % b"bzip2" + b"byte skip: 3\n\n" + bz2.compress(b"abc" + samples))
        self.back("a.nrrd", "bzip2")
        self.assertEqual((self.folder / "back" / "a.nrrd").read_bytes(), head % b"raw" + b"byte skip: 3\n\nabc" + samples)
        for z in range(5):
            (self.folder / f"{z}.raw.bz2").write_bytes(bz2.compress(samples[z * 874:][:874]))
        (self.folder / "b.nhdr").write_bytes(head % b"bz2" + b"data file: %d.raw.bz2 0 4 1\n")
        self.back("b.nhdr", "bzip2")
        self.assertEqual((self.folder / "back" / "b.nhdr").read_bytes(), head % b"raw" + b"data file: %d.raw 0 4 1\n")
        self.assertEqual(b"".join((self.folder / "back" / f"{z}.raw").read_bytes() for z in range(5)), samples)

    # All of them

    def test_what_holds_for_all_of_them(self):
        truth = self.volume((4, 24, 31))
        self.write_tiff("a.tif", truth, compression="deflate")
        self.write_hdf5("a.h5", truth, compression="gzip")
        (self.folder / "a.nrrd").write_bytes(b"NRRD0004\ntype: ushort\ndimension: 3\nsizes: 31 24 4\nendian: little\nencoding: bzip2\n\n" + bz2.compress(truth.tobytes()))
        readers = {"a.tif": lambda path: tifffile.imread(path, key=range(4)), "a.h5": lambda path: h5py.File(path)["entry/data"][()],
                   "a.nrrd": lambda path: numpy.frombuffer(path.read_bytes()[-truth.nbytes:], "<u2").reshape(truth.shape)}
        if shutil.which("dcmconv") is not None:
            self.write_deflated("s", truth)
            readers["s"] = lambda path: numpy.stack([pydicom.dcmread(path.parent / f"{z}.dcm").pixel_array for z in range(4)])
        for name, read in readers.items():
            options = ("--dataset", "/entry/data") if name == "a.h5" else ()
            if name != "a.nrrd":  # all that its header says is in the .tag file, and decode writes it
                self.assert_refused(64, "and come back uncompressed", "encode", name, "--rm", "-f", "-o", "x.tag", *options)
            self.ok("encode", name, "-o", "x.tag", "-f", "--strip", *options)
            self.assert_refused(64, "holds no source files", "restore", "x.tag", "-o", "r")
            self.ok("encode", name, "-o", "x.tag", "-f", "--max-error", "20", *options)
            run = self.ok("restore", "x.tag", "-o", "lossy")
            self.assertIn("were not kept exactly; they differ by up to 20", run.stderr)
            self.assertTrue(0 < numpy.abs(read(self.folder / "lossy" / name).astype(int) - truth).max() <= 20, name)
            shutil.rmtree(self.folder / "lossy")
            # A list of one: its original stays.
            (self.folder / "list").write_text("\t".join([name, *(["dataset=/entry/data"] if options else [])]) + "\n")
            self.ok("convert", "--manifest", "list", "--output-dir", f"out {name}")
            if name != "a.nrrd":
                self.assertEqual(self.tagrid("convert", "--manifest", "list", "--output-dir", f"out {name}", "--remove-verified").returncode, 65)
                self.assertTrue((self.folder / name).exists())
                self.assertIn("come back uncompressed", (self.folder / f"out {name}" / "results.jsonl").read_text())
            # Damage is found, or harms nothing.
            if name == "s":
                continue
            whole = (self.folder / name).read_bytes()
            for i in range(24):
                broken = bytearray(whole[:len(whole) * i // 24] if i % 2 else whole)
                if i % 2 == 0:
                    broken[len(whole) * i // 24] ^= 1 << i % 8
                (self.folder / ("broken" + name[1:])).write_bytes(broken)
                run = self.tagrid("encode", "broken" + name[1:], "-o", "broken.tag", "-f", *options)
                self.assertIn(run.returncode, (0, 64, 65), run.stderr)
                if run.returncode == 0:
                    restored = self.tagrid("restore", "broken.tag", "-o", "broken", "-f")
                    self.assertIn(restored.returncode, (0, 64), restored.stderr)
                    (self.folder / "broken.tag").unlink()
                else:
                    self.assertFalse((self.folder / "broken.tag").exists())


if __name__ == "__main__":
    main()
