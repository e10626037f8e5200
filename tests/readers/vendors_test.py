"""Volumes as scanners' own programs write them: VGStudio, Nikon, Scanco, PyHST, VFF, and folders of samples alone."""

import shutil
import struct
import subprocess
import unittest

from other_readers import ReaderTest, main, numpy, random_samples

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
    return random_samples(type, shape)


@unittest.skipIf(numpy is None, "there is no numpy on this machine")
class Vendors(ReaderTest):
    def test_vgstudio(self):
        for type, words, bits in (("uint8", "unsigned integer", 8), ("uint16", "unsigned integer", 16), ("int16", "signed integer", 16),
                                  ("float32", "float", 32), ("uint32", "Unsigned Integer", 32)):
            truth = volume(type)
            for skip, name, line in ((0, "scan.vol", "\n"), (17, "D:\\data\\scan.vol", "\r\n")):
                (self.folder / "scan.vol").write_bytes(bytes(skip) + truth.tobytes())
                (self.folder / "a.vgi").write_text(VGI.format(type=words, bits=bits, skip=skip, name=name).replace("\n", line), newline="")
                info = self.encodes(truth, "a.vgi", what=f"{type} {skip}")
                self.assertEqual(info["geometry"]["spacing"], [0.05, 0.06, 0.07])
                self.assertEqual(info["geometry"]["units"], ["mm"] * 3)

    def test_what_a_description_says_beyond_its_samples_is_said(self):
        truth = volume("int16") // 64  # all within the usual range
        good = VGI.format(type="signed integer", bits=16, skip=0, name="scan.vol")
        (self.folder / "scan.vol").write_bytes(truth.tobytes())
        other = "{volume2}\n[representation]\nsize = 2 2 2\n[file1]\nSkipHeader = 99\nSize = 2 2 2\nName = other.vol\nDatatype = float\nBitsPerElement = 32\n"
        start = "RegionOfInterestStart = 0 0 1\nRegionOfInterestEnd = 22 18 6\n"
        for old, new, text in (("", "", None), ("Name = scan.vol", start.replace("0 0 1", "0 0 0") + "Name = scan.vol", None),
                               ("[representation]\n", "[representation]\nmirror = 0 0 0 0\n", None),
                               ("[representation]\n", "[representation]\nmirror = 0 0 1 0\n", "representation/mirror"),
                               ("Name = scan.vol", start + "Name = scan.vol", 'only samples from \"0 0 1\" to \"22 18 6\" are to be used; all are read'),
                               ("bitsperelement = 16", "bitsperelement = 8", "are to be mapped to type"),
                               ("size = 23 19 7\n", "size = 23 19 6\n", 'the volume has \"23 19 6\" samples, and its file \"23 19 7\"'),
                               ("{volumeprimitive1}", other + "{volumeprimitive1}", "describes 2 volumes (volume1, volume2); only the first one is read")):
            (self.folder / "a.vgi").write_text(good.replace(old, new, 1) if old else good)
            self.encodes(truth, "a.vgi", what=new)
            if text is None:
                self.assertNotIn("warning", self.messages, new)
                continue
            self.assertIn(text.replace('\\', ''), self.messages)
            run = self.tagrid("encode", "a.vgi", "--max-error", "5", "--rm", "-f", "-o", "b.tag")
            self.assertNotEqual(run.returncode, 0)
            self.assertTrue((self.folder / "scan.vol").exists() and (self.folder / "a.vgi").exists())
        for scale, said in (("1 1.0 1", ""), ("2 2 2", 'scale is "2 2 2", which is not applied')):
            (self.folder / "a.vgi").write_text(good + f"scale = {scale}\n")
            self.assertEqual(self.encodes(truth, "a.vgi", says=said)["geometry"]["spacing"], [0.05, 0.06, 0.07])
            self.assertEqual("warning" in self.messages, said != "")
        # The second volume lends nothing to the first one.
        (self.folder / "a.vgi").write_text(good.replace("SkipHeader = 0\n", "").replace("{volumeprimitive1}", other + "{volumeprimitive1}"))
        self.encodes(truth, "a.vgi")
        self.ok("verify", "out.tag", "--against", "a.vgi")
        for old, new, text in (("[geometry]", "[file2]\nName = b.vol\n[geometry]", "[file2]"), ("FileFormat = raw", "FileFormat = raw\nEndian = big", "endian"),
                               ("FileFormat = raw", "FileFormat = raw\nByteOrder = MSB", "byteorder"),
                               ("FileFormat = raw", "FileFormat = raw\nCompression = zip", "compression")):
            (self.folder / "a.vgi").write_text(good.replace(old, new))
            self.assert_refused(65, text, "encode", "a.vgi")

    def test_samples_are_told_of_their_header(self):
        truth = volume("uint16")
        (self.folder / "scan.vol").write_bytes(truth.tobytes())
        (self.folder / "scan.vgi").write_text(VGI.format(type="unsigned integer", bits=16, skip=0, name="scan.vol"))
        self.assert_refused(65, "scan.vgi describes its samples; give that file", "encode", "scan.vol")
        self.encodes(truth, "scan.vgi")
        (self.folder / "scan.vgi").unlink()
        (self.folder / "scan.xtekct").write_text("[XTekCT]\nVoxelsX=23\nVoxelsY=19\nVoxelsZ=7\nVoxelSizeX=0,05\nVoxelSizeY=-1\n")
        self.assert_refused(65, "scan.xtekct describes its samples; give that file", "encode", "scan.vol")
        samples, info = self.encoded("scan.xtekct")
        self.assert_same(samples, truth)
        self.assertEqual(info["geometry"]["spacing"], [0.05, None, None])
        self.assertIn("VoxelSizeX is \"0,05\", with a decimal comma; it is read as 0.05", self.messages)
        self.assertIn("VoxelSizeY: a distance between samples cannot be -1", self.messages)

    def pyhst(self, truth, name="scan.vol", order="LOWBYTEFIRST", fields="", size=0.28):
        """Both files, as PyHST leaves them."""
        (self.folder / name).write_bytes(truth.astype(truth.dtype.newbyteorder(">" if order == "HIGHBYTEFIRST" else "<")).tobytes())
        text = f"! PyHST_SLAVE VOLUME INFO FILE\nNUM_X =  23\nNUM_Y =  19\nNUM_Z =  7\nvoxelSize =  {size}\nBYTEORDER = {order}\nValMin =  -1.5\nS1 =  2\ns1 =  0\n"
        (self.folder / f"{name}.info").write_text(text + fields)
        return f"{name}.info"

    def test_pyhst(self):
        for order in ("LOWBYTEFIRST", "HIGHBYTEFIRST"):
            truth = volume("float32")
            info = self.encodes(truth, self.pyhst(truth, order=order), what=order)
            self.assertEqual((info["geometry"]["spacing"], info["geometry"]["units"], self.messages), ([0.28] * 3, ["um"] * 3, ""))
            pairs = dict(info["source"]["pairs"])
            self.assertEqual([pairs[f"pyhst_{name}"] for name in ("ValMin", "S1", "s1")], ["-1.5", "2", "0"])
        # The size of the file says the type, or a line that other programs write.
        for type in ("uint8", "uint16"):
            self.encodes(volume(type), self.pyhst(volume(type), "small.raw"), what=type)
        for type, line in (("int16", "DATA_TYPE = int16\n"), ("uint32", "DATA_TYPE = uint32\n"), ("float32", "DATA_TYPE = FLOAT\n")):
            self.encodes(volume(type), self.pyhst(volume(type), fields=line), what=type)
        (self.folder / "a.raw").write_bytes(truth.tobytes())
        (self.folder / "a.raw.info").write_text("NUM_X = 23\r\nNUM_Y = 19\r\nNUM_Z = 7")
        self.assertEqual(self.encodes(truth, "a.raw.info")["geometry"]["spacing"], None)
        self.assert_refused(65, "a.raw.info describes its samples; give that file", "encode", "a.raw")
        for size, text in (("0", "cannot be 0"), ("-1", "cannot be -1"), ("x", "not a number")):
            self.assertEqual(self.encodes(truth, self.pyhst(truth, size=size), says=text)["geometry"]["spacing"], None)
            self.assertEqual(self.messages.count("voxelSize"), 1)

    def test_what_is_wrong_with_pyhst_is_said(self):
        truth = volume("float32")
        good = (self.folder / self.pyhst(truth)).read_text()
        for old, new, text in (("NUM_Z =  7\n", "", "NUM_Z is missing"), ("=  7", "=  x", "NUM_Z"), ("=  7", "=  -7", "a volume cannot have"), ("=  7", "=  8", "bytes, but"),
                               ("=  23", "=  99999999999", "a volume cannot have"), ("LOWBYTEFIRST", "MIDDLE", "BYTEORDER"), ("ValMin", "DATA_TYPE = PACKED_BINARY\nx", "not supported")):
            self.assertIn(old, good)
            (self.folder / "scan.vol.info").write_text(good.replace(old, new))
            self.assert_refused(65, text, "encode", "scan.vol.info")
        (self.folder / "scan.vol.info").write_text(good)
        whole = (self.folder / "scan.vol").read_bytes()
        (self.folder / "scan.vol").write_bytes(whole[:-1])
        self.assert_refused(65, "expected", "encode", "scan.vol.info")
        (self.folder / "scan.vol.info").write_text(good + "DATA_TYPE = float32\n")
        self.assert_refused(65, "its slices should end", "encode", "scan.vol.info")
        (self.folder / "scan.vol").write_bytes(whole + b"more")
        self.encodes(truth, "scan.vol.info", says="4 bytes follow the samples")
        (self.folder / "scan.vol").unlink()
        self.assert_refused(74, "scan.vol", "encode", "scan.vol.info")
        (self.folder / "scan.txt").write_text(good)
        self.assert_refused(64, "without .info", "encode", "scan.txt")
        # A removed scan is both files.
        self.pyhst(truth)
        (self.folder / "scan.txt").unlink()
        self.assertIn("scan.vol.info", self.search(".").stdout)
        self.ok("encode", "scan.vol.info", "--rm", "-o", "kept.tag")
        self.assertEqual(sorted(path.name for path in self.folder.glob("scan*")), [])
        self.ok("restore", "kept.tag", "-o", "back")
        self.assertEqual((self.folder / "back/scan.vol").read_bytes(), whole)

    def vff(self, truth, line="\n", old="", new="", name="a.vff"):
        bits = 8 * truth.itemsize
        text = f"ncaa\nrank=3;\ntype=raster;\nformat=slice;\nbits={bits};\nbands=1;\nsize=23 19 7;\nspacing=1.0 1.0 2.0;\norigin=0 -2 4;\nrawsize={truth.nbytes};\n" \
            "elementsize=0.045;\ntitle=C:\\data\\foot.vff;\n\f\n"
        self.assertIn(old, text)
        (self.folder / name).write_bytes(text.replace(old, new).replace("\n", line, text.count("\n") - 1).encode() + truth.astype(truth.dtype.newbyteorder(">")).tobytes())
        return name

    def test_vff(self):
        for type in ("int16", "uint8"):
            truth = volume(type)
            for line in ("\n", "\r\n"):
                info = self.encodes(truth, self.vff(truth, line), what=(type, line))
                geometry = info["geometry"]
                self.assertEqual((geometry["spacing"], geometry["units"], geometry["origin"], self.messages), ([0.045, 0.045, 0.09], ["mm"] * 3, [0, -0.09, 0.18], ""))
                self.assertEqual(dict(info["source"]["pairs"])["vff_title"], "C:\\data\\foot.vff")
        truth = volume("int16")
        for old, new, spacing, unit in (("elementsize=0.045;\n", "", [1, 1, 2], ""), ("spacing=1.0 1.0 2.0;\n", "", [0.045] * 3, "mm"), ("0.045", "x", None, ""), ("1.0 1.0 2.0", "1.0 2.0", None, "")):
            geometry = self.encodes(truth, self.vff(truth, old=old, new=new), what=new)["geometry"]
            self.assertEqual(geometry["spacing"], spacing, old)
            self.assertEqual(geometry["units"] or [""] * 3, [unit] * 3, old)
        self.encodes(volume("float32"), self.vff(volume("float32")), says="whether its samples of 32 bits are floats")
        # Values are samples times data_scale plus data_offset.
        truth //= 64
        self.ok("encode", self.vff(truth, old="title", new="data_scale=0.5;\ndata_offset=-3;\ntitle"), "-o", "a.tag")
        self.ok("decode", "a.tag", "-o", "a.raw", "--values")
        self.assertTrue(numpy.array_equal(numpy.fromfile(self.folder / "a.raw", "float32").reshape(truth.shape), truth * 0.5 - 3))

    def test_what_is_wrong_with_vff_is_said(self):
        truth = volume("int16")
        for old, new, text in (("rank=3", "rank=2", "rank"), ("raster", "vector", "type"), ("format=slice", "format=base", "format"), ("bands=1", "bands=3", "bands"), ("bits=16", "bits=12", "bits"),
                               ("size=23 19 7", "size=23 19", "size"), ("size=23 19 7", "size=23 0 7", "size"), ("size=23 19 7", "size=23 19 8", "expected"), ("\f\n", "", "does not end"),
                               ("size=23 19 7", "size=99999999999 99999999999 7", "a volume cannot have")):
            self.assert_refused(65, text, "encode", self.vff(truth, old=old, new=new))
        whole = (self.folder / self.vff(truth)).read_bytes()
        for size in (5, 100, len(whole) - 1):
            (self.folder / "a.vff").write_bytes(whole[:size])
            self.assert_refused(65, "a.vff", "encode", "a.vff")
        self.encodes(truth, self.vff(truth, old="title", new="data_scale=x;\ntitle"), says="what values samples mean is unknown")

    def nikon(self, folder, truth, vgi_size="23 19 7", resolution="0.05 0.06 0.07", unit="mm", sizes=(23, 19, 7), stem="scan"):
        """The three files that Nikon's program leaves."""
        (self.folder / folder).mkdir(exist_ok=True)
        (self.folder / folder / "scan.vol").write_bytes(truth.tobytes())
        vgi = VGI.format(type="unsigned integer", bits=16, skip=0, name="scan.vol").replace("23 19 7", vgi_size)
        (self.folder / folder / f"{stem}.vgi").write_text(vgi.replace("0.05 0.06 0.07", resolution).replace("unit = mm", f"unit = {unit}"))
        (self.folder / folder / "scan.xtekct").write_text(
            "[XTekCT]\nVoxelsX=%d\nVoxelsY=%d\nVoxelsZ=%d\nVoxelSizeX=0.05\nVoxelSizeY=0.06\nVoxelSizeZ=0.07\nXraykV=225\n" % sizes)

    def test_both_descriptions_of_nikon_are_one_volume(self):
        truth = volume("uint16") // 16
        for stem in ("scan", "a_scan", "z_scan"):
            self.nikon(stem, truth, stem=stem)
            for name in (f"{stem}.vgi", "scan.xtekct"):
                info = self.encodes(truth, f"{stem}/{name}")
                self.assertEqual(self.messages, "")
                self.assertEqual(info["geometry"]["spacing"], [0.05, 0.06, 0.07])
                pairs = dict(info["source"]["pairs"])
                self.assertEqual((pairs["xtekct_xtekct/xraykv"], pairs["vgi_file1/name"]), ("225", "scan.vol"))
                self.ok("restore", "out.tag", "-o", "back", "-f")
                for path in (self.folder / stem).iterdir():
                    self.assertEqual((self.folder / "back" / path.name).read_bytes(), path.read_bytes())
                shutil.rmtree(self.folder / "back")
            found = self.search(stem)
            lines = [line for line in found.stdout.splitlines() if not line.startswith("#")]
            self.assertEqual((len(lines), found.stdout.count("passed over")), (1, 0), found.stdout)
            (self.folder / "list.tsv").write_text(found.stdout)
            options = ("convert", "--manifest", "list.tsv", "--output-dir", f"out_{stem}")
            self.ok(*options)
            # A header of another name may be of another volume, too.
            are_own = stem == "scan"
            self.assertEqual(self.tagrid(*options, "--remove-verified").returncode, 0 if are_own else 65)
            self.assertEqual(len(list((self.folder / stem).iterdir())), 0 if are_own else 3)
            [tag] = (self.folder / f"out_{stem}").rglob("*.tag")
            self.ok("restore", tag, "-o", "back")
            self.assertEqual(numpy.fromfile(self.folder / "back" / "scan.vol", "uint16").tobytes(), truth.tobytes())
            self.assertEqual(len(list((self.folder / "back").iterdir())), 3)
            shutil.rmtree(self.folder / "back")

    def test_descriptions_of_nikon_that_contradict_each_other_are_said(self):
        truth = volume("uint16") // 16
        for changes, said in (({"resolution": "0.05 0.06 0.08"}, "0.08 mm along z"), ({"resolution": "50 60 70", "unit": "um"}, ""),
                              ({"resolution": "0.050000001 0.06 0.07"}, ""), ({"sizes": (23, 19, 6)}, "23 x 19 x 6 samples")):
            self.nikon("s", truth, **changes)
            self.encodes(truth, "s/scan.vgi", says=said, what=changes)
            self.assertEqual("the former is used" in self.messages, said != "", changes)
            self.tagrid("encode", "s/scan.vgi", "--max-error", "5", "--rm", "-f", "-o", "b.tag")
            self.assertEqual((self.folder / "s" / "scan.vol").exists(), said != "", changes)
        # The size of the file contradicts Nikon's description.
        self.nikon("s", truth, sizes=(23, 19, 6))
        self.assert_refused(65, "samples of 1, 2 or 4 bytes are expected", "encode", "s/scan.xtekct")
        # VGStudio's says the type.
        self.nikon("t", truth.astype("uint16"))
        text = (self.folder / "t" / "scan.vgi").read_text()
        (self.folder / "t" / "scan.vgi").write_text(text.replace("unsigned", "signed"))
        self.encodes(truth.view("int16"), "t/scan.xtekct")
        # One that is broken belongs to the scan, and is said.
        (self.folder / "t" / "scan.vgi").write_text("{volume1}\n[file1]\n")
        self.encodes(truth, "t/scan.xtekct", says="the other description of its samples cannot be read")
        self.assert_refused(65, "size is missing", "encode", "t/scan.vgi")

    def test_a_scanco_header_that_cannot_be_meant_is_said(self):
        truth = volume("int16")
        whole = self.isq(truth)
        (self.folder / "a.isq").write_bytes(whole + bytes(100))  # filled up to a block
        self.encodes(truth, "a.isq")
        self.assertNotIn("follow", self.messages)
        (self.folder / "a.isq").write_bytes(whole + bytes(600))
        self.encodes(truth, "a.isq", says="600 bytes follow the samples")
        for at, value, text in ((60, 0, "the size of axis 2"), (64, -5, "the size of axis 3")):
            broken = bytearray(whole)
            struct.pack_into("<i", broken, at, value)
            (self.folder / "a.isq").write_bytes(broken)
            info = self.encodes(truth, "a.isq")
            self.assertIsNone(info["geometry"]["spacing"][(at - 56) // 4])
            self.assertIn(text, self.messages)
        broken = bytearray(whole)
        struct.pack_into("<i", broken, 88, -4096)
        (self.folder / "a.isq").write_bytes(broken)
        self.encodes(truth, "a.isq")
        self.assertIn("mu_scaling", self.assert_refused(64, "--max-error", "encode", "a.isq", "--max-error", "5"))

    def test_advice_about_gaps_helps(self):
        truth = volume("int16", (12, 20, 30))
        (self.folder / "s").mkdir()
        for z in (0, 1, 2, 4, 5, 6):
            (self.folder / "s" / f"slice{z}.raw").write_bytes(truth[z].tobytes())
        options = ["--type", "int16", "--dims"]
        # With six of seven slices, no gap may be meant.
        message = self.assert_refused(65, "6 files cannot have equal parts of 30 x 20 x 7 int16", "encode", "s", *options, "30,20,7")
        self.assertNotIn("--gaps-ok", message)
        self.assertIn("slices are missing", message)
        self.assert_refused(65, "--gaps-ok", "encode", "s", *options, "30,20,6")
        self.encodes(truth[[0, 1, 2, 4, 5, 6]], "s", *options, "30,20,6", "--gaps-ok")

    def test_nikon(self):
        for type in ("uint8", "uint16", "float32"):
            truth = volume(type)
            (self.folder / "scan.vol").write_bytes(truth.tobytes())
            (self.folder / "scan.xtekct").write_text("[XTekCT]\nName=scan\nVoxelsX=23\nVoxelsY=19\nVoxelsZ=7\nVoxelSizeX=0.05\n"
                                                     "VoxelSizeY=0.05\nVoxelSizeZ=0.06\nXraykV=120\n[Xrays]\nXraykV=120\n")
            info = self.encodes(truth, "scan.xtekct", what=type)
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
        info = self.encodes(truth, "a.isq")
        numpy.testing.assert_allclose(info["geometry"]["spacing"], [0.082, 0.082, 0.09])
        pairs = info["source"]["pairs"]
        self.assertEqual((float(pairs["rescale_slope"]), pairs["rescale_units"], pairs["isq_name"], pairs["isq_energy"]),
                         (1 / 8192, "1/cm", "Bone 17", "55000"))
        # A bound is for attenuations.
        self.encoded("a.isq", "--max-error", "0.001", says="0.001 allows 8 steps")
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
                self.encodes(truth, "s", *options)
                self.ok("verify", "out.tag", "--against", "s", *options)
        (self.folder / "s" / "slice9.raw").write_bytes(b"")
        self.assert_refused(65, "bytes, but 7200 are expected", "encode", "s", "--dims", "30,20,12", "--type", "int16")
        (self.folder / "s" / "slice9.raw").unlink()
        (self.folder / "s" / "slice8.raw").write_bytes(truth.tobytes())
        (self.folder / "s" / "other.txt").write_bytes(b"")
        options = ["--dims", "30,20,12", "--type", "int16"]
        self.assert_refused(64, "holds 2 series of files; choose one with --series", "encode", "s", *options)
        for series in ("slice8.raw", "2"):
            self.encodes(truth, "s", *options, "--series", series)
        self.assert_refused(64, "has no series 3", "encode", "s", *options, "--series", "3")
        for name in ("slice1.txt", "slice#.txt"):
            (self.folder / "s" / name).write_bytes(b"")
        (self.folder / "s" / "slice2.txt").write_bytes(b"")
        self.assert_refused(64, "has 2 series that are called slice#.txt", "encode", "s", *options, "--series",
                            "slice#.txt")
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
    main()
