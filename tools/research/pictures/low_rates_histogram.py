#!/usr/bin/python3
"""Draws histograms of the most homogeneous cube of a volume, as tagrid, SPERR and JPEG-LS give it in the same size.

    low_rates_histogram.py PROGRAMS RATIO OUT.png VOLUME.nhdr ...

PROGRAMS is the directory of tagrid and of bench/bench_jpegls, such as build/release. sperr3d must be on the PATH. Each
volume has a panel. The cube is chosen in the original: of 16 samples along an edge, and not air. It prints where it
is, and a table of mean and standard deviation.

Needs what `tools/install_packages.sh pictures` and `bench` install.
"""

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
from same_size import by_jpegls, by_sperr, by_tagrid, homogeneous  # noqa: E402

BINS = 40


def cubes_of(programs, volume, ratio):
    """The cube of each program, by its name."""
    samples = numpy.array(nrrd.read(volume).samples())
    cube = homogeneous(samples)
    print(volume.stem, "x, y, z:", *(f"{part.start} .. {part.stop - 1}" for part in cube[::-1]))
    size = samples.nbytes / ratio
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        return {"original": samples[cube], "tagrid": by_tagrid(programs, volume, samples, size, folder)[1][cube],
                "SPERR": by_sperr(samples, size, folder)[1][cube],
                "JPEG-LS": by_jpegls(programs, samples, size, folder)[1][cube]}


def draw(ax, cubes):
    """Curves of the share of samples that have a value, in per cent; of values that are many, in bins."""
    original = cubes["original"].astype(float)
    low, high = original.mean() - 4 * original.std(), original.mean() + 4 * original.std()
    width = max(1, round((high - low) / BINS))
    edges = numpy.arange(numpy.floor(low), high + width, width) - 0.5
    for (name, cube), color in zip(cubes.items(), ("black", "tab:blue", "tab:orange", "tab:red")):
        shares = 100 * numpy.histogram(cube, edges)[0] / cube.size
        ax.stairs(shares, edges, label=name, color=color, linewidth=2 if name == "original" else 1.4)


def main():
    programs, ratio, out, volumes = Path(sys.argv[1]), float(sys.argv[2]), sys.argv[3], [*map(Path, sys.argv[4:])]
    figure, axes = plt.subplots(1, len(volumes), figsize=(5 * len(volumes), 3.5), layout="constrained", squeeze=False)
    rows = []
    for ax, volume in zip(axes[0], volumes):
        cubes = cubes_of(programs, volume, ratio)
        draw(ax, cubes)
        ax.set(title=volume.stem, xlabel="value", ylabel="samples, %", ylim=(0, None))
        rows += [(volume.stem, name, f"{cube.mean():.2f}", f"{cube.std():.2f}") for name, cube in cubes.items()]
    axes[0, 0].legend(frameon=False)
    figure.savefig(out, dpi=100)
    print_table(["volume", "", "mean", "standard deviation"], rows)


if __name__ == "__main__":
    main()
