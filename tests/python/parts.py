"""Chunks that are written in parts, again and again, as HDF5 and Zarr do it: cases and checks for both."""

import numpy as np

from volumes import TYPES

SHAPE, CHUNKS = (6, 9, 21), (4, 5, 21)
WHOLE = (0.5, 1, 2.75, 5, 100, 127.9, 128, 2**15 - 1, 2**16, 2**31 - 1, 2**31, 1e300)
REAL = (1e-3, 0.1, 5, 7.3, 2.0**20, 1e30, 3.4e38, 1e300, 1e-40, 1.4e-45, 2e-46, 1e-310, 5e-324)


def cases():
    """Samples and bounds: small and large ones, the limits of the type and what lies beside them, subnormal numbers, and
    floats that are not finite or far from 0."""
    random = np.random.default_rng(7)
    for name in TYPES:
        dtype = np.dtype(name)
        for bound in (REAL if dtype.kind == "f" else WHOLE):
            yield _samples(dtype, bound, random), bound


def _samples(dtype, bound, random):
    count = int(np.prod(SHAPE))
    if dtype.kind != "f":
        limits = np.iinfo(dtype)
        samples = random.integers(limits.min, limits.max, count, dtype, endpoint=True)
        samples[::5] = np.clip(random.normal(0, 30, len(samples[::5])), limits.min, limits.max)
        samples[::7] = random.choice([limits.min, limits.min + 1, limits.max - 1, limits.max], len(samples[::7]))
        return samples.reshape(SHAPE)
    limits = np.finfo(dtype)
    with np.errstate(all="ignore"):
        samples = random.normal(0, 50 * min(bound, 1e306), count).astype(dtype)
        # The middle between two places, and what lies beside it.
        samples[::4] = (2 * random.integers(-40, 40, len(samples[::4])) + 1) * min(bound, 1e300)
        samples[1::8] = np.nextafter(samples[::8][:len(samples[1::8])], dtype.type(np.inf))
    samples[2::40] = random.choice(np.array([0, -0.0, limits.max, limits.min, limits.smallest_subnormal, -limits.tiny], dtype),
                                   len(samples[2::40]))
    samples[3::60] = random.choice(np.array([np.nan, np.inf, -np.inf, 9.969209968386869e36], dtype), len(samples[3::60]))
    if bound == 7.3:
        # More different samples that no lattice holds than a chunk can name.
        samples[:] = random.normal(0, 1, count) * 10.0**random.integers(-30, 30, count)
    return samples.reshape(SHAPE)


def fill_of(samples, bound):
    """A fill value that stands for missing samples, and samples with some of them."""
    fill = samples.dtype.type({"u": 200, "i": -99, "f": -9999.5}[samples.dtype.kind])
    samples = samples.copy()
    samples[1::2, ::3, 4:9] = fill
    return samples, fill


def write_in_parts(target, samples, seed):
    """Slice by slice, then boxes that overlap, in any order. The file's samples are always those of the original."""
    random = np.random.default_rng(seed)
    for z in range(SHAPE[0]):
        target[z] = samples[z]
    for _ in range(5):
        low = [int(random.integers(0, n)) for n in SHAPE]
        box = tuple(slice(a, int(random.integers(a, n)) + 1) for a, n in zip(low, SHAPE))
        target[box] = samples[box]


def check_within(test, found, samples, bound, what):
    """Every sample is within the bound, and those that are not finite are the same bit by bit."""
    test.assertEqual(found.dtype, samples.dtype)
    if samples.dtype.kind != "f":
        test.assertLessEqual(int(np.abs(found.astype(np.int64) - samples.astype(np.int64)).max()), bound, what)
        return
    finite = np.isfinite(samples)
    test.assertEqual(found[~finite].tobytes(), samples[~finite].tobytes(), what)
    # Wider than both types, so that the difference is exact where it is near the bound.
    off = np.abs(found[finite].astype(np.longdouble) - samples[finite].astype(np.longdouble))
    test.assertLessEqual(off.max(), np.longdouble(bound), what)
