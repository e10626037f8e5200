"""A wheel of tagrid-reader reads in a fresh environment, where there is no package tagrid. With TAGRID_LONG=1, it is
made as it is given away: with a library of its own, which needs nothing but the C library; that takes minutes.

    reader_wheel_test.py PROGRAM BUILD
"""

import importlib.util
import os
import pathlib
import re
import shutil
import sys
import unittest
import zipfile

from installed_test import BUILD, ROOT, run
from volumes import temporary_folder

PROGRAM = os.path.abspath(sys.argv[1])
MISSING = [module for module in ("pip", "wheel", "setuptools", "venv") if not importlib.util.find_spec(module)]
MISSING += [program for program in ("readelf", "nm") if not shutil.which(program)]
LONG = bool(os.environ.get("TAGRID_LONG"))
#: What the wheels named manylinux may expect of a system, of what is used here.
EVERYWHERE = r"(ld-linux.*|lib(c|m|dl|pthread|gcc_s)\.so\.\d+)"
USE = """
import hashlib, sys
import tagrid_reader
try:
    import tagrid
    sys.exit("tagrid is there, too")
except ImportError:
    pass
scan = tagrid_reader.open(sys.argv[1])
print(tagrid_reader.__file__)
print(scan.shape, scan.dtype, scan.overviews, scan[3:9, ::2, 5].shape)
print(hashlib.sha256(scan.read(threads=2)).hexdigest())
print("\\n".join(sorted({line.split()[-1] for line in open("/proc/self/maps") if "tagrid" in line})))
"""


class ReaderWheel(unittest.TestCase):
    def test_it_reads_in_a_fresh_environment(self):
        folder = temporary_folder(self)
        settings = {"TAGRID_READER_LIBRARY": str(BUILD / "libtagrid.so")}
        if LONG:
            settings = {"TAGRID_BUILD": str(BUILD / "reader/linux-x86_64")}
        run(ROOT / "tools/reader_wheel.sh", "linux-x86_64", folder, **settings)
        wheel, = folder.glob("*.whl")
        self.assertRegex(wheel.name, rf"^tagrid_reader-[\d.rc]+-py3-none-manylinux_2_\d+_{os.uname().machine}\.whl$")
        content = zipfile.ZipFile(wheel)
        content.extract("tagrid_reader/libtagrid_reading.so", folder)
        library = folder / "tagrid_reader/libtagrid_reading.so"
        if LONG:
            self.check_library(library)
            self.assertIn("manylinux_2_17_", wheel.name)
        if shutil.which("dpkg-query"):
            self.assertEqual(len([name for name in content.namelist() if "/licenses/" in name]), 8 if LONG else 6)
        file, = (name for name in content.namelist() if name.endswith(".dist-info/METADATA"))
        metadata = content.read(file).decode()
        self.assertEqual(re.findall("^Requires-Dist: (.*)", metadata, re.MULTILINE), ["numpy"])
        self.assertIn("Requires-Python: >=3.9\n", metadata)

        environment = folder / "environment"
        run(sys.executable, "-m", "venv", "--without-pip", "--system-site-packages", environment)
        run(sys.executable, "-m", "pip", "--python", environment / "bin/python", "install", "-q", "--no-index",
            "--no-deps", wheel)
        scan = ROOT / "tests/golden/1.0/lead_voxels_overviews_int16.tag"
        said = run(environment / "bin/python", "-B", "-c", USE, scan, PYTHONPATH="").splitlines()
        self.assertTrue(said[0].startswith(str(environment)), said)
        self.assertEqual(said[1], "(38, 35, 41) int16 (4, 16) (6, 18)")
        run(PROGRAM, "decode", scan, "-o", folder / "a.raw", "-q")
        self.assertEqual(said[2], run("sha256sum", folder / "a.raw").split()[0])
        self.assertTrue(all(file.startswith(str(environment)) for file in said[3:]), said)

    def check_library(self, library):
        """It needs the C library alone, which was several files before 2.34, and exports what its header declares."""
        needed = re.findall(r"\(NEEDED\).*\[(.*)\]", run("readelf", "-d", library))
        self.assertEqual([name for name in needed if not re.fullmatch(EVERYWHERE, name)], [])
        names = {line.split()[-1] for line in run("nm", "-D", "--defined-only", library).splitlines()}
        header = (ROOT / "include/tagrid/tagrid_blocks.h").read_text()
        declared = set(re.findall(r"^TAGRID_API [^(]*\b(tagrid_\w+)\(", header, re.MULTILINE))
        self.assertEqual(names, declared | {"tagrid_version", "tagrid_status_text", "tagrid_info_init_sized"})
        self.assertLess(library.stat().st_size, 5_000_000)


if __name__ == "__main__":
    if MISSING:
        print(f"skipped: there is no {', '.join(MISSING)} for {sys.executable} on this machine")
    else:
        unittest.main(argv=sys.argv[:1])
