"""What every chapter of the report works with: the program, and volumes."""

import dataclasses
import itertools
import json
import pathlib

import numpy

import nrrd
from mesh import read_vtu
from running import info_of, output_of


@dataclasses.dataclass(frozen=True)
class Volume:
    name: str
    path: pathlib.Path  # an NRRD header
    dims: tuple  # x, y, z
    low: int  # the values that count as 8 voxels of height: --range
    high: int
    iso: float  # the value of the surface that pictures show
    is_real: bool = False

    def samples(self):
        """All samples as an array [z, y, x]."""
        return numpy.array(nrrd.read(self.path).samples())


class Tagrid:
    """Runs tagrid. Its output is in a directory, under numbered names."""

    def __init__(self, program, directory):
        self.program, self.directory = program, directory
        self._numbers = itertools.count()
        self._grids = {}

    def _new(self, ending):
        return self.directory / f"{next(self._numbers)}{ending}"

    def run(self, *words, program=None):
        """Standard output of the program. Raises Failure if it fails."""
        return output_of(*(program or [self.program]), *words)

    def phantom(self, path, dims, *options):
        self.run("phantom", "--dims", ",".join(map(str, dims)), *options, "-o", path, "-f", "-q")

    def grid(self, volume, *options):
        """A grid-only file: the grid of the paper. It is made once for the same volume and options."""
        key = (volume.path, *options)
        if key not in self._grids:
            self._grids[key] = self._new(".tag")
            self.run("encode", volume.path, "--grid-only", "--lead", 0, "--range", f"{volume.low}:{volume.high}", *options, "-q",
                     "-o", self._grids[key])
        return self._grids[key]

    def info(self, tag):
        return info_of(self.program, tag)

    def mesh(self, tag, level=None, padded=True):
        """The leaves as a Mesh: padded, so that all of them are tetrahedra of the hierarchy, or cut to the volume."""
        vtu = self._new(".vtu")
        self.run("mesh", tag, "-q", "-o", vtu, *(["--padded"] if padded else []), *([] if level is None else ["--level", level]))
        mesh = read_vtu(vtu)
        vtu.unlink()
        return mesh

    def surface(self, tag, iso, *options):
        """The isosurface: a PLY file, and the counts that the program reports."""
        ply = self._new(".ply")
        return ply, json.loads(self.run("surface", tag, "--iso", iso, "-q", "-o", ply, "--json", "-", *options))["settings"]


@dataclasses.dataclass
class Study:
    tagrid: Tagrid
    directory: pathlib.Path  # for volumes that a chapter makes
    lobster: Volume
    foot: Volume
    quick: bool

    def pixels(self, usual):
        """The size of a picture: smaller in a quick report."""
        return usual // 2 if self.quick else usual


def write(directory, name, samples, low, high, iso=0.0):
    """Writes an array [z, y, x] of uint8 or int16 as a volume."""
    path = nrrd.write(directory / f"{name}.nhdr", samples)
    return Volume(name, path, samples.shape[::-1], low, high, iso)


@dataclasses.dataclass(frozen=True)
class Wanted:
    """A volume of the paper."""

    name: str
    file: str
    dims: tuple
    type: str
    range_of_volume: tuple
    range_of_phantom: tuple
    iso: float
    small: tuple  # dims of the phantom for a quick report


LOBSTER = Wanted("lobster", "lobster_321x321x33", (321, 321, 33), "uint8", (0, 252), (0, 256), 60.5, (65, 33, 33))
FOOT = Wanted("foot", "foot_161x321x129", (161, 321, 129), "int16", (-1024, 1693), (-1024, 3072), -300.5, (33, 33, 33))


def find(wanted, data, tagrid, quick, seed):
    """The volume in the directory `data`, or a phantom of the same size if it is missing."""
    path = data / f"{wanted.file}.nhdr"
    if path.is_file() and not quick:
        return Volume(wanted.name, path, wanted.dims, *wanted.range_of_volume, wanted.iso, True)
    path, dims = tagrid.directory / f"{wanted.name}.nhdr", wanted.small if quick else wanted.dims
    tagrid.phantom(path, dims, "--type", wanted.type, "--seed", seed)
    return Volume(wanted.name, path, dims, *wanted.range_of_phantom, wanted.iso)
