"""What decode writes opens elsewhere as the values that it means: HU in other people's programs."""

import itertools
import json
import re
import shutil
import subprocess
import unittest

from other_readers import PROGRAM, ReaderTest, h5py, main, nibabel, numpy, pydicom, tifffile, vtk_image, vtk_numpy
from scans import write_series
from seen_by_others import PLAIN, SCALED, by_plastimatch, by_teem, seen

SHAPE = (5, 19, 23)


def stored(type="uint16", low=0, high=4000, shape=SHAPE):
    """Noise with both ends of its range in it."""
    samples = numpy.random.default_rng(7).integers(low, high, shape, endpoint=True).astype(type)
    samples.flat[:2] = low, high
    return samples


@unittest.skipIf(None in (numpy, nibabel, tifffile, h5py, vtk_image, vtk_numpy), "libraries are missing")
class Values(ReaderTest):
    def encode(self, samples, pairs, *options, name="a"):
        place = "space: left-posterior-superior\nspace directions: (0.5,0,0) (0,0.5,0) (0,0,2)\nspace origin: (1,2,3)\n"
        self.write_nrrd(f"{name}.nrrd", samples, place + 'space units: "mm" "mm" "mm"\n' + pairs)
        self.ok("encode", f"{name}.nrrd", "-o", f"{name}.tag", "-f", "--range", "auto", "--cube", "8", "--brick", "1",
                *options)

    def decode(self, name, *options, tag="a.tag"):
        run = self.ok("decode", tag, "-o", name, "-f", "--json", "run.json", *options)
        self.report = json.loads((self.folder / "run.json").read_text())
        return run.stderr

    def seen(self, name):
        shape = self.report["dims"][::-1]
        return seen(self.folder / name, numpy.empty(shape, self.report["written_type"]))

    def pairs(self, name):
        return self.encoded(name, "--range", "auto")[1]["source"]["pairs"]

    def test_hounsfield_units_open_as_such_in_every_format(self):
        for type, low, high, intercept, written in (("uint16", 0, 4000, -1024, "int16"), ("int16", -32768, 31000, 1000, "int16"),
                                                    ("uint16", 1, 65000, 500, "uint16"), ("uint8", 0, 255, -1024, "int16"),
                                                    ("int32", 10000, 70000, -40000, "int16")):
            samples = stored(type, low, high)
            self.encode(samples, f"rescale_slope:=1\nrescale_intercept:={intercept}\nrescale_units:=HU\n")
            truth = samples.astype(int) + intercept
            for name in PLAIN + SCALED:
                said = self.decode(name)
                numpy.testing.assert_array_equal(self.seen(name), truth, f"{type} {name}")
                is_scaled = name in SCALED
                self.assertEqual(self.report["written_type"], type if is_scaled else written, name)
                self.assertEqual(self.report["written_values"], not is_scaled, name)
                self.assertEqual(f"{name}: has values, sample {'-' if intercept < 0 else '+'} {abs(intercept)}, as {written}" in said,
                                 not is_scaled, said)
            numpy.testing.assert_array_equal(by_teem(self.folder / "b.nrrd"), truth)
            if shutil.which("plastimatch"):
                for name in ("b.mha", "b.nrrd"):
                    numpy.testing.assert_array_equal(by_plastimatch(self.folder / name), truth, name)

    def test_info_says_what_the_source_says_of_values(self):
        for pairs, said in (("rescale_slope:=5\n", "5 * sample\n"), ("rescale_intercept:=-7\n", "sample - 7\n"),
                            ("rescale_slope:=5\nrescale_intercept:=-7\nrescale_units:=HU\n", "5 * sample - 7 HU\n")):
            self.encode(stored(), pairs)
            self.assertRegex(self.tagrid("info", "a.tag").stdout, "(?m)^ *values +" + re.escape(said))

    def test_stored_samples_and_values_on_demand(self):
        for type, low, high, slope, intercept, written in (
                ("uint16", 0, 65535, 1, -1024, "int32"), ("int16", -32768, 32767, 2.5, -7, "float32"), ("uint8", 0, 255, 1, 0.25, "float32"),
                ("uint32", 0, 2**32 - 1, 1, -5, "float32"), ("int32", -9, 10**9, 1, 10**9, "int32"), ("float32", 0, 9000, 0.1, 3, "float32"),
                ("float64", 0, 9000, 0.1, 3, "float64"), ("int16", -5, 5, 1e300, 0, "float64"), ("int16", -500, 3000, 2, -1024, "int16"),
                ("uint16", 0, 65535, -3, 7, "int32"), ("uint8", 0, 255, 10**9, 0, "float32")):
            samples = stored(type, low, high)
            self.encode(samples, f"rescale_slope:={slope}\nrescale_intercept:={intercept}\nrescale_units:=HU\n")
            truth = (samples.astype(float) * slope + intercept).astype(written)
            for name in PLAIN + SCALED:
                what = f"{type} {slope} {name}"
                self.decode(name, "--values")
                self.assertEqual(self.report["written_type"], written, what)
                if name == "b.tif" and written == "float64" and slope == 1e300:
                    continue
                numpy.testing.assert_array_equal(self.seen(name), truth, what)
                said = self.decode(name)
                self.assertEqual(self.report["written_type"], type, what)
                is_scaled = name in SCALED
                self.assertEqual(f"{name}: has stored samples; values are {slope} * sample" .replace("1e300", "1e+300") in said, not is_scaled, said)
                self.assertEqual("--values writes values" in said, not is_scaled, said)
                if not is_scaled:
                    numpy.testing.assert_array_equal(self.seen(name), samples, what)
                automatic = (self.folder / name).read_bytes()
                self.assertNotIn("has stored samples", self.decode(name, "--samples"))
                self.assertEqual((self.folder / name).read_bytes(), automatic, what)
        self.encode(stored(), "rescale_slope:=1\nrescale_intercept:=-1024\n")
        for name in PLAIN:
            self.decode(name, "--samples")
            numpy.testing.assert_array_equal(self.seen(name), stored(), name)
        self.assertEqual(self.pairs("b.nrrd")["rescale_intercept"], "-1024")
        run = subprocess.run([PROGRAM, "decode", "a.tag", "-o", "-"], cwd=self.folder, stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE)
        self.assertEqual(run.stdout, (stored().astype("<i2") - 1024).tobytes())
        self.assertIn(b"tagrid: standard output: has values, sample - 1024, as int16", run.stderr)
        self.assert_refused(64, "only one of them", "decode", "a.tag", "-fo", "b.nrrd", "--samples", "--values")

    def test_slices_with_slopes_of_their_own_become_values_on_demand(self):
        samples, slopes, intercepts = stored("int16", -300, 300), [1, 2, -0.5, 1, 3], [0, -1, 5, 0, 2.5]
        texts = [" ".join(map(str, numbers)) for numbers in (slopes, intercepts)]
        self.encode(samples, f"slice_slopes:={texts[0]}\nslice_intercepts:={texts[1]}\nrescale_slope:=3\nrescale_intercept:=0\n")
        truth = (samples * numpy.array(slopes)[:, None, None] + numpy.array(intercepts)[:, None, None]).astype("float32")
        for name in PLAIN + SCALED:
            self.assertIn("--values writes values", self.decode(name))
            self.decode(name, "--values")
            numpy.testing.assert_array_equal(self.seen(name), truth, name)
            self.decode(name, "--values", "--region", ":22,3:,1:5", "--step", "2")
            numpy.testing.assert_array_equal(self.seen(name), truth[2:5:2, 4::2, :22:2], name)
        self.decode("b.nrrd", "--values", "--region", ":,:,1:4")
        pairs = self.pairs("b.nrrd")
        self.assertEqual((pairs["slice_applied_slopes"], pairs["slice_applied_intercepts"]), ("2 -0.5 1", "-1 5 0"))
        self.assertFalse([key for key in pairs if key.startswith(("rescale_s", "slice_s", "slice_i"))])
        self.encode(samples, "slice_slopes:=1 -2 40 0 3\nslice_intercepts:=0 -1 5 0 2\n", "--strip")
        truth = samples * numpy.array([1, -2, 40, 0, 3])[:, None, None] + numpy.array([0, -1, 5, 0, 2])[:, None, None]
        self.decode("b.nrrd", "--values")
        self.assertEqual(self.report["written_type"], "int16")  # numbers of all slices are whole
        numpy.testing.assert_array_equal(self.seen("b.nrrd"), truth)
        self.assert_refused(64, "slices have the slope 0", "decode", "a.tag", "-o", "c.nrrd", "--values", "--rm")
        self.encode(samples, "slice_slopes:=1 2 3\n")
        self.assert_refused(64, "give --samples", "decode", "a.tag", "-fo", "b.nrrd", "--values")
        self.decode("b.nrrd")

    def test_what_was_written_as_values_is_encoded_as_values(self):
        samples = stored()
        self.encode(samples, "rescale_slope:=1\nrescale_intercept:=-1024\nrescale_units:=HU\nlossy source:=TIFF, JPEG\n")
        for name in ("b.nrrd", "b.vtkhdf"):
            self.decode(name)
            pairs = self.pairs(name)
            self.assertEqual({key: value for key, value in pairs.items() if "hdf5" not in key},
                             {"applied_intercept": "-1024", "rescale_units": "HU", "lossy source": "TIFF, JPEG"})
            self.ok("encode", name, "-o", "c.tag", "-f", "--max-error", "5")
            for again in ("c.nrrd", "c.nii", "c.mha"):
                said = self.decode(again, tag="c.tag")
                self.assertNotIn("has values", said)  # nothing is added twice
                error = numpy.abs(self.seen(again) - (samples.astype(int) - 1024)).max()
                self.assertTrue(2 < error <= 5, f"{again}: {error}")
        # A slope that was applied is remembered, too.
        self.encode(samples, "rescale_slope:=0.5\nrescale_intercept:=-1024\n")
        self.decode("b.nrrd", "--values")
        self.assertEqual(self.pairs("b.nrrd"), {"applied_slope": "0.5", "applied_intercept": "-1024"})

    def test_bounds_count_in_the_type_of_what_is_written(self):
        """Lossy samples may lie outside the range of the original ones, and their values must still fit."""
        samples = stored("uint16", 0, 32767 + 1024)
        self.encode(samples, "rescale_slope:=1\nrescale_intercept:=-1024\n", "--max-error", "40")
        self.decode("b.nii")
        truth = self.seen("b.nii")
        self.assertIn("has stored samples", self.decode("b.nrrd"))
        self.decode("b.nrrd", "--values")
        self.assertEqual(self.report["written_type"], "int32")
        numpy.testing.assert_array_equal(self.seen("b.nrrd"), truth)

    def test_pipes_threads_regions_and_damage_give_the_same_values(self):
        samples = stored("uint16", 0, 4000, (19, 33, 41))
        self.encode(samples, "rescale_slope:=1\nrescale_intercept:=-1024\n")
        truth = samples.astype(int) - 1024
        formats = {"b.nrrd": "nrrd", "b.mha": "metaimage", "b.tif": "tiff", "b.vti": "vti", "b.raw": "raw", "b.vtkhdf": "vtkhdf",
                   "b.h5": "hdf5", "b.nii": "nifti", "b.nii.gz": "nifti.gz"}
        for (name, format), options in itertools.product(formats.items(), ((), ("--values",), ("--samples",))):
            self.decode(name, *options)
            expected = (self.folder / name).read_bytes()
            for more in (("-T", "1"), ("-T", "3"), ("-M", "200M")):
                self.decode(name, *options, *more)
                self.assertEqual((self.folder / name).read_bytes(), expected, f"{name} {options} {more}")
            if options == ("--values",):
                continue  # from a pipe, these have a larger type
            piped = subprocess.run(f"cat a.tag | {PROGRAM} decode - -q -o - --format {format} {' '.join(options)} | cmp - {name}",
                                   shell=True, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            self.assertEqual(piped.returncode, 0, piped.stdout)
        for name in formats:
            self.decode(name, "--region", "3:30,5:,2:18", "--step", "2")
            numpy.testing.assert_array_equal(self.seen(name), truth[2:18:2, 6::2, 4:30:2], name)
        damaged = bytearray((self.folder / "a.tag").read_bytes())
        damaged[len(damaged) // 2] ^= 1
        (self.folder / "d.tag").write_bytes(damaged)
        for name in ("b.nrrd", "b.mha", "b.nii"):
            run = self.tagrid("decode", "d.tag", "--salvage", "--fill", "-2000" if name != "b.nii" else "4095", "-fo", name)
            self.assertEqual(run.returncode, 65, run.stderr)
            values = seen(self.folder / name)
            lost = values == (-2000 if name != "b.nii" else 4095 - 1024)
            self.assertTrue(0 < lost.sum() < lost.size / 4, f"{name}: {lost.sum()}")
            numpy.testing.assert_array_equal(values[~lost], truth[~lost], name)
        self.assertEqual(self.tagrid("decode", "d.tag", "--salvage", "--fill", "40000", "-fo", "b.nrrd").returncode, 64)

    def test_a_file_as_the_standard_input_gives_the_same_values(self):
        """Its index is read, too, although it has been read in part when that is done."""
        self.encode(stored(), "rescale_slope:=1\nrescale_intercept:=-1024\n")
        self.decode("a.raw")
        with open(self.folder / "a.tag", "rb") as file:
            run = subprocess.run([PROGRAM, "decode", "-", "-o", "b.raw"], cwd=self.folder, stdin=file, capture_output=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual((self.folder / "b.raw").read_bytes(), (self.folder / "a.raw").read_bytes())

    def test_a_pipe_with_values_beyond_16_bits_is_refused_and_advice_helps(self):
        samples = stored("uint16", 0, 65535)
        self.encode(samples, "rescale_slope:=1\nrescale_intercept:=-1024\n")
        for output in ("-fo b.nrrd", "-fo b.nrrd --region :,:,1:4"):
            run = subprocess.run(f"cat a.tag | {PROGRAM} decode - {output}", shell=True, cwd=self.folder,
                                 stderr=subprocess.PIPE, text=True)
            self.assertEqual(run.returncode, 64, run.stderr)
            self.assertIn("is not one of type int16", run.stderr)
            self.assertFalse((self.folder / "b.nrrd").exists())
            for option in ("--values", "--samples"):
                self.assertIn(option, run.stderr)
                again = subprocess.run(f"cat a.tag | {PROGRAM} decode - {output} {option}", shell=True, cwd=self.folder,
                                       stderr=subprocess.PIPE)
                self.assertEqual(again.returncode, 0, again.stderr)
                cut = slice(1, 4) if "region" in output else slice(None)
                numpy.testing.assert_array_equal(seen(self.folder / "b.nrrd"), samples[cut].astype(int) - (1024 if option == "--values" else 0))
                (self.folder / "b.nrrd").unlink()

    def test_the_original_goes_only_for_values_that_are_exact(self):
        self.encode(stored(), "rescale_slope:=0.1\nrescale_intercept:=-1024\n", "--strip")
        self.assert_refused(64, "values are rounded to float32", "decode", "a.tag", "-o", "c.nrrd", "--values", "--rm")
        self.encode(stored(), "rescale_slope:=1\nrescale_intercept:=-1024\n", "--strip")
        self.decode("c.nrrd", "--rm")
        self.assertFalse((self.folder / "a.tag").exists())
        numpy.testing.assert_array_equal(self.seen("c.nrrd"), stored().astype(int) - 1024)

    def test_openvdb_files_have_values_too(self):
        if not (PROGRAM.parent / "tagrid-write-vdb").exists():
            self.skipTest("tagrid-write-vdb was not built")
        samples = stored()
        self.encode(samples, "rescale_slope:=1\nrescale_intercept:=-1024\n", "--max-error", "3")
        self.decode("b.nii")
        truth = self.seen("b.nii")
        self.assertIn("has values, sample - 1024", self.decode("b.vdb", "--vdb-background", "-1024"))
        found, info = self.encoded("b.vdb", "--range", "auto")
        numpy.testing.assert_array_equal(found, truth)
        self.assertEqual((info["type"], info["source"]["pairs"]["applied_intercept"]), ("int16", "-1024"))
        self.decode("b.vdb", "--samples")
        numpy.testing.assert_array_equal(self.encoded("b.vdb", "--range", "auto")[0], truth + 1024)

    @unittest.skipIf(pydicom is None, "there is no pydicom")
    def test_a_ct_series_of_16_stored_bits_opens_in_hounsfield_units(self):
        samples = stored("uint16", 0, 4000)
        write_series(self.folder / "s", samples, step=2, BitsStored=16, HighBit=15)
        self.ok("encode", "s", "-o", "a.tag")
        for name in PLAIN + SCALED:
            self.decode(name)
            numpy.testing.assert_array_equal(self.seen(name), samples.astype(int) - 1024, name)


if __name__ == "__main__":
    main()
