"""The two volumes of the paper, or phantoms of the same size where they are missing; and volumes made of a function."""

import dataclasses
import pathlib
import re

import numpy

TYPES = {"uint8": "u1", "int16": "<i2"}


@dataclasses.dataclass(frozen=True)
class Volume:
    name: str
    path: pathlib.Path  # an .nhdr with a .raw beside it
    dims: tuple  # x, y, z
    kind: str  # type of the samples
    low: int  # the values that count as 8 voxels of height: --range
    high: int
    iso: float  # the value of the surface that pictures show
    is_real: bool = False

    def samples(self):
        """All samples as an array [z, y, x]."""
        header = self.path.read_text()
        data = re.search(r"^data file: *(.*)$", header, re.MULTILINE)[1]
        return numpy.fromfile(self.path.with_name(data), TYPES[self.kind]).reshape(self.dims[::-1])


def write(folder, name, samples, low, high, iso=0.0):
    """Writes an array [z, y, x] of uint8 or int16 as a volume."""
    kind = {"u1": "uint8", "i2": "int16"}[samples.dtype.str[1:]]
    dims = samples.shape[::-1]
    path = folder / f"{name}.nhdr"
    numpy.ascontiguousarray(samples).astype(TYPES[kind]).tofile(path.with_suffix(".raw"))
    path.write_text(f"NRRD0004\ntype: {kind}\ndimension: 3\nsizes: {' '.join(map(str, dims))}\nspacings: 1 1 1\n"
                    f"encoding: raw\nendian: little\ndata file: {name}.raw\n")
    return Volume(name, path, dims, kind, low, high, iso)


@dataclasses.dataclass(frozen=True)
class Wanted:
    """A volume of the paper."""

    name: str
    file: str
    dims: tuple
    kind: str
    range_of_volume: tuple
    range_of_phantom: tuple
    iso_of_volume: float
    iso_of_phantom: float
    small: tuple  # of the phantom for a quick report


LOBSTER = Wanted("lobster", "lobster_321x321x33", (321, 321, 33), "uint8", (0, 252), (0, 256), 60.5, 60.5, (65, 33, 33))
FOOT = Wanted("foot", "foot_161x321x129", (161, 321, 129), "int16", (-1024, 1693), (-1024, 3072), -300.5, -300.5, (33, 33, 33))


def find(wanted, data, folder, tagrid, quick, seed):
    """The volume in the folder `data`, or a phantom."""
    path = data / f"{wanted.file}.nhdr"
    if path.is_file() and not quick:
        return Volume(wanted.name, path, wanted.dims, wanted.kind, *wanted.range_of_volume, wanted.iso_of_volume, True)
    dims = wanted.small if quick else wanted.dims
    path = folder / f"{wanted.name}.nhdr"
    tagrid.phantom(path, dims, wanted.kind, seed)
    return Volume(wanted.name, path, dims, wanted.kind, *wanted.range_of_phantom, wanted.iso_of_phantom)
