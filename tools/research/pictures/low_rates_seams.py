#!/usr/bin/python3
"""Draws how errors of tagrid grow towards the faces of bricks, at a low rate.

    low_rates_seams.py PROGRAMS RATIO OUT.png VOLUME.nhdr ...

PROGRAMS is the directory of tagrid, such as build/release. Each volume is compressed twice with the same PSNR, the
second time rolled by half a brick, so that faces lie elsewhere. The same voxels are compared: the rms error at a
distance from a face is divided by that of the file in which they lie inside, and by this ratio of voxels that lie
inside in both. A volume of random numbers, smoothed, shows what remains without edges of objects. It prints a
table: at faces (distance 0), where two and where three of them meet.

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

BRICK, INSIDE = 128, 16
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


def psnr_of(programs, volume, ratio, folder):
    """The PSNR that compresses a volume so many times."""
    samples = numpy.array(nrrd.read(volume).samples())
    decoded = by_tagrid(programs, volume, samples, samples.nbytes / ratio, folder)[1]
    peak = float(samples.max()) - float(samples.min())
    return 20 * numpy.log10(peak / numpy.sqrt(((decoded.astype(float) - samples)**2).mean()))


class Compared:
    """The squared errors of two files. Each voxel that is considered lies inside of a brick of the second one."""

    def __init__(self, programs, volume, psnr, folder):
        samples = numpy.array(nrrd.read(volume).samples())
        self._axes = [axis for axis in range(3) if samples.shape[axis] > BRICK]
        squares = (at_psnr(psnr, programs, volume, samples, folder)[1].astype(float) - samples)**2
        rolled = numpy.roll(samples, BRICK // 2, self._axes)
        decoded = at_psnr(psnr, programs, nrrd.write(folder / "rolled.nhdr", rolled), rolled, folder)[1]
        self._squares = squares, numpy.roll((decoded.astype(float) - rolled)**2, -BRICK // 2, self._axes)
        self._near, self._valid = [], []
        for axis, length in enumerate(samples.shape):
            cut = axis in self._axes
            others = [0, *range(BRICK // 2, length, BRICK), length - BRICK // 2, length]
            self._near.append(layers(length, range(BRICK, length, BRICK)) if cut else numpy.full(length, BRICK))
            self._valid.append(layers(length, others) >= INSIDE if cut else numpy.ones(length, bool))
        self._inside = self._sums({})

    def _sums(self, distances):
        """Of the squared errors of both files, at distances from the faces across some axes and inside along others."""
        chosen = [valid & (near == distances[axis] if axis in distances else near >= INSIDE)
                  for axis, (near, valid) in enumerate(zip(self._near, self._valid))]
        return numpy.array([squares[numpy.ix_(*chosen)].sum() for squares in self._squares])

    def ratio(self, distance, axes=1):
        """How much larger the rms error is at this distance from the faces across so many axes than inside."""
        sums = [self._sums(dict.fromkeys(some, distance)) for some in itertools.combinations(self._axes, axes)]
        first, second = sum(sums, numpy.zeros(2)) / self._inside
        return numpy.sqrt(first / second) if second > 0 else numpy.nan


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
                ax.plot(places, [compared.ratio(distance) for distance in DISTANCES], label=volume.stem, marker="o", markersize=3,
                        color="black" if is_noise else None, linewidth=2 if is_noise else 1.2)
                yield volume.stem, *(f"{compared.ratio(0, axes):.2f}" for axes in (1, 2, 3))

        print_table(["volume", "face", "edge", "corner"], rows())
    ax.axhline(2**0.5, color="gray", linestyle=":", linewidth=1)
    ax.text(places[-1], 2**0.5, "√2", color="gray", ha="right", va="bottom")
    ax.axhline(1, color="gray", linewidth=0.8)
    ax.set(xlabel="voxels between the voxel and the nearest face", ylabel="rms error, divided by that inside", ylim=(0.8, None))
    ax.set_xticks(places, DISTANCES)
    ax.legend(frameon=False)
    figure.savefig(out, dpi=100)


if __name__ == "__main__":
    main()
