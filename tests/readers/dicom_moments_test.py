"""Several images of DICOM at one place: volumes to choose from, each told from the others, or an error that names the files.

    dicom_moments_test.py PROGRAM
"""

import itertools
import re
import unittest

from dicom_test import data_set, volume
from other_readers import ReaderTest, main, pydicom


@unittest.skipIf(pydicom is None, "there is no pydicom on this machine")
class DicomMoments(ReaderTest):
    def assert_samples(self, path, truth, *options):
        """The same samples, with -1024 added."""
        for command in (("encode", path, "-o", "out.tag", "-f", *options), ("decode", "out.tag", "-o", "out.raw", "-f")):
            self.ok(*command)
        self.assertEqual((self.folder / "out.raw").read_bytes(), (truth - 1024).astype("<i2").tobytes(), (path, options))

    def choices(self, path):
        """The names and texts that are listed, which all differ."""
        run = self.tagrid("encode", path, "-o", "x.tag", "-f")
        self.assertEqual(run.returncode, 64, run.stderr)
        choices = re.findall(r"^ +\d+  (\S+)  (.*)$", run.stderr, re.MULTILINE)
        self.assertEqual(len({text for _, text in choices}), len(choices), choices)
        return choices

    def write(self, folder, images, attributes):
        """Slices [moment, z]; attributes(moment, z) tells them apart."""
        count, slices = images.shape[:2]
        for moment, z in itertools.product(range(count), range(slices)):
            uid = f"5.{moment}.{z}"
            given = {"number": moment * slices + z + 1} | attributes(moment, z)
            self.save(f"{folder}/{moment}_{z}.dcm", data_set(images[moment, z], instance=uid, position=(0, 0, 2 * z), **given))

    def test_images_at_one_place_are_volumes_by_what_tells_them_apart(self):
        images = volume(shape=(2, 3, 5, 6))
        for i, (attributes, words) in enumerate((
                (lambda m, z: {"TemporalPositionIdentifier": m + 1}, ["TemporalPositionIdentifier 1", "TemporalPositionIdentifier 2"]),
                (lambda m, z: {"EchoTime": (9.5, 12.25)[m]}, ["EchoTime 9.5", "EchoTime 12.25"]),
                (lambda m, z: {"AcquisitionTime": ("101500", "101530.5")[m], "number": z + 1}, ["AcquisitionTime 101500", "AcquisitionTime 101530.5"]),
                (lambda m, z: {"AcquisitionTime": f"10150{3 * m + z}", "number": z + 1}, ["AcquisitionTime 101500 to 101502", "AcquisitionTime 101503 to 101505"]),
                (lambda m, z: {"ContentTime": f"10150{2 * z + m}", "number": z + 1}, ["ContentTime 101500 to 101504", "ContentTime 101501 to 101505"]),
                (lambda m, z: {"TriggerTime": str(100 * m + z), "AcquisitionNumber": 3 * m + z}, ["TriggerTime 0 to 2", "TriggerTime 100 to 102"]),
                (lambda m, z: {"DiffusionBValue": 1000.0 * m}, ["DiffusionBValue 0", "DiffusionBValue 1000"]),
                (lambda m, z: {"ImageType": ["DERIVED", "PRIMARY", "DIXON", ("FAT", "WATER")[m]]}, ["FAT", "WATER"]),
                (lambda m, z: {}, ["InstanceNumber 1 to 3", "InstanceNumber 4 to 6"]))):
            self.write(f"s{i}", images, attributes)
            choices = self.choices(f"s{i}")
            self.assertEqual(len(choices), 2, choices)
            for moment, (name, text) in enumerate(choices):
                self.assertTrue(text.endswith(words[moment]), (text, words))
                self.assert_samples(f"s{i}", images[moment], "--series", name)

    def test_echoes_and_moments_together(self):
        images = volume(shape=(4, 3, 5, 6))
        self.write("s", images, lambda m, z: {"EchoTime": 1.5 + m % 2, "TemporalPositionIdentifier": m // 2 + 1})
        self.write("t", images, lambda m, z: {"EchoTime": 1.5 + m % 2, "AcquisitionTime": f"1015{m // 2}{z}", "number": z + 1})
        for folder, order in (("s", [0, 1, 2, 3]), ("t", [0, 2, 1, 3])):
            choices = self.choices(folder)
            self.assertEqual(len(choices), 4, choices)
            for moment, (name, text) in zip(order, choices):
                self.assertIn(f"EchoTime {1.5 + moment % 2}", text)
                self.assert_samples(folder, images[moment], "--series", name)

    def test_an_image_that_is_there_twice_is_refused_and_the_advice_helps(self):
        truth = volume(shape=(3, 5, 6))
        self.write("s", truth[None], lambda m, z: {})
        (self.folder / "s" / "copy.dcm").write_bytes((self.folder / "s" / "0_1.dcm").read_bytes())
        message = self.assert_refused(65, "are one image twice (SOPInstanceUID); remove one of them", "encode", "s")
        self.assertIn("copy.dcm", message)
        (self.folder / "s" / "copy.dcm").unlink()
        self.encodes((truth - 1024).astype("int16"), "s")
        # One slice was taken again, at another time; slices have times of their own.
        self.write("t", truth[None], lambda m, z: {"AcquisitionTime": f"10150{z}"})
        self.save("t/again.dcm", data_set(truth[0], instance="7", number=9, position=(0, 0, 2), AcquisitionTime="101509"))
        message = self.assert_refused(65, "they differ in AcquisitionTime (101501 and 101509), InstanceNumber (2 and 9)); move one of them", "encode", "t")
        (self.folder / "elsewhere").mkdir()
        (self.folder / "t" / "again.dcm").rename(self.folder / "elsewhere" / "again.dcm")
        self.encodes((truth - 1024).astype("int16"), "t")

    def test_localizers_in_several_directions_are_told_apart(self):
        truth = volume(shape=(7, 5, 6))
        directions = [[1, 0, 0, 0, 1, 0], [0, 1, 0, 0, 0, -1], [1, 0, 0, 0, 0, -1], [0, 1, 0, 1, 0, 0], [-1, 0, 0, 0, 1, 0],
                      [0.8, 0.6, 0, -0.6, 0.8, 0], [1, 0, 0, 0, 0.8, 0.6]]
        for i, direction in enumerate(directions):
            self.save(f"s/{i}.dcm", data_set(truth[i], instance=f"8.{i}", number=i + 1, ImageOrientationPatient=direction))
        choices = self.choices("s")
        self.assertEqual(len(choices), 7)
        for word in ("axial", "sagittal", "coronal", "axial, turned to the normal 0 -0.6 0.8"):
            self.assertTrue(any(word in text for _, text in choices), choices)
        for i, (name, text) in enumerate(choices):
            self.assert_samples("s", truth[i], "--series", name)
        # Nothing but their files differs.
        for i, uid in enumerate(("1.1", "1.2", "1.3")):
            self.save(f"t/{i}.dcm", data_set(truth[i], instance=f"9.{i}", series=uid))
        self.assertIn("begins with 1.dcm", self.choices("t")[1][1])

    def enhanced(self, truth, of_frame):
        Dataset, Sequence = pydicom.Dataset, pydicom.Sequence
        file = data_set(truth.reshape(-1, *truth.shape[2:]), SOPClassUID="1.2.840.10008.5.1.4.1.1.4.1", PixelSpacing=None)
        shared = Dataset()
        measures = Dataset()
        measures.PixelSpacing, measures.SliceThickness = [0.5, 0.25], 1
        shared.PixelMeasuresSequence = Sequence([measures])
        file.SharedFunctionalGroupsSequence = Sequence([shared])
        frames = []
        for moment, z in itertools.product(*map(range, truth.shape[:2])):
            frame, place, content = Dataset(), Dataset(), Dataset()
            place.ImagePositionPatient = [0, 0, 2 * z]
            frame.PlanePositionSequence, frame.FrameContentSequence = Sequence([place]), Sequence([content])
            of_frame(frame, content, moment, z)
            frames.append(frame)
        file.PerFrameFunctionalGroupsSequence = Sequence(frames)
        return file

    def test_frames_of_one_file_are_volumes_too(self):
        images = volume(shape=(2, 3, 5, 6))
        def by_index(frame, content, moment, z):
            content.DimensionIndexValues = [z + 1, moment + 1]
        def by_echo(frame, content, moment, z):
            echo = pydicom.Dataset()
            echo.EffectiveEchoTime = 2.5 + moment
            frame.MREchoSequence = pydicom.Sequence([echo])
        def by_b_value(frame, content, moment, z):
            diffusion = pydicom.Dataset()
            diffusion.DiffusionBValue = 500.0 * moment
            frame.MRDiffusionSequence = pydicom.Sequence([diffusion])
        def by_segment(frame, content, moment, z):
            segment = pydicom.Dataset()
            segment.ReferencedSegmentNumber = moment + 1
            frame.SegmentIdentificationSequence = pydicom.Sequence([segment])
        for of_frame, word in ((by_index, "DimensionIndexValues, the second 1"), (by_echo, "EffectiveEchoTime 2.5"),
                               (by_b_value, "DiffusionBValue 0"), (by_segment, "ReferencedSegmentNumber 1")):
            self.save("a.dcm", self.enhanced(images, of_frame))
            choices = self.choices("a.dcm")
            self.assertIn(word, choices[0][1])
            for moment, (name, text) in enumerate(choices):
                self.assert_samples("a.dcm", images[moment], "--series", name)
        self.save("a.dcm", self.enhanced(images, lambda *_: None))
        self.assertNotIn("remove", self.assert_refused(65, "a.dcm, frame 1 and a.dcm, frame 4 are at the same position",
                                                       "encode", "a.dcm"))

    def test_frames_in_time_have_no_places(self):
        truth = volume(shape=(4, 5, 6))
        file = data_set(truth, FrameIncrementPointer=0x00181063, FrameTime=40, SpacingBetweenSlices=2)
        self.save("a.dcm", file)
        info = self.encodes((truth - 1024).astype("int16"), "a.dcm")
        self.assertIn("its frames follow each other by FrameTime (FrameIncrementPointer), not in space", self.messages)
        self.assertEqual((info["geometry"]["directions"], info["geometry"]["spacing"]), (None, [0.25, 0.5, None]))

    def test_vectors_of_nuclear_medicine_tell_frames_apart(self):
        images = volume(shape=(2, 3, 5, 6))
        file = data_set(images.reshape(6, 5, 6), FrameIncrementPointer=[0x00540010, 0x00540080], SpacingBetweenSlices=2)
        file.EnergyWindowVector, file.SliceVector = [1, 1, 1, 2, 2, 2], [1, 2, 3, 3, 2, 1]
        self.save("a.dcm", file)
        choices = self.choices("a.dcm")
        self.assertEqual([text.split(", ")[-1] for _, text in choices], ["EnergyWindowVector 1", "EnergyWindowVector 2"])
        for (name, _), truth in zip(choices, (images[0], images[1, ::-1])):
            info = self.encodes((truth - 1024).astype("int16"), "a.dcm", "--series", name)
            self.assertEqual((info["geometry"]["origin"], info["geometry"]["directions"][2]), ([0, 0, 0], [0, 0, 2]))

    def test_one_file_of_a_series_is_said_to_be_one(self):
        truth = volume(shape=(3, 5, 6))
        self.write("s", truth[None], lambda m, z: {})
        self.encodes((truth[1:2] - 1024).astype("int16"), "s/0_1.dcm")
        self.assertIn("s/0_1.dcm: is one image of a series, and 0_0.dcm is another one; give their directory to read all of them", self.messages)
        self.encodes((truth - 1024).astype("int16"), "s")
        self.assertEqual(self.messages, "")

    def test_parts_of_a_concatenation_that_are_missing_are_said(self):
        truth = volume(shape=(4, 5, 6))
        for part in range(2):
            file = data_set(truth[2 * part:2 * part + 2], instance=f"6.{part}", position=(0, 0, 6 * part), ConcatenationUID="1.9",
                            InConcatenationNumber=part + 1, InConcatenationTotalNumber=2)
            self.save(f"s/{part}.dcm", file)
        self.encodes((truth - 1024).astype("int16"), "s")
        self.assertEqual(self.messages, "")
        (self.folder / "s" / "1.dcm").unlink()
        self.encoded("s", says="s: 0.dcm is one of 2 files of a concatenation, of which 1 is missing")


if __name__ == "__main__":
    main()
