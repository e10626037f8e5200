"""Several images of DICOM at one place: volumes to choose from, each told from the others, or an error that names the files.
"""

import itertools
import random
import re
import unittest

from other_readers import ReaderTest, main, numpy, pydicom
from scans import data_set, enhanced, sequence, volume

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

    def save_enhanced(self, truth, of_frame):
        """Frames [moment, z]; of_frame(moment, z) has what tells them apart, by the sequence that it is in."""
        frames = []
        for moment, z in itertools.product(*map(range, truth.shape[:2])):
            groups = {"PlanePositionSequence": sequence(ImagePositionPatient=[0, 0, 2 * z])}
            frames.append(groups | {name: sequence(**values) for name, values in of_frame(moment, z).items()})
        samples = truth.reshape(-1, *truth.shape[2:])
        self.save("a.dcm", enhanced(samples, frames, SOPClassUID="1.2.840.10008.5.1.4.1.1.4.1"))

    def test_frames_of_one_file_are_volumes_too(self):
        images = volume(shape=(2, 3, 5, 6))
        for of_frame, word in (
                (lambda m, z: {"FrameContentSequence": {"DimensionIndexValues": [z + 1, m + 1]}},
                 "DimensionIndexValues, the second 1"),
                (lambda m, z: {"MREchoSequence": {"EffectiveEchoTime": 2.5 + m}}, "EffectiveEchoTime 2.5"),
                (lambda m, z: {"MRDiffusionSequence": {"DiffusionBValue": 500.0 * m}}, "DiffusionBValue 0"),
                (lambda m, z: {"SegmentIdentificationSequence": {"ReferencedSegmentNumber": m + 1}},
                 "ReferencedSegmentNumber 1")):
            self.save_enhanced(images, of_frame)
            choices = self.choices("a.dcm")
            self.assertIn(word, choices[0][1])
            for moment, (name, text) in enumerate(choices):
                self.assert_samples("a.dcm", images[moment], "--series", name)
        self.save_enhanced(images, lambda *_: {})
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


# Acquisitions of one DICOM series whose slices lie between each other are volumes to choose from; slices of one
# acquisition stay one volume. pydicom says which positions and samples belong together.

# What makes an acquisition: attributes of a slice of each of two.
TWO = (("AcquisitionNumber", 1, 2), ("TriggerTime", 0, 400), ("NominalPercentageOfCardiacPhase", 30.0, 70.0),
       ("NominalPercentageOfRespiratoryPhase", 0.0, 50.0), ("TemporalPositionIdentifier", 1, 2), ("ContrastBolusAgent", None, "Iohexol"),
       ("KVP", 80, 140), ("PatientPosition", "HFS", "FFS"), ("ConvolutionKernel", "B30f", "B70f"), ("EchoNumbers", 1, 2),
       ("EchoTime", 2.5, 5), ("DiffusionBValue", 0.0, 800.0), ("FrameOfReferenceUID", "1.2.8", "1.2.9"), ("GantryDetectorTilt", 0, 15),
       ("ImageType", ["DERIVED", "PRIMARY", "AXIAL", "80KV"], ["DERIVED", "PRIMARY", "AXIAL", "140KV"]))


