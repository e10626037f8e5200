"""Volumes: NRRD files with raw samples, attached or detached. They are only read."""

import re
import shutil
from dataclasses import dataclass
from pathlib import Path

from failure import BROKEN_INPUT, WORLD, Failure

BYTES = {"uint8": 1, "int8": 1, "uint16": 2, "int16": 2}
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
        return self.voxels * BYTES[self.type]

    def copy_samples(self, target):
        """Writes the samples alone, without any header."""
        with open(self.data, "rb") as source, open(target, "wb") as copy:
            source.seek(self.offset)
            shutil.copyfileobj(source, copy, 1 << 20)


def fields_of(path):
    """The fields of an NRRD header, and where it ends."""
    fields = {}
    try:
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
    except OSError as error:
        raise Failure(WORLD, f"{path}: {error.strerror}") from None


def read_header(path):
    """The volume that an NRRD file describes. Raises Failure if it cannot be compared."""
    path = Path(path)
    fields, end = fields_of(path)

    def refuse(reason):
        raise Failure(BROKEN_INPUT, f"{path}: {reason}")

    written = fields.get("type", "no type").lower()
    types = [name for name, synonyms in NAMES.items() if written in synonyms]
    if not types:
        refuse(f"samples are {written}; the benchmark compares integers of 8 and 16 bits")
    sizes = fields.get("sizes", "").split()
    if len(sizes) != 3 or not all(re.fullmatch("0*[1-9][0-9]{0,9}", size) for size in sizes):
        refuse(f"three sizes are needed, not '{' '.join(sizes)}'")
    if fields.get("encoding", "raw").lower() != "raw":
        refuse(f"encoding is {fields['encoding']}; the benchmark reads raw")
    if fields.get("endian", "little").lower() != "little" and BYTES[types[0]] > 1:
        refuse("samples are big endian; the benchmark reads little endian")
    for skipping in ("byte skip", "byteskip", "line skip", "lineskip"):
        if fields.get(skipping, "0") != "0":
            refuse(f"{skipping} is not supported by the benchmark")

    detached = fields.get("data file") or fields.get("datafile")
    data, offset = (path.parent / detached, 0) if detached else (path, end)
    volume = Volume(path, tuple(int(size) for size in sizes), types[0], data, offset)
    try:
        present = data.stat().st_size - offset
    except OSError as error:
        raise Failure(WORLD, f"{data}: {error.strerror}") from None
    if present != volume.bytes:
        refuse(f"{volume.bytes} bytes of samples are expected, {present} are present")
    return volume
