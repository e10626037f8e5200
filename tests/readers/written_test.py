"""What decode writes: other people's libraries read the same samples and the same geometry, and tagrid reads them again.

    written_test.py PROGRAM
"""

import itertools
import os
import re
import shutil
import struct
import subprocess
import unittest

from other_readers import PROGRAM, ReaderTest, h5py, main, nibabel, numpy, tifffile

TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64"]
OBLIQUE = [[0.4, 0.3, 0], [-0.3, 0.4, 0], [0, 0, 2.5]]
SHEARED = [[0.5, 0, 0], [0, 0.5, 0], [0.1, 0.2, 2.5]]


@unittest.skipIf(numpy is None, "there is no numpy on this machine")
class Written(ReaderTest):
    def encode(self, type="int16", space="left-posterior-superior", directions=OBLIQUE, origin=(10, -20, 30.5), shape=(5, 19, 23), pairs=""):
        random = numpy.random.default_rng(1)
        samples = (random.standard_normal(shape) * 100).astype(type)
        lines = []
        if directions is not None:
            lines = [f"space: {space}" if space else "space dimension: 3",
                      "space directions: " + " ".join(f"({','.join(map(str, d))})" for d in directions),
                      f"space origin: ({','.join(map(str, origin))})", 'space units: "mm" "mm" "mm"']
        elif space == "spacing":
            lines = ["spacings: 0.5 0.25 3", 'units: "um" "um" "um"']
        self.write_nrrd("a.nrrd", samples, "".join(line + "\n" for line in lines) + pairs)
        self.ok("encode", "a.nrrd", "-o", "a.tag", "-f")
        return samples

    def decode(self, name, *options):
        return self.ok("decode", "a.tag", "-o", name, "-f", *options).stderr

    def test_samples_come_back_from_every_format_and_type(self):
        for type, name in itertools.product(TYPES, ("b.nii", "b.nii.gz", "b.mha", "b.mhd", "b.tif", "b.vti")):
            truth = self.encode(type)
            self.decode(name)
            if not name.endswith(".vti"):
                self.encodes(truth, name, "--range", "auto", what=f"{type} {name}")
            if name.endswith(".tif") and tifffile:
                self.assert_same(tifffile.imread(self.folder / name), truth, type)
            if ".nii" in name and nibabel:
                image = nibabel.load(self.folder / name)
                self.assert_same(numpy.asanyarray(image.dataobj).transpose(2, 1, 0), truth, type)

    def test_a_pipe_gets_the_same_bytes(self):
        self.encode()
        for format, name in (("nifti", "b.nii"), ("nifti.gz", "b.nii.gz"), ("metaimage", "b.mha"), ("tiff", "b.tif"), ("vti", "b.vti")):
            self.decode(name)
            run = subprocess.run(f"{PROGRAM} decode - -o - --format {format} < a.tag | cmp - {name}", shell=True,
                                 cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            self.assertEqual(run.returncode, 0, run.stdout)

    def test_geometry_comes_back(self):
        for space, directions in itertools.product(("left-posterior-superior", "right-anterior-superior", "LPS", "left-anterior-superior"),
                                                   (OBLIQUE, SHEARED)):
            self.encode(space=space, directions=directions)
            # The signs of the world's axes, as right-anterior-superior has them.
            signs = numpy.array([-1 if space.lower()[0] == "l" else 1, -1 if "p" in space.lower().replace("superior", "") else 1, 1])
            affine = numpy.eye(4)
            affine[:3, :3] = numpy.array(directions).T * signs[:, None]
            affine[:3, 3] = numpy.array((10, -20, 30.5)) * signs
            self.decode("b.nii")
            if nibabel:
                image = nibabel.load(self.folder / "b.nii")
                numpy.testing.assert_allclose(image.affine, affine, atol=1e-5)
                if directions is OBLIQUE:
                    numpy.testing.assert_allclose(image.header.get_qform(), affine, atol=1e-5)
            geometry = self.encoded("b.nii")[1]["geometry"]
            numpy.testing.assert_allclose(numpy.array(geometry["directions"]).T, affine[:3, :3], atol=1e-6)
            self.assertEqual(geometry["units"], ["mm"] * 3)
            self.decode("b.mha")
            geometry = self.encoded("b.mha")[1]["geometry"]
            lps = numpy.array([-1, -1, 1])
            numpy.testing.assert_allclose(numpy.array(geometry["directions"]).T, affine[:3, :3] * lps[:, None], atol=1e-12)
            numpy.testing.assert_allclose(geometry["origin"], affine[:3, 3] * lps, atol=1e-12)
            if shutil.which("plastimatch") and directions is OBLIQUE:
                subprocess.run(["plastimatch", "convert", "--input", "b.mha", "--output-img", "itk.nrrd"], cwd=self.folder, check=True,
                               stdout=subprocess.DEVNULL)
                itk = self.encoded("itk.nrrd")[1]["geometry"]
                numpy.testing.assert_allclose(itk["directions"], geometry["directions"], atol=1e-6)

    def test_a_mirrored_volume_in_nifti(self):
        self.encode(space="right-anterior-superior", directions=[[0.4, 0.3, 0], [-0.3, 0.4, 0], [0, 0, -2.5]])
        self.decode("b.nii")
        if nibabel:
            header = nibabel.load(self.folder / "b.nii").header
            numpy.testing.assert_allclose(header.get_qform(), header.get_sform(), atol=1e-5)

    def test_spacing_alone(self):
        self.encode(directions=None, space="spacing")
        for name in ("b.nii", "b.mha", "b.tif"):
            self.decode(name)
            geometry = self.encoded(name)[1]["geometry"]
            # MetaImage means millimeters.
            factor = 1e-3 if name == "b.mha" else 1
            numpy.testing.assert_allclose(geometry["spacing"], numpy.array([0.5, 0.25, 3]) * factor, rtol=1e-6, err_msg=name)
            self.assertEqual(geometry["units"], ["mm" if name == "b.mha" else "um"] * 3, name)
            # NIfTI must say where a volume lies, or every program puts it elsewhere. MetaImage that does not say it lies
            # along the axes of its space.
            is_nifti, has_place = name == "b.nii", name != "b.tif"
            directions = numpy.diag([0.5, 0.25, 3]) * factor
            self.assertEqual(geometry["directions"], directions.tolist() if has_place else None, name)
            self.assertEqual(geometry["origin"], [0, 0, 0] if has_place else None, name)
            if is_nifti and nibabel:
                header = nibabel.load(self.folder / name).header
                self.assertEqual((int(header["sform_code"]), int(header["qform_code"])), (2, 2), "aligned to something")

    def affine_of(self, name):
        """Places of samples, as a file says them to others."""
        path = self.folder / name
        affine = numpy.eye(4)
        if name.endswith(".nii"):
            return nibabel.load(path).affine
        if name.endswith(".h5"):
            attributes = h5py.File(path)["volume"].attrs
            affine[:3, :3] = attributes["directions"].T if "directions" in attributes else numpy.diag(attributes["spacing"])
            affine[:3, 3] = attributes.get("origin", [0, 0, 0])
            return affine
        if name.endswith(".vtkhdf"):
            fields = dict(h5py.File(path)["VTKHDF"].attrs)
            spacing, direction, origin = fields["Spacing"], fields["Direction"].reshape(3, 3), fields["Origin"]
        else:
            text = path.read_bytes()[:2000].decode("latin-1")
            def numbers(pattern, otherwise):
                found = re.search(pattern, text)
                return numpy.array([float(n) for n in found[1].split()] if found else otherwise)
            is_meta = name.endswith(".mha")
            spacing = numbers("ElementSpacing = (.*)" if is_meta else 'Spacing="([^"]*)"', [1, 1, 1])
            origin = numbers("Offset = (.*)" if is_meta else 'Origin="([^"]*)"', [0, 0, 0])
            direction = numbers("TransformMatrix = (.*)" if is_meta else 'Direction="([^"]*)"', [1, 0, 0, 0, 1, 0, 0, 0, 1]).reshape(3, 3)
            direction = direction.T if is_meta else direction  # ITK has a row for each axis of the volume
        affine[:3, :3] = direction * spacing
        affine[:3, 3] = origin
        return affine

    @unittest.skipIf(None in (numpy, nibabel, h5py), "libraries are missing")
    def test_a_part_lies_in_the_whole_in_every_format(self):
        volumes = {"nothing": dict(directions=None, space=""), "spacing": dict(directions=None, space="spacing"),
                   "some spacing": dict(directions=None, space="", pairs="spacings: 0.5 nan 3\n"),
                   "oblique": dict(), "sheared": dict(directions=SHEARED, space="right-anterior-superior")}
        for (what, volume), name in itertools.product(volumes.items(), ("nii", "mha", "vti", "vtkhdf", "h5")):
            if name == "h5" and what in ("nothing", "some spacing"):
                continue  # unknown spacing stays unknown
            self.encode(**volume)
            self.decode(f"whole.{name}")
            whole = self.affine_of(f"whole.{name}")
            for region, step, first in (("10:20,:,2:5", 1, (10, 0, 2)), ("3:,5:9,:", 1, (3, 5, 0)), ("5:,4:,1:", 2, (6, 4, 2))):
                if step > 1 and what in ("nothing", "some spacing"):
                    continue  # an unknown spacing counts as 1 in the part, too
                self.decode(f"part.{name}", "--region", region, "--step", step)
                part = self.affine_of(f"part.{name}")
                expected = whole @ numpy.diag([step, step, step, 1])
                expected[:, 3] = whole @ (*first, 1)
                numpy.testing.assert_allclose(part, expected, rtol=1e-6, atol=1e-5, err_msg=f"{what} {name} {region}")

    @unittest.skipIf(nibabel is None, "there is no nibabel")
    def test_a_nifti_file_without_a_form_gets_none(self):
        samples = numpy.arange(60, dtype="int16").reshape(3, 4, 5)
        image = nibabel.Nifti1Image(samples, None)
        image.header.set_zooms((0.5, 0.25, 3))
        nibabel.save(image, self.folder / "a.nii")
        self.ok("encode", "a.nii", "-o", "a.tag")
        self.decode("b.nii")
        header, affine = nibabel.load(self.folder / "b.nii").header, nibabel.load(self.folder / "b.nii").affine
        self.assertEqual((int(header["sform_code"]), int(header["qform_code"])), (0, 0))
        numpy.testing.assert_array_equal(affine, nibabel.load(self.folder / "a.nii").affine)

    def test_what_is_lost_is_said(self):
        self.encode(space="")
        self.assertIn("not known", self.decode("b.nii"))
        self.assertIn("not known", self.decode("b.mha"))
        self.assertIn("no place for positions", self.decode("b.tif"))
        self.assertNotIn("space", self.decode("b.vti"))
        self.encode(pairs="rescale_slope:=2.5\nrescale_intercept:=0\n")
        self.assertIn("slope", self.decode("b.vti"))
        self.assertNotIn("slope", self.decode("b.tif"))
        self.encode("float32", pairs="rescale_slope:=2.5\nrescale_intercept:=0\nrescale_units:=mg/cm3\n")
        self.assertIn("TIFF has no place for slope", self.decode("b.tif"))
        self.assertIn("values are in \"mg/cm3\"", self.decode("b.tif"))
        self.encode(pairs="rescale_units:=mg/cm3\n")
        self.assertNotIn("mg/cm3", self.decode("b.tif"))
        for name in ("b.nii", "b.nii.gz", "b.mha", "b.mhd", "b.vti"):
            self.assertIn("values are in \"mg/cm3\" (rescale_units)", self.decode(name), name)
        for name in ("b.nrrd", "b.h5", "b.vtkhdf"):
            self.assertNotIn("mg/cm3", self.decode(name), name)
        self.encode(pairs="metaimage_ElementDataFile:=other.raw\nmetaimage_DimSize:=1 1 1\nmetaimage_headersize:=9\n")
        self.decode("b.mha")
        self.assertNotIn(b"other.raw", (self.folder / "b.mha").read_bytes())
        self.encoded("b.mha")
        self.encode()
        for name in ("b.nii", "b.nii.gz", "b.mha", "b.mhd", "b.nrrd"):
            self.assertEqual(self.decode(name), "", name)

    def test_fields_of_the_same_format_come_back(self):
        self.encode(pairs="metaimage_Modality:=MET_MOD_CT\nrescale_slope:=2.5\nrescale_intercept:=-7\nnifti_descrip:=a scan\nnifti_cal_max:=9\n")
        self.decode("b.mha")
        text = (self.folder / "b.mha").read_bytes()
        self.assertIn(b"\nModality = MET_MOD_CT\n", text)
        self.assertIn(b"\nElementToIntensityFunctionSlope = 2.5\nElementToIntensityFunctionOffset = -7\n", text)
        self.decode("b.nii")
        pairs = self.encoded("b.nii")[1]["source"]["pairs"]
        self.assertEqual((pairs["rescale_slope"], pairs["rescale_intercept"], pairs["nifti_descrip"], pairs["nifti_cal_max"]),
                         ("2.5", "-7", "a scan", "9"))

    @unittest.skipIf(tifffile is None, "there is no tifffile on this machine (python3-tifffile)")
    def test_tiff_has_the_calibration_of_image_j(self):
        for type, slope, intercept in itertools.product(("uint8", "uint16", "int16"), (1, 2.5), (0, -1024)):
            pairs = f"rescale_slope:={slope}\nrescale_intercept:={intercept}\nrescale_units:=HU\n"
            truth = self.encode(type, directions=None, space="spacing", pairs=pairs if (slope, intercept) != (1, 0) else "rescale_units:=HU\n")
            said = self.decode("b.tif", "--samples")
            self.assertEqual(said, "", type)
            with tifffile.TiffFile(self.folder / "b.tif") as file:
                known, tags = file.imagej_metadata, file.pages[0].tags
                self.assertEqual((known["spacing"], known["unit"], known["vunit"], known["cf"]), (3, "um", "HU", 0))
                # ImageJ calibrates signed numbers as the unsigned ones that it has in memory.
                self.assertEqual((known["c1"], known["c0"]), (slope, intercept - (32768 * slope if type == "int16" else 0)))
                x, y = tags["XResolution"].value, tags["YResolution"].value
                self.assertAlmostEqual(x[0] / x[1], 1 / 0.5, places=6)
                self.assertAlmostEqual(y[0] / y[1], 1 / 0.25, places=6)
                self.assertEqual(int(tags["ResolutionUnit"].value), 1)
            info = self.encodes(truth, "b.tif", what=type)
            found = info["source"]["pairs"]
            self.assertEqual((float(found.get("rescale_slope", 1)), float(found.get("rescale_intercept", 0)), found["rescale_units"]),
                             (slope, intercept, "HU"), type)
        # Nobody else would read these as they are here.
        for type, pairs, words in (("uint16", "rescale_slope:=1\nrescale_intercept:=-32768\n", "is read as int16"),
                                   ("int16", "rescale_slope:=0.1\nrescale_intercept:=0.3\n", "TIFF rounds the intercept")):
            self.encode(type, pairs=pairs)
            self.assertIn(words, self.decode("b.tif", "--samples"))
        # Slices with slopes of their own have no common one.
        self.encode(pairs="slice_slopes:=1 2 1 2 1\nslice_intercepts:=0 0 0 0 0\nrescale_slope:=2\nrescale_intercept:=0\n")
        self.assertIn("slice_slopes", self.decode("b.tif"))
        self.assertNotIn(b"cf=", (self.folder / "b.tif").read_bytes())

    def test_a_program_writes_for_a_pipe_where_spool_says(self):
        self.encode()
        for options, folder in (((), "/nowhere-to-be"), (("--spool", "/not-here-either"), "/not-here-either")):
            run = subprocess.run([PROGRAM, "decode", "a.tag", "-o", "-", "--format", "hdf5", *options], cwd=self.folder,
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "TMPDIR": "/nowhere-to-be"})
            self.assertEqual(run.returncode, 74, run.stderr)
            self.assertIn(f"temporary file in {folder}".encode(), run.stderr)
        self.decode("b.h5")
        (self.folder / "spool").mkdir()
        run = subprocess.run([PROGRAM, "decode", "a.tag", "-o", "-", "--format", "hdf5", "--spool", "spool"],
                             cwd=self.folder,
                             stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "TMPDIR": "/nowhere-to-be"})
        self.assertEqual((run.returncode, run.stderr), (0, b""))
        self.assertEqual(run.stdout, (self.folder / "b.h5").read_bytes())

    def test_wide_volumes_in_nifti_2(self):
        truth = self.encode(shape=(1, 2, 40000))
        self.decode("b.nii")
        self.assertEqual((self.folder / "b.nii").read_bytes()[:4], struct.pack("<i", 540))
        self.encodes(truth, "b.nii")
        if nibabel:
            self.assertEqual(nibabel.load(self.folder / "b.nii").shape, (40000, 2, 1))

    def test_image_data_of_vtk(self):
        truth = self.encode()
        self.decode("b.vti")
        text = (self.folder / "b.vti").read_bytes()
        start = text.index(b"<AppendedData encoding=\"raw\">\n_") + 31
        self.assertEqual(struct.unpack("<Q", text[start:start + 8])[0], truth.nbytes)
        self.assertEqual(text[start + 8:start + 8 + truth.nbytes], truth.tobytes())
        self.assertEqual(text[start + 8 + truth.nbytes:], b"\n</AppendedData>\n</VTKFile>\n")
        head = text[:start].decode()
        self.assertIn('WholeExtent="0 22 0 18 0 4" Origin="10 -20 30.5" Spacing="0.5 0.5 2.5"', head)
        direction = [float(n) for n in re.search(r'Direction="([^"]*)"', head)[1].split()]
        numpy.testing.assert_allclose(numpy.array(direction).reshape(3, 3), [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]], atol=1e-12)
        self.assertIn('type="Int16" Name="value"', head)

    def test_regions_and_steps(self):
        truth = self.encode()
        for name in ("b.nii", "b.mha", "b.tif"):
            self.decode(name, "--region", "2:12,4:10,1:4", "--step", "2")
            self.encodes(truth[2:4:2, 4:10:2, 2:12:2], name, what=name)

    def test_big_tiff_beyond_4_gb(self):
        """By a volume of one value, whose samples are holes in a file of 4.3 GB."""
        run = subprocess.run(f"head -c {1100 * 2000 * 2000} /dev/zero | {PROGRAM} encode -q --grid derived --dims 2000,2000,1100 --type uint8 - -o big.tag",
                             shell=True, cwd=self.folder, stderr=subprocess.PIPE, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        run = subprocess.run(f"{PROGRAM} decode big.tag -o - --format tiff | head -c 1000000 > head.tif", shell=True,
                             cwd=self.folder, stderr=subprocess.PIPE, text=True)
        head = (self.folder / "head.tif").read_bytes()
        self.assertEqual(head[:8], b"II\x2b\0\x08\0\0\0")
        at, offsets = struct.unpack("<Q", head[8:16])[0], []
        while at:
            count = struct.unpack("<Q", head[at:at + 8])[0]
            fields = {struct.unpack("<H", head[at + 8 + 20 * i:at + 10 + 20 * i])[0]: struct.unpack("<Q", head[at + 20 + 20 * i:at + 28 + 20 * i])[0]
                      for i in range(count)}
            offsets.append(fields[273])
            at = struct.unpack("<Q", head[at + 8 + 20 * count:at + 16 + 20 * count])[0]
        self.assertEqual(len(offsets), 1100)
        self.assertEqual({b - a for a, b in zip(offsets, offsets[1:])}, {4000000})


if __name__ == "__main__":
    main()
