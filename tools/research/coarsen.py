#!/usr/bin/python3
"""Compares the coarsest meshes within an error with uniform ones.

    coarsen.py VOLUME.nhdr [--errors 1,2,4,8,16,32] [--cube 32]

Encodes the volume losslessly, and prints a table in Markdown. For each error, it has the mesh of `tagrid mesh --coarsen`,
the coarsest uniform mesh within that error (all tetrahedra of the hierarchy are bisected n times), and the error of the
uniform mesh that has at least as many tetrahedra. Both are padded, so that no tetrahedron is cut. The time is that of
the entire command with one thread. The last line has the grid of the file, which `--grid-only` interpolates alone.

Needs NumPy.
"""

import itertools
import json
import math
import tempfile
from pathlib import Path

import numpy

import nrrd
from markdown import print_table
from running import Parser, checked, main, output_of, usage_of


def padded(samples, cube):
    """The samples of complete root cubes; outside the volume the nearest one. Axes are z, y, x."""
    pad = [(0, max(1, -(-(n - 1) // cube)) * cube + 1 - n) for n in samples.shape]
    return numpy.pad(samples, pad, "edge").astype(float)


def interpolate_class(values, unit, odd, cube):
    """Gives the points of one class (`odd`: whether z, y, x are odd multiples of the unit) the mean of the ends of their
    base edges. A diagonal joins the corner of its cell with even coordinates, in units of the cell, with the odd one."""
    places = [numpy.arange(unit if o else 0, n, 2 * unit) for o, n in zip(odd, values.shape)]
    if any(len(p) == 0 for p in places):
        return
    axes = [axis for axis in range(3) if odd[axis]]
    at_root = 2 * unit == cube
    parities = [numpy.zeros(len(places[a]), bool) if at_root else (places[a] - unit) // (2 * unit) % 2 == 1 for a in axes]
    # For each direction of the base edge, the points that have it: the first odd axis runs upwards.
    for others in itertools.product((1, -1), repeat=len(axes) - 1):
        same = (1, *others)
        for first in (False, True):
            chosen = list(places)
            for axis, parity, sign in zip(axes, parities, same):
                chosen[axis] = places[axis][parity == (first if sign == 1 else not first)]
            ends = []
            for direction in (-unit, unit):
                end = list(chosen)
                for axis, sign in zip(axes, same):
                    end[axis] = chosen[axis] + direction * sign
                ends.append(values[numpy.ix_(*end)])
            values[numpy.ix_(*chosen)] = (ends[0] + ends[1]) / 2


def errors_of_uniform_meshes(samples, cube):
    """The largest error of the uniform mesh of each level."""
    all_values = padded(samples, cube)
    inside = tuple(slice(n) for n in samples.shape)
    # From the coarsest level on: the middles of cells, of their faces, and of their edges.
    classes = [(cube >> halving, odd_axes) for halving in range(1, cube.bit_length()) for odd_axes in (3, 2, 1)]
    errors = []
    for last in range(len(classes) + 1):
        values = all_values.copy()
        for unit, odd_axes in classes[last:]:
            for odd in itertools.product((0, 1), repeat=3):
                if sum(odd) == odd_axes:
                    interpolate_class(values, unit, odd, cube)
        errors.append(float(numpy.abs(values[inside] - samples).max()))
    return errors


def run():
    parser = Parser(__doc__)
    parser.add_argument("volume")
    parser.add_argument("--errors", default="1,2,4,8,16,32")
    parser.add_argument("--cube", type=int, default=32)
    options = parser.parse_args()
    tagrid, cube = checked(options.tagrid), options.cube
    with tempfile.TemporaryDirectory() as directory:
        tag, vtu, report = (Path(directory) / name for name in ("v.tag", "v.vtu", "v.json"))

        def mesh(*words):
            seconds = usage_of(tagrid, "mesh", tag, "--padded", *words, "-o", vtu, "-fq", "-T1", "--json", report).cpu
            return json.loads(report.read_text())["settings"], seconds

        encode = (tagrid, "encode", options.volume, "-fq", "--cube", cube, "-o", tag)
        output_of(*encode, "--grid-only")
        info, grid = nrrd.info_of(tagrid, tag), mesh()[0]
        output_of(*encode)
        samples = nrrd.decoded(tagrid, tag)[1]
        uniform = errors_of_uniform_meshes(samples, cube)
        points = padded(samples, cube).size
        roots = 6 * math.prod(max(1, -(-(n - 1) // cube)) for n in info["dims"])

        def figures(mesh):
            return [f"{mesh['points']:,}", f"{100 * mesh['points'] / points:.2f} %", f"{mesh['tetrahedra']:,}"]

        def rows():
            for error in map(float, options.errors.split(",")):
                found, seconds = mesh(f"--coarsen={error:g}")
                level = next(n for n, e in enumerate(uniform) if e <= error)
                as_many = next(e for n, e in enumerate(uniform) if roots << n >= found["tetrahedra"])
                yield [f"{error:g}", *figures(found), level, f"{roots << level:,}",
                       f"{(roots << level) / found['tetrahedra']:.1f}", f"{as_many:.1f}", f"{seconds:.1f} s"]
            yield [f"{info['achieved']['max_error']:g}: the grid of the file", *figures(grid), *[""] * 5]

        print_table(["largest error", "points", "of all", "tetrahedra", "uniform: level", "tetrahedra", "times",
                     "error of as many", "time"], rows())


if __name__ == "__main__":
    main("coarsen.py", run)
