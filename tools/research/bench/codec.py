"""The interface of a codec for the comparison: how to ask it for a bound, and how to run it.

A codec gets samples in the form that it takes. Making that form from the volume, and rounding the decoded samples to
the type of the volume, is not measured. Commands run in a folder of the codec's own.
"""

import shutil
from dataclasses import dataclass
from pathlib import Path

from measuring import Programs
from volume import Volume


@dataclass(frozen=True)
class Work:
    """A volume in the forms that codecs take."""

    volume: Volume
    programs: Programs
    folder: Path
    low: int  # the smallest sample
    high: int  # the largest

    @property
    def samples(self):
        return self.folder / "samples.raw"

    def floats(self):
        """The samples as float32; made when first used."""
        path = self.folder / "samples.f32"
        if not path.exists():
            self.programs.samples("to-float", self.volume.type, self.samples, path)
        return path


class Codec:
    """The common case: one file `coded`, which is decoded to a file `decoded.raw`."""

    name = ""
    program = ""
    package = ""
    slow = False  # measured once
    keeps_bounds = True  # according to its documentation
    encodes_in_parallel = decodes_in_parallel = False

    def missing(self, programs):
        """Why it cannot take part, or None."""
        return None if shutil.which(self.program) else f"{self.program} is not on the PATH"

    def version(self, programs):
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

    def prepare(self, work, folder):
        pass

    def finish(self, work, folder):
        """Makes decoded.raw from the decoded samples, in the type of the volume."""

    def size(self, folder):
        return (folder / "coded").stat().st_size

    def parts(self, folder):
        """Bytes of named parts of the file."""
        return {}
