"""Slices that are read one after the other decode a brick twice, not 64 times; what is kept for that has a limit."""

import gc
import random
import sys
import unittest
from unittest import mock

import numpy as np
import tagrid
import tagrid._kept

from volumes import Source, blobs, in_threads

SHAPE = (70, 60, 50)
SAMPLES = blobs(SHAPE)
# Bricks of 16 samples along each edge.
DATA = tagrid.encode(SAMPLES, cube=8, brick=2)


def kept_bytes():
    gc.collect()
    return sum(tagrid._kept._sizes.values())


class Kept(unittest.TestCase):
    def tearDown(self):
        self.assertEqual(kept_bytes(), 0, "a volume is gone, and its samples are not")

    def test_a_loop_over_slices_reads_each_brick_twice(self):
        for axis in range(3):
            file = Source(DATA)
            volume = tagrid.open(file)
            before = file.bytes
            for i in range(SHAPE[axis]):
                key = (slice(None),) * axis + (i,)
                np.testing.assert_array_equal(volume[key], SAMPLES[key])
            self.assertLess(file.bytes - before, 2.5 * len(DATA))

    def test_a_loop_over_single_samples_reads_a_brick_twice(self):
        file = Source(DATA)
        volume = tagrid.open(file)
        before = file.bytes
        self.assertEqual([volume[20, 20, i] for i in range(17, 33)], SAMPLES[20, 20, 17:33].tolist())
        self.assertLess(file.bytes - before, len(DATA) / 16)  # with the page of the index

    def test_one_slice_keeps_nothing_and_neither_does_read(self):
        volume = tagrid.open(DATA)
        volume[20]
        volume[40]
        self.assertEqual(kept_bytes(), 0)
        for _ in range(3):
            volume.read(((20, 21), (0, 60), (0, 50)))
            volume[10:60]
            volume[::2]
        self.assertEqual(kept_bytes(), 0)
        volume[40]
        volume[41]
        self.assertEqual(kept_bytes(), 16 * 60 * 50 * 2)
        volume.close()
        self.assertEqual(kept_bytes(), 0)
        self.assertRaises(tagrid.ArgumentError, volume.__getitem__, 41)

    def test_any_parts_in_any_order_are_those_of_the_array(self):
        draw = random.Random(1)
        volume = tagrid.open(DATA)
        corner = [0, 0, 0]
        for _ in range(1500):
            if draw.random() < 0.1:
                corner = [draw.randrange(size) for size in SHAPE]
            ends = [sorted(min(size, max(0, at + draw.randrange(-3, 4))) for _ in range(2)) for at, size in zip(corner, SHAPE)]
            key = tuple(slice(*pair) if draw.random() < 0.7 else min(pair[0], size - 1) for pair, size in zip(ends, SHAPE))
            np.testing.assert_array_equal(volume[key], SAMPLES[key], str(key))

    def test_all_volumes_together_keep_to_the_limit(self):
        layer = 16 * 60 * 50 * 2
        with mock.patch.object(tagrid._kept, "MOST_BYTES", int(2.5 * layer)):
            files = [Source(DATA) for _ in range(4)]
            volumes = [tagrid.open(file) for file in files]
            for volume in volumes:
                for i in (20, 21, 22):
                    np.testing.assert_array_equal(volume[i], SAMPLES[i])
            self.assertEqual(kept_bytes(), 2 * layer)
            # Two of them, read in turn, do not drive out each other.
            before = [file.bytes for file in files]
            for i in range(20, 30):
                np.testing.assert_array_equal(volumes[2][i] - volumes[3][i], SAMPLES[i] - SAMPLES[i])
            self.assertEqual([file.bytes for file in files], before)
        with mock.patch.object(tagrid._kept, "MOST_BYTES", layer - 1):
            other = tagrid.open(DATA)
            for i in (40, 41, 42):
                np.testing.assert_array_equal(other[i], SAMPLES[i])
            self.assertLess(kept_bytes(), 3 * layer)

    def test_threads_get_their_own_slices(self):
        volume, wrong = tagrid.open(DATA, threads=1), []

        def work(seed):
            draw = random.Random(seed)
            at = draw.randrange(SHAPE[0])
            for _ in range(200):
                at = (at + draw.randrange(2)) % SHAPE[0]
                if not np.array_equal(volume[at], SAMPLES[at]):
                    wrong.append(at)

        in_threads(work, range(8))
        self.assertEqual(wrong, [])

    def test_damaged_bricks_are_an_error_each_time_and_nothing_is_kept(self):
        data = bytearray(DATA)
        data[len(data) // 2] ^= 1
        volume = tagrid.open(bytes(data))
        failed = set()
        for _ in range(3):
            for i in range(SHAPE[0]):
                try:
                    np.testing.assert_array_equal(volume[i], SAMPLES[i])
                except tagrid.DamagedError:
                    failed.add(i)
        self.assertIn(len(failed), (16, 17))
        volume.close()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
