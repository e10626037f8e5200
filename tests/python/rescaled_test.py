"""Values of samples, such as HU: those of numpy's arithmetic, in the types and with the bytes of `tagrid decode --values`."""

import os
import pickle
import subprocess
import sys
import unittest

import numpy as np
import tagrid

from volumes import module, temporary_folder

PROGRAM = os.path.abspath(sys.argv[1])
SHAPE = (5, 19, 23)


def stored(dtype, low, high):
    """Noise with both ends of its range in it."""
    samples = np.random.default_rng(7).integers(low, high, SHAPE, endpoint=True).astype(dtype)
    samples.flat[:2] = low, high
    return samples


def decoded(path):
    """What `tagrid decode --values` writes, read by the lines of its header."""
    written = path.with_suffix(".nrrd")
    subprocess.run([PROGRAM, "decode", path, "--values", "-q", "-f", "-o", written], check=True)
    header, samples = written.read_bytes().split(b"\n\n", 1)
    name = next(line[6:].decode() for line in header.split(b"\n") if line.startswith(b"type: "))
    return np.frombuffer(samples, {"float": "float32", "double": "float64"}.get(name, name)).reshape(SHAPE)


class Values(unittest.TestCase):
    def setUp(self):
        self.path = temporary_folder(self) / "a.tag"

    def volume(self, samples, **pairs):
        tagrid.encode(samples, self.path, metadata={name: str(text) for name, text in pairs.items()}, cube=8, brick=1)
        return tagrid.open(self.path)

    def check(self, volume, truth):
        values = volume.rescaled
        for found in (values[...], values.read(), np.asarray(values), np.stack(list(values)), decoded(self.path)):
            self.assertEqual(found.dtype, truth.dtype)
            np.testing.assert_array_equal(found, truth)
        self.assertEqual((values.shape, values.dtype, values.ndim, len(values)), (SHAPE, truth.dtype, 3, 5))

    def test_values_are_those_of_arithmetic_and_of_the_program(self):
        for dtype, low, high, slope, intercept, written in (
                ("uint16", 0, 4000, 1, -1024, "int16"), ("int16", -32768, 31000, 1, 1000, "int16"), ("uint16", 1, 65000, 1, 500, "uint16"),
                ("uint8", 0, 255, 1, -1024, "int16"), ("int32", 10000, 70000, 1, -40000, "int16"), ("uint16", 0, 65535, 1, -1024, "int32"),
                ("int16", -32768, 32767, 2.5, -7, "float32"), ("uint8", 0, 255, 1, 0.25, "float32"), ("uint32", 0, 2**32 - 1, 1, -5, "float32"),
                ("int32", -9, 10**9, 1, 10**9, "int32"), ("float32", 0, 9000, 0.1, 3, "float32"), ("float64", 0, 9000, 0.1, 3, "float64"),
                ("int16", -5, 5, 1e300, 0, "float64"), ("uint16", 0, 9, 1, 0, "uint16"), ("int16", -9, 9, -1, 0, "int16"),
                ("int16", -500, 3000, 2, -1024, "int16"), ("uint16", 0, 65535, -3, 7, "int32"), ("uint8", 0, 255, 1e9, 0, "float32"),
                ("int16", 0, 9, 2, 0.5, "float32"), ("int32", 0, 10**9, 4, -1, "float32"), ("int32", 1, 10**9, 4, -1, "uint32")):
            with self.subTest(dtype=dtype, slope=slope, intercept=intercept):
                samples = stored(dtype, low, high)
                wide = samples.astype(np.int64) if written.startswith(("i", "u")) else samples.astype(np.float64)
                self.check(self.volume(samples, rescale_slope=slope, rescale_intercept=intercept), (wide * slope + intercept).astype(written))

    def test_a_bound_widens_the_range_of_values(self):
        samples = stored("uint16", 0, 32767 + 1024)
        tagrid.encode(samples, self.path, max_error=5, metadata={"rescale_slope": "1", "rescale_intercept": "-1024"})
        volume = tagrid.open(self.path)
        self.check(volume, (volume.read().astype(int) - 1024).astype("int32"))

    def test_slices_may_have_slopes_of_their_own(self):
        samples, slopes, intercepts = stored("int16", -300, 300), [1, 2, -0.5, 1, 3], [0, -1, 5, 0, 2.5]
        truth = (samples * np.array(slopes)[:, None, None] + np.array(intercepts)[:, None, None]).astype("float32")
        volume = self.volume(samples, slice_slopes="1 2 -0.5 1 3", slice_intercepts="0 -1 5 0 2.5", rescale_slope=3)
        self.check(volume, truth)
        for key in (2, -1, (slice(None, None, -2), 3), ([4, 0, 2], slice(3), 5), (slice(1, 3), None, 5), (Ellipsis, 7), (3, 4, 5),
                    np.array([True, False, True, True, False])):
            np.testing.assert_array_equal(volume.rescaled[key], truth[key])
        np.testing.assert_array_equal(volume.rescaled.read(((1, 5), (3, None), (0, 22)), 2), truth[1:5:2, 3::2, :22:2])
        whole = self.volume(samples, slice_slopes="1 -2 40 1 3", slice_intercepts="0 -1 5 0 2")
        numbers = (np.array(part).reshape(-1, 1, 1) for part in ([1, -2, 40, 1, 3], [0, -1, 5, 0, 2]))
        truth = (samples * next(numbers) + next(numbers)).astype("int16")
        self.check(whole, truth)
        for key in (2, (slice(None, None, -2), 3), (3, 4, 5)):
            np.testing.assert_array_equal(whole.rescaled[key], truth[key])
        wrong = self.volume(samples, slice_slopes="1 2 3")
        self.assertRaisesRegex(tagrid.ArgumentError, "not one number for each of 5 slices", lambda: wrong.rescaled)

    def test_parts_have_the_type_of_all(self):
        samples = stored("uint16", 0, 65535)
        values = self.volume(samples, rescale_slope=1, rescale_intercept=-1024).rescaled
        self.assertEqual((values[0, 0, 5].dtype, values[2:3].dtype), (np.int32, np.int32))
        self.assertEqual(values[4, 3, 2], int(samples[4, 3, 2]) - 1024)
        self.assertEqual(values[1:1].shape, (0, *SHAPE[1:]))
        self.assertRegex(repr(values), r"tagrid.Rescaled \(5, 19, 23\) int32 of <tagrid.Volume")
        np.testing.assert_array_equal(pickle.loads(pickle.dumps(values))[3], values[3])
        np.testing.assert_array_equal(np.asarray(values, np.float32), samples.astype(np.float32) - 1024)

    def test_metadata_is_that_of_the_program(self):
        for pairs in ({"rescale_slope": "0.5", "rescale_intercept": "-1024", "a": "b"}, {"rescale_slope": "1", "rescale_intercept": "-7"},
                      {"rescale_slope": "2", "rescale_intercept": "3", "applied_slope": "0.25", "applied_intercept": "-1"}, {"a": "b"},
                      {"slice_slopes": "1 2 3 4 5", "slice_intercepts": "5 4 3 2 1"}):
            volume = self.volume(stored("uint16", 0, 4000), **pairs)
            decoded(self.path)
            lines = self.path.with_suffix(".nrrd").read_bytes().split(b"\n\n", 1)[0].decode().split("\n")
            self.assertEqual(volume.rescaled.metadata, dict(line.split(":=") for line in lines if ":=" in line))

    def test_values_that_are_no_numbers_stay(self):
        samples = np.array([np.nan, np.inf, -np.inf, 2], np.float32).reshape(1, 2, 2)
        volume = tagrid.open(tagrid.encode(samples, metadata={"rescale_slope": "2", "rescale_intercept": "1"}))
        np.testing.assert_array_equal(volume.rescaled[...], 2 * samples + 1)

    def test_dask_takes_them(self):
        volume = self.volume(stored("uint16", 0, 4000), rescale_slope=1, rescale_intercept=-1024)
        array = module("dask.array").from_array(volume.rescaled, chunks=volume.aligned_chunks())
        self.assertEqual(array.min().compute(), -1024)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
