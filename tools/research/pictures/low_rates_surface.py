#!/usr/bin/python3
"""Draws the isosurface of a volume, and of what tagrid and SPERR give back in the same size.

    xvfb-run -a low_rates_surface.py PROGRAMS VOLUME.nhdr RATIO ISO VIEW OUT.png [X,Y,Z,EDGE]

PROGRAMS is the directory of tagrid, such as build/release; sperr3d must be on the PATH. All surfaces are made of
samples, by marching cubes. VIEW is the direction of view: x,y,z. With X,Y,Z,EDGE, a second row shows a cube of samples.
It prints a table of distances in samples, from the vertices of each surface to that of the volume, and back.

Needs what `tools/install_packages.sh paper` installs.
"""

import sys
import tempfile
from pathlib import Path

import numpy

sys.path[1:1] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "paper")]
import nrrd
from drawing import SHELL, beside
from markdown import print_table
from same_size import by_sperr, by_tagrid
from scene import Scene, contour_of_samples
from surfaces import distances


def drawn(samples, iso, view):
    scene = Scene(380, 380, view, zoom=1.3)
    scene.add(contour_of_samples(samples, iso), SHELL, smooth=True)
    return scene.picture()


def rows(name, shown, iso):
    """Of the table of distances: all vertices of both surfaces count."""
    surfaces = {program: contour_of_samples(decoded, iso) for program, decoded in shown.items()}
    for program in ("tagrid", "SPERR"):
        pair = surfaces[program], surfaces["original"]
        found = numpy.concatenate([distances(*pair, sys.maxsize), distances(*pair[::-1], sys.maxsize)])
        yield (f"{name}, {iso:g}", program, f"{found.mean():.3f}", f"{numpy.percentile(found, 95):.3f}",
               f"{numpy.percentile(found, 99.9):.2f}", f"{found.max():.1f}")


def main():
    programs, volume, out = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[6]
    ratio, iso, view = float(sys.argv[3]), float(sys.argv[4]), [float(n) for n in sys.argv[5].split(",")]
    samples = numpy.array(nrrd.read(volume).samples())
    size = samples.nbytes / ratio
    with tempfile.TemporaryDirectory() as name:
        shown = {"original": samples, "tagrid": by_tagrid(programs, volume, samples, size, Path(name))[1],
                 "SPERR": by_sperr(samples, size, Path(name))[1]}
    panels = [drawn(decoded, iso, view) for decoded in shown.values()]
    if len(sys.argv) > 7:
        x, y, z, edge = (int(n) for n in sys.argv[7].split(","))
        panels += [drawn(decoded[z:z + edge, y:y + edge, x:x + edge], iso, view) for decoded in shown.values()]
    titles = [*shown, *[""] * len(shown)][:len(panels)]
    beside(panels, titles, len(shown)).quantize(64).save(out, optimize=True)
    print_table(["volume, value", "", "mean", "95 %", "99.9 %", "largest"], rows(volume.stem, shown, iso))


if __name__ == "__main__":
    main()
