"""The interface of a codec for the comparison: how to ask it for a bound, and how to run it.

A codec gets samples in the form that it takes. Making that form from the volume, and making the type of the volume from
the decoded samples, is not measured. Commands run in a directory of the codec's own.
"""

import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy

from nrrd import TYPES, Volume


@dataclass(frozen=True)
class Work:
    """A volume in the forms that codecs take."""

    volume: Volume
    directory: Path
    low: int  # the smallest sample
    high: int  # the largest

    def written(self, name, samples):
        """A file with an array of samples; `samples` makes it when it is first needed."""
        path = self.directory / name
        if not path.exists():
            samples().tofile(path)
        return path

    def plain(self):
        return self.written("samples.raw", self.volume.samples)

    def floats(self):
        return self.written("samples.f32", lambda: self.volume.samples().astype("<f4"))

    @property
    def level_type(self):
        return numpy.dtype("u1" if self.high - self.low < 256 else "<u2")

    def levels(self):
        """The samples less the smallest one: unsigned, of 8 bits if they fit."""
        return (self.volume.samples().astype("i4") - self.low).astype(self.level_type)

    def typed(self, samples):
        """Samples of any type in that of the volume: rounded, and within its limits."""
        limits = numpy.iinfo(TYPES[self.volume.type])
        return numpy.clip(numpy.rint(samples), limits.min, limits.max).astype(TYPES[self.volume.type])


class Codec:
    """The common case: one file `coded`, which is decoded to a file `decoded.raw`."""

    name = ""
    program = ""
    package = ""
    slow = False  # measured once
    keeps_bounds = True  # according to its documentation
    encodes_in_parallel = decodes_in_parallel = False

    def __init__(self, tagrid):
        self.tagrid = tagrid

    def missing(self):
        """Why it cannot take part, or None."""
        return None if shutil.which(self.program) else f"{self.program} is not on the PATH"

    def version(self):
        return "unknown"

    def refusal(self, work, bound):
        """Why it cannot keep this bound on this volume, or None."""
        return None

    def settings(self, bound):
        """Settings with which no voxel should be off by more than `bound`, the loosest first."""
        return [bound]

    def first_setting(self, bound, psnr):
        """`psnr`: that of tagrid at this bound, or None."""
        return self.settings(bound)[0]

    def next_setting(self, row, psnr):
        """The next setting to try, given the result of the last one; None if that is good enough."""
        settings = self.settings(row["bound"])
        following = settings.index(row["setting"]) + 1
        return None if row["kept"] or following == len(settings) else settings[following]

    def prepare(self, work, directory):
        work.plain()

    def decoded(self, work, directory):
        """The decoded samples in the type of the volume, x fastest."""
        return numpy.fromfile(directory / "decoded.raw", TYPES[work.volume.type])

    def size(self, directory):
        return (directory / "coded").stat().st_size

    def parts(self, directory):
        """Bytes of named parts of the file."""
        return {}
