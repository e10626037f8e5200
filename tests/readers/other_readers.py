"""What the tests of readers share: volumes go through tagrid and come back as arrays of NumPy.

Files are written and read by other people's libraries, so that tagrid agrees with them, not with itself. A test whose
library is missing says so and passes. The program is the argument of each test.
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

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import scans  # noqa: E402

PROGRAM = pathlib.Path(sys.argv[1]).resolve()
IS_SANITIZED = b"__asan_init" in PROGRAM.read_bytes()
# Tests may take hours; see tools/test.sh.
IS_LONG = "TAGRID_LONG" in os.environ
# For tests of limits on memory.
unless_sanitized = unittest.skipIf(IS_SANITIZED, "sanitizers take memory of their own")


# The packages that have the libraries, and libraries whose module has another name.
PACKAGES = {name: f"python3-{name}"
            for name in ("numpy", "pydicom", "nibabel", "tifffile", "h5py", "gmsh", "meshio", "zarr", "numcodecs", "xarray",
                         "mrcfile", "fabio")} | \
    {"Image": "python3-pil"} | {name: "python3-vtk9" for name in ("vtk_hdf", "vtk_image", "vtk_xml", "vtk_numpy")}
# Not all modules of VTK: some would replace its readers by those for MPI.
MODULES = {"Image": "PIL.Image", "vtk_hdf": "vtkmodules.vtkIOHDF", "vtk_image": "vtkmodules.vtkIOImage",
           "vtk_xml": "vtkmodules.vtkIOXML", "vtk_numpy": "vtkmodules.util.numpy_support"}


def __getattr__(name):
    """`from other_readers import numpy` gives the module, or None after a message; its tests are then skipped."""
    if name not in PACKAGES:
        raise AttributeError(f"module 'other_readers' has no attribute '{name}'")
    try:
        return importlib.import_module(MODULES.get(name, name))
    except ImportError:
        print(f"skipped: there is no {name} on this machine ({PACKAGES[name]})", file=sys.stderr)
        return None


def some(cases, every, first=0):
    """Every so-manyth case from the first one on, or all if IS_LONG. Of values that are combined, each is met if their
    numbers have no factor in common with `every`."""
    return list(cases) if IS_LONG else list(cases)[first::every]


def random_samples(type, shape):
    """Any numbers of a type of integers; floats up to some thousands."""
    import numpy

    random = numpy.random.default_rng(1)
    if numpy.dtype(type).kind == "f":
        return (random.standard_normal(shape) * 1000).astype(type)
    return random.integers(numpy.iinfo(type).min, numpy.iinfo(type).max, shape, type, endpoint=True)


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

    def ok(self, *arguments):
        """A run that must succeed."""
        run = self.tagrid(*arguments)
        self.assertEqual(run.returncode, 0, f"{arguments}: {run.stderr}")
        return run

    def search(self, *arguments):
        """A run of convert --find, whose exit code must agree with its list."""
        run = self.tagrid("convert", "--find", *arguments)
        is_complete = not any(line.startswith("# not listed: ") for line in run.stdout.splitlines())
        self.assertEqual(run.returncode, 0 if is_complete else 65, f"{arguments}: {run.stderr}")
        return run

    def info(self, name):
        return json.loads(self.ok("info", name, "--json").stdout)

    def encoded(self, path, *options, says=""):
        """Encodes a volume without a loss, with messages that have the text `says`; its stored samples as an array [z, y, x],
        and what info says."""
        import numpy

        # spacing_test.py has what is said of volumes without a voxel size.
        said = self.ok("encode", path, "-o", "out.tag", "-f", *options).stderr.splitlines(keepends=True)
        self.messages = "".join(line for line in said if "add it with --spacing" not in line)
        self.assertIn(says, self.messages)
        info = self.info("out.tag")
        self.ok("decode", "out.tag", "-o", "out.raw", "-f", "--samples")
        if info["restorable"]:
            self.assert_restored(pathlib.Path(self.folder / path))
        elif info["compression"]:
            self.assert_restored_uncompressed(pathlib.Path(self.folder / path), info, options)
        return numpy.fromfile(self.folder / "out.raw", numpy.dtype(info["type"])).reshape(info["dims"][::-1]), info

    def encodes(self, truth, path, *options, what="", says=""):
        """The same, with the samples `truth`; returns what info says."""
        samples, info = self.encoded(path, *options, says=says)
        self.assert_same(samples, truth, what or (path, options))
        return info

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
        run = self.ok("restore", "out.tag", "-o", "restored")
        self.assertIn("not restored byte for byte: samples were compressed (" + info["compression"], run.stderr)
        name = path.name.removesuffix(".gz").removesuffix(".GZ")
        restored = "restored" if path.is_dir() else f"restored/{name}"
        # A number of one of several series means nothing among the files of one.
        options = [option for i, option in enumerate(options) if not (path.is_dir() and "--series" in options[max(i - 1, 0):i + 1])]
        self.ok("encode", restored, "-o", "again.tag", "-f", *options)
        again = self.info("again.tag")
        self.assertIs(again["restorable"], True, path)
        self.assertIsNone(again["compression"])
        for key in ("dims", "type", "geometry"):
            self.assertEqual(again[key], info[key], path)
        # TIFF has no word for a loss in the past, a file of DICOM may not say it, and a filter of HDF5 is gone.
        sources = [one["source"] | {"pairs": dict(one["source"]["pairs"])} for one in (again, info)]
        loss = sources[1]["pairs"].get("lossy source", "")
        if loss in ("TIFF, JPEG", "DICOM") or "HDF5, " in loss:
            for source in sources:
                source["pairs"].pop("lossy source", None)
        # The plain form may not have what was not understood: sparse chunks do not come back as such.
        for source in sources:
            source["pairs"].pop("not understood", None)
        self.assertEqual(*sources, path)
        self.ok("decode", "again.tag", "-o", "again.raw", "-f", "--samples")
        self.assertEqual((self.folder / "again.raw").read_bytes(), (self.folder / "out.raw").read_bytes(), path)
        # A range and a resumed run are for encoding, and say nothing of the file.
        of_file = [option for i, option in enumerate(options) if "--range" not in options[max(i - 1, 0):i + 1] and option != "--resume"]
        run = self.ok("verify", "out.tag", "--against", restored, *of_file)
        self.assertIn("source files: not those that were encoded: their samples are not compressed", run.stdout)
        for name in ("again.tag", "again.raw"):
            (self.folder / name).unlink()
        shutil.rmtree(self.folder / "restored")

    def records(self):
        """Those of `convert` to the directory out."""
        return [json.loads(line) for line in (self.folder / "out" / "results.jsonl").read_bytes().decode().splitlines()]

    def save(self, name, file):
        """Writes a data set of pydicom."""
        (self.folder / name).parent.mkdir(exist_ok=True)
        file.save_as(self.folder / name, write_like_original=False)

    def write_nrrd(self, name, samples, fields=""):
        (self.folder / name).write_bytes(scans.nrrd(samples, fields))

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


class ArchiveTest(ReaderTest):
    """Volumes in a directory of which each test knows the name."""
    archive = "archive"

    def volume(self, seed, shape=(4, 9, 11)):
        import numpy

        return numpy.random.default_rng(seed).integers(0, 4000, shape, "uint16")

    def path(self, name):
        path = self.folder / self.archive / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def write_dicom(self, name, uid, samples, **attributes):
        """`name`: of a file, with {} for the number of its slice."""
        path = self.path(name)
        scans.write_series(path.parent, samples, names=path.name, series=uid, first=0, RescaleIntercept=0, **attributes)
