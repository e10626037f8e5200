"""What the tests of readers share: volumes go through tagrid and come back as arrays of NumPy.

Files are written and read by other people's libraries, so that tagrid agrees with them, not with itself. A test whose
library is missing says so and passes.
"""

import importlib
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAM = pathlib.Path(sys.argv[1]).resolve()
IS_SANITIZED = b"__asan_init" in PROGRAM.read_bytes()
# Tests may take hours; see tools/test.sh.
IS_LONG = "TAGRID_LONG" in os.environ
# For tests of limits on memory.
unless_sanitized = unittest.skipIf(IS_SANITIZED, "sanitizers take memory of their own")


def library(name, package):
    """The module, or None after a message; its tests are then skipped."""
    try:
        return importlib.import_module(name)
    except ImportError:
        print(f"skipped: there is no {name} on this machine ({package})", file=sys.stderr)
        return None


def some(cases, every, first=0):
    """Every so-manyth case from the first one on, or all if IS_LONG. Of values that are combined, each is met if their
    numbers have no factor in common with `every`."""
    return list(cases) if IS_LONG else list(cases)[first::every]


def main():
    """Runs the tests of the calling script, whose first argument is the program."""
    del sys.argv[1]
    unittest.main(module="__main__")


class ReaderTest(unittest.TestCase):
    def setUp(self):
        # A sanitized program takes a third of a second to start.
        if IS_SANITIZED and not IS_LONG and "damaged" not in self.id():
            self.skipTest("damaged files are what sanitizers are for; set TAGRID_LONG=1 for all tests")
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def tagrid(self, *arguments):
        return subprocess.run([PROGRAM, *map(str, arguments)], cwd=self.folder, text=True, errors="replace",
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL)

    def encoded(self, path, *options):
        """Encodes a volume without a loss; its stored samples as an array [z, y, x], and what info says."""
        import numpy

        run = self.tagrid("encode", path, "-o", "out.tag", "-f", *options)
        self.assertEqual(run.returncode, 0, f"{path} {options}: {run.stderr}")
        self.messages = run.stderr
        info = json.loads(self.tagrid("info", "out.tag", "--json").stdout)
        run = self.tagrid("decode", "out.tag", "-o", "out.raw", "-f", "--samples")
        self.assertEqual(run.returncode, 0, run.stderr)
        if info["restorable"]:
            self.assert_restored(pathlib.Path(self.folder / path))
        elif info["compression"]:
            self.assert_restored_uncompressed(pathlib.Path(self.folder / path), info, options)
        return numpy.fromfile(self.folder / "out.raw", numpy.dtype(info["type"])).reshape(info["dims"][::-1]), info

    def assert_restored(self, path):
        """Files that come back from out.tag are those at `path`, byte for byte."""
        shutil.rmtree(self.folder / "restored", ignore_errors=True)
        run = self.tagrid("restore", "out.tag", "-o", "restored")
        self.assertEqual((run.returncode, run.stderr), (0, ""), path)
        folder = path if path.is_dir() else path.parent
        for file in (self.folder / "restored").rglob("*"):
            if file.is_file():
                name = str(file.relative_to(self.folder / "restored"))
                originals = [original for original in folder.rglob(file.name) if str(original).endswith("/" + name) and original != file]
                self.assertTrue(any(original.read_bytes() == file.read_bytes() for original in originals), f"{path}: {name}")
        shutil.rmtree(self.folder / "restored")

    def assert_restored_uncompressed(self, path, info, options):
        """Files that come back from out.tag, whose samples were compressed, are the same data set uncompressed."""
        shutil.rmtree(self.folder / "restored", ignore_errors=True)
        run = self.tagrid("restore", "out.tag", "-o", "restored")
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("not restored byte for byte: samples were compressed (" + info["compression"], run.stderr)
        name = path.name.removesuffix(".gz").removesuffix(".GZ")
        restored = "restored" if path.is_dir() else f"restored/{name}"
        # A number of one of several series means nothing among the files of one.
        options = [option for i, option in enumerate(options) if not (path.is_dir() and "--series" in options[max(i - 1, 0):i + 1])]
        run = self.tagrid("encode", restored, "-o", "again.tag", "-f", *options)
        self.assertEqual(run.returncode, 0, f"{path} {options}: {run.stderr}")
        again = json.loads(self.tagrid("info", "again.tag", "--json").stdout)
        self.assertIs(again["restorable"], True, path)
        self.assertIsNone(again["compression"])
        for key in ("dims", "type", "geometry"):
            self.assertEqual(again[key], info[key], path)
        # TIFF has no word for a loss in the past, and a file of DICOM may not say it.
        sources = [one["source"] | {"pairs": dict(one["source"]["pairs"])} for one in (again, info)]
        if sources[1]["pairs"].get("lossy source") in ("TIFF, JPEG", "DICOM"):
            for source in sources:
                source["pairs"].pop("lossy source", None)
        # The plain form may not have what was not understood: sparse chunks do not come back as such.
        for source in sources:
            source["pairs"].pop("not understood", None)
        self.assertEqual(*sources, path)
        run = self.tagrid("decode", "again.tag", "-o", "again.raw", "-f", "--samples")
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual((self.folder / "again.raw").read_bytes(), (self.folder / "out.raw").read_bytes(), path)
        # A range and a resumed run are for encoding, and say nothing of the file.
        of_file = [option for i, option in enumerate(options) if "--range" not in options[max(i - 1, 0):i + 1] and option != "--resume"]
        run = self.tagrid("verify", "out.tag", "--against", restored, *of_file)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("source files: not those that were encoded: their samples are not compressed", run.stdout)
        for name in ("again.tag", "again.raw"):
            (self.folder / name).unlink()
        shutil.rmtree(self.folder / "restored")

    def assert_same(self, samples, truth, what=""):
        self.assertEqual(samples.shape, truth.shape, what)
        self.assertEqual(samples.dtype, truth.dtype.newbyteorder("="), what)
        self.assertEqual(samples.tobytes(), truth.astype(samples.dtype).tobytes(), what)

    def assert_refused(self, code, text, *arguments):
        run = self.tagrid(*arguments)
        self.assertEqual(run.returncode, code, run.stderr)
        self.assertIn(text, run.stderr)
        self.assertTrue(run.stderr.startswith("tagrid: "), run.stderr)
        return run.stderr
