#!/usr/bin/python3
"""Draws how errors of tagrid grow towards the faces of bricks, at a low rate.

    low_rates_seams.py PROGRAMS RATIO OUT.png VOLUME.nhdr ...

PROGRAMS is the directory of tagrid, such as build/release. Each volume is compressed with the same PSNR as it is and
rolled, so that faces lie elsewhere. The same voxels are compared: the rms error at a distance from a face is divided by
that of the files in which they lie inside, and by this ratio of voxels that lie inside in all. A volume of random
numbers, smoothed, shows what remains without edges of objects. Theory is what mirrored functions of the wavelet make of
errors of coefficients that are independent and of one size. It prints a table: at faces (distance 0), where two and
where three of them meet.

Needs what `tools/install_packages.sh pictures` installs.
"""

import itertools
import sys
import tempfile
from pathlib import Path

import matplotlib
import numpy

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

sys.path.insert(1, str(Path(__file__).parents[1]))
import nrrd  # noqa: E402
from markdown import print_table  # noqa: E402
from same_size import at_psnr, by_tagrid  # noqa: E402

BRICK, INSIDE, LEVELS = 128, 16, 6
ROLLS = (49, 54)  # inside, errors depend on the position modulo 2, 4 ...; here, their mean is that of all positions
DISTANCES = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32)


def noise(edge):
    """Random numbers that are alike over some samples, as the noise of a CT."""
    samples = numpy.random.default_rng(1).standard_normal((edge, edge, edge), numpy.float32)
    for axis in (0, 1, 2) * 3:
        samples = (numpy.roll(samples, 1, axis) + 2 * samples + numpy.roll(samples, -1, axis)) / 4
    return numpy.clip(numpy.rint(100 + 10 * samples / samples.std()), 0, 255).astype(numpy.uint8)


def layers(length, faces):
    """For each sample along an axis, how many lie between it and the nearest face; a face at n is before sample n."""
    at = numpy.arange(length)
    return numpy.min([numpy.where(at < face, face - 1 - at, at - face) for face in faces], axis=0)


def joined(low, high):
    """One level of the inverse wavelet (9/7), of columns: mirrored at the first and at the last sample."""
    even, odd = low.copy(), high.copy()
    for even_factor, odd_factor in ((-0.4435069, -0.8829111), (0.0529801, 1.5861343)):
        even += even_factor * (numpy.concatenate([odd[:1], odd[:-1]]) + odd)
        odd += odd_factor * (even + numpy.concatenate([even[1:], even[-1:]]))
    return numpy.stack([even, odd], axis=1).reshape(2 * len(even), -1)


def expected(finest):
    """The rms error by distance if all coefficients along an axis from a level on have errors of the same size."""
    power = numpy.zeros(BRICK)
    for level in range(finest, LEVELS + 1):
        functions = numpy.eye(BRICK >> level)
        functions = joined(0 * functions, functions)
        while len(functions) < BRICK:
            functions = joined(functions, 0 * functions)
        power += (functions**2).sum(axis=1) / (functions[:, functions.shape[1] // 2]**2).sum()
    both_ends = (power + power[::-1])[list(DISTANCES)] / 2
    return numpy.sqrt(both_ends / power[INSIDE:-INSIDE].mean())


def psnr_of(programs, volume, ratio, folder):
    """The PSNR that compresses a volume so many times."""
    samples = numpy.array(nrrd.read(volume).samples())
    decoded = by_tagrid(programs, volume, samples, samples.nbytes / ratio, folder)[1]
    peak = float(samples.max()) - float(samples.min())
    return 20 * numpy.log10(peak / numpy.sqrt(((decoded.astype(float) - samples)**2).mean()))


class Compared:
    """The squared errors of several files. Each voxel that is considered lies inside of bricks of all but the first."""

    def __init__(self, programs, volume, psnr, folder):
        samples = numpy.array(nrrd.read(volume).samples())
        self._axes = [axis for axis in range(3) if samples.shape[axis] > BRICK]
        self._squares = []
        for roll in (0, *ROLLS):
            rolled = numpy.roll(samples, roll, self._axes)
            decoded = at_psnr(psnr, programs, nrrd.write(folder / "rolled.nhdr", rolled), rolled, folder)[1]
            self._squares.append(numpy.roll((decoded.astype(numpy.float32) - rolled)**2, -roll, self._axes))
        self._near, self._valid = [], []
        for axis, length in enumerate(samples.shape):
            cut = axis in self._axes
            others = [face for roll in ROLLS
                      for face in (0, *range(BRICK - roll, length, BRICK), length - roll, length)]
            self._near.append(layers(length, range(BRICK, length, BRICK)) if cut else numpy.full(length, BRICK))
            self._valid.append(layers(length, others) >= INSIDE if cut else numpy.ones(length, bool))
        self._inside = self._sums({})

    def _sums(self, distances):
        """Of the squared errors of each file, at distances from the faces across some axes and inside along others."""
        chosen = [valid & (near == distances[axis] if axis in distances else near >= INSIDE)
                  for axis, (near, valid) in enumerate(zip(self._near, self._valid))]
        return numpy.array([squares[numpy.ix_(*chosen)].sum(dtype=float) for squares in self._squares])

    def ratio(self, distance, axes=1):
        """How much larger the rms error is at this distance from the faces across so many axes than inside."""
        sums = [self._sums(dict.fromkeys(some, distance)) for some in itertools.combinations(self._axes, axes)]
        first, *others = sum(sums, numpy.zeros(len(self._squares))) / self._inside
        return numpy.sqrt(first / numpy.mean(others)) if sums else numpy.nan


def main():
    programs, ratio, out = Path(sys.argv[1]), float(sys.argv[2]), sys.argv[3]
    figure, ax = plt.subplots(figsize=(8, 4), layout="constrained")
    places = numpy.log2(numpy.array(DISTANCES) + 1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # The PSNR of much noise is that of a brick.
        volumes = {path: path for path in map(Path, sys.argv[4:])}
        volumes[nrrd.write(folder / "noise.nhdr", noise(3 * BRICK))] = nrrd.write(folder / "brick.nhdr", noise(BRICK))

        def rows():
            for volume, part in volumes.items():
                compared = Compared(programs, volume, psnr_of(programs, part, ratio, folder), folder)
                is_noise = volume != part
                ax.plot(places, [compared.ratio(distance) for distance in DISTANCES], label=volume.stem, marker="o",
                        markersize=3, color="black" if is_noise else None, linewidth=2 if is_noise else 1.2)
                yield volume.stem, *(f"{compared.ratio(0, axes):.2f}" for axes in (1, 2, 3))

        print_table(["volume", "face", "edge", "corner"], rows())
    for finest, style, label in ((1, "--", "theory, all bands"), (2, ":", "without the finest")):
        ax.plot(places, expected(finest), label=label, color="gray", linestyle=style)
    ax.axhline(1, color="lightgray", linewidth=0.8, zorder=0)
    ax.set(xlabel="voxels between the voxel and the nearest face", ylabel="rms error, divided by that inside",
           ylim=(0.8, None))
    ax.set_xticks(places, DISTANCES)
    ax.legend(frameon=False)
    figure.savefig(out, dpi=100)


if __name__ == "__main__":
    main()
