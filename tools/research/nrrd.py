"""Volumes as NRRD files with raw samples, attached or detached."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy

from running import BROKEN_INPUT, Failure, output_of, info_of

#: numpy's types of samples, by their name in tagrid.
TYPES = {"uint8": "u1", "int8": "i1", "uint16": "<u2", "int16": "<i2", "uint32": "<u4", "int32": "<i4", "float32": "<f4",
         "float64": "<f8"}
#: The names in NRRD files of the types that can be read.
NAMES = {
    "uint8": ("uchar", "unsigned char", "uint8", "uint8_t"),
    "int8": ("signed char", "int8", "int8_t"),
    "uint16": ("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"),
    "int16": ("short", "short int", "signed short", "signed short int", "int16", "int16_t"),
}


@dataclass(frozen=True)
class Volume:
    path: Path  # the NRRD file
    dims: tuple  # x (fastest), y, z
    type: str
    data: Path  # the file with the samples
    offset: int  # of the first sample in it

    @property
    def name(self):
        return self.path.stem

    @property
    def voxels(self):
        return self.dims[0] * self.dims[1] * self.dims[2]

    @property
    def bytes(self):
        return self.voxels * numpy.dtype(TYPES[self.type]).itemsize

    def samples(self):
        """All samples as an array [z, y, x], read on demand."""
        return numpy.memmap(self.data, TYPES[self.type], "r", self.offset, self.dims[::-1])


def fields_of(path):
    """The fields of an NRRD header, and where it ends."""
    fields = {}
    with open(path, "rb") as file:
        if not file.readline(80).startswith(b"NRRD000"):
            raise Failure(BROKEN_INPUT, f"{path}: not an NRRD file")
        for line in file:
            text = line.decode("latin-1").strip()
            if not text:
                break
            if not text.startswith("#") and ": " in text:
                name, value = text.split(": ", 1)
                fields[name.lower()] = value.strip()
        return fields, file.tell()


def read(path):
    """The volume of an NRRD file. Raises Failure if its samples cannot be read as they are."""
    path = Path(path)
    fields, end = fields_of(path)

    def refuse(reason):
        raise Failure(BROKEN_INPUT, f"{path}: {reason}")

    written = fields.get("type", "no type").lower()
    types = [name for name, synonyms in NAMES.items() if written in synonyms]
    if not types:
        refuse(f"samples are {written}; only integers of 8 and 16 bits are supported")
    sizes = fields.get("sizes", "").split()
    if len(sizes) != 3 or not all(re.fullmatch("0*[1-9][0-9]{0,9}", size) for size in sizes):
        refuse(f"three sizes are needed, not '{' '.join(sizes)}'")
    if fields.get("encoding", "raw").lower() != "raw":
        refuse(f"encoding is {fields['encoding']}; only raw is supported")
    if fields.get("endian", "little").lower() != "little" and types[0] in ("uint16", "int16"):
        refuse("samples are big endian; only little endian is supported")
    for skipping in ("byte skip", "byteskip", "line skip", "lineskip"):
        if fields.get(skipping, "0") != "0":
            refuse(f"{skipping} is not supported")

    detached = fields.get("data file") or fields.get("datafile")
    data, offset = (path.parent / detached, 0) if detached else (path, end)
    volume = Volume(path, tuple(int(size) for size in sizes), types[0], data, offset)
    present = data.stat().st_size - offset
    if present != volume.bytes:
        refuse(f"{volume.bytes} bytes of samples are expected, {present} are present")
    return volume


def type_of(samples):
    return numpy.dtype(samples.dtype).name


def write(path, samples, data=None):
    """Writes an array [z, y, x] as a header and a file of samples beside it. `data`: its bytes, compressed with gzip."""
    raw = path.with_suffix(".raw")
    raw.write_bytes(numpy.ascontiguousarray(samples, TYPES[type_of(samples)]).tobytes() if data is None else data)
    path.write_text(f"NRRD0004\ntype: {type_of(samples)}\ndimension: 3\nsizes: {' '.join(map(str, samples.shape[::-1]))}\n"
                    f"spacings: 1 1 1\nencoding: {'raw' if data is None else 'gzip'}\nendian: little\ndata file: {raw.name}\n")
    return path


def decoded(tagrid, tag):
    """The information about a .tag file, and its samples as an array [z, y, x]."""
    info, raw = info_of(tagrid, tag), tag.with_suffix(".decoded.raw")
    output_of(tagrid, "decode", tag, "-o", raw, "-f", "-q")
    return info, numpy.fromfile(raw, TYPES[info["type"]]).reshape(info["dims"][::-1])
