"""The installed package: it finds its library wherever the prefix is, and xarray finds its engine."""

import os
import pathlib
import subprocess
import sys
import unittest

from volumes import temporary_folder

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv[2])

USE = """
import numpy as np, tagrid, sys, importlib.metadata
assert tagrid.__file__.startswith(sys.argv[1]), tagrid.__file__
assert importlib.metadata.version("tagrid") == tagrid.__version__
samples = np.arange(3000, dtype="i2").reshape(10, 15, 20)
tagrid.encode(samples, sys.argv[2], spacing=(2, 1, 1))
assert (np.asarray(tagrid.open(sys.argv[2])) == samples).all()
try:
    import xarray
except ImportError:
    sys.exit()
for options in ({"engine": "tagrid"}, {}):
    data = xarray.open_dataset(sys.argv[2], **options)
    assert float(data.volume.sel(z=18.0).max()) == 2999
assert "tagrid" in {point.name for point in importlib.metadata.entry_points(group="numcodecs.codecs")}
manifest, = importlib.metadata.entry_points(group="napari.manifest", name="tagrid")
assert manifest.value == "tagrid:napari.yaml"
"""


def run(*command, **environment):
    done = subprocess.run([str(part) for part in command], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | environment)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}\n{done.stdout}")
    return done.stdout


class Installed(unittest.TestCase):
    def setUp(self):
        self.folder = temporary_folder(self)

    def install(self, *components):
        for component in components:
            run("cmake", "--install", BUILD, "--prefix", self.folder / "here", "--component", component)
        (self.folder / "here").rename(self.folder / "moved")
        return self.folder / "moved"

    def test_it_works_from_any_prefix_and_has_entry_points(self):
        prefix = self.install("libtagrid", "python3-tagrid")
        package = next(prefix.rglob("tagrid/__init__.py")).parent
        names = {path.name for path in package.iterdir()}
        self.assertLessEqual({"py.typed", "_tagrid.pyi", "_volume.py", "xarray.py", "napari.yaml"}, names)
        run(sys.executable, "-B", "-c", USE, package.parent, self.folder / "a.tag", PYTHONPATH=str(package.parent))

    @unittest.skipUnless(os.environ.get("TAGRID_LONG"), "compiles the extension again: set TAGRID_LONG=1")
    def test_cmake_builds_it_with_an_installed_library(self):
        prefix = self.install("libtagrid", "libtagrid-dev")
        library = next(prefix.rglob("libtagrid.so")).parent
        run("cmake", "-S", ROOT / "python", "-B", self.folder / "build", CMAKE_PREFIX_PATH=str(prefix))
        run("cmake", "--build", self.folder / "build")
        run("cmake", "--install", self.folder / "build", "--prefix", self.folder / "cmake")
        found = next((self.folder / "cmake").rglob("tagrid/__init__.py")).parents[1]
        run(sys.executable, "-B", "-c", USE, found, self.folder / "a.tag", PYTHONPATH=str(found), LD_LIBRARY_PATH=str(library))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
