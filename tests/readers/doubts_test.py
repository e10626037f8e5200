"""What encode was in doubt about is in the .tag file, and nothing is said of values that nobody knows."""

import shutil
import subprocess
import unittest

from other_readers import PROGRAM, ReaderTest, h5py, main, nibabel, numpy, pydicom, tifffile
from scans import data_set

SHAPE = (8, 9, 10)


@unittest.skipIf(None in (numpy, pydicom, tifffile, h5py, nibabel), "libraries are missing")
class Doubts(ReaderTest):
    def samples(self, type="uint16", high=3000):
        return numpy.random.default_rng(3).integers(0, high, SHAPE).astype(type)

    def nrrd(self, fields="", samples=None, name="a.nrrd"):
        self.write_nrrd(name, self.samples() if samples is None else samples, fields)
        return name

    def run_ok(self, *arguments):
        run = self.ok(*arguments)
        return run.stderr + run.stdout

    def sources_of_unknown_scale(self):
        """Names of files, and words of the doubt."""
        for z in range(3):
            path = self.folder / "s" / f"{z}.dcm"
            path.parent.mkdir(exist_ok=True)
            data_set(self.samples()[z], instance=f"1.{z}", position=(0, 0, z), RescaleSlope="7.25").save_as(path, write_like_original=False)
            content = path.read_bytes()
            self.assertEqual(content.count(b"7.25"), 1)
            path.write_bytes(content.replace(b"7.25", b"x 0 "))
        self.slices_with_a_table()
        with h5py.File(self.folder / "a.h5", "w") as file:
            file.create_dataset("volume", data=self.samples()).attrs["rescale_slope"] = "abc"
        return ("t", "by a table (ModalityLUTSequence)"), ("s", "RescaleSlope is \"x 0\""), ("a.h5", "abc"), (self.nrrd("rescale_slope:=abc\n"), "rescale_slope \"abc\"")

    def slices_with_a_table(self, folder="t", **attributes):
        """Slices whose values are 5 * sample + 7, by a table; not all of them have it."""
        for z in range(3):
            path = self.folder / folder / f"{z}.dcm"
            path.parent.mkdir(exist_ok=True)
            file = data_set(self.samples()[z], instance=f"2.{z}", position=(0, 0, z),
                            **{"RescaleSlope": None, "RescaleIntercept": None} | attributes)
            if z > 0:
                table = pydicom.Dataset()
                table.add_new("LUTDescriptor", "US", [3000, 0, 16])
                table.ModalityLUTType = "US"
                table.add_new("LUTData", "OW", (5 * numpy.arange(3000) + 7).astype("<u2").tobytes())
                file.ModalityLUTSequence = pydicom.Sequence([table])
            file.save_as(path, write_like_original=False)

    def test_samples_that_pydicom_takes_by_a_table_are_kept_as_stored_and_in_doubt(self):
        from pydicom.pixel_data_handlers.util import apply_modality_lut

        # A table and a slope exclude each other; with both, the slope is no better known.
        for attributes in ({}, {"RescaleSlope": 2, "RescaleIntercept": -5}):
            self.slices_with_a_table(**attributes)
            files = [pydicom.dcmread(self.folder / "t" / f"{z}.dcm") for z in range(3)]
            stored = numpy.stack([file.pixel_array for file in files])
            values = [apply_modality_lut(file.pixel_array, file) for file in files]
            numpy.testing.assert_array_equal(values[1:], 5 * stored[1:].astype("int64") + 7)
            self.assertIn("by a table (ModalityLUTSequence), which is not applied",
                          self.run_ok("encode", "t", "-o", "a.tag", "-f"))
            self.run_ok("decode", "a.tag", "-o", "b.raw", "-f")
            numpy.testing.assert_array_equal(numpy.fromfile(self.folder / "b.raw", "<i2").reshape(stored.shape), stored)
            self.assertFalse({"rescale_slope", "rescale_intercept"} & set(self.info("a.tag")["source"]["pairs"]))
            self.assert_refused(64, "ModalityLUTSequence", "encode", "t", "-o", "c.tag", "--max-error", "5")

    def test_a_doubt_about_the_scale_is_in_the_file(self):
        for name, words in self.sources_of_unknown_scale():
            with self.subTest(name):
                self.assertIn(words, self.run_ok("encode", name, "-o", "a.tag", "-f"))
                doubt = self.info("a.tag")["source"]["pairs"]["scale doubt"]
                self.assertIn(words, doubt)
                self.assertFalse(doubt.startswith(name), doubt)
                self.assertIn(words, self.tagrid("info", "a.tag").stdout)
                for output in ("b.nii", "b.mha", "b.tif", "b.nrrd"):
                    said = self.run_ok("decode", "a.tag", "-o", output, "-f")
                    self.assertEqual(said.count("was encoded in doubt: "), 1, said)
                    self.assertIn(words, said)
                # A volume that tells of it is encoded with the same doubt.
                self.assertIn(words, self.run_ok("encode", "b.nrrd", "-o", "again.tag", "-f"))
                self.assertEqual(self.info("again.tag")["source"]["pairs"]["scale doubt"], doubt)
                self.assert_refused(64, words, "encode", "b.nrrd", "-o", "again.tag", "-f", "--max-error", "2")
                self.run_ok("encode", name, "-o", "stripped.tag", "-f", "--strip")
                self.assertEqual(self.info("stripped.tag")["source"]["pairs"]["scale doubt"], "what values samples mean is in doubt")
                self.assertIn("was encoded in doubt: ", self.run_ok("decode", "stripped.tag", "-o", "b.nrrd", "-f"))

    def test_what_needs_values_is_refused_and_works_with_samples(self):
        for name, words in self.sources_of_unknown_scale():
            with self.subTest(name):
                self.run_ok("encode", name, "-o", "a.tag", "-f", "--range", "auto")
                for arguments in (("decode", "--values", "-o", "b.nrrd"), ("surface", "--iso", "300.5", "-o", "b.ply"),
                                  ("mesh", "--coarsen", "200", "-o", "b.vtu")):
                    said = self.assert_refused(64, words, arguments[0], "a.tag", "-f", *arguments[1:])
                    self.assertIn("give --samples", said)
                self.run_ok("surface", "a.tag", "--iso", "300.5", "-fo", "b.ply", "--samples")
                self.run_ok("mesh", "a.tag", "--coarsen", "200", "-fo", "b.vtu", "--samples")

    def test_samples_of_surfaces_and_meshes_are_those_of_a_file_without_a_scale(self):
        made = []
        for fields in ("rescale_slope:=-2\nrescale_intercept:=7\n", ""):
            self.run_ok("encode", self.nrrd(fields), "-o", "a.tag", "-f", "--range", "auto")
            self.run_ok("surface", "a.tag", "--iso", "1500.5", "--samples", "-fo", "b.obj")
            said = self.run_ok("mesh", "a.tag", "--coarsen", "500", "--samples", "-fo", "b.vtu", "-v")
            made.append(((self.folder / "b.obj").read_bytes(), said.split("points, ")[1].split()[0]))
        self.assertEqual(*made)
        self.assert_refused(64, "give --coarsen as well", "mesh", "a.tag", "--samples", "-o", "c.vtu")

    def test_a_spacing_that_is_unknown_is_said_when_it_becomes_1(self):
        tifffile.imwrite(self.folder / "a.tif", self.samples(), photometric="minisblack")
        self.run_ok("encode", "a.tif", "-o", "a.tag")
        self.assertIsNone(self.info("a.tag")["geometry"]["spacing"])
        for output in ("b.nii", "b.nii.gz", "b.mha", "b.mhd", "b.vti", "b.vtkhdf", "b.vdb"):
            run = self.tagrid("decode", "a.tag", "-o", output)
            if output == "b.vdb" and "not installed" in run.stderr:
                print("not tried: there is no writer of OpenVDB on this machine")
                continue
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertIn("a spacing is unknown", run.stderr, output)
        self.assertEqual(nibabel.load(self.folder / "b.nii").header.get_zooms(), (1, 1, 1))
        for output in ("b.nrrd", "b.h5"):
            self.assertEqual(self.run_ok("decode", "a.tag", "-o", output), "")

    def test_ends_of_axes_give_the_spacing_that_teem_gives_them(self):
        shape = (8, 30, 40)
        for centers, spacing, origin in (("", (1, 2, 3), (10.5, 21, 31.5)), ("centers: cell ??? cell\n", (1, 2, 3), (10.5, 21, 31.5)),
                                         ("centerings: node cell node\n", (40 / 39, 2, 24 / 7), (10, 21, 30)),
                                         ("spacings: nan 5 nan\n", (1, 5, 3), (10.5, 22.5, 31.5))):
            self.nrrd("axis mins: 10 20 30\naxis maxs: 50 80 54\n" + centers, numpy.zeros(shape, "uint8") + 7)
            self.run_ok("encode", "a.nrrd", "-o", "a.tag", "-f")
            geometry = self.info("a.tag")["geometry"]
            numpy.testing.assert_allclose(geometry["spacing"], spacing, err_msg=centers)
            numpy.testing.assert_allclose(geometry["origin"], origin, err_msg=centers)
            unu = shutil.which("unu") or shutil.which("teem-unu")
            if unu is None:
                print("not compared with teem: there is no unu on this machine")
                continue
            if "spacings" in centers:
                continue
            # Cutting away one sample at the beginning moves an axis min by one spacing.
            part = subprocess.run([unu, "crop", "-min", "1", "1", "1", "-max", "M", "M", "M", "-i", "a.nrrd"], cwd=self.folder, capture_output=True)
            mins = next(line for line in part.stdout.split(b"\n") if line.startswith(b"axis mins:")).split()[2:]
            numpy.testing.assert_allclose(numpy.array(list(map(float, mins))) - (10, 20, 30), spacing, err_msg=centers)

    def test_a_scale_that_only_one_side_has_is_a_difference(self):
        place = "spacings: 1 1 2\n"
        scaled = "rescale_slope:=0.5\nrescale_intercept:=-512.5\n"
        for ours, theirs, words in ((scaled, "", "rescale_slope: only the .tag file has one; values differ"),
                                    ("", scaled, "rescale_slope: only the original has one; values differ"),
                                    ("", "rescale_intercept:=-1024\n", "rescale_intercept: only the original has one; values differ"),
                                    ("slice_slopes:=1 2 3 4 5 6 7 8\n", "", "slice_slopes: only the .tag file has one; values differ"),
                                    ("rescale_slope:=1\nrescale_intercept:=0\n", "", "")):
            self.run_ok("encode", self.nrrd(place + ours), "-o", "a.tag", "-f")
            self.nrrd(place + theirs, name="b.nrrd")
            if words:
                self.assert_refused(65, words, "verify", "a.tag", "--against", "b.nrrd")
            else:
                self.assertIn("geometry: the same (spacing)", self.run_ok("verify", "a.tag", "--against", "b.nrrd"))
        # Samples without a header have no place for it.
        self.run_ok("encode", self.nrrd(scaled), "-o", "a.tag", "-f")
        (self.folder / "b.raw").write_bytes(self.samples().tobytes())
        said = self.run_ok("verify", "a.tag", "--against", "b.raw", "--dims", "10,9,8", "--type", "uint16")
        self.assertIn("geometry: not compared: neither file defines it", said)

    def test_why_a_geometry_is_not_compared(self):
        place = "spacings: 1 1 2\n"
        for ours, theirs, words in (("", "", "neither file defines it"), (place, "", "the original does not define it"),
                                    ("", place, "the file does not define it"),
                                    ("space: LPS\n", place,
                                     "they define other parts of it, or in ways that cannot be compared")):
            self.run_ok("encode", self.nrrd(ours), "-o", "a.tag", "-f")
            said = self.run_ok("verify", "a.tag", "--against", self.nrrd(theirs, name="b.nrrd"))
            self.assertIn(f"geometry: not compared: {words}\n", said)

    def test_slices_at_unequal_distances_have_their_own_places(self):
        heights = (0, 1, 2, 3, 4, 5, 6, 9.5)
        self.nrrd("space: LPS\nspace directions: (0.5,0,0) (0,0.5,0) (0,0,1)\nspace origin: (1,2,3)\nspace units: \"mm\" \"mm\" \"mm\"\nslice_positions:=" +
                  "; ".join(f"1 2 {3 + height}" for height in heights) + "\n")
        self.run_ok("encode", "a.nrrd", "-o", "a.tag")
        self.assertRegex(self.tagrid("info", "a.tag").stdout, r"\nphysical size +5 x 4.5 x 10.5 mm\n")

    def test_a_grid_that_misses_a_mask_is_warned_of_where_a_mesh_is_asked_for(self):
        small = (self.samples() > 1500).astype("uint8")
        mask = numpy.kron(small, numpy.ones((4, 4, 4), "uint8"))
        warning = ("a.tag: samples span 0 to 1, but the grid was made for 0 to 256, the usual range of uint8: it misses detail; "
                   "encode with --range auto to follow it")
        self.assertNotIn("range", self.run_ok("encode", self.nrrd(samples=mask), "-o", "a.tag"))
        self.assertIn(warning, self.run_ok("mesh", "a.tag", "-o", "a.vtu"))
        self.assertNotIn("detail", self.run_ok("mesh", "a.tag", "-qfo", "a.vtu"))
        for options in (("--range", "auto"), ("--mesh-error", "1")):
            self.run_ok("encode", "a.nrrd", "-o", "a.tag", "-f", *options)
            self.assertNotIn("detail", self.run_ok("mesh", "a.tag", "-fo", "a.vtu"))
        for samples in (mask * 20, mask * 0 + 3, small):
            self.run_ok("encode", self.nrrd(samples=samples), "-o", "a.tag", "-f")
            self.assertNotIn("detail", self.run_ok("mesh", "a.tag", "-fo", "a.vtu"))

    def test_metaimage_without_a_place_lies_where_itk_puts_it(self):
        samples = self.samples("uint8", 200)
        (self.folder / "a.mha").write_bytes(b"ObjectType = Image\nNDims = 3\nElementSpacing = 0.7 0.5 1.25\nDimSize = 10 9 8\nElementType = MET_UCHAR\n"
                                            b"ElementDataFile = LOCAL\n" + samples.tobytes())
        self.run_ok("encode", "a.mha", "-o", "a.tag")
        self.run_ok("decode", "a.tag", "-o", "b.nii")
        numpy.testing.assert_allclose(nibabel.load(self.folder / "b.nii").affine, numpy.diag([-0.7, -0.5, 1.25, 1]), atol=1e-6)
        if shutil.which("plastimatch") is None:
            return print("not compared with ITK: there is no plastimatch on this machine")
        subprocess.run(["plastimatch", "convert", "--input", "a.mha", "--output-img", "itk.nii"], cwd=self.folder, check=True, capture_output=True)
        numpy.testing.assert_allclose(nibabel.load(self.folder / "b.nii").affine, nibabel.load(self.folder / "itk.nii").affine, atol=1e-6)

    def test_messages_say_what_to_do(self):
        self.run_ok("encode", self.nrrd(), "-o", "a.tag")
        (self.folder / "d").mkdir()
        for arguments in (("verify", "d"), ("preview", "d", "-o", "x.png"), ("info", "d"), ("decode", "d", "-o", "x.nrrd"), ("mesh", "d", "-o", "x.vtu")):
            self.assert_refused(64, "d: is a directory, not a .tag file; encode it first", *arguments)
        self.assert_refused(64, "--max-error -3 must be a finite number of at least 0", "encode", "a.nrrd", "-o", "x.tag", "--max-error=-3")
        self.nrrd("rescale_slope:=1.19\nrescale_intercept:=0\n", name="r.nrrd")
        self.assertIn("3 allows 2 steps of the stored samples (1.19 each)", self.run_ok("encode", "r.nrrd", "-o", "r.tag", "--max-error", "3"))

    def test_decode_of_a_damaged_file_names_what_helps(self):
        self.run_ok("encode", self.nrrd(), "-o", "a.tag", "--cube", "4", "--brick", "1")
        content = bytearray((self.folder / "a.tag").read_bytes())
        content[len(content) // 2] ^= 1
        (self.folder / "a.tag").write_bytes(content)
        advice = "; tagrid decode a.tag --salvage decodes the intact bricks"
        self.assert_refused(65, advice, "decode", "a.tag", "-o", "b.nrrd")
        self.assertNotIn("--salvage", self.tagrid("decode", "a.nrrd", "-o", "b.nrrd").stderr)

    def test_only_pairs_that_are_lost_keep_the_file(self):
        (self.folder / "a.mha").write_bytes(b"ObjectType = Image\nNDims = 3\nElementSpacing = 0.7 0.5 1.25\nModality = MET_MOD_CT\nDimSize = 10 9 8\n"
                                            b"ElementType = MET_USHORT\nElementDataFile = LOCAL\n" + self.samples().tobytes())
        # From a pipe, so that there are no source files to keep.
        run = subprocess.run([PROGRAM, "encode", "-", "-o", "a.tag"], cwd=self.folder,
                             input=(self.folder / "a.mha").read_bytes(), capture_output=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("metaimage_Modality", self.info("a.tag")["source"]["pairs"])
        self.run_ok("decode", "a.tag", "-o", "b.mha", "--rm")
        self.assertFalse((self.folder / "a.tag").exists())


if __name__ == "__main__":
    main()
