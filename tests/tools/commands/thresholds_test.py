"""No voxel changes its side of a threshold: numpy compares masks of the original with masks of what is decoded.

    thresholds_test.py TAGRID
"""

import itertools
import json
import struct
import unittest

from program import ProgramTest, decoder, numpy

from forged import Forged

TYPES = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64")
SHAPE = (19, 40, 35)


def volume(type, shape=SHAPE, seed=1):
    """Balls with noise, from about -100 to 100, or from 0 to 200."""
    random = numpy.random.default_rng(seed)
    z, y, x = numpy.indices(shape)
    smooth = 60 * numpy.sin(x / 5) * numpy.cos(y / 7) + 2 * z - 20
    noisy = numpy.clip(smooth + random.normal(0, 6, shape), -100, 100)
    if type.startswith("u"):
        noisy = noisy + 100
    samples = noisy.astype(type) if "float" in type else numpy.rint(noisy).astype(type)
    if "float" in type:
        samples[random.random(shape) < 0.01] = numpy.nan
        samples[0, 0, :2] = numpy.inf, -numpy.inf
        samples[1, :5, :5] = -0.0
    return samples


class Thresholds(ProgramTest):
    def encode(self, samples, *options, code=0, name="v.tag"):
        (self.folder / "v.raw").write_bytes(samples.tobytes())
        dims = ",".join(map(str, samples.shape[::-1]))
        return self.tagrid("encode", "v.raw", "--dims", dims, "--type", samples.dtype.name, *options, "-q", "-f", "-o",
                           name, code=code)

    def write_nrrd(self, name, samples, lines="", type="int16"):
        sizes = " ".join(map(str, samples.shape[::-1]))
        header = f"NRRD0004\ntype: {type}\ndimension: 3\nsizes: {sizes}\nencoding: raw\nendian: little\n{lines}\n"
        (self.folder / name).write_bytes(header.encode() + samples.tobytes())

    def decode(self, samples, *options, shape=None, name="v.tag"):
        self.tagrid("decode", name, *options, "-q", "-f", "-o", "back.raw")
        return numpy.frombuffer((self.folder / "back.raw").read_bytes(), samples.dtype).reshape(shape or samples.shape)

    def check(self, samples, thresholds, *options, largest=None):
        self.encode(samples, "--threshold=" + ",".join(map(str, thresholds)), *options)
        back = self.decode(samples)
        for threshold in thresholds:
            numpy.testing.assert_array_equal(back >= threshold, samples >= threshold, f"{threshold} {options}")
        if largest is not None:
            finite = numpy.isfinite(samples)
            self.assertLessEqual(numpy.abs(back[finite].astype("f8") - samples[finite].astype("f8")).max(), largest)
        self.tagrid("verify", "v.tag", "-q", "--against", "v.raw", "--dims", ",".join(map(str, samples.shape[::-1])),
                    "--type", samples.dtype.name)
        recorded = self.info("v.tag")["achieved"]["thresholds"]
        self.assertEqual([entry["samples_at_least"] for entry in recorded],
                         [int((samples >= threshold).sum()) for threshold in sorted(thresholds)])
        return back, recorded

    def test_masks_are_those_of_the_original_for_every_type_and_bound(self):
        for type in TYPES:
            samples = volume(type)
            base = 100 if type.startswith("u") else 0
            thresholds = [base - 40, base, base + 30]
            for options, largest in ((("--max-error", "5"), 5), (("--max-error", "9", "--surface-error", "2"), 9),
                                     (("--psnr", "30"), None), (("--psnr", "32", "--max-error", "30"), 30),
                                     (("--bits", "1.5"), None),
                                     (("--max-error", "300", "--grid", "derived", "--effort", "best"), 300),
                                     (("--max-error", "7", "--overviews", "4", "--lead", "0"), 7),
                                     (("--max-error", "4", "--mesh-error", "20"), 4), ((), 0)):
                with self.subTest(type=type, options=options):
                    _, recorded = self.check(samples, thresholds, *options, largest=largest)
                    moved = sum(entry["samples_moved"] for entry in recorded)
                    self.assertEqual(moved == 0, options == ())

    def test_without_them_masks_differ(self):
        samples = volume("int16")
        self.encode(samples, "--max-error", "5")
        self.assertGreater(((self.decode(samples) >= 0) != (samples >= 0)).sum(), 100)

    def test_a_region_and_a_step_are_parts_of_the_whole(self):
        samples = volume("int16")
        self.encode(samples, "--max-error", "9", "--threshold=-20,0,20", "--cube", "8", "--brick", "1")
        whole = self.decode(samples)
        part = self.decode(samples, "--region", "3:30,5:33,2:11", shape=(9, 28, 27))
        numpy.testing.assert_array_equal(part, whole[2:11, 5:33, 3:30])
        thin = self.decode(samples, "--region", ":,:,0:1", shape=(1, *SHAPE[1:]))
        numpy.testing.assert_array_equal(thin, whole[:1])

    def test_bytes_do_not_depend_on_threads_and_the_second_decoder_agrees(self):
        samples = volume("float32", (9, 17, 12))
        files = set()
        for threads in ("1", "3"):
            self.encode(samples, "--max-error", "6.5", "--threshold=-0.0,12.3", "--cube", "8", "--threads", threads)
            files.add((self.folder / "v.tag").read_bytes())
        self.assertEqual(len(files), 1)
        self.assertEqual(decoder.decode(files.pop()), self.decode(samples).tobytes())

    def test_thresholds_are_values_where_samples_have_a_slope(self):
        for slope, intercept, threshold in ((1, -1024, 300), (0.5, -10.25, 7.3), (-2, 100, 60), (0.1, 0, 0.3)):
            samples = volume("int16") + numpy.int16(1200 if intercept == -1024 else 0)
            self.write_nrrd("v.nrrd", samples, f"rescale_slope:={slope}\nrescale_intercept:={intercept}\n")
            with self.subTest(slope=slope):
                self.tagrid("encode", "v.nrrd", "--max-error", 8 * abs(slope), f"--threshold={threshold}", "-q", "-f",
                            "-o", "v.tag")
                back = self.decode(samples)
                self.assertGreater((back != samples).sum(), 1000)
                numpy.testing.assert_array_equal(back * float(slope) + intercept >= threshold,
                                                 samples * float(slope) + intercept >= threshold)

    def test_a_slope_may_turn_the_order_and_the_ends_of_a_type_count(self):
        samples = numpy.arange(256, dtype="uint8").repeat(48).reshape(16, 24, 32)
        for slope, intercept, threshold, code in ((-1, 0, 0, 0), (-1, 255, 255, 0), (0.7, 0, 178.5, 0), (-1, 255, 0, 64),
                                                  (-1, 0, -255, 64), (1, 5, 5, 64)):
            lines = f"rescale_slope:={slope}\nrescale_intercept:={intercept}\n"
            self.write_nrrd("v.nrrd", samples, lines, "uint8")
            with self.subTest(slope=slope, threshold=threshold):
                self.tagrid("encode", "v.nrrd", "--max-error", "20", f"--threshold={threshold}", "-q", "-f", "-o", "v.tag",
                            code=code)
                if code == 0:
                    back = self.decode(samples) * float(slope) + intercept
                    numpy.testing.assert_array_equal(back >= threshold, samples * float(slope) + intercept >= threshold)
                    said = self.tagrid("info", "v.tag", "--no-levels").stdout.decode()
                    self.assertIn("at most this" if slope < 0 else "at least this", said)

    def test_floats_with_a_slope_are_refused(self):
        self.write_nrrd("v.nrrd", volume("float32"), "rescale_intercept:=-1024\n", "float")
        said = self.tagrid("encode", "v.nrrd", "--max-error", "5", "--threshold=-993", "-o", "v.tag", code=64).stderr.decode()
        self.assertIn("--threshold is not possible for floats with a slope or an intercept", said)

    def test_a_psnr_and_a_ratio_are_reached_where_samples_are_moved(self):
        z, y, x = numpy.indices((64, 64, 64))
        samples = 90 + 20 * numpy.sin(x / 9) * numpy.cos(y / 7) + 10 * numpy.sin(z / 11)
        random = numpy.random.default_rng(1)
        samples = numpy.rint(samples + random.normal(0, 0.5, samples.shape)).astype("uint8")
        samples[random.random(samples.shape) < 0.002] = 150
        for option, reached in (("--psnr=34", lambda back, size: self.psnr(samples, back) >= 34),
                                ("--ratio=60", lambda back, size: samples.size / size >= 60)):
            self.encode(samples, option, "--threshold=150", "--strip")
            back = self.decode(samples)
            self.assertTrue(reached(back, (self.folder / "v.tag").stat().st_size), option)
            numpy.testing.assert_array_equal(back >= 150, samples >= 150)

    def psnr(self, samples, back):
        rmse = numpy.sqrt(numpy.mean((samples.astype("f8") - back) ** 2))
        return 20 * numpy.log10((float(samples.max()) - float(samples.min())) / rmse)

    def test_a_value_between_two_samples_is_the_upper_one(self):
        samples = volume("uint8")
        _, recorded = self.check(samples, [99.5, 120], "--max-error", "4")
        self.assertEqual([entry["sample"] for entry in recorded], [100, 120])
        floats = volume("float32")
        self.encode(floats, "--max-error", "4", "--threshold", "0.1")
        recorded = self.info("v.tag")["achieved"]["thresholds"]
        self.assertEqual([entry["sample"] for entry in recorded], [float(numpy.float32(0.1))])

    def test_another_original_is_told_by_the_voxel_and_the_threshold(self):
        samples = volume("int16")
        back, _ = self.check(samples, [10], "--max-error", "5")
        other = samples.copy()
        z, y, x = numpy.argwhere(back == 10)[0]
        other[z, y, x] = 9
        (self.folder / "other.raw").write_bytes(other.tobytes())
        said = self.tagrid("verify", "v.tag", "--against", "other.raw", "--dims", ",".join(map(str, SHAPE[::-1])),
                           "--type", "int16", code=65).stderr.decode()
        self.assertIn(f"voxel ({x}, {y}, {z}) is 10, but 9 in the original, on the other side of the threshold 10",
                      said)

    def test_what_cannot_be_kept_is_refused(self):
        samples = volume("uint8")
        for options, what in ((("--threshold", "300"), "one side"), (("--threshold", "0"), "one side"),
                              (("--threshold=-5",), "one side"), (("--threshold", "nan"), "numbers"),
                              (("--threshold", "1,2,x"), "numbers"),
                              (("--threshold", ",".join(map(str, range(1, 10)))), "at most 8"),
                              (("--threshold", "5,5"), "increasing"),
                              (("--threshold", "5", "--grid-only"), "--grid-only")):
            with self.subTest(options):
                self.assertIn(what, self.encode(samples, *options, code=64).stderr.decode())

    def test_files_that_contradict_themselves_are_refused(self):
        samples = volume("int16", (9, 17, 12))
        self.encode(samples, "--max-error", "9", "--threshold=-20,15")
        whole = (self.folder / "v.tag").read_bytes()
        at = decoder.Header(whole).size - 8 - 16

        def refused(forged, command):
            (self.folder / "forged.tag").write_bytes(forged.data())
            to = ("-f", "-o", "x.raw") if command == "decode" else ()
            return self.tagrid(command, "forged.tag", "-q", *to, code=65).stderr.decode()

        for first, second in ((15, 15), (20, 15), (-20.5, 15), (float("nan"), 15), (-32768, 15), (-20, float("inf"))):
            with self.subTest((first, second)):
                forged = Forged(whole).with_field(at, "d", first).with_field(at + 8, "d", second)
                self.assertIn("thresholds", refused(forged, "decode"))
        # The numbers of samples that are at least a threshold are the first of four at the end of the section.
        for entry in (4, 3):
            forged = Forged(whole)
            stored = struct.unpack_from("<Q", forged.sections[1], len(forged.sections[1]) - 8 * entry)[0]
            self.assertIn("threshold", refused(forged.with_statistic(entry, "Q", stored + 1), "verify"))
        # Another threshold than that of the sides: they do not end where the stream does.
        self.assertTrue(refused(Forged(whole).with_field(at, "d", -35.0), "verify"))

    def test_every_damaged_part_of_the_sides_is_refused_or_decoded(self):
        samples = volume("int16", (9, 17, 12))
        self.encode(samples, "--max-error", "9", "--threshold=-20,15", "--grid", "derived")
        whole = (self.folder / "v.tag").read_bytes()
        block = next(i for i, (kind, _) in enumerate(Forged(whole).blocks) if kind == 0)
        body = Forged(whole).blocks[block][1]
        self.assertEqual(body[8], 10)
        for offset, bit in itertools.product((*range(9, 40), 60, 80), (1, 128)):
            forged = Forged(whole)
            changed = bytearray(body)
            changed[offset] ^= bit
            forged.blocks[block][1] = bytes(changed)
            (self.folder / "forged.tag").write_bytes(forged.data())
            data = (self.folder / "forged.tag").read_bytes()
            try:
                expected = decoder.decode(data)
            except Exception:
                expected = None
            with self.subTest((offset, bit)):
                self.tagrid("decode", "forged.tag", "-q", "-f", "-o", "back.raw", code=65 if expected is None else 0)
                if expected is not None:
                    self.assertEqual((self.folder / "back.raw").read_bytes(), expected)

    def test_convert_and_estimate_know_them(self):
        samples = volume("int16")
        (self.folder / "in").mkdir()
        self.write_nrrd("in/v.nrrd", samples)
        (self.folder / "list.tsv").write_bytes(self.tagrid("convert", "--find", "in", "-q").stdout)
        self.tagrid("convert", "--manifest", "list.tsv", "--output-dir", "out", "--max-error", "5", "--threshold",
                    "0,12", "-q")
        back = self.decode(samples, name=next((self.folder / "out").rglob("*.tag")).relative_to(self.folder))
        for threshold in (0, 12):
            numpy.testing.assert_array_equal(back >= threshold, samples >= threshold)
        again = self.tagrid("convert", "--manifest", "list.tsv", "--output-dir", "out", "--max-error", "5",
                            "--threshold", "0,13", "--skip-done", code=65)
        self.assertIn("threshold was 0,12, now 0,13", again.stderr.decode())
        sizes = []
        for options in ((), ("--threshold", "0,12")):
            self.tagrid("estimate", "in/v.nrrd", "--errors", "5", *options, "-q", "-f", "--json", "e.json")
            sizes.append(self.statistics("e.json")["settings"]["estimates"][0]["bytes"])
        self.assertGreater(sizes[1], sizes[0])


if __name__ == "__main__":
    unittest.main()
