"""The program for Linux on arm64, under qemu-user: its vector code is NEON, and its bytes are those of this machine.

    arm64_test.py PROGRAM FOLDER
        FOLDER: where tools/arm64.sh builds. With TAGRID_LONG=1, as that takes minutes.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/support"))

from other_program import OtherProgram

PROGRAM, FOLDER = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()


@unittest.skipUnless(shutil.which("qemu-aarch64") and shutil.which("aarch64-linux-gnu-g++"),
                     "there is no compiler for arm64, or no qemu-user: tools/install_packages.sh arm64")
class Arm64(OtherProgram, unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        subprocess.run([ROOT / "tools/arm64.sh", FOLDER / "arm64"], check=True, stdout=subprocess.DEVNULL)
        cls.program, cls.command = PROGRAM, ["qemu-aarch64", str(FOLDER / "arm64/tagrid")]

    def test_it_is_for_arm64_and_needs_no_library(self):
        shown = subprocess.run(["readelf", "-hld", self.command[-1]], check=True, capture_output=True, text=True).stdout
        self.assertIn("AArch64", shown)
        for word in ("NEEDED", "INTERP"):
            self.assertNotIn(word, shown)


if __name__ == "__main__":
    if "TAGRID_LONG" in os.environ:
        unittest.main(argv=sys.argv[:1])
    else:
        print("skipped: builds the program for another processor: set TAGRID_LONG=1")
