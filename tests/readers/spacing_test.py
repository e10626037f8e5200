"""Voxel sizes: what files state is what other people's libraries wrote, and what users give is what these read back."""

import math
import os
import struct
import unittest

from other_readers import ReaderTest, Image, h5py, main, nibabel, numpy, tifffile

SHAPE = (4, 9, 11)


def volume(type="uint16"):
    return numpy.random.default_rng(3).integers(0, 4096, SHAPE, dtype=type)


class Spacing(ReaderTest):
    def geometry(self, path, *options, says="", silent=False):
        """The geometry in the .tag file of a volume, and its pairs. With `silent`, nothing is said."""
        run = self.ok("encode", path, "-o", "out.tag", "-f", *options)
        self.messages = run.stderr
        self.assertIn(says, self.messages)
        if silent:
            self.assertEqual(self.messages, "")
        self.ok("decode", "out.tag", "-o", "out.nrrd", "-f")
        header = (self.folder / "out.nrrd").read_bytes().split(b"\n\n")[0].decode()
        self.pairs = dict(line.split(":=", 1) for line in header.splitlines() if ":=" in line)
        return self.info("out.tag")["geometry"]

    def assert_spacing(self, geometry, spacing, unit):
        for found, wanted in zip(geometry["spacing"], spacing):
            if wanted is None:
                self.assertIsNone(found)
            else:
                self.assertLess(abs(found - wanted), 1e-6 * wanted, geometry)
        self.assertEqual(len(geometry["spacing"]), 3)
        self.assertEqual(geometry.get("units"), None if unit is None else [unit] * 3, geometry)

    def stack(self, name="stack", **options):
        (self.folder / name).mkdir()
        for z, slice in enumerate(volume()):
            tifffile.imwrite(self.folder / name / f"slice{z:03}.tif", slice, photometric="minisblack", **options)
        return name

    def inputs_without_spacing(self):
        """Volumes of every format that may state no spacing, with their options."""
        samples = volume()
        (self.folder / "a.raw").write_bytes(samples.tobytes())
        yield "a.raw", ["--dims", "11,9,4", "--type", "uint16"]
        head = "NRRD0004\ntype: uint16\ndimension: 3\nsizes: 11 9 4\nencoding: raw\nendian: little\n\n"
        (self.folder / "a.nrrd").write_bytes(head.encode() + samples.tobytes())
        yield "a.nrrd", []
        head = "ObjectType = Image\nNDims = 3\nDimSize = 11 9 4\nElementType = MET_USHORT\nElementDataFile = LOCAL\n"
        (self.folder / "a.mha").write_bytes(head.encode() + samples.tobytes())
        yield "a.mha", []
        if tifffile:
            tifffile.imwrite(self.folder / "a.tif", samples, photometric="minisblack", metadata=None)
            yield "a.tif", []
            yield self.stack(), []
        if h5py:
            with h5py.File(self.folder / "a.h5", "w") as file:
                file["volume"] = samples
            yield "a.h5", []
        if Image:
            (self.folder / "bmp").mkdir()
            for z, slice in enumerate(volume("uint16")):
                Image.fromarray((slice >> 4).astype("uint8")).save(self.folder / "bmp" / f"s{z}.bmp")
            yield "bmp", []
            (self.folder / "png").mkdir()
            for z, slice in enumerate(volume("uint16")):
                Image.fromarray((slice >> 4).astype("uint8")).save(self.folder / "png" / f"s{z}.png")
            yield "png", []

    def test_one_number_or_three_give_every_format_a_spacing(self):
        for path, options in self.inputs_without_spacing():
            with self.subTest(path=path):
                for text, spacing, unit in (("10um", [10, 10, 10], "um"), ("0.5,0.25,1.25mm", [0.5, 0.25, 1.25], "mm"),
                                            ("2micron", [2, 2, 2], "um"), ("1\u00b5m", [1, 1, 1], "um"), ("1in", [1, 1, 1], "inch"),
                                            ("3e-3,3e-3,4e-3 cm", [3e-3, 3e-3, 4e-3], "cm"), ("1.5um,1.5um,3um", [1.5, 1.5, 3], "um")):
                    self.assert_spacing(self.geometry(path, *options, "--spacing", text, silent=True), spacing, unit)
                if nibabel:
                    self.geometry(path, *options, "--spacing", "20,20,50um")
                    self.ok("decode", "out.tag", "-o", "out.nii", "-f")
                    image = nibabel.load(self.folder / "out.nii")
                    lengths = dict(mm=1e-3, micron=1e-6, meter=1)[image.header.get_xyzt_units()[0]]
                    numpy.testing.assert_allclose(numpy.array(image.header.get_zooms()) * lengths, [2e-5, 2e-5, 5e-5], rtol=1e-6)
                # The original with and without the given spacing.
                self.ok("verify", "out.tag", "--against", path, *options)
                self.ok("verify", "out.tag", "--against", path, *options, "--spacing", "20,20,50um")
                self.ok("estimate", path, *options, "--spacing", "20um", "--errors", "0")
                # It is in the output, so the record of it is no loss.
                self.geometry(path, *options, "--spacing", "0.5,0.5,1.25mm")
                for name in ("out.tif", "out.nii", "out.mha", "out.vti"):
                    self.assertNotIn("given spacing", self.ok("decode", "out.tag", "-o", name, "-f").stderr, name)

    def test_other_texts_are_refused(self):
        (self.folder / "a.raw").write_bytes(volume().tobytes())
        for text in ("1,2", "1,2um", "0", "-1", "1,0,1", "nan", "inf", "1,1,inf", "um", "1parsec", "1,1,1,1", "", "1um,2,3", "1um,1um,1mm",
                     "1um,1,1um", "0,5mm"):
            for option in ("--spacing", "--override-spacing"):
                run = self.tagrid("encode", "a.raw", "--dims", "11,9,4", "--type", "uint16", f"{option}={text}", "-f")
                if text:
                    self.assertEqual(run.returncode, 64, (text, run.stderr))
        self.assertIn("decimal point", self.tagrid("encode", "a.raw", "--spacing=0,5mm").stderr)
        self.assert_refused(64, "only one", "encode", "a.raw", "--dims", "11,9,4", "--type", "uint16", "--spacing", "1", "--override-spacing", "1")

    def test_what_is_missing_is_said_once(self):
        for path, options in self.inputs_without_spacing():
            if path in ("a.raw", "a.nrrd", "a.mha"):
                self.geometry(path, *options, silent=True)
                continue
            with self.subTest(path=path):
                self.geometry(path, *options, says="--spacing")
                self.assertEqual(self.messages.count("warning"), 1, self.messages)
                self.assertIn("its voxel size is not stated", self.messages)
                self.geometry(path, *options, "-q", silent=True)
                if path in ("a.tif", "stack", "a.h5", "bmp", "png"):
                    self.geometry(path, *options, "--spacing", "7", says="its voxel size has no unit; add it with --spacing, such as --spacing 7,7,7um")

    def write_nrrd(self, lines):
        head = f"NRRD0005\ntype: uint16\ndimension: 3\nsizes: 11 9 4\nencoding: raw\nendian: little\n{lines}\n"
        (self.folder / "a.nrrd").write_bytes(head.encode() + volume().tobytes())

    def test_another_spacing_is_refused_or_overridden(self):
        self.write_nrrd("spacings: 0.5 0.5 2\nunits: \"mm\" \"mm\" \"mm\"\nkey:=value\n")
        message = self.assert_refused(64, "states the spacing 0.5 0.5 2 mm, but --spacing is 10 10 10 um", "encode", "a.nrrd", "--spacing", "10um")
        self.assertIn("--override-spacing", message)
        said = "its spacing 0.5 0.5 2 mm is replaced by 10 10 10 um"
        self.assert_spacing(self.geometry("a.nrrd", "--override-spacing", "10um", says=said), [10, 10, 10], "um")
        self.assertEqual(self.pairs, {"key": "value", "given spacing": "10 10 10 um", "overridden spacing": "0.5 0.5 2 mm"})
        self.ok("verify", "out.tag", "--against", "a.nrrd")
        self.ok("verify", "out.tag", "--against", "out.nrrd")
        # Encoded anew, the record stays, and nothing is said.
        self.assert_spacing(self.geometry("out.nrrd", silent=True), [10, 10, 10], "um")
        self.assertEqual(self.pairs["overridden spacing"], "0.5 0.5 2 mm")
        # Another original is another one.
        self.write_nrrd("spacings: 0.5 0.5 3\nunits: \"mm\" \"mm\" \"mm\"\n")
        self.assertEqual(self.tagrid("verify", "out.tag", "--against", "a.nrrd").returncode, 65)
        # The unit of the file, if none is given; and metadata that are stripped.
        self.assert_spacing(self.geometry("a.nrrd", "--override-spacing", "4", "--strip"), [4, 4, 4], "mm")
        self.ok("verify", "out.tag", "--against", "a.nrrd")

    def test_what_agrees_is_completed(self):
        self.write_nrrd("spacings: 0.5 0.5 2\nunits: \"mm\" \"mm\" \"mm\"\n")
        for option in ("--spacing", "--override-spacing"):
            self.assert_spacing(self.geometry("a.nrrd", option, "500,500,2000um", silent=True), [0.5, 0.5, 2], "mm")
            self.assertEqual(self.pairs, {})
        self.write_nrrd("spacings: 0.5 0.5 2\n")
        self.assert_spacing(self.geometry("a.nrrd", "--spacing", "0.5,0.5,2mm", silent=True), [0.5, 0.5, 2], "mm")
        self.write_nrrd("spacings: 0.5 0.5 nan\nunits: \"mm\" \"mm\" \"mm\"\n")
        self.assert_spacing(self.geometry("a.nrrd", "--spacing", "500,500,750um", silent=True), [500, 500, 750], "um")
        self.assert_refused(64, "0.5 0.5 unknown mm", "encode", "a.nrrd", "--spacing", "0.6mm")

    @unittest.skipIf(nibabel is None, "there is no nibabel on this machine")
    def test_directions_are_scaled_and_the_origin_keeps_its_place(self):
        turn = math.radians(30)
        affine = numpy.array([[2 * math.cos(turn), -3 * math.sin(turn), 0, 100], [2 * math.sin(turn), 3 * math.cos(turn), 0, -50], [0, 0, 4, 7],
                              [0, 0, 0, 1.0]])
        image = nibabel.Nifti1Image(volume().T.astype("int16"), affine)
        image.header.set_xyzt_units("mm")
        nibabel.save(image, self.folder / "a.nii")
        self.geometry("a.nii", "--override-spacing", "20,30,40um", says="is replaced by 20 30 40 um")
        self.ok("verify", "out.tag", "--against", "a.nii")
        self.ok("decode", "out.tag", "-o", "b.nii")
        found = nibabel.load(self.folder / "b.nii")
        scale = {"mm": 1, "micron": 1e-3}[found.header.get_xyzt_units()[0]]
        wanted = affine.copy()
        wanted[:3, :3] /= 100
        numpy.testing.assert_allclose(found.affine[:3] * scale, wanted[:3], rtol=1e-5, atol=1e-6)
        numpy.testing.assert_allclose(numpy.array(found.header.get_zooms()) * scale, [0.02, 0.03, 0.04], rtol=1e-5)

    def test_lists_of_convert_have_these_options(self):
        self.write_nrrd("spacings: 0.5 0.5 2\nunits: \"mm\" \"mm\" \"mm\"\n")
        os.rename(self.folder / "a.nrrd", self.folder / "b.nrrd")
        self.write_nrrd("")
        (self.folder / "list.tsv").write_text("a.nrrd\tspacing=12.5um\nb.nrrd\toverride-spacing=1,1,4mm\n")
        self.ok("convert", "--manifest", "list.tsv", "--output-dir", "out")
        self.assert_spacing(self.info("out/a.tag")["geometry"], [12.5] * 3, "um")
        self.assert_spacing(self.info("out/b.tag")["geometry"], [1, 1, 4], "mm")
        (self.folder / "list.tsv").write_text("b.nrrd\tspacing=12.5um\n")
        run = self.tagrid("convert", "--manifest", "list.tsv", "--output-dir", "other")
        self.assertNotEqual(run.returncode, 0)
        self.assertIn("--override-spacing", run.stderr)

    @unittest.skipIf(tifffile is None, "there is no tifffile on this machine")
    def test_resolutions_of_tiff_are_distances_unless_they_are_those_of_paper(self):
        def file(x, y, unit, **options):
            tifffile.imwrite(self.folder / "a.tif", volume(), photometric="minisblack", resolution=(x, y), resolutionunit=unit,
                             metadata=options.pop("metadata", None), **options)
            return "a.tif"

        z = "a.tif: the distance between its slices is not stated; meshes and other programs assume 1; add it with --spacing"
        self.assert_spacing(self.geometry(file(1000, 500, "CENTIMETER"), says=z), [0.01, 0.02, None], "mm")
        self.assert_spacing(self.geometry(file(1000, 500, "CENTIMETER"), "--spacing", "10,20,30um", silent=True), [10, 20, 30], "um")
        self.assert_spacing(self.geometry(file(2540, 2540, "INCH"), says=z), [0.01, 0.01, None], "mm")
        self.assert_refused(64, "0.01 0.01 unknown mm", "encode", "a.tif", "--spacing", "11um")
        self.assert_spacing(self.geometry("a.tif", "--override-spacing", "11um", says="replaced"), [11, 11, 11], "um")
        self.ok("verify", "out.tag", "--against", "a.tif")
        for dpi in (72, 96, 150, 300, 600, 1200):
            for name, resolution in (("INCH", dpi), ("CENTIMETER", round(dpi / 2.54, 2))):
                geometry = self.geometry(file(resolution, resolution, name), says="dpi is treated as a print resolution, not as a voxel size")
                self.assertIsNone(geometry["spacing"])
                self.assertIn("its voxel size is not stated", self.messages)
        self.assertIsNone(self.geometry(file(1000, 1000, "NONE"), says="has no unit")["spacing"])
        self.assertIsNone(self.geometry(file(1, 1, "INCH"), says="its voxel size is not stated")["spacing"])
        # ImageJ keeps what other programs wrote.
        imagej = dict(imagej=True, metadata={"axes": "ZYX", "unit": "inch", "spacing": 1.0})
        self.assertIsNone(self.geometry(file(300, 300, "INCH", **imagej), says="300 dpi is treated as a print resolution")["spacing"])
        imagej["metadata"] = {"axes": "ZYX", "spacing": 0.003}
        self.assert_spacing(self.geometry(file(1000, 1000, "CENTIMETER", **imagej), silent=True), [0.01, 0.01, 0.03], "mm")

    @unittest.skipIf(tifffile is None, "there is no tifffile on this machine")
    def test_the_example_in_the_warning_is_taken_when_its_letters_are_replaced(self):
        tifffile.imwrite(self.folder / "a.tif", volume(), photometric="minisblack", resolution=(400, 200), resolutionunit="CENTIMETER", metadata=None)
        self.geometry("a.tif", says="such as --spacing 0.025,0.05,Zmm with a number for Z")
        self.assert_spacing(self.geometry("a.tif", "--spacing", "0.025,0.05,0.1mm", silent=True), [0.025, 0.05, 0.1], "mm")
        self.geometry("a.tif", "--override-spacing", "10um", says="its spacing 0.025 0.05 unknown mm is replaced by 10 10 10 um")
        self.assertEqual(self.pairs["overridden spacing"], "0.025 0.05 nan mm")
        self.ok("verify", "out.tag", "--against", "a.tif")
        self.assert_refused(64, "states the spacing 0.025 0.05 unknown mm", "encode", "a.tif", "--spacing", "10um")

    @unittest.skipIf(tifffile is None, "there is no tifffile on this machine")
    def test_pages_with_different_resolutions_state_none(self):
        described = {"plain": None, "imagej": "ImageJ=1.11a\nimages=4\nslices=4\nunit=mm\nspacing=0.5\n"}
        for name, description in described.items():
            for resolutions, wanted in (((400, 400, 400, 400), True), ((400, 400, 400.001, 400), True), ((400, 400, 800, 800), False),
                                        ((400, None, None, None), True), ((72, 72, 400, 400), False)):
                with tifffile.TiffWriter(self.folder / "a.tif") as file:
                    for page, resolution in zip(volume(), resolutions):
                        options = {} if resolution is None else {"resolution": (resolution, resolution), "resolutionunit": "CENTIMETER"}
                        file.write(page, photometric="minisblack", metadata=None, description=description, **options)
                        description = None
                description = described[name]
                with self.subTest(name=name, resolutions=resolutions):
                    geometry = self.geometry("a.tif")
                    self.assertEqual("a.tif: its slices have different spacings, so the spacing is unknown" in self.messages, not wanted, self.messages)
                    self.assertEqual(geometry["spacing"] is not None, wanted)

    @unittest.skipIf(tifffile is None, "there is no tifffile on this machine")
    def test_a_directory_of_slices_has_the_spacing_of_its_files(self):
        geometry = self.geometry(self.stack("a", resolution=(2000, 2000), resolutionunit="CENTIMETER", metadata=None),
                                 says="a: the distance between its slices is not stated")
        self.assert_spacing(geometry, [0.005, 0.005, None], "mm")
        self.assertEqual(self.messages.count("warning"), 1)
        self.geometry(self.stack("b", resolution=(300, 300), resolutionunit="INCH", metadata=None), says="b: its resolution of 300 dpi")
        self.assertEqual(self.messages.count("warning"), 2, self.messages)
        self.assert_spacing(self.geometry("b", "--spacing", "5um"), [5, 5, 5], "um")

    @unittest.skipIf(tifffile is None, "there is no tifffile on this machine")
    def test_the_log_of_skyscan_may_have_one_size_only(self):
        self.stack("s", metadata=None)
        log = self.folder / "s" / "slice.log"
        log.write_text("[Acquisition]\nImage Pixel Size (um)=9\n[Reconstruction]\nPixel Size (um)=4.5\n")
        self.assert_spacing(self.geometry("s", silent=True), [4.5] * 3, "um")
        log.write_text("[Acquisition]\nImage Pixel Size (um)=9\n[Reconstruction]\nSection to Section Step=2\n")
        self.assert_spacing(self.geometry("s", says="Image Pixel Size (um) = 9 is used instead"), [9, 9, 18], "um")
        self.assert_refused(64, "states the spacing 9 9 18 um", "encode", "s", "--spacing", "9um")
        log.write_text("[Acquisition]\nImage Pixel Size (um)=9\n")
        self.assertIsNone(self.geometry("s", says="its voxel size is not stated")["spacing"])
        # The resolution of a page does not matter where the log has the size.
        (self.folder / "dpi").mkdir()
        for z, slice in enumerate(volume()):
            tifffile.imwrite(self.folder / "dpi" / f"slice{z:03}.tif", slice, photometric="minisblack", metadata=None, resolution=(72, 72), resolutionunit="INCH")
        self.assertIsNone(self.geometry("dpi", says="its resolution of 72 dpi")["spacing"])
        (self.folder / "dpi" / "slice.log").write_text("[Acquisition]\nImage Pixel Size (um)=9\n[Reconstruction]\nPixel Size (um)=4.5\n")
        self.assert_spacing(self.geometry("dpi", silent=True), [4.5] * 3, "um")

    @unittest.skipIf(tifffile is None, "there is no tifffile on this machine")
    def test_units_of_imagej(self):
        for unit, wanted in (("um", "um"), ("\\u00B5m", "um"), ("micron", "um"), ("mm", "mm"), ("cm", "cm"), ("nm", "nm")):
            tifffile.imwrite(self.folder / "a.tif", volume(), imagej=True, resolution=(4, 4), metadata={"axes": "ZYX", "unit": unit, "spacing": 0.75})
            self.assert_spacing(self.geometry("a.tif", silent=True), [0.25, 0.25, 0.75], wanted)
        tifffile.imwrite(self.folder / "a.tif", volume(), imagej=True, metadata={"axes": "ZYX", "unit": "pixel"})
        self.assertIsNone(self.geometry("a.tif", says="its voxel size is not stated")["spacing"])

    @unittest.skipIf(tifffile is None, "there is no tifffile on this machine")
    def test_sizes_in_ome_xml(self):
        sizes = {"PhysicalSizeX": 0.5, "PhysicalSizeXUnit": "\u00b5m", "PhysicalSizeY": 0.5, "PhysicalSizeYUnit": "\u00b5m", "PhysicalSizeZ": 0.002,
                 "PhysicalSizeZUnit": "mm"}
        tifffile.imwrite(self.folder / "a.ome.tif", volume(), metadata={"axes": "ZYX", **sizes})
        self.assert_spacing(self.geometry("a.ome.tif", silent=True), [0.5, 0.5, 2], "um")
        tifffile.imwrite(self.folder / "b.ome.tif", volume(), resolution=(2000, 2000), resolutionunit="CENTIMETER", metadata={"axes": "ZYX"})
        self.assert_spacing(self.geometry("b.ome.tif", says="--spacing"), [0.005, 0.005, None], "mm")

    @unittest.skipIf(Image is None, "there is no PIL on this machine")
    def test_the_capture_resolution_of_jpeg_2000(self):
        image = Image.fromarray(volume()[0].astype("uint8"))
        image.save(self.folder / "plain.jp2")
        plain = (self.folder / "plain.jp2").read_bytes()
        at = plain.index(b"jp2h") - 4
        size = struct.unpack(">I", plain[at:at + 4])[0]

        def box(name, content):
            return struct.pack(">I", 8 + len(content)) + name + content

        def with_resolution(kind, y, x, power):
            resolution = box(b"res ", box(kind, struct.pack(">HHHHbb", y, 1, x, 1, power, power)))
            (self.folder / "a.jp2").write_bytes(plain[:at] + struct.pack(">I", size + len(resolution)) + plain[at + 4:at + size] + resolution +
                                                plain[at + size:])
            return "a.jp2"

        self.assert_spacing(self.geometry(with_resolution(b"resc", 500, 1000, 2), says="the distance between"), [0.01, 0.02, None], "mm")
        self.assertIsNone(self.geometry(with_resolution(b"resc", 11811, 11811, 0), says="300 dpi is treated")["spacing"])
        self.assertIsNone(self.geometry(with_resolution(b"resd", 500, 1000, 2), says="its voxel size is not stated")["spacing"])
        self.assertIsNone(self.geometry("plain.jp2", says="its voxel size is not stated")["spacing"])


if __name__ == "__main__":
    main()
