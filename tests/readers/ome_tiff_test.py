"""OME-TIFF: order, spacing and completeness are those of the XML, whichever file or folder is named; tifffile is the judge.
"""

import json
import shutil
import unittest
import uuid

from other_readers import ReaderTest, main, numpy, tifffile

SPACING = {"PhysicalSizeX": "0.25", "PhysicalSizeXUnit": "mm", "PhysicalSizeY": "0.5", "PhysicalSizeYUnit": "mm", "PhysicalSizeZ": "2", "PhysicalSizeZUnit": "mm"}
SCHEMA = 'xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"'


def uuid_of(name):
    return f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, name)}"


def attributes(values):
    return " ".join(f'{key}="{value}"' for key, value in values.items())


def image(planes, shape, pixels=None):
    """XML of an image of shape [c, z, y, x], whose planes are (file, page, z, c)."""
    c, z, y, x = shape
    data = "".join(f'<TiffData FirstZ="{one[2]}" FirstC="{one[3]}" FirstT="0" IFD="{one[1]}" PlaneCount="1"><UUID FileName="{one[0]}">{uuid_of(one[0])}</UUID></TiffData>'
                   for one in planes)
    pixels = {"DimensionOrder": "XYZCT", "Type": "uint16", "SizeX": x, "SizeY": y, "SizeZ": z, "SizeC": c, "SizeT": 1} | SPACING | (pixels or {})
    channels = "".join(f'<Channel ID="Channel:0:{i}" SamplesPerPixel="1"/>' for i in range(c))
    return f'<Image ID="Image:0"><Pixels ID="Pixels:0" {attributes(pixels)}>{channels}{data}</Pixels></Image>'


