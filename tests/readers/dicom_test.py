"""DICOM: series that pydicom writes, in all transfer syntaxes that other people's tools make, and files that others made."""

import json
import pathlib
import re
import shutil
import subprocess
import unittest

from other_readers import PROGRAM, ReaderTest, main, nibabel, numpy, pydicom, some
from scans import BIG, IMPLICIT, LITTLE, data_set, enhanced_ct, volume, write_series


@unittest.skipIf(pydicom is None, "there is no pydicom on this machine")
class Dicom(ReaderTest):
    def write_series(self, samples, folder="s", step=(0, 0, 1.5), names=None, **attributes):
        for z, slice in enumerate(samples):
            position = tuple(-10 + z * d for d in step)
            name = names[z] if names else f"i{z:03}.dcm"
            self.save(f"{folder}/{name}", data_set(slice, instance=f"1.2.3.{z + 1}", number=z + 1, position=position, **attributes))
        return folder

    def run_tool(self, *command):
        run = subprocess.run([str(part) for part in command], cwd=self.folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertEqual(run.returncode, 0, f"{command}: {run.stdout}")

    def test_a_series_in_hounsfield_units(self):
        truth = volume()
        for syntax in (LITTLE, IMPLICIT, BIG):
            info = self.encodes((truth - 1024).astype("int16"), self.write_series(truth, syntax=syntax), what=syntax)
            geometry = info["geometry"]
            self.assertEqual(geometry["space"], "left-posterior-superior")
            # PixelSpacing is that of rows, and then that of columns.
            self.assertEqual(geometry["directions"], [[0.25, 0, 0], [0, 0.5, 0], [0, 0, 1.5]])
            self.assertEqual(geometry["origin"], [-10, -10, -10])
            pairs = info["source"]["pairs"]
            self.assertEqual((pairs["dicom_PatientName"], pairs["dicom_PatientID"]), ("Doe^Jane", "4711"))
            self.assertEqual((pairs["rescale_units"], pairs["dicom_added_intercept"]), ("HU", "-1024"))
            self.assertEqual(pairs["slice_sop_instance_uids"].split(), [f"1.2.3.{z + 1}" for z in range(7)])
            self.assertNotIn("slice_positions", pairs)

    def test_names_are_left_out_on_demand(self):
        self.write_series(volume(), PatientComments="Doe")
        samples, info = self.encoded("s", "--strip")
        self.assertNotIn("Doe", str(info))
        self.assertEqual(set(info["source"]["pairs"]), {"rescale_units", "dicom_added_intercept"})
        self.assertEqual(info["geometry"]["directions"][2], [0, 0, 1.5])
        self.assertNotIn(b"Doe", (self.folder / "out.tag").read_bytes())
        self.ok("verify", "out.tag", "--against", "s")

    def test_slices_are_sorted_by_their_positions(self):
        truth = volume()
        names = [f"{number}.dcm" for number in (5, 0, 3, 6, 1, 4, 2)]
        info = self.encodes((truth[::-1] - 1024).astype("int16"),
                            self.write_series(truth, names=names, step=(0, 0, -1.5)))
        self.assertEqual(info["geometry"]["origin"][2], -10 - 6 * 1.5)

    def test_spacings_that_are_rounded_differently_are_one(self):
        truth = volume()
        self.write_series(truth, step=(0, 0, 1))
        for z, spacing in ((2, [0.50000005, 0.25]), (3, [0.5, 0.24999998])):
            self.save(f"s/i{z:03}.dcm", data_set(truth[z], instance=f"1.2.3.{z + 1}", number=z + 1, position=(-10, -10, -10 + z), PixelSpacing=spacing))
        info = self.encodes((truth - 1024).astype("int16"), "s")
        self.assertEqual(info["geometry"]["spacing"], [0.25, 0.5, 1])

    def test_a_tilted_gantry_shears_and_does_not_resample(self):
        truth = volume()
        info = self.encodes((truth - 1024).astype("int16"), self.write_series(truth, step=(0, 0.4, 1.5)))
        numpy.testing.assert_allclose(info["geometry"]["directions"][2], [0, 0.4, 1.5], atol=1e-9)

    def test_a_gap_is_kept_and_said(self):
        truth = volume()
        self.write_series(truth)
        (self.folder / "s" / "i003.dcm").unlink()
        info = self.encodes((truth[[0, 1, 2, 4, 5, 6]] - 1024).astype("int16"), "s")
        self.assertIn("between slices 2 and 3 (i002.dcm and i004.dcm) the distance is 3 mm, elsewhere 1.5 mm; 1 slice seems to be missing",
                      self.messages)
        positions = [list(map(float, place.split())) for place in info["source"]["pairs"]["slice_positions"].split("; ")]
        self.assertEqual([place[2] for place in positions], [-10, -8.5, -7, -4, -2.5, -1])
        self.assertEqual(info["geometry"]["directions"][2], [0, 0, 1.5])
        self.assertEqual(info["geometry"]["slice_positions"], positions)
        for name, warns in (("a.nii", True), ("a.mha", True), ("a.nrrd", False)):
            run = self.tagrid("decode", "out.tag", "-o", name, "-f")
            self.assertEqual((run.returncode, "slices lie at unequal distances" in run.stderr), (0, warns), name)
        # Slices 0 to 2 lie at equal distances, and so do 1 and 3.
        for region, options, step in ((":,:,0:3", [], 1.5), (":,:,1:", ["--step", "2"], 4.5), (":,:,4:5", [], 1.5), (":,:,1:5", [], None)):
            run = self.tagrid("decode", "out.tag", "-o", "part.nii", "-f", "--region", region, *options)
            self.assertEqual((run.returncode, "slices lie at unequal distances" in run.stderr), (0, step is None), f"{region}: {run.stderr}")
            self.assertNotIn("HU", run.stderr)  # every CT series has this unit
            if nibabel and step:
                self.assertAlmostEqual(nibabel.load(self.folder / "part.nii").affine[2, 2], step, msg=region)
        text = self.tagrid("info", "out.tag").stdout
        self.assertRegex(text, r"\nslices +unequally spaced")
        mesh = self.tagrid("mesh", "out.tag", "-o", "a.vtu")
        self.assertEqual((mesh.returncode, "slices of the source are unequally spaced" in mesh.stderr), (0, True),
                         mesh.stderr)
        self.assertRegex(text, r"\npatient +Doe\^Jane \(4711\)\n")
        self.assertRegex(text, r"\nmetadata +\d+ key/value pairs")

    def test_two_slices_at_one_place_are_refused(self):
        truth = volume()
        self.write_series(truth)
        self.save("s/again.dcm", data_set(truth[0], instance="1.2.3.99", number=1, position=(-10, -10, -8.5)))
        message = self.assert_refused(65, "at the same position", "encode", "s")
        self.assertIn("again.dcm", message)
        self.assertIn("i001.dcm", message)

    def test_several_series_are_listed(self):
        truth = volume()
        self.write_series(truth)
        for z in range(3):
            self.save(f"s/other{z}", data_set(truth[z], series="9.8.7", instance=f"9.{z}", position=(0, 0, z), SeriesDescription="Lung"))
        (self.folder / "s" / "notes.txt").write_text("not DICOM")
        message = self.assert_refused(64, "holds 2 volumes", "encode", "s")
        self.assertRegex(message, r"1\.2\.3-[0-9a-f]{8}  31 x 20 x 7, CT")
        self.assertRegex(message, r"9\.8\.7-[0-9a-f]{8}  31 x 20 x 3, CT, Lung")
        for series, part in (("9.8.7", truth[:3]), ("1.2.3", truth), ("1", truth), ("2", truth[:3])):
            self.encodes((part - 1024).astype("int16"), "s", "--series", series)
        self.assert_refused(64, "has no series 3.3", "encode", "s", "--series", "3.3")

    def test_parts_of_one_series(self):
        """A localizer in the series, and two moments at the same places."""
        truth = volume()
        self.write_series(truth)
        self.save("s/localizer.dcm", data_set(truth[0], instance="1.1", position=(0, 0, 0), ImageOrientationPatient=[0, 1, 0, 0, 0, -1]))
        message = self.assert_refused(64, "holds 2 volumes", "encode", "s")
        name = re.search(r"1  (1\.2\.3-[0-9a-f]{8})  31 x 20 x 7, CT, axial\n", message)[1]
        self.encodes((truth - 1024).astype("int16"), "s", "--series", name)
        for moment in (1, 2):
            for z in range(4):
                self.save(f"m/{moment}_{z}.dcm", data_set(truth[z] ^ moment, instance=f"5.{moment}.{z}", position=(0, 0, z),
                                                          TemporalPositionIdentifier=moment))
        self.assert_refused(64, "holds 2 volumes", "encode", "m")
        for moment in (1, 2):
            self.encodes(((truth[:4] ^ moment) - 1024).astype("int16"), "m", "--series", moment)

    def test_samples_of_all_kinds(self):
        for allocated, stored, signed, intercept, type, added in (
                (8, 8, 0, 0, "uint8", 0), (8, 8, 1, 0, "int8", 0), (8, 7, 0, 5, "uint8", 0), (16, 16, 0, 0, "uint16", 0),
                (16, 16, 1, 0, "int16", 0), (16, 12, 1, 0, "int16", 0), (16, 12, 0, -1024, "int16", -1024), (16, 16, 0, -1024, "uint16", 0),
                (16, 12, 0, 40000, "uint16", 40000), (16, 12, 0, -0.5, "uint16", 0), (32, 32, 0, 0, "uint32", 0), (32, 24, 1, 0, "int32", 0)):
            for syntax in (LITTLE, BIG):
                what = f"{allocated} {stored} {signed} {intercept} {syntax}"
                truth = volume(stored, (2, 5, 6), signed)
                noise = numpy.random.default_rng(2).integers(0, 1 << (allocated - stored), truth.shape) << stored
                samples, info = self.encoded(self.write_series(
                    (truth & ((1 << stored) - 1)) | noise, syntax=syntax, BitsAllocated=allocated, BitsStored=stored, HighBit=stored - 1,
                    PixelRepresentation=signed, RescaleIntercept=intercept), "--range", "auto")
                self.assert_same(samples, (truth + added).astype(type), what)
                pairs = info["source"]["pairs"]
                self.assertEqual(pairs.get("rescale_intercept"), str(intercept) if intercept != added else None, what)

    def test_slopes_of_their_own(self):
        truth = volume(shape=(4, 5, 6))
        for z in range(4):
            self.save(f"s/{z}.dcm", data_set(truth[z], instance=f"1.2.3.{z}", position=(0, 0, z), RescaleSlope=1 + z / 2, RescaleIntercept=z))
        samples, info = self.encoded("s")
        self.assert_same(samples, truth.astype("uint16"))
        self.assertEqual(info["source"]["pairs"]["slice_slopes"], "1 1.5 2 2.5")
        # No slope is right for all, so files state none and say so; those that can have the list.
        for name in ("a.nii", "a.mha", "a.tif", "a.vti", "a.nrrd", "a.h5"):
            run = self.ok("decode", "out.tag", "-o", name)
            content = (self.folder / name).read_bytes()
            for slope in (b"ElementToIntensityFunctionSlope", b"rescale_slope"):
                self.assertNotIn(slope, content, name)
            if name in ("a.nrrd", "a.h5"):
                self.assertIn("because each slice has its own slope and intercept; --values writes values", run.stderr)
                self.assertIn(b"slice_slopes", content)
            else:
                self.assertIn("slices have individual slopes (slice_slopes), which", run.stderr)
                self.assertIn("the .tag file and .nrrd files have them; the values in this file are the stored samples", run.stderr)
        if nibabel:
            self.assert_same(numpy.asarray(nibabel.load(self.folder / "a.nii").get_fdata()).transpose(2, 1, 0), truth.astype("float64"))
        self.assertNotIn("rescale_slope", info["source"]["pairs"])
        self.ok("decode", "out.tag", "--region", ":,:,1:3", "-o", "part.nrrd")
        for line in (b"slice_slopes:=1.5 2\n", b"slice_intercepts:=1 2\n", b"slice_sop_instance_uids:=1.2.3.1 1.2.3.2\n"):
            self.assertIn(line, (self.folder / "part.nrrd").read_bytes())
        self.assertEqual(info["source"]["pairs"]["slice_intercepts"], "0 1 2 3")
        self.assertRegex(self.tagrid("info", "out.tag").stdout,
                         r"\nvalues +individual slope and intercept of each slice")
        self.assertIn("slopes and intercepts of their own", self.messages)
        self.encoded("s", "--max-error", "10", says="10 allows 4 steps of the stored samples (2.5 each)")
        self.encoded("s", "--max-error", "3", says="3 allows 1 step of the stored samples (2.5 each)")

    def test_whole_intercepts_of_their_own_are_added(self):
        truth = volume(shape=(4, 5, 6))
        for z in range(4):
            self.save(f"s/{z}.dcm", data_set(truth[z], instance=f"1.2.3.{z}", position=(0, 0, z), RescaleIntercept=-1000 - z))
        self.encodes((truth - 1000 - numpy.arange(4)[:, None, None]).astype("int16"), "s")

    @unittest.skipIf(shutil.which("gdcmconv") is None or shutil.which("dcmcjpeg") is None,
                     "there are no gdcmconv and dcmcjpeg on this machine (libgdcm-tools, dcmtk)")
    def test_transfer_syntaxes_that_others_make(self):
        tools = [["gdcmconv", "--raw"], ["gdcmconv", "--implicit"], ["gdcmconv", "--rle"], ["gdcmconv", "--jpeg"],
                 ["gdcmconv", "--jpegls"], ["gdcmconv", "--j2k"], ["dcmcrle"], ["dcmcjpeg"],
                 ["dcmcjpeg", "+el"], ["dcmcjpls"], ["dcmconv", "+tb"], ["dcmconv", "+td"], ["dcmconv", "+te", "-F"]]
        smooth = (numpy.add.outer(numpy.add.outer(numpy.arange(7) * 90, numpy.arange(20) * 20), numpy.arange(31) * 30) + volume(5)) & 4095
        for signed in (False, True):
            truth = smooth - 2048 if signed else smooth
            shutil.rmtree(self.folder / "s", ignore_errors=True)
            self.write_series(truth & 4095, PixelRepresentation=int(signed), RescaleIntercept=0)
            for tool in some(tools, 2, first=signed):
                shutil.rmtree(self.folder / "t", ignore_errors=True)
                (self.folder / "t").mkdir()
                for file in sorted((self.folder / "s").iterdir()):
                    self.run_tool(*tool, file, self.folder / "t" / file.name)
                self.encodes(truth.astype("int16"), "t", what=f"{tool} {signed}")

    @unittest.skipIf(shutil.which("dcmcjpeg") is None, "there are no dcmcjpeg and dcmcjpls on this machine (dcmtk)")
    def test_a_loss_before_is_known_and_a_larger_file_is_said(self):
        noise = volume(8, (4, 64, 80))
        self.write_series(noise, BitsAllocated=8, BitsStored=8, HighBit=7, RescaleIntercept=0)
        for tool, method in ((["dcmcjpeg", "+eb", "+q", "30"], "ISO_10918_1"), (["dcmcjpls", "+en", "+md", "20"], "ISO_14495_1")):
            shutil.rmtree(self.folder / "t", ignore_errors=True)
            (self.folder / "t").mkdir()
            for file in sorted((self.folder / "s").iterdir()):
                self.run_tool(*tool, file, self.folder / "t" / file.name)
            info = self.encoded("t")[1]
            self.assertEqual(info["source"]["pairs"]["lossy source"], "DICOM, " + method)
            before, after = sum(file.stat().st_size for file in (self.folder / "t").iterdir()), info["bytes"]["file"]
            self.assertGreater(after, before)
            warning = f"t: the source was already compressed with loss (DICOM, {method}), and the .tag file is {100 * (after / before - 1):.0f} % larger"
            self.assertIn(warning, self.messages)
            run = self.tagrid("encode", "t", "-o", "out.tag", "-f", "--strip", "--json", "run.json")
            self.assertIn("already compressed with loss", run.stderr, "--strip leaves the pair out")
            self.assertEqual(json.loads((self.folder / "run.json").read_text())["lossy_source"], "DICOM, " + method)
            run = self.tagrid("encode", "t", "-o", "out.tag", "-f", "--max-error", "200")
            self.assertEqual((run.returncode, run.stderr), (0, ""), "the file is small")
            (self.folder / "list.tsv").write_text("t\n")
            shutil.rmtree(self.folder / "tags", ignore_errors=True)
            run = self.ok("convert", "--manifest", "list.tsv", "--output-dir", "tags")
            self.assertIn("t: the source was already compressed with loss", run.stderr)
            records = [json.loads(line) for file in (self.folder / "tags").glob("*.jsonl") for line in file.read_text().splitlines()]
            self.assertEqual([record["lossy_source"] for record in records], ["DICOM, " + method])
        # Without a loss, a larger file is not worth a word.
        info = self.encoded("s")[1]
        self.assertNotIn("lossy source", info["source"]["pairs"])
        self.assertNotIn("with loss", self.messages)

    def lossy_source(self, path):
        loss = self.encoded(path)[1]["source"]["pairs"].get("lossy source")
        run = self.tagrid("restore", "out.tag", "-o", "back", "-f")
        self.assertEqual(f"some were compressed with loss ({loss}), which the .tag file records" in run.stderr,
                         loss is not None)
        return loss

    @unittest.skipIf(None in map(shutil.which, ("dcmcjpls", "opj_compress")), "there is no dcmcjpls (dcmtk) or opj_compress (libopenjp2-tools) on this machine")
    def test_a_loss_that_only_the_code_stream_tells_is_known(self):
        smooth = (numpy.add.outer(numpy.arange(64) * 20, numpy.arange(80) * 30) & 4095).astype("uint16")
        self.save("a.dcm", data_set(smooth))
        for options, loss in ((["+el"], None), (["+en", "+md", "5"], "DICOM")):
            self.run_tool("dcmcjpls", *options, self.folder / "a.dcm", self.folder / "b.dcm")
            file = pydicom.dcmread(self.folder / "b.dcm")
            for tag in ("LossyImageCompression", "LossyImageCompressionMethod", "LossyImageCompressionRatio", "DerivationDescription"):
                if tag in file:
                    delattr(file, tag)
            file.file_meta.TransferSyntaxUID = "1.2.840.10008.1.2.4.81"  # near-lossless, of which lossless is a case
            file.save_as(self.folder / "b.dcm")
            self.assertEqual(self.lossy_source("b.dcm"), loss, options)
        smooth.astype(">u2").tofile(self.folder / "slice.raw")
        for options, loss in (([], None), (["-I"], "DICOM")):
            self.run_tool("opj_compress", "-i", self.folder / "slice.raw", "-F", "80,64,1,12,u", "-o", self.folder / "s.j2k", *options)
            stream = (self.folder / "s.j2k").read_bytes()
            for syntax in ("90", "91"):
                file = data_set(smooth)
                file.file_meta.TransferSyntaxUID = "1.2.840.10008.1.2.4." + syntax
                file.PixelData = pydicom.encaps.encapsulate([stream + b"\0" * (len(stream) % 2)])
                file["PixelData"].VR, file["PixelData"].is_undefined_length = "OB", True
                self.save("c.dcm", file)
                self.assertEqual(self.lossy_source("c.dcm"), loss, (options, syntax))
        # What the file says is believed, too.
        file.LossyImageCompression, file.LossyImageCompressionMethod = "01", "ISO_15444_1"
        self.save("c.dcm", file)
        self.assertEqual(self.lossy_source("c.dcm"), "DICOM, ISO_15444_1")

    @unittest.skipIf(shutil.which("dcmcrle") is None, "there is no dcmcrle on this machine (dcmtk)")
    def test_a_wrong_length_of_the_meta_information_comes_back(self):
        self.save("a.dcm", data_set(volume()[0]))
        self.run_tool("dcmcrle", self.folder / "a.dcm", self.folder / "b.dcm")
        for name, wrongs in (("a.dcm", (-2, 2)), ("b.dcm", (-2, 2))):
            good = (self.folder / name).read_bytes()
            at = good.index(b"\x02\0\0\0UL\x04\0") + 8
            for wrong in wrongs:
                length = int.from_bytes(good[at:at + 4], "little") + wrong
                (self.folder / "c.dcm").write_bytes(good[:at] + length.to_bytes(4, "little") + good[at + 4:])
                self.encoded("c.dcm")  # and restores it
                shutil.rmtree(self.folder / "back", ignore_errors=True)
                self.ok("restore", "out.tag", "-o", "back")
                self.assertEqual((self.folder / "back" / "c.dcm").read_bytes()[at:at + 4], length.to_bytes(4, "little"), (name, wrong))

    def test_errors_are_said_in_samples_and_in_values(self):
        self.write_series(volume(), RescaleSlope=2.5, RescaleIntercept=-7)
        run = self.tagrid("encode", "s", "-o", "a.tag", "--max-error", "10", "-v", "--json", "run.json")
        self.assertIn("largest error 4 in stored samples (10 HU)", run.stderr)
        achieved = json.loads((self.folder / "run.json").read_text())["achieved"]
        self.assertEqual((achieved["max_error"], achieved["max_error_in_values"], achieved["units_of_values"]), (4, 10, "HU"))
        self.assertAlmostEqual(achieved["rmse_in_values"], 2.5 * achieved["rmse"])
        self.assertIn("largest error against s: 4 in stored samples (10 HU)", self.tagrid("verify", "a.tag", "--against", "s").stdout)
        self.assertRegex(self.tagrid("info", "a.tag").stdout, r"bound 4, reached 4 in stored samples \(10 HU\)")
        self.write_series(volume(), folder="hu")
        run = self.tagrid("encode", "hu", "-o", "b.tag", "--max-error", "2", "-v")
        self.assertIn("largest error 2 HU", run.stderr)

    def test_what_both_say_of_the_geometry_is_compared(self):
        self.write_series(volume())
        self.encoded("s")
        self.assertIn("geometry: the same (spacing, directions, origin)", self.tagrid("verify", "out.tag", "--against", "s").stdout)
        for changes, words in (({"PixelSpacing": [0.5, 0.3]}, "the spacing along x is 0.25, but 0.3 in the original"),
                               ({"step": (0, 0, 1.6)}, "the spacing along z is 1.5, but 1.6 in the original"),
                               ({"step": (0.25, 0, 1.5)}, "the direction of z is (0, 0, 1.5), but (0.25, 0, 1.5) in the original")):
            shutil.rmtree(self.folder / "t", ignore_errors=True)
            self.write_series(volume(), folder="t", **changes)
            self.assertIn(words, self.assert_refused(65, "out.tag: the ", "verify", "out.tag", "--against", "t", "--json", "run.json", "-f"))
            found = json.loads((self.folder / "run.json").read_text())["geometry"]
            self.assertTrue(any(words in difference for difference in found["differences"]), found)
        for name in ("b.nrrd", "b.nii", "b.mha", "b.h5", "b.tif", "b.raw"):
            self.ok("decode", "out.tag", "-o", name, "-f")
            raw = ("--dims", "31,20,7", "--type", "int16") if name == "b.raw" else ()
            run = self.tagrid("verify", "out.tag", "--against", name, *raw)
            self.assertEqual((run.returncode, run.stderr), (0, ""), name)
            words = "not compared" if raw else "the same (spacing" if name != "b.tif" else "the same (spacing)"
            self.assertIn(f"geometry: {words}", run.stdout, name)

    def test_many_frames_in_one_file(self):
        truth = volume()
        order = [3, 1, 0, 6, 5, 2, 4]
        file = enhanced_ct(truth, order)
        self.save("a.dcm", file)
        samples, info = self.encoded("a.dcm")
        expected = numpy.empty_like(truth)
        expected[order] = truth
        self.assert_same(samples, (expected - 1024).astype("int16"))
        self.assertEqual(info["geometry"]["directions"], [[0.25, 0, 0], [0, 0.5, 0], [0, 0, 1.5]])
        self.assertEqual(info["geometry"]["origin"], [1, 2, 3])
        if shutil.which("gdcmconv"):
            for option in ("--jpegls", "--rle", "--j2k"):
                self.run_tool("gdcmconv", option, "a.dcm", "b.dcm")
                self.encodes(samples, "b.dcm", what=option)
        del file.PerFrameFunctionalGroupsSequence[0]
        self.save("c.dcm", file)
        self.assert_refused(65, "7 frames, but describes 6", "encode", "c.dcm")

    def test_frames_without_places_of_their_own(self):
        truth = volume()
        self.save("a.dcm", data_set(truth, SpacingBetweenSlices=2))
        info = self.encodes((truth - 1024).astype("int16"), "a.dcm")
        self.assertEqual(info["geometry"]["directions"][2], [0, 0, 2])

    def test_frames_that_follow_each_other_downwards(self):
        truth = volume()
        self.save("a.dcm", data_set(truth, SpacingBetweenSlices=-2, position=(0, 0, 30)))
        info = self.encodes((truth[::-1] - 1024).astype("int16"), "a.dcm")
        self.assertEqual(info["geometry"]["origin"], [0, 0, 18])
        self.assertEqual(info["geometry"]["directions"][2], [0, 0, 2])

    def dose(self, samples, offsets, **attributes):
        """A dose as a planning system writes it; its samples have 32 bits."""
        file = data_set(samples, BitsAllocated=32, BitsStored=32, HighBit=31, position=(10, 20, 30), **attributes)
        file.file_meta.MediaStorageSOPClassUID = file.SOPClassUID = "1.2.840.10008.5.1.4.1.1.481.2"
        file.Modality, file.DoseUnits, file.DoseType, file.DoseSummationType = "RTDOSE", "GY", "PHYSICAL", "PLAN"
        file.DoseGridScaling, file.GridFrameOffsetVector = "0.000125", offsets
        for name in ("RescaleSlope", "RescaleIntercept", "RescaleType", "SliceThickness", "SpacingBetweenSlices"):
            delattr(file, name)
        file["PixelData"].VR = "OW"
        return file

    def test_a_dose_has_its_scale_and_its_places(self):
        truth = volume(32, (5, 20, 31))
        for offsets, order, origin, step in (([0, 2, 4, 6, 8], 1, 30, 2), ([30, 32, 34, 36, 38], 1, 30, 2), ([0, -2, -4, -6, -8], -1, 22, 2)):
            self.dose(truth, offsets).save_as(self.folder / "dose.dcm", write_like_original=False)
            info = self.encodes(truth[::order].astype("uint32"), "dose.dcm", what=offsets)
            pairs = info["source"]["pairs"]
            self.assertEqual((float(pairs["rescale_slope"]), float(pairs["rescale_intercept"]), pairs["rescale_units"]), (0.000125, 0, "Gy"))
            self.assertEqual((info["geometry"]["origin"], info["geometry"]["spacing"]), ([10, 20, origin], [0.25, 0.5, step]), offsets)
        # A bound is for doses: 0.01 Gy are 80 steps.
        samples, info = self.encoded("dose.dcm", "--max-error", "0.01")
        self.assertEqual(info["max_error"], 80)
        self.assertLessEqual(abs(samples[::-1].astype("int64") - truth).max(), 80)
        # Coordinates along z, of images that are seen from the other side.
        file = self.dose(truth, [30, 32, 34, 36, 38])
        file.ImageOrientationPatient = [-1, 0, 0, 0, 1, 0]
        self.save("dose.dcm", file)
        info = self.encodes(truth[::-1].astype("uint32"), "dose.dcm")
        self.assertEqual((info["geometry"]["origin"], info["geometry"]["directions"][2]), ([10, 20, 38], [0, 0, -2]))
        # Uneven ones are kept.
        self.dose(truth, [0, 2, 4, 6, 11]).save_as(self.folder / "dose.dcm", write_like_original=False)
        self.assertTrue(self.encoded("dose.dcm")[1]["source"]["pairs"]["slice_positions"].endswith("10 20 41"))
        self.assertIn("elsewhere 2 mm", self.messages)

    def test_a_dose_without_a_scale_is_refused(self):
        for scale in (None, "0"):
            file = self.dose(volume(32, (2, 20, 31)), [0, 2])
            del file.DoseGridScaling
            if scale is not None:
                file.DoseGridScaling = scale
            self.save("dose.dcm", file)
            self.assert_refused(65, "dose.dcm: DICOM file: has doses without a scale (DoseGridScaling)", "encode", "dose.dcm")

    def test_what_is_missing_is_not_invented(self):
        truth = volume()
        info = self.encoded(self.write_series(truth, PixelSpacing=None))[1]
        self.assertIn("PixelSpacing", self.messages)
        self.assertIsNone(info["geometry"]["directions"])
        samples, info = self.encoded(self.write_series(truth, "t", RescaleSlope=0))
        self.assert_same(samples, truth.astype("uint16") if samples.dtype == "uint16" else truth.astype("int16"))

    def test_a_broken_file_of_another_series_does_no_harm(self):
        truth = volume()
        self.write_series(truth)
        self.write_series(truth[:3], series="9.9", names=["x0", "x1", "x2"])
        broken = self.folder / "s" / "x1"
        broken.write_bytes(broken.read_bytes()[:-100])
        self.encodes((truth - 1024).astype("int16"), "s", "--series", "1.2.3")
        self.assert_refused(65, "x1: DICOM file: ends too soon, within", "encode", "s", "--series", "9.9")
        with open(self.folder / "s" / "mask.bin", "wb") as file:
            file.truncate(3 << 30)
        self.encoded("s", "--series", "1.2.3")

    def test_no_positions_at_all(self):
        truth = volume()
        for z in range(7):
            self.save(f"s/{6 - z}.dcm", data_set(truth[z], instance=f"1.2.3.{z}", number=z + 1, position=None))
        info = self.encodes((truth - 1024).astype("int16"), "s")
        self.assertIn("slices have no positions; they are in the order of their numbers, and the distance between them is a guess: their thickness, 3 mm",
                      self.messages)
        self.assertEqual(info["geometry"]["spacing"], [0.25, 0.5, 3])
        for z in range(7):
            self.save(f"t/{z}.dcm", data_set(truth[z], instance=f"1.2.3.{z}", number=z + 1, position=None, SpacingBetweenSlices=2))
            self.save(f"u/{z}.dcm", data_set(truth[z], instance=f"1.2.3.{z}", number=z + 1, position=None, SliceThickness=None))
        for folder, words, spacing in (("t", "is what they say, 2 mm", 2), ("u", "is not known", None)):
            self.assertEqual(self.encoded(folder)[1]["geometry"]["spacing"], [0.25, 0.5, spacing])
            self.assertIn("the distance between them " + words, self.messages)
            self.assertNotIn("missing", self.messages)
        (self.folder / "t" / "3.dcm").unlink()
        self.encoded("t", says="between numbers 3 and 5 (2.dcm and 4.dcm) slices seem to be missing")

    def test_what_is_no_volume_is_refused_by_name(self):
        truth = volume(shape=(5, 6))
        for attributes, text in (({"PhotometricInterpretation": "RGB", "SamplesPerPixel": 3}, "colors (RGB)"),
                                 ({"PhotometricInterpretation": "PALETTE COLOR"}, "colors (PALETTE COLOR)"),
                                 ({"HighBit": 13}, "number 13"), ({"BitsStored": 17}, "17 of 16 bits"), ({"Rows": 0}, "6 x 0"),
                                 ({"Rows": 7}, "have 84")):
            self.save("a.dcm", data_set(truth, **attributes))
            self.assert_refused(65, text, "encode", "a.dcm")
        self.save("a.dcm", data_set(truth))
        whole = (self.folder / "a.dcm").read_bytes()
        (self.folder / "short.dcm").write_bytes(whole[:-1])
        self.assert_refused(65, "short.dcm: DICOM file: ends too soon, within its pixels", "encode", "short.dcm")
        (self.folder / "head.dcm").write_bytes(whole[:400])
        self.assert_refused(65, "head.dcm: ", "encode", "head.dcm")
        self.assert_refused(64, "leave out --dims", "encode", "a.dcm", "--dims", "6,5,1", "--type", "int16")
        self.assert_refused(64, "--rm", "encode", "a.dcm", "--rm", "--strip")
        with open(self.folder / "a.dcm") as file:
            run = subprocess.run([PROGRAM, "encode", f"/dev/fd/{file.fileno()}", "-o", "x.tag"], cwd=self.folder,
                                 text=True, capture_output=True, pass_fds=[file.fileno()])
        self.assertEqual((run.returncode, "give the name of the file itself" in run.stderr), (64, True), run.stderr)
        (self.folder / "empty").mkdir()
        self.assert_refused(65, "no DICOM image", "encode", "empty", "--from", "dicom")

    def test_a_broken_file_among_others_is_an_error(self):
        self.write_series(volume())
        broken = self.folder / "s" / "i003.dcm"
        broken.write_bytes(broken.read_bytes()[:-100])
        self.assert_refused(65, "i003.dcm", "encode", "s")

    def series_with(self, name, content):
        """A whole series of 7 images, and one of its files with other content."""
        truth = volume()
        self.write_series(truth)
        (self.folder / "s" / name).write_bytes(content)
        return truth

    def test_a_destroyed_file_among_its_siblings_is_refused_by_name(self):
        whole = len(volume()[0].tobytes()) // 4
        for name, content, why in (("i006.dcm", b"\0" * whole, "is not a DICOM file"), ("i000.dcm", b"", "is empty"),
                                   ("i006.dcm", b"see the other disk\n", "is not a DICOM file"), ("note.DCM", b"x", "is not a DICOM file"),
                                   ("i007.bak", b"", None), ("i007", b"\0" * 500, None)):
            shutil.rmtree(self.folder / "s", ignore_errors=True)
            truth = self.series_with(name, content)
            if why is None:  # plainly something else
                self.encodes((truth - 1024).astype("int16"), "s",
                             says=f"warning: s: 1 file is not a DICOM image: {name}")
                continue
            message = self.assert_refused(65, f"s: 1 file cannot be read and may belong to series 1.2.3: {name} ({why})", "encode", "s")
            self.assertIn("--gaps-ok", message)
            left = [z for z in range(7) if f"i{z:03}.dcm" != name]
            self.encodes((truth[left] - 1024).astype("int16"), "s", "--gaps-ok", what=name)
            self.assertIn(f"1 file cannot be read, and the volume is without it: {name} ({why})", self.messages)
        # Names without an extension, which have the same pattern as the others.
        self.write_series(volume(), "t", names=[f"IM{z:04}" for z in range(7)])
        (self.folder / "t" / "IM0006").write_bytes(b"\0" * 1000)
        self.assert_refused(65, "IM0006 (is not a DICOM file)", "encode", "t")

    def test_an_image_whose_link_leads_nowhere_is_missed(self):
        truth = volume()
        self.write_series(truth)
        (self.folder / "s" / "readme").symlink_to("lost")  # plainly something else
        self.encodes((truth - 1024).astype("int16"), "s")
        (self.folder / "s" / "i006.dcm").unlink()
        for target in ("/nowhere/i006.dcm", "i006.dcm"):
            (self.folder / "s" / "i006.dcm").symlink_to(target)
            self.assert_refused(65, "i006.dcm (is a broken symbolic link)", "encode", "s")
            (self.folder / "s" / "i006.dcm").unlink()

    def test_a_link_that_leads_in_a_circle_is_none_of_the_slices(self):
        truth = volume()
        self.write_series(truth)
        (self.folder / "s" / "a").symlink_to("a")  # comes before all slices
        self.encodes((truth - 1024).astype("int16"), "s", says="warning: s: 1 file is not a DICOM image: a\n")

    def test_files_that_are_no_images_are_named_once(self):
        truth = volume()
        self.write_series(truth)
        for name in ("report.txt", "DICOMDIR", "study.xml"):
            (self.folder / "s" / name).write_text("something else")
        plan = data_set(truth[0], SOPClassUID="1.2.840.10008.5.1.4.1.1.481.5")
        for tag in ("Rows", "Columns", "PixelData"):
            delattr(plan, tag)
        self.save("s/plan.dcm", plan)
        self.encodes((truth - 1024).astype("int16"), "s")
        self.assertEqual([line for line in self.messages.splitlines() if "warning" in line],
                         ["tagrid: warning: s: 4 files are not DICOM images: DICOMDIR, plan.dcm, report.txt, study.xml"])

    def test_a_file_cut_at_any_byte_is_named_and_does_no_harm_to_other_series(self):
        truth = volume(shape=(4, 5, 6))
        self.write_series(truth, names=[f"a{z}.dcm" for z in range(4)])
        self.write_series(truth[::-1], series="9.9", names=[f"b{z}.dcm" for z in range(4)])
        cut = self.folder / "s" / "a2.dcm"
        whole = cut.read_bytes()
        for size in sorted({*range(0, 140, 20), *range(140, len(whole), 97), whole.index(b"\xe0\x7f\x10\0"), len(whole) - 1}):
            cut.write_bytes(whole[:size])
            message = self.assert_refused(65, "a2.dcm", "encode", "s", "--series", "1.2.3")
            self.assertIn("1.2.3", message, size)
            run = self.tagrid("encode", "s", "--series", "9.9", "-o", "b.tag", "-f")
            self.assertEqual((run.returncode, run.stderr), (0, ""), size)
            self.ok("encode", "s", "--series", "1.2.3", "--gaps-ok", "-o", "a.tag", "-f")
            self.assertEqual(self.info("a.tag")["dims"], [6, 5, 3], size)
        # A name that is unlike all others may belong to any series.
        cut.write_bytes(whole)
        (self.folder / "s" / "odd.dcm").write_bytes(whole[:200])
        for series in ("1.2.3", "9.9"):
            self.assert_refused(65, f"may belong to series {series}: odd.dcm (ends too soon)", "encode", "s", "--series", series)
        # Its header may say to which one it belongs.
        (self.folder / "s" / "odd.dcm").write_bytes(whole[:whole.index(b"\x20\0\x0e\0") + 40])
        self.assert_refused(65, "may belong to series 1.2.3: odd.dcm", "encode", "s", "--series", "1.2.3")
        self.encoded("s", "--series", "9.9")
        self.assertEqual(self.messages, "")
        # A series of which nothing can be read is named where others are.
        self.save("t/only.dcm", data_set(truth[0], series="4.4"))
        lost = (self.folder / "t" / "only.dcm").read_bytes()
        (self.folder / "s" / "odd.dcm").write_bytes(lost[:lost.index(b"\x20\0\x0e\0") + 40])
        self.encoded("s", "--series", "9.9", says="s: 1 other file cannot be read: odd.dcm")

    def test_damaged_files_are_errors_or_other_samples_and_no_more(self):
        truth = volume(shape=(16, 16))
        self.save("a.dcm", data_set(truth))
        files = [(self.folder / "a.dcm").read_bytes()]
        if shutil.which("gdcmconv"):
            for option in ("--jpegls", "--rle", "--j2k", "--jpeg"):
                self.run_tool("gdcmconv", option, "a.dcm", "b.dcm")
                files.append((self.folder / "b.dcm").read_bytes())
        random = numpy.random.default_rng(1)
        for whole in files:
            for i in some(range(25), 3):
                broken = bytearray(whole[:random.integers(140, len(whole))] if i % 4 == 0 else whole)
                for _ in range(random.integers(0, 6)):
                    broken[random.integers(140, len(broken))] = random.integers(0, 256)
                (self.folder / "broken.dcm").write_bytes(broken)
                run = self.tagrid("encode", "broken.dcm", "-o", "broken.tag", "-f", "-q")
                # A library that crashes is a failure of the reader, 74.
                self.assertIn(run.returncode, (0, 64, 65, 74), f"{i}: {run.stderr}")
                if run.returncode == 74:
                    self.assertIn("tagrid-read-dicom", run.stderr)

    def test_files_that_others_made(self):
        folder = pathlib.Path(pydicom.__file__).parent / "data" / "test_files"
        if not (folder / "MR_small.dcm").exists():
            print("skipped: pydicom's files are not on this machine")
            return
        # One image in many transfer syntaxes.
        truth = pydicom.dcmread(folder / "MR_small.dcm").pixel_array
        for name in ("MR_small", "MR_small_implicit", "MR_small_bigendian", "MR_small_expb", "MR_small_RLE", "MR_small_jpeg_ls_lossless",
                     "MR_small_jp2klossless", "MR_small_padded"):
            shutil.copy(folder / f"{name}.dcm", self.folder)
            self.encodes(truth[None].astype("int16"), f"{name}.dcm", what=name)
        for name in ("CT_small", "image_dfl", "rtdose", "rtdose_expb", "rtdose_1frame", "693_J2KI",
                     "J2K_pixelrep_mismatch", "JPEG2000", "rtdose_rle", "JPGExtended"):
            shutil.copy(folder / f"{name}.dcm", self.folder)
            file = pydicom.dcmread(folder / f"{name}.dcm")
            samples, info = self.encoded(f"{name}.dcm")
            try:
                truth = file.pixel_array
            except (RuntimeError, NotImplementedError, AttributeError):
                continue  # pydicom has no decoder for it here
            except OverflowError:
                continue  # pydicom 2.4 with numpy 2: signed samples in JPEG 2000
            truth = truth.reshape((-1,) + truth.shape[-2:]).astype("int64")
            pairs = info["source"]["pairs"]
            self.assert_same(samples, (truth + int(pairs.get("dicom_added_intercept", 0))).astype(samples.dtype), name)
        shutil.copy(folder / "MR_truncated.dcm", self.folder)
        self.assert_refused(65, "ends too soon, within its pixels", "encode", "MR_truncated.dcm")
        shutil.copy(folder / "SC_rgb_rle.dcm", self.folder)
        self.assert_refused(65, "colors", "encode", "SC_rgb_rle.dcm")
        shutil.copy(folder / "liver_1frame.dcm", self.folder)
        self.assert_refused(65, "liver_1frame.dcm: DICOM file: ", "encode", "liver_1frame.dcm")
        shutil.copy(folder / "rtplan.dcm", self.folder)
        self.assert_refused(65, "no DICOM image", "encode", "rtplan.dcm")

        root = folder / "dicomdirtests"
        for series, z in (("98892001/CT5N", 5), ("77654033/CT2", 4)):
            files = [pydicom.dcmread(path) for path in (root / series).iterdir()]
            files.sort(key=lambda file: file.ImagePositionPatient[2])
            samples, info = self.encoded(root / series)
            self.assertEqual(len(files), z)
            stored = numpy.stack([file.pixel_array for file in files]).astype("int64")
            added = int(info["source"]["pairs"].get("dicom_added_intercept", 0))
            self.assert_same(samples, (stored + added).astype(samples.dtype), series)
        self.assertIn("elsewhere", self.messages)  # the gap of CT2
        self.assert_refused(64, "holds 2 volumes", "encode", root / "98892001/CT2N", "-o", "x.tag")
        self.assert_refused(64, "holds 7 volumes", "encode", root / "98892003/MR700", "-o", "x.tag")
        if (root / "DICOMDIR").exists():
            self.assert_refused(64, "volumes", "encode", root / "DICOMDIR", "-o", "x.tag")


if __name__ == "__main__":
    main()
