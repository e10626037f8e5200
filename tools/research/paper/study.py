"""What every chapter of the report works with."""

import dataclasses
import pathlib

from program import Tagrid
from report import Report
from volumes import Volume


@dataclasses.dataclass
class Study:
    tagrid: Tagrid
    report: Report
    folder: pathlib.Path  # for volumes that a chapter makes
    lobster: Volume
    foot: Volume
    quick: bool

    def pixels(self, usual):
        """The size of a picture: smaller in a quick report."""
        return usual // 2 if self.quick else usual
