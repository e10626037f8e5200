"""v[...] gives what numpy gives, whatever the index is, and decodes no more than it needs."""

import itertools
import random
import sys
import unittest

import numpy as np
import tagrid

from volumes import Source, blobs

SHAPE = (37, 50, 70)


class Indexing(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.samples = blobs(SHAPE)
        # Bricks of 16 samples, so that there are many.
        cls.input = Source(tagrid.encode(cls.samples, cube=8, brick=2, threads=2))
        cls.volume = tagrid.open(cls.input)
        cls.bricks = np.prod([-(-n // 16) for n in SHAPE])

    def check(self, key):
        expected, got = self.samples[key], self.volume[key]
        self.assertEqual(np.shape(got), np.shape(expected), key)
        self.assertEqual(got.dtype, expected.dtype, key)
        np.testing.assert_array_equal(got, expected, str(key))
        self.assertEqual(type(got), type(expected), key)

    def test_every_kind_of_index_gives_what_numpy_gives(self):
        kinds = [slice(None), 5, -3, np.int64(7), np.array(4), slice(10, 20), slice(None, None, 3), slice(-5, None), slice(2, 1),
                 slice(None, None, -1), slice(30, 3, -4), slice(100, 200), slice(-100, 5), [1, 5, 2], [-1, 0], np.arange(20, 30),
                 np.array([[3, 1], [2, 36]]), []]
        arrays = (list, np.ndarray)
        for key in itertools.product(kinds, repeat=3):
            if sum(isinstance(k, arrays) and np.ndim(k) > 0 for k in key) <= 1:
                if random.Random(str(key)).random() < 0.12:
                    with self.subTest(key):
                        self.check(key)

    def test_random_indices_give_what_numpy_gives(self):
        some = random.Random(5)
        for _ in range(300):
            key = []
            for size in SHAPE:
                ends = [None if some.random() < 0.3 else some.randint(-size - 3, size + 3) for _ in range(2)]
                key.append(some.choice([slice(*ends, some.choice([-40, -7, -3, -2, -1, 1, 2, 3, 17])), some.randint(-size, size - 1)]))
            if some.random() < 0.4:
                axis = some.randrange(3)
                key[axis] = [some.randint(-SHAPE[axis], SHAPE[axis] - 1) for _ in range(some.randint(0, 7))]
            self.check(tuple(key))

    def test_fewer_indices_ellipsis_and_new_axes(self):
        for key in (Ellipsis, (), 3, slice(3, 5), [2, 3], (Ellipsis, 4), (4, Ellipsis), (Ellipsis, 4, 5), (1, 2, 3, Ellipsis),
                    None, (None, 3), (3, None, slice(4, 6)), (Ellipsis, None), (None, Ellipsis, 3, None), (1, None, [4, 5])):
            with self.subTest(key):
                self.check(key)

    def test_steps_may_be_as_large_as_whole_numbers_are(self):
        for key in (slice(None, None, 2**70), slice(None, None, -2**70), (0, slice(3, None, 10**30))):
            self.check(key)

    def test_bools_along_an_axis_are_positions(self):
        for axis in range(3):
            mask = np.arange(SHAPE[axis]) % 7 == 2
            self.check((slice(None),) * axis + (mask,))
        self.check((slice(5, 9), np.zeros(SHAPE[1], bool)))

    def test_a_position_outside_is_an_IndexError_as_for_numpy(self):
        for key in (37, -38, (0, 50), (0, 0, 70), ([0, 37],), ([-38],), (0, 0, 0, 0), (Ellipsis, Ellipsis)):
            with self.subTest(key):
                self.assertRaises(IndexError, lambda: self.samples[key])
                self.assertRaises(IndexError, lambda: self.volume[key])

    def test_other_indices_are_refused_and_the_message_says_what_is_supported(self):
        for key in ("a", 1.5, True, (slice(None), 2.0), [0.5], self.samples > 3, ([1, 2], [3, 4]), np.ones(3, bool)):
            with self.subTest(key):
                with self.assertRaisesRegex(IndexError, "supported are integers, slices|does not fit"):
                    self.volume[key]
        with self.assertRaises(TypeError):
            self.volume[slice("a", None)]

    def test_a_slice_reads_only_the_bricks_that_it_meets(self):
        for key, bricks in (((3, 4, 5), 1), ((slice(0, 16), slice(0, 16), slice(0, 17)), 2), ((slice(15, 17), 0, 0), 2),
                            ((0, 0, [0, 3, 5, 15]), 1), ((slice(16, 32), slice(0, 16), slice(48, 64)), 1),
                            ((0, 0, slice(None, None, 32)), 3), ((0, 0, [0, 33, 2]), 2), ((slice(3, 3), 0, 0), 0)):
            with self.subTest(key):
                self.input.reads = 0
                self.check(key)
                self.assertEqual(self.input.reads, bricks)

    def test_aligned_chunks_are_whole_bricks(self):
        self.assertEqual(self.volume.aligned_chunks(1), ((16, 16, 5), (16, 16, 16, 2), (16, 16, 16, 16, 6)))
        self.assertEqual(self.volume.aligned_chunks(2), ((32, 5), (32, 18), (32, 32, 6)))
        self.assertEqual(self.volume.aligned_chunks(), ((37,), (50,), (64, 6)))
        self.assertRaises(tagrid.ArgumentError, self.volume.aligned_chunks, 0)
        self.input.reads = 0
        z = 0
        for deep in self.volume.aligned_chunks(1)[0]:
            self.check(slice(z, z + deep))
            z += deep
        self.assertEqual(self.input.reads, self.bricks)

    def test_without_a_lead_the_first_bricks_have_a_sample_more(self):
        source = Source(tagrid.encode(self.samples, cube=8, brick=2, threads=2, lead=0))
        volume = tagrid.open(source)
        self.assertEqual((volume.info["lead"], self.volume.info["lead"]), (0, 1))
        self.assertEqual(volume.aligned_chunks(1), ((17, 16, 4), (17, 16, 16, 1), (17, 16, 16, 16, 5)))
        self.assertEqual(volume.aligned_chunks(2), ((33, 4), (33, 17), (33, 32, 5)))
        for key, bricks in (((slice(0, 17), slice(0, 17), slice(0, 18)), 2), ((slice(16, 18), 0, 0), 2),
                            ((0, 0, [0, 3, 5, 16]), 1)):
            source.reads = 0
            np.testing.assert_array_equal(volume[key], self.samples[key])
            self.assertEqual(source.reads, bricks)

    def test_iteration_gives_slices_and_reads_each_brick_once(self):
        self.input.reads = 0
        for expected, got in zip(self.samples, self.volume, strict=True):
            np.testing.assert_array_equal(got, expected)
        self.assertEqual(self.input.reads, self.bricks)

    def test_asarray_takes_a_type_and_refuses_not_to_copy(self):
        np.testing.assert_array_equal(np.asarray(self.volume), self.samples)
        for dtype in ("float32", "float64", "int32", ">i2"):
            got = np.asarray(self.volume, dtype)
            self.assertEqual(got.dtype, np.dtype(dtype))
            np.testing.assert_array_equal(got, self.samples)
        np.testing.assert_array_equal(np.array(self.volume, np.float32), self.samples)
        np.testing.assert_array_equal(self.volume.__array__(copy=True), self.samples)
        self.assertRaises(ValueError, self.volume.__array__, copy=False)
        self.assertEqual(np.mean(self.volume), self.samples.mean())


class Reading(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.samples = blobs(SHAPE, "float32")
        cls.volume = tagrid.open(tagrid.encode(cls.samples))

    def test_a_region_has_open_ends_and_a_step_for_each_axis(self):
        for region, step in ((None, 1), (((1, 9), (2, 8), (3, 70)), 1), (((None, None), (None, 8), (3, None)), 2),
                             (((0, 37), (0, 50), (0, 70)), (1, 5, 100)), ([[3, 4], [4, 5], [6, 7]], np.int64(3))):
            pairs = ((None, None),) * 3 if region is None else region
            steps = step if isinstance(step, tuple) else (step,) * 3
            key = tuple(slice(*pair, every) for pair, every in zip(pairs, steps))
            np.testing.assert_array_equal(self.volume.read(region, step), self.samples[key])

    def test_out_may_have_any_strides(self):
        region, expected = ((1, 9), (2, 8), (3, 30)), self.samples[1:9, 2:8, 3:30]
        shape = expected.shape
        arrays = [np.empty(shape, "f4"), np.empty(shape, "f4", order="F"), np.empty(shape, "f4")[::-1, :, ::-1],
                  np.empty((8, 12, 81), "f4")[:, ::2, ::3], np.empty(shape[::-1], "f4").T,
                  np.frombuffer(bytearray(expected.nbytes + 1), "u1")[1:].view("f4").reshape(shape)]
        for out in arrays:
            with self.subTest(strides=out.strides):
                out[:] = 0
                self.assertIs(self.volume.read(region, out=out, threads=2), out)
                np.testing.assert_array_equal(out, expected)

    def test_an_out_that_does_not_fit_is_refused_and_untouched(self):
        region = ((1, 9), (2, 8), (3, 30))
        frozen = np.zeros((8, 6, 27), "f4")
        frozen.flags.writeable = False
        for out, error in ((np.zeros((8, 6, 26), "f4"), ValueError), (np.zeros((8, 6), "f4"), ValueError),
                           (np.zeros((8, 6, 27), "f8"), TypeError), (np.zeros((8, 6, 27), "i4"), TypeError),
                           (np.zeros((8, 6, 27), ">f4"), TypeError), (frozen, ValueError), ([0], TypeError), ("a", TypeError),
                           (np.broadcast_to(np.zeros((1, 1, 1), "f4"), (8, 6, 27)), ValueError)):
            with self.subTest(repr(out)[:50]):
                self.assertRaises(error, self.volume.read, region, out=out)
                self.assertFalse(np.any(np.asarray(out) != 0) if isinstance(out, np.ndarray) else False)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
