"""The recipes of docs/howto.md work: each is run in a directory of its own, which has the files that it begins with.

    howto_test.py PROGRAM BUILD
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/support"))

import nibabel
import numpy
import tifffile
from documents import sessions
from scans import write_series

PROGRAM, BUILD = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
# What a recipe needs that no test has: a cluster.
ELSEWHERE = ("sbatch ",)


def recipes():
    """The parts of the document, by their headings."""
    parts = re.split(r"^## (.*)\n", (ROOT / "docs/howto.md").read_text(), flags=re.MULTILINE)[1:]
    return dict(zip(parts[::2], parts[1::2]))


class HowTo(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.environment = os.environ | {"PATH": f"{PROGRAM.parent}:{os.environ['PATH']}", "PYTHONPATH": str(BUILD / "python"),
                                        "LC_ALL": "C.UTF-8"}

    def run_in(self, folder, *command):
        done = subprocess.run(command, cwd=folder, env=self.environment, text=True, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, check=False)
        self.assertEqual(done.returncode, 0, f"{command}\n{done.stdout}")
        return done.stdout

    def begin(self, folder):
        """The files that recipes begin with."""
        make = "tagrid phantom --dims 80,70,60 -q -o"
        self.run_in(folder, "bash", "-ec", f"""
            mkdir scans; {make} scan.nhdr; {make} scan.nrrd; {make} copy.nrrd; {make} scans/knee.nrrd
            tagrid encode scan.nhdr -q; tagrid encode scan.nrrd -q -o arrived.tag; rm arrived.tag""")
        samples = numpy.random.default_rng(1).integers(0, 4000, (12, 40, 50), dtype=numpy.uint16)
        write_series(folder / "series", samples & 0xFFF)
        (folder / "slices").mkdir()
        for i, part in enumerate(samples):
            tifffile.imwrite(folder / f"slices/slice{i:03}.tif", part)
        (folder / "samples.raw").write_bytes(bytes(64 * 48 * 32 * 2))
        volumes = numpy.random.default_rng(2).integers(0, 99, (20, 16, 12, 5), dtype=numpy.int16)
        nibabel.save(nibabel.Nifti1Image(volumes, numpy.eye(4)), folder / "bold.nii.gz")
        self.run_in(folder, "tagrid", "encode", "bold.nii.gz", "-q", "-o", "bold.tag")

    def test_every_recipe_works(self):
        self.assertGreaterEqual(len(recipes()), 20)
        for name, text in recipes().items():
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                self.begin(pathlib.Path(folder))
                before = set(pathlib.Path(folder).rglob("*"))
                ran = [self.run_in(folder, sys.executable, "-B", "-c", code)
                       for code in re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)]
                for session in sessions(text):
                    for command, _ in session:
                        if not command.startswith(ELSEWHERE):
                            ran.append(self.run_in(folder, "bash", "-o", "pipefail", "-c", command))
                self.assertTrue(ran, "nothing was run")
                # Either a file was made, or something was said.
                self.assertTrue("".join(ran).strip() or set(pathlib.Path(folder).rglob("*")) != before)

    def test_what_they_promise_is_so(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            self.begin(folder)
            for recipe in ("Compress a DICOM series and get it back", "Delete originals safely",
                           "Send a scan through ssh or tar"):
                for session in sessions(recipes()[recipe]):
                    for command, _ in session:
                        self.run_in(folder, "bash", "-o", "pipefail", "-c", command)
            restored = {path.name: path.read_bytes() for path in (folder / "original").rglob("*.dcm")}
            self.assertEqual(restored, {path.name: path.read_bytes() for path in (folder / "series").iterdir()})
            self.assertFalse((folder / "copy.nrrd").exists())
            self.assertTrue((folder / "copy.tag").exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
