#!/usr/bin/python3
"""Compares surfaces of tagrid with marching cubes of the decoded voxels.

    surfaces.py TAGRID VOLUME.nhdr ISO [--levels 6,9,12,15] [--encode "--max-error 2"]

Prints two tables in Markdown. The first has the time of a thread: `tagrid surface`, against `tagrid decode` and
vtkMarchingCubes. The second has the distances between surfaces and that of marching cubes, in millimetres of the
header, or in samples: of surfaces of several levels, and of marching cubes after vtkQuadricDecimation to as many triangles.
Distances are measured both ways, from the vertices of one surface to the nearest point of the other one: "off" from
the surface to marching cubes (what is there but should not be), "missed" from marching cubes to the surface.

Needs VTK for Python (python3-vtk9); nothing else of tagrid does.
"""

import argparse
import os
import shlex
import subprocess
import tempfile
import time

import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from programs import TYPES, info_of, seconds_of

MOST_POINTS = 50000  # of one surface that are measured


def best_of(repetitions, run):
    return min(run() for _ in range(repetitions))


def image_of(path, info):
    x, y, z = info['dims']
    samples = numpy.fromfile(path, TYPES[info['type']])
    image = vtk.vtkImageData()
    image.SetDimensions(x, y, z)
    image.SetSpacing(*[float(s) for s in info['geometry']['spacing'] or (1, 1, 1)])
    image.GetPointData().SetScalars(numpy_to_vtk(samples, deep=1))
    return image


def marching_cubes(image, iso):
    cubes = vtk.vtkMarchingCubes()
    cubes.SetInputData(image)
    cubes.SetValue(0, iso)
    cubes.ComputeNormalsOff()
    cubes.ComputeScalarsOff()
    start = time.process_time()
    cubes.Update()
    return cubes.GetOutput(), time.process_time() - start


def decimated(surface, triangles):
    decimation = vtk.vtkQuadricDecimation()
    decimation.SetInputData(surface)
    decimation.SetTargetReduction(max(0.0, 1 - triangles / surface.GetNumberOfPolys()))
    start = time.process_time()
    decimation.Update()
    return decimation.GetOutput(), time.process_time() - start


def read_ply(path):
    reader = vtk.vtkPLYReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def distances(from_surface, to_surface):
    points = vtk_to_numpy(from_surface.GetPoints().GetData()).astype(float)
    points = points[::max(1, len(points) // MOST_POINTS)]
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
    print(f'| {name} | {surface.GetNumberOfPolys():,} | {off.mean():.3f} | {numpy.percentile(off, 99):.2f} | '
          f'{100 * (off <= 1).mean():.2f} % | {off.max():.1f} | {missed.mean():.3f} | '
          f'{numpy.percentile(missed, 99):.2f} | {missed.max():.1f} | {seconds:.2f} s |')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('tagrid')
    parser.add_argument('volume')
    parser.add_argument('iso', type=float)
    parser.add_argument('--levels', default='6,9,12,15')
    parser.add_argument('--encode', default='', help='options of encode')
    parser.add_argument('--repetitions', type=int, default=5)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        tag, raw, ply = (os.path.join(folder, name) for name in ('v.tag', 'v.raw', 'v.ply'))
        subprocess.run([given.tagrid, 'encode', given.volume, '-o', tag] + shlex.split(given.encode), check=True)
        info = info_of(given.tagrid, tag)
        common = ['-T1', '-f', '-q']
        surface_command = [given.tagrid, 'surface', tag, f'--iso={given.iso}', '-o', ply] + common
        decode = best_of(given.repetitions,
                         lambda: seconds_of([given.tagrid, 'decode', tag, '-o', raw] + common))
        image = image_of(raw, info)
        cubes = marching_cubes(image, given.iso)[0]
        of_cubes = best_of(given.repetitions, lambda: marching_cubes(image, given.iso)[1])
        whole = best_of(given.repetitions, lambda: seconds_of(surface_command))
        size = os.path.getsize(ply)
        triangles = read_ply(ply).GetNumberOfPolys()
        print('| one thread | triangles | time | per million triangles |\n|---|---|---|---|')
        print(f'| `surface`, from the file to a PLY file of {size / 1e6:.1f} MB | {triangles:,} | {whole:.3f} s | '
              f'{1e6 * whole / triangles:.2f} s |')
        both = decode + of_cubes
        print(f'| `decode` ({decode:.3f} s), and vtkMarchingCubes in memory ({of_cubes:.3f} s) | '
              f'{cubes.GetNumberOfPolys():,} | {both:.3f} s | {1e6 * both / cubes.GetNumberOfPolys():.2f} s |\n')

        print('| surface | triangles | off, mean | 99 % | within 1 | most | missed, mean | 99 % | most | time |')
        print('|---|---|---|---|---|---|---|---|---|---|')
        for level in given.levels.split(','):
            seconds = seconds_of(surface_command + ['--level', level])
            surface = read_ply(ply)
            row(f'`--level {level}`', surface, cubes, seconds)
            if surface.GetNumberOfPolys() < cubes.GetNumberOfPolys():
                fewer, seconds = decimated(cubes, surface.GetNumberOfPolys())
                row('cubes, decimated', fewer, cubes, both + seconds)


if __name__ == '__main__':
    main()
