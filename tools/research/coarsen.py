#!/usr/bin/python3
"""Compares the coarsest meshes within an error with uniform ones.

    coarsen.py TAGRID VOLUME.nhdr [--errors 1,2,4,8,16,32] [--cube 32]

Encodes the volume without loss, and prints a table in Markdown: for each error, the mesh of `tagrid mesh --coarsen`, and
the coarsest uniform mesh within that error: the one of the hierarchy in which all tetrahedra have been bisected n times; then
the error of the uniform mesh that has at least as many tetrahedra.
Both are padded, so that no tetrahedron is cut. The time is that of the whole command with one thread, mesh included.
The last line has the grid of the file, which `--grid-only` interpolates alone.

Needs NumPy; nothing else of tagrid does.
"""

import argparse
import json
import os
import subprocess
import tempfile

import numpy

from programs import TYPES, info_of, seconds_of


def padded(samples, cube):
    """The samples of whole root cubes; outside the volume the nearest one. Axes are z, y, x."""
    pad = [(0, max(1, -(-(n - 1) // cube)) * cube + 1 - n) for n in samples.shape]
    return numpy.pad(samples, pad, 'edge').astype(float)


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
    for signs in range(1 << (len(axes) - 1)):
        same = [1] + [-1 if signs >> i & 1 else 1 for i in range(len(axes) - 1)]
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
    deepest = 3 * (cube.bit_length() - 1)
    errors = []
    for last in range(deepest + 1):
        values = all_values.copy()
        level, unit = 0, cube // 2
        while unit >= 1:
            for odd_axes in (3, 2, 1):
                level += 1
                for pattern in range(1, 8):
                    odd = [pattern >> i & 1 for i in range(3)]
                    if sum(odd) == odd_axes and level > last:
                        interpolate_class(values, unit, odd, cube)
            unit //= 2
        errors.append(float(numpy.abs(values[inside] - samples).max()))
    return errors


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('tagrid')
    parser.add_argument('volume')
    parser.add_argument('--errors', default='1,2,4,8,16,32')
    parser.add_argument('--cube', type=int, default=32)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        tag, raw, vtu, report = (os.path.join(folder, name) for name in ('v.tag', 'v.raw', 'v.vtu', 'v.json'))
        encode = [given.tagrid, 'encode', given.volume, '-fq', '--cube', str(given.cube), '-o', tag]

        def run(arguments):
            seconds = seconds_of([given.tagrid] + arguments + ['-fq', '-T1', '--json', report])
            with open(report) as file:
                return json.load(file), seconds

        subprocess.run(encode + ['--grid-only'], check=True)
        info = info_of(given.tagrid, tag)
        grid = run(['mesh', tag, '--padded', '-o', vtu])[0]['settings']
        error_of_grid = info['achieved']['max_error']
        subprocess.run(encode, check=True)
        run(['decode', tag, '-o', raw])
        samples = numpy.fromfile(raw, TYPES[info['type']]).reshape(info['dims'][::-1])
        uniform = errors_of_uniform_meshes(samples, given.cube)
        points = padded(samples, given.cube).size
        cubes = 1
        for n in info['dims']:
            cubes *= max(1, -(-(n - 1) // given.cube))
        print('| largest error | points | of all | tetrahedra | uniform: level | tetrahedra | times | error of as many | time |')
        print('|---|---|---|---|---|---|---|---|---|')
        for error in (float(e) for e in given.errors.split(',')):
            result, seconds = run(['mesh', tag, '--padded', f'--coarsen={error:g}', '-o', vtu])
            mesh = result['settings']
            level = next(n for n, e in enumerate(uniform) if e <= error)
            tetrahedra = 6 * cubes << level
            as_many = next(e for n, e in enumerate(uniform) if 6 * cubes << n >= mesh['tetrahedra'])
            print(f'| {error:g} | {mesh["points"]:,} | {100 * mesh["points"] / points:.2f} % | {mesh["tetrahedra"]:,} | '
                  f'{level} | {tetrahedra:,} | {tetrahedra / mesh["tetrahedra"]:.1f} | {as_many:.1f} | {seconds:.1f} s |', flush=True)
        print(f'| {error_of_grid:g}: the grid of the file | {grid["points"]:,} | {100 * grid["points"] / points:.2f} % | '
              f'{grid["tetrahedra"]:,} | | | | | |')


if __name__ == '__main__':
    main()