@unittest.skipIf(pydicom is None, "there is no pydicom on this machine")
class Interleaved(ReaderTest):
    def write(self, folder, groups, numbers_go_on=True, **common):
        """Slices of several groups, each a list of (z, attributes). The samples of a slice are unlike those of all others."""
        self.count = 0
        for g, group in enumerate(groups):
            for i, (z, attributes) in enumerate(group):
                self.count += 1
                samples = numpy.full((4, 5), 100 * (g + 1) + i, "uint16")
                number = self.count if numbers_go_on else i + 1
                self.save(f"{folder}/{g}_{i:02}.dcm", data_set(samples, instance=f"7.{g}.{i}", position=(0, 0, z),
                                                               **({"number": number} | common | attributes)))

    def seen_by_pydicom(self, folder, group):
        """The positions and levels of the slices of a group, by position."""
        files = [pydicom.dcmread(path) for path in sorted((self.folder / folder).glob(f"{group}_*.dcm"))]
        return sorted((float(file.ImagePositionPatient[2]), int(file.pixel_array[0, 0]) - 1024) for file in files)

    def assert_volume(self, path, expected, *options, says=""):
        """The slices are at these positions, and have these levels."""
        samples, info = self.encoded(path, *options, says=says)
        self.assertEqual(samples[:, 0, 0].tolist(), [level for _, level in expected], path)
        # Uneven positions are in a pair.
        pair = [line.split(":=")[1] for line in self.ok("info", "out.tag").stdout.splitlines() if "slice_positions" in line]
        if not pair:
            origin, step = info["geometry"]["origin"][2], info["geometry"]["directions"][2][2] if len(expected) > 1 else 0
            for i, (z, _) in enumerate(expected):
                self.assertAlmostEqual(origin + i * step, z, places=2, msg=path)

    def assert_split(self, folder, groups, word=""):
        run = self.tagrid("encode", folder, "-o", "x.tag", "-f")
        self.assertEqual(run.returncode, 64, (folder, run.stderr))
        choices = re.findall(r"^ +\d+  (\S+)  (.*)$", run.stderr, re.MULTILINE)
        self.assertEqual((len(choices), len(set(choices)), len({name for name, _ in choices})), (groups,) * 3, run.stderr)
        self.assertIn(word, run.stderr)
        seen = sorted(tuple(self.seen_by_pydicom(folder, g)) for g in range(groups))
        got = []
        for name, _ in choices:
            samples, _ = self.encoded(folder, "--series", name)
            got.append(samples[:, 0, 0].tolist())
        self.assertEqual(sorted(got), sorted([level for _, level in group] for group in seen), folder)
        return choices

    def test_every_attribute_of_an_acquisition_splits_slices_that_interleave(self):
        for name, one, other in TWO:
            for numbers_go_on in (True, False):
                values = [{} if value is None else {name: value} for value in (one, other)]
                folder = f"{name}{numbers_go_on}"
                self.write(folder, [[(2 * i, values[0]) for i in range(5)], [(2 * i + 1, values[1]) for i in range(5)]], numbers_go_on)
                choices = self.assert_split(folder, 2, name)
                # The names stay when one of the two is gone.
                for path in (self.folder / folder).glob("1_*.dcm"):
                    path.unlink()
                left = [name for name, _ in choices if self.tagrid("encode", folder, "--series", name, "-o", "y.tag", "-f").returncode == 0]
                self.assertEqual(len(left), 1, (name, choices))

    def test_shifts_of_any_size_and_ranges_that_overlap(self):
        rng = random.Random(5)
        shifts = {"half": [2 * i + 1 for i in range(6)], "quarter": [2 * i + 0.5 for i in range(6)], "tiny": [2 * i + 0.01 for i in range(6)],
                  "irregular": [2 * i + rng.uniform(0.2, 1.8) for i in range(6)], "overlapping": [7 + 2 * i for i in range(6)],
                  "other_step": [0.5 + 3 * i for i in range(5)], "some_equal": [3 * i for i in range(5)], "inside": [5, 7]}
        for name, places in shifts.items():
            self.write(name, [[(2 * i, {"AcquisitionNumber": 1}) for i in range(6)], [(z, {"AcquisitionNumber": 2}) for z in places]])
            self.assert_split(name, 2, "AcquisitionNumber")
        self.write("four", [[(2 * i + 0.5 * g, {"AcquisitionNumber": 1 + g // 2, "EchoTime": 1 + g % 2}) for i in range(4)] for g in range(4)])
        self.assert_split("four", 4, "EchoTime")
        # Phases of a scan in blocks: each block of each phase has a number.
        self.write("blocks", [[(2 * i + g, {"NominalPercentageOfCardiacPhase": 40.0 * g, "AcquisitionNumber": 2 * (i // 4) + g}) for i in range(12)]
                              for g in range(2)])
        self.assert_split("blocks", 2, "NominalPercentageOfCardiacPhase")

    def test_slices_of_one_acquisition_stay_one_volume(self):
        n = 12
        by_slice = {
            "times": lambda i: {"AcquisitionTime": f"1200{i:02}", "ContentTime": f"1201{(7 * i) % n:02}"},
            "step_and_shoot": lambda i: {"AcquisitionNumber": i + 1, "AcquisitionTime": f"1200{i:02}"},
            "rotations_of_four": lambda i: {"AcquisitionNumber": i // 4 + 1, "AcquisitionTime": f"1200{i // 4:02}"},
            "chest_and_abdomen": lambda i: {"AcquisitionNumber": 1 if i < 7 else 2, "ContrastBolusAgent": "none" if i < 7 else "Iohexol"},
            "a_part_taken_again": lambda i: {"AcquisitionNumber": 2 if 4 <= i < 8 else 1},
            "one_slice_taken_again": lambda i: {"AcquisitionNumber": 2 if i == 5 else 1},
            "current": lambda i: {"XRayTubeCurrent": 100 + i % 2, "ExposureTime": 500 + i % 3},
        }
        for name, attributes in by_slice.items():
            self.write(name, [[(2 * i, attributes(i)) for i in range(n)]])
            self.assert_volume(name, self.seen_by_pydicom(name, 0))
            self.assertEqual(self.messages, "", name)
        # MR: every second slice is acquired in a second pass, at other times but with one number.
        self.write("passes", [[(2 * i, {"AcquisitionNumber": 1, "AcquisitionTime": f"12{i % 2}0{i:02}"}) for i in range(n)]], Modality="MR")
        self.assert_volume("passes", self.seen_by_pydicom("passes", 0))
        self.assertEqual(self.messages, "")

    def test_what_may_be_two_acquisitions_is_said(self):
        n = 10
        for folder, attributes, common, said in (
                ("times", lambda i: {"AcquisitionTime": f"12{i % 2}0{i:02}"}, {},
                 "slices of AcquisitionTime 120000 to 120008 and of 121001 to 121009 are interleaved"),
                ("moments", lambda i: {"TriggerTime": 400 * (i % 2)}, {"Modality": "MR"},
                 "slices of TriggerTime 0.0 and of TriggerTime 400.0 are interleaved"),
                ("frames", lambda i: {"FrameOfReferenceUID": f"1.2.{i // 5}"}, {}, "different coordinate systems (FrameOfReferenceUID)")):
            self.write(folder, [[(2 * i, attributes(i)) for i in range(n)]], **common)
            self.assert_volume(folder, self.seen_by_pydicom(folder, 0), says=said)

    def test_gaps_and_rounding_in_attributes_leave_one_volume(self):
        n = 12
        gaps = {f"{state}{name}": (name, value, lambda i, v, n=name, s=state: {} if i in (3, 7) and not s else {n: s if i in (3, 7) else v})
                for name, value in (("ConvolutionKernel", "B30f"), ("PatientPosition", "HFS"), ("AcquisitionNumber", 1)) for state in ("", None)}
        gaps["alternating"] = ("PatientPosition", "HFS", lambda i, v: {"PatientPosition": v} if i % 2 else {})
        for folder, (name, value, attributes) in gaps.items():
            self.write(folder, [[(2 * i, attributes(i, value)) for i in range(n)]])
            self.assert_volume(folder, self.seen_by_pydicom(folder, 0), says=f"without {name}")
        more = ["ORIGINAL", "PRIMARY", "AXIAL"]
        self.write("type", [[(2 * i, {"ImageType": [*more, "SPI"] if i in (3, 7) else more}) for i in range(n)]])
        self.assert_volume("type", self.seen_by_pydicom("type", 0), says="ImageType")
        for name, one, other in (("GantryDetectorTilt", 0, 0.01), ("EchoTime", 1.5, 1.50001), ("KVP", 120, 120.01)):
            self.write(f"{name}rounded", [[(2 * i, {name: (one, other)[i % 2]}) for i in range(n)]])
            self.assert_volume(f"{name}rounded", self.seen_by_pydicom(f"{name}rounded", 0))
            self.assertEqual(self.messages, "", name)
        # Passes of MR have numbers or inversion times of their own.
        for name, value in (("AcquisitionNumber", lambda i: i % 2 + 1), ("InversionTime", lambda i: 100 * (i % 6))):
            self.write(f"{name}mr", [[(2 * i, {name: value(i)}) for i in range(n)]], Modality="MR")
            self.assert_volume(f"{name}mr", self.seen_by_pydicom(f"{name}mr", 0), says=f"of {name}")

    def test_a_second_sweep_without_a_pause_is_said(self):
        for folder, second, pause in (("up", range(10), 0), ("down", range(9, -1, -1), 0), ("pause_within", range(10), 30)):
            order = [2 * i for i in range(10)] + [2 * i + 1 for i in second]
            times = [i + (pause if i > 4 else 0) for i in range(20)]
            self.write(folder, [[(z, {"AcquisitionTime": f"1210{time:02}"}) for z, time in zip(order, times)]])
            self.assert_volume(folder, self.seen_by_pydicom(folder, 0), says="are interleaved")

    def test_frames_of_enhanced_files(self):
        images = volume(shape=(2, 4, 5, 6))
        for group, name, of_frame in (
                ("FrameContentSequence", "StackID", lambda g, z: {"StackID": str(g + 1), "InStackPositionNumber": z + 1}),
                ("FrameContentSequence", "TemporalPositionIndex",
                 lambda g, z: {"TemporalPositionIndex": g + 1, "StackID": "1", "InStackPositionNumber": z + 1}),
                ("CTXRayDetailsSequence", "KVP", lambda g, z: {"KVP": 80 + 60 * g}),
                ("ContrastBolusUsageSequence", "ContrastBolusAgentAdministered",
                 lambda g, z: {"ContrastBolusAgentAdministered": ("NO", "YES")[g]}),
                ("CardiacSynchronizationSequence", "NominalPercentageOfCardiacPhase",
                 lambda g, z: {"NominalPercentageOfCardiacPhase": 40.0 * g})):
            frames = [{"PlanePositionSequence": sequence(ImagePositionPatient=[0, 0, 2 * z + g]), group: sequence(**of_frame(g, z))}
                      for g in range(2) for z in range(4)]
            file = enhanced(images.reshape(8, 5, 6), frames, thickness=2)
            self.save(f"{name}.dcm", file)
            run = self.tagrid("encode", f"{name}.dcm", "-o", "x.tag", "-f")
            self.assertEqual(run.returncode, 64, (name, run.stderr))
            self.assertIn(name, run.stderr)
            # pydicom has the frames in the order of the file.
            seen = pydicom.dcmread(self.folder / f"{name}.dcm").pixel_array.astype(int) - 1024
            for g in range(2):
                self.encodes(seen[4 * g:4 * g + 4].astype("int16"), f"{name}.dcm", "--series", str(g + 1), what=name)

    def test_find_lists_each(self):
        self.write("s", [[(2 * i + g, {"AcquisitionNumber": g + 1}) for i in range(4)] for g in range(2)])
        run = self.search(".")
        lines = [line for line in run.stdout.splitlines() if line and not line.startswith("#")]
        self.assertEqual(len(lines), 2, run.stdout)


if __name__ == "__main__":
    main()