@unittest.skipIf(None in (numpy, tifffile), "libraries are missing")
class OmeTiff(ReaderTest):
    def volume(self, shape=(1, 5, 16, 24), seed=1):
        return numpy.random.default_rng(seed).integers(0, 4000, shape, "uint16")

    def write(self, name, pages, xml):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        with tifffile.TiffWriter(path) as file:
            for i, page in enumerate(pages):
                file.write(page, photometric="minisblack", metadata=None, contiguous=False, description=xml.encode() if i == 0 else None)

    def write_set(self, truth, planes, folder="set", pixels=None, more=""):
        """A file for each name, with its pages in order. Each has the whole XML."""
        for name in dict.fromkeys(plane[0] for plane in planes):
            pages = [truth[c, z] for file, page, z, c in sorted(planes) if file == name]
            self.write(f"{folder}/{name}", pages, f'<OME {SCHEMA} UUID="{uuid_of(name)}">{more}{image(planes, truth.shape, pixels)}</OME>')

    def reversed_set(self, truth, **options):
        self.write_set(truth, [(f"p{k}.ome.tif", 0, 4 - k, 0) for k in range(5)], **options)

    def lines_of_find(self, *options):
        run = self.search("set", *options)
        (self.folder / "list.tsv").write_text(run.stdout)
        return [line.split("\t") for line in run.stdout.splitlines() if not line.startswith("#")], run.stdout

    def assert_found(self, truths):
        """convert --find lists these volumes, by the ends of the names of their outputs, and each once."""
        lines, _ = self.lines_of_find()
        self.assertEqual({line[-1].removeprefix("output=") for line in lines}, set(truths), lines)
        self.assertEqual(len(lines), len(truths))
        shutil.rmtree(self.folder / "out", ignore_errors=True)
        self.ok("convert", "--manifest", "list.tsv", "--output-dir", "out", "-q")
        for name, truth in truths.items():
            self.ok("decode", f"out/{name}.tag", "-o", "a.raw", "-f")
            self.assertEqual((self.folder / "a.raw").read_bytes(), truth.tobytes(), name)

    def test_all_channels_in_one_file(self):
        truth = self.volume((3, 5, 16, 24))
        self.write_set(truth, [("a.ome.tif", 5 * c + z, z, c) for z in range(5) for c in range(3)])
        self.ok("encode", "set/a.ome.tif", "--series", "all", "-o", "a.tag")
        info = self.info("a.tag")
        self.assertEqual((info["volumes"], info["dims"], len(set(info["volume_names"]))), (3, [24, 16, 5], 3))
        self.ok("verify", "a.tag", "--against", "set/a.ome.tif", "--series", "all")
        for channel in range(3):
            self.ok("decode", "a.tag", "--volume", channel, "-o", "x.raw", "-f")
            self.assertEqual((self.folder / "x.raw").read_bytes(), truth[channel].tobytes())
        self.ok("restore", "a.tag", "-o", "back")
        self.assertEqual((self.folder / "back/a.ome.tif").read_bytes(), (self.folder / "set/a.ome.tif").read_bytes())
        self.assertEqual(self.tagrid("encode", "set", "--series", "all").returncode, 64)

    def test_channels_whose_slices_alternate_come_back_byte_for_byte(self):
        truth = self.volume((3, 5, 16, 24))
        self.write_set(truth, [("a.ome.tif", 3 * z + c, z, c) for z in range(5) for c in range(3)])
        # ZCYX, as many programs write it: one page follows another without gaps.
        tifffile.imwrite(self.folder / "set/b.ome.tif", truth.swapaxes(0, 1), metadata={"axes": "ZCYX"},
                         photometric="minisblack")
        for name in ("a", "b"):
            source = self.folder / f"set/{name}.ome.tif"
            self.ok("encode", source, "--series", "all", "-o", f"{name}.tag", "--json", f"{name}.json")
            self.assertEqual(json.loads((self.folder / f"{name}.json").read_text())["bytes_in"], source.stat().st_size)
            for channel in range(3):
                self.ok("decode", f"{name}.tag", "--volume", channel, "-o", "x.raw", "-f")
                self.assertEqual((self.folder / "x.raw").read_bytes(), truth[channel].tobytes())
            self.ok("restore", f"{name}.tag", "-o", "back")
            self.assertEqual((self.folder / f"back/{name}.ome.tif").read_bytes(), source.read_bytes())

    def test_a_set_is_read_by_its_xml_from_the_folder_and_from_each_of_its_files(self):
        truth = self.volume()
        self.reversed_set(truth)
        self.assertTrue((tifffile.imread(self.folder / "set/p1.ome.tif") == truth[0]).all())
        for path in ("set", "set/p0.ome.tif", "set/p3.ome.tif"):
            info = self.encodes(truth[0], path, what=path)
            self.assertEqual((info["geometry"]["spacing"], info["geometry"]["units"]), ([0.25, 0.5, 2], ["mm"] * 3))
            self.assertEqual(self.messages.count("warning"), 0, self.messages)
        # A file that does not belong to the set is another volume.
        tifffile.imwrite(self.folder / "set/other.tif", truth[0, :2], photometric="minisblack")
        self.assert_found({"p0.ome.tif": truth[0], "other.tif": truth[0, :2]})
        message = self.assert_refused(64, "holds 2 volumes", "encode", "set")
        self.assertRegex(message, r"p0.ome.tif +24 x 16 x 5 uint16")
        self.encodes(truth[0], "set", "--series", "p0.ome.tif")
        self.encodes(truth[0, :2], "set", "--series", "other.tif")
        # Not even one whose name is like theirs gives the set another name.
        (self.folder / "set/other.tif").rename(self.folder / "set/p17.ome.tif")
        self.encodes(truth[0], "set", "--series", "p0.ome.tif")
        self.encodes(truth[0, :2], "set", "--series", "p17.ome.tif")

    def test_channels_of_a_folder_are_volumes(self):
        truth = self.volume((2, 3, 16, 24))
        self.write_set(truth, [(f"c{c}z{z}.ome.tif", 0, z, c) for c in range(2) for z in range(3)])
        self.assertRegex(self.assert_refused(64, "holds 2 volumes", "encode", "set"), "c1 +channel 1 of 2.*\n.*c2 +channel 2 of 2")
        self.assertIn("holds 2 volumes", self.assert_refused(64, "--series", "encode", "set/c0z1.ome.tif"))
        for path in ("set", "set/c0z1.ome.tif"):
            for c in range(2):
                self.encodes(truth[c], path, "--series", f"c{c + 1}", what=path)
        self.assert_found({"c0z0.ome.tif/c1": truth[0], "c0z0.ome.tif/c2": truth[1]})

    def test_files_with_several_planes_and_other_sizes_of_files(self):
        truth = self.volume((1, 7, 16, 24))
        # The second file has the first slices, and says only how many pages it has, not how many planes are meant.
        names = ("a.ome.tif", "b.ome.tif")
        data = "".join(f'<TiffData FirstZ="{first}"><UUID FileName="{name}">{uuid_of(name)}</UUID></TiffData>' for name, first in zip(names, (3, 0)))
        for name, part in zip(names, (truth[0, 3:], truth[0, :3])):
            xml = f'<OME {SCHEMA} UUID="{uuid_of(name)}">{image([], truth.shape)}</OME>'
            self.write(f"set/{name}", part, xml.replace("</Pixels>", data + "</Pixels>"))
        for path in ("set", "set/a.ome.tif", "set/b.ome.tif"):
            self.encodes(truth[0], path, what=path)
        self.assert_found({"a.ome.tif": truth[0]})

    def test_a_folder_of_one_file_of_channels_can_be_chosen_from(self):
        truth = self.volume((2, 3, 16, 24))
        planes = [("a.ome.tif", c * 3 + z, z, c) for c in range(2) for z in range(3)]
        self.write_set(truth, planes)
        self.assertRegex(self.assert_refused(64, "holds 2 volumes", "encode", "set"), "c1 .*\n.*c2 ")
        for name in ("c2", "a.ome.tif:c2"):
            self.encodes(truth[1], "set", "--series", name)
        # Beside another file, names say which file is meant.
        tifffile.imwrite(self.folder / "set/zz.tif", truth[0], photometric="minisblack")
        message = self.assert_refused(64, "holds 3 volumes", "encode", "set")
        self.assertIn("a.ome.tif:c2", message)
        self.encodes(truth[1], "set", "--series", "a.ome.tif:c2")
        self.encodes(truth[0], "set", "--series", "1")
        self.assert_found({"a.ome.tif/c1": truth[0], "a.ome.tif/c2": truth[1], "zz.tif": truth[0]})

    def test_missing_files_are_named_and_may_be_left_out(self):
        truth = self.volume()
        self.reversed_set(truth)
        (self.folder / "set/p3.ome.tif").unlink()
        said = 'set/p0.ome.tif: TIFF file: OME-XML names a file that is missing: "p3.ome.tif"'
        for path in ("set", "set/p0.ome.tif", "set/p4.ome.tif"):
            self.assertIn("--gaps-ok", self.assert_refused(65, said, "encode", path))
            info = self.encodes(truth[0, [0, 2, 3, 4]], path, "--gaps-ok", what=path)
            self.assertIn("slices that are left out, as they have no page: 2", self.messages)
            self.assertIn(said, self.messages)
            # Which distance is meant cannot be known.
            self.assertEqual(info["geometry"]["spacing"], [0.25, 0.5, None])
        lines, text = self.lines_of_find()
        self.assertEqual((lines, text.count("# not listed: ")), ([], 1), text)
        lines, _ = self.lines_of_find("--gaps-ok")
        self.assertEqual(lines, [[str(self.folder / "set/p0.ome.tif"), "gaps-ok=true", "output=p0.ome.tif"]])
        self.ok("convert", "--manifest", "list.tsv", "--output-dir", "out", "-q")

    def test_the_description_may_lie_in_a_companion(self):
        truth = self.volume()
        planes = [(f"p{k}.ome.tif", 0, 4 - k, 0) for k in range(5)]
        for k in range(5):
            self.write(f"set/p{k}.ome.tif", [truth[0, 4 - k]], f'<OME {SCHEMA}><BinaryOnly MetadataFile="set.companion.ome" UUID="urn:uuid:1"/></OME>')
        self.assert_refused(65, 'p2.ome.tif: TIFF file: its OME-XML is in the file "set.companion.ome", which is missing', "encode", "set/p2.ome.tif")
        (self.folder / "set/set.companion.ome").write_text(f"<OME {SCHEMA}>{image(planes, truth.shape)}</OME>")
        for path in ("set", "set/p2.ome.tif"):
            info = self.encodes(truth[0], path, what=path)
            self.assertEqual(info["geometry"]["spacing"], [0.25, 0.5, 2])
            self.assertTrue(info["restorable"])
        self.assert_found({"p0.ome.tif": truth[0]})
        # The companion belongs to the volume.
        self.assertNotIn("companion", self.lines_of_find()[1])
        self.ok("encode", "set", "-o", "b.tag", "--rm")
        self.assertEqual(list((self.folder / "set").iterdir()), [])
        # The file with the description may be TIFF, too.
        xml = f'<OME {SCHEMA} UUID="{uuid_of("p0.ome.tif")}">{image(planes, truth.shape)}</OME>'
        for k in range(5):
            self.write(f"set/p{k}.ome.tif", [truth[0, 4 - k]], xml if k == 0 else f'<OME {SCHEMA}><BinaryOnly MetadataFile="p0.ome.tif" UUID="urn:uuid:1"/></OME>')
        for path in ("set", "set/p0.ome.tif", "set/p2.ome.tif"):
            self.encodes(truth[0], path, what=path)
        self.assert_found({"p0.ome.tif": truth[0]})

    def test_only_the_first_file_of_a_set_may_have_a_description(self):
        truth = self.volume((1, 6, 16, 24))
        names = ("a_MMStack.ome.tif", "a_MMStack_1.ome.tif")
        planes = [(names[z // 3], z % 3, z, 0) for z in range(6)]
        self.write(f"set/{names[0]}", truth[0, :3], f'<OME {SCHEMA} UUID="{uuid_of(names[0])}">{image(planes, truth.shape)}</OME>')
        tifffile.imwrite(self.folder / "set" / names[1], truth[0, 3:], photometric="minisblack", metadata=None, ome=False)
        for path in ("set", f"set/{names[0]}", f"set/{names[1]}"):
            self.encodes(truth[0], path, what=path)
        self.assert_found({names[0]: truth[0]})

    def test_names_in_the_xml_do_not_lead_out_of_the_folder(self):
        truth = self.volume()
        tifffile.imwrite(self.folder / "secret.tif", truth[0, 0])
        for name in ("../secret.tif", str(self.folder / "secret.tif"), "..", "sub/../../secret.tif"):
            planes = [("p0.ome.tif", 0, 0, 0), (name, 0, 1, 0)]
            self.write("set/p0.ome.tif", [truth[0, 0]], f'<OME {SCHEMA} UUID="{uuid_of("p0.ome.tif")}">{image(planes, (1, 2, 16, 24))}</OME>')
            self.assert_refused(65, "which is not in its directory", "encode", "set/p0.ome.tif")
            self.assert_refused(65, "which is not in its directory", "encode", "set")
            self.write("set/p0.ome.tif", [truth[0, 0]], f'<OME {SCHEMA}><BinaryOnly MetadataFile="{name}" UUID="urn:uuid:1"/></OME>')
            self.assert_refused(65, "which is not in its directory", "encode", "set/p0.ome.tif")

    def one_file(self, pixels=None, more="", shape=(1, 2, 16, 24), pages=None):
        truth = self.volume(shape)
        planes = [("a.ome.tif", z, z, 0) for z in range(shape[1])]
        xml = f'<OME {SCHEMA} UUID="{uuid_of("a.ome.tif")}">{image(planes, shape, pixels)}{more}</OME>'
        self.write("a.ome.tif", truth[0] if pages is None else pages, xml)
        return truth[0]

    def test_a_distance_that_cannot_be_read_is_said_and_unknown(self):
        for text, spacing, said in (("0,25", 0.25, 'PhysicalSizeX is "0,25", with a decimal comma; it is read as 0.25'),
                                    ("abc", None, 'PhysicalSizeX is "abc", which is not a number; the spacing along x is unknown'),
                                    ("", None, "PhysicalSizeX is empty"), ("1,024", None, "which is not a number"), ("inf", None, "which is not a number"),
                                    ("NaN", None, "which is not a number"), ("0", None, "which is no distance"), ("-0.25", None, "which is no distance"),
                                    ("0.25 mm", None, "which is not a number")):
            truth = self.one_file({"PhysicalSizeX": text})
            info = self.encodes(truth, "a.ome.tif")
            self.assertEqual(info["geometry"]["spacing"], [spacing, 0.5, 2], text)
            self.assertIn(said, self.messages)
        for unit, factor in (("m", 1000), ("\u00b5m", 0.001), ("nm", 1e-6), ("\u00c5", 1e-7), ("in", 25.4)):
            self.one_file({"PhysicalSizeZUnit": unit})
            spacing = self.encoded("a.ome.tif")[1]["geometry"]["spacing"]
            self.assertTrue(numpy.allclose(spacing, [0.25, 0.5, 2 * factor], rtol=1e-12), f"{unit} {spacing}")
        for unit in ("pixel", "reference frame", "parsec"):
            self.one_file({"PhysicalSizeZUnit": unit})
            self.assertEqual(self.encoded("a.ome.tif")[1]["geometry"]["spacing"], [0.25, 0.5, None])
            self.assertIn(f'PhysicalSizeZ has the unit "{unit}"', self.messages)

    def test_a_count_that_cannot_be_read_is_refused_by_name(self):
        for name in ("SizeZ", "SizeC", "SizeT", "SizeX"):
            for text in ("2,0", "", "two", "2.5", "-1", "99999999999"):
                self.one_file({name: text})
                self.assert_refused(65, f"OME-XML: {name} is ", "encode", "a.ome.tif")
        path = self.folder / "a.ome.tif"
        self.one_file()
        whole = path.read_bytes()
        path.write_bytes(whole)
        again = image([("a.ome.tif", 0, 0, 0)] * 9, (1, 2, 16, 24))
        self.write("b.ome.tif", self.volume((2, 16, 24)), f'<OME {SCHEMA} UUID="{uuid_of("a.ome.tif")}">{again}</OME>')
        self.assert_refused(65, "the same planes again and again", "encode", "b.ome.tif")
        for old, new, said in ((b'FirstZ="1"', b'FirstZ="x"', "FirstZ is"), (b'IFD="1"', b'IFD="?"', "IFD is"), (b'PlaneCount="1"', b'PlaneCount=" "', "PlaneCount is"),
                               (b'FirstZ="1"', b'FirstZ="7"', "begins outside its image"), (b'FirstZ="1"', b'FirstZ="0"', "is in two places"),
                               (b"XYZCT", b"XYZZT", 'DimensionOrder is "XYZZT"'), (b'IFD="1"', b'IFD="9"', "gives no page to slice 2")):
            path.write_bytes(whole.replace(old, new, 1))
            self.assert_refused(65, said, "encode", "a.ome.tif")

    def test_what_the_xml_says_and_is_not_understood_is_said(self):
        modulo = '<StructuredAnnotations><XMLAnnotation ID="Annotation:0" Namespace="openmicroscopy.org/omero/dimension/modulo"><Value><Modulo>' \
                 '<ModuloAlongZ Type="angle" Start="0" End="1"/></Modulo></Value></XMLAnnotation></StructuredAnnotations>'
        for options, said in (({"more": modulo}, "splits an axis of its images in two"), ({"pixels": {"Type": "int16"}}, "OME-XML says that pages are 24 x 16 int16"),
                              ({"pixels": {"SizeX": 23}}, "OME-XML says that pages are 23 x 16 uint16"),
                              ({"pages": self.volume((3, 16, 24))}, "1 pages of its files are no slices by OME-XML")):
            self.one_file(**options)
            self.encoded("a.ome.tif", says=said)
            self.assert_refused(64, said, "encode", "a.ome.tif", "-o", "x.tag", "--max-error", "5", "--rm")
        self.one_file()
        self.encoded("a.ome.tif")
        self.assertEqual(self.messages.count("warning"), 0, self.messages)

    def test_each_image_has_its_own_spacing(self):
        truth = self.volume((1, 4, 16, 24))
        images = image([("a.ome.tif", 0, 0, 0), ("a.ome.tif", 1, 1, 0)], (1, 2, 16, 24)) + \
            image([("a.ome.tif", 2, 0, 0), ("a.ome.tif", 3, 1, 0)], (1, 2, 16, 24), {"PhysicalSizeX": "7", "PhysicalSizeXUnit": "um"})
        self.write("a.ome.tif", truth[0], f'<OME {SCHEMA} UUID="{uuid_of("a.ome.tif")}">{images}</OME>')
        for i, spacing in enumerate(([0.25, 0.5, 2], [7, 500, 2000])):
            info = self.encodes(truth[0, 2 * i:2 * i + 2], "a.ome.tif", "--series", f"i{i + 1}")
            self.assertEqual(info["geometry"]["spacing"], spacing)

    def test_slices_that_know_only_themselves_are_a_folder_of_slices(self):
        truth = self.volume((1, 3, 16, 24))
        for z in range(3):
            name = f"s{z}.ome.tif"
            self.write(f"set/{name}", [truth[0, z]], f'<OME {SCHEMA} UUID="{uuid_of(name)}">{image([(name, 0, 0, 0)], (1, 1, 16, 24))}</OME>')
        info = self.encodes(truth[0], "set")
        self.assertEqual(info["geometry"]["spacing"], [0.25, 0.5, None])  # a slice knows no other
        self.assert_found({"s#.ome.tif": truth[0]})

    def test_damaged_xml_is_an_error_and_no_more(self):
        self.reversed_set(self.volume())
        whole = (self.folder / "set/p0.ome.tif").read_bytes()
        begin, end = whole.index(b"<OME"), whole.index(b"</OME>")
        random = numpy.random.default_rng(1)
        for _ in range(12):
            broken = bytearray(whole)
            for _ in range(random.integers(1, 4)):
                broken[random.integers(begin, end)] = random.choice(list(b'<>"0129 =/Z'))
            (self.folder / "set/p0.ome.tif").write_bytes(broken)
            run = self.tagrid("encode", "set/p0.ome.tif", "-o", "a.tag", "-f", "-q")
            self.assertIn(run.returncode, (0, 64, 65), run.stderr)


if __name__ == "__main__":
    main()
