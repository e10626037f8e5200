#!/usr/bin/python3
"""Compares surfaces of tagrid with marching cubes of the decoded voxels.

    surfaces.py VOLUME.nhdr ISO [--levels 6,9,12,15] [--encode "--max-error 2"]

Prints two tables in Markdown. The first has the time of one thread: `tagrid surface`, compared with `tagrid decode` and
vtkMarchingCubes. The second has the distances between surfaces and that of marching cubes, in the units of the header,
or in samples: for surfaces of several levels, and for marching cubes after vtkQuadricDecimation to as many triangles.
Distances are measured both ways, from the vertices of one surface to the nearest point of the other one: "off" from
the surface to marching cubes, "missed" from marching cubes to the surface.

Needs VTK for Python (python3-vtk9).
"""

import shlex
import tempfile
import time
from pathlib import Path

import numpy
import vtk

import nrrd
from markdown import print_table
from running import Parser, checked, main, output_of, usage_of
from vtk_data import image_of, made_by, points_of, read_ply

MOST_POINTS = 50000  # of one surface that are usually measured


def timed(work):
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def marching_cubes(image, iso):
    return timed(lambda: made_by(vtk.vtkMarchingCubes(), image, Value=(0, iso), ComputeNormals=False, ComputeScalars=False))


def decimated(surface, triangles):
    reduction = max(0.0, 1 - triangles / surface.GetNumberOfPolys())
    return timed(lambda: made_by(vtk.vtkQuadricDecimation(), surface, TargetReduction=reduction))


def distances(from_surface, to_surface, most_points=MOST_POINTS):
    points = points_of(from_surface)
    points = points[::max(1, len(points) // most_points)]
    locator = vtk.vtkCellLocator()
    locator.SetDataSet(to_surface)
    locator.BuildLocator()
    cell, place = vtk.vtkGenericCell(), [0.0, 0.0, 0.0]
    number, part, squared = vtk.reference(0), vtk.reference(0), vtk.reference(0.0)
    found = numpy.empty(len(points))
    for i, point in enumerate(points):
        locator.FindClosestPoint(point, place, cell, number, part, squared)
        found[i] = float(squared) ** 0.5
    return found


def row(name, surface, cubes, seconds):
    off, missed = distances(surface, cubes), distances(cubes, surface)
    return [name, f"{surface.GetNumberOfPolys():,}", f"{off.mean():.3f}", f"{numpy.percentile(off, 99):.2f}",
            f"{100 * (off <= 1).mean():.2f} %", f"{off.max():.1f}", f"{missed.mean():.3f}",
            f"{numpy.percentile(missed, 99):.2f}", f"{missed.max():.1f}", f"{seconds:.2f} s"]


def run():
    parser = Parser(__doc__)
    parser.add_argument("volume")
    parser.add_argument("iso", type=float)
    parser.add_argument("--levels", default="6,9,12,15")
    parser.add_argument("--encode", default="", help="options of encode")
    parser.add_argument("--repetitions", type=int, default=5)
    options = parser.parse_args()
    tagrid, repetitions = checked(options.tagrid), range(options.repetitions)
    with tempfile.TemporaryDirectory() as directory:
        tag, raw, ply = (Path(directory) / name for name in ("v.tag", "v.raw", "v.ply"))
        output_of(tagrid, "encode", options.volume, "-o", tag, *shlex.split(options.encode))
        info, samples = nrrd.decoded(tagrid, tag)
        image = image_of(samples, [float(s) for s in info["geometry"]["spacing"] or (1, 1, 1)])
        surface_command = (tagrid, "surface", tag, f"--iso={options.iso}", "-o", ply, "-T1", "-f", "-q")
        decode = min(usage_of(tagrid, "decode", tag, "-o", raw, "-T1", "-f", "-q").cpu for _ in repetitions)
        of_cubes = min(marching_cubes(image, options.iso)[1] for _ in repetitions)
        cubes = marching_cubes(image, options.iso)[0]
        whole = min(usage_of(*surface_command).cpu for _ in repetitions)
        both = decode + of_cubes
        rows = [(f"`surface`, from the file to a PLY file of {ply.stat().st_size / 1e6:.1f} MB", read_ply(ply), whole),
                (f"`decode` ({decode:.3f} s), and vtkMarchingCubes in memory ({of_cubes:.3f} s)", cubes, both)]
        print_table(["one thread", "triangles", "time", "per million triangles"],
                    [(name, f"{surface.GetNumberOfPolys():,}", f"{seconds:.3f} s",
                      f"{1e6 * seconds / surface.GetNumberOfPolys():.2f} s") for name, surface, seconds in rows])
        print()

        def rows_of_levels():
            for level in options.levels.split(","):
                seconds = usage_of(*surface_command, "--level", level).cpu
                surface = read_ply(ply)
                yield row(f"`--level {level}`", surface, cubes, seconds)
                if surface.GetNumberOfPolys() < cubes.GetNumberOfPolys():
                    fewer, seconds = decimated(cubes, surface.GetNumberOfPolys())
                    yield row("cubes, decimated", fewer, cubes, both + seconds)

        print_table(["surface", "triangles", "off, mean", "99 %", "within 1", "most", "missed, mean", "99 %", "most", "time"],
                    rows_of_levels())


if __name__ == "__main__":
    main("surfaces.py", run)
