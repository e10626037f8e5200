"""A wheel works in a fresh environment that has nothing but numpy, and brings the libraries that it needs."""

import importlib.util
import os
import pathlib
import re
import shutil
import sys
import unittest
import zipfile

from installed_test import BUILD, ROOT, USE, run
from volumes import temporary_folder

MISSING = [module for module in ("pip", "wheel", "setuptools", "venv") if not importlib.util.find_spec(module)]
MISSING += [program for program in ("patchelf", "readelf", "pkg-config", "c++") if not shutil.which(program)]

# Which libraries the process has mapped, without those of numpy.
MAPPED = USE.replace("import xarray", "raise ImportError").replace("    sys.exit()", """
    mapped = {line.split()[-1] for line in open("/proc/self/maps") if ".so" in line}
    print("\\n".join(sorted(file for file in mapped if "numpy" not in file)))
    sys.exit()""")


class Wheel(unittest.TestCase):
    def test_it_needs_nothing_but_numpy(self):
        folder = temporary_folder(self)
        run(ROOT / "tools/wheel.sh", folder, TAGRID_BUILD=str(BUILD))
        wheel, = folder.glob("*.whl")
        python = f"cp{sys.version_info.major}{sys.version_info.minor}"
        libc = os.confstr("CS_GNU_LIBC_VERSION").removeprefix("glibc ").replace(".", "_")
        self.assertRegex(wheel.name, rf"^tagrid-[\d.]+-{python}-{python}-manylinux_{libc}_{os.uname().machine}\.whl$")
        names = zipfile.ZipFile(wheel).namelist()
        libraries = {re.sub(r"-\w{8}\.so[\d.]*$", "", pathlib.Path(name).name) for name in names if "/libs/" in name}
        self.assertEqual(libraries, {"libtbb", "libfmt", "libzstd", "libxxhash", "libisal"})
        self.assertFalse([name for name in names if "libtagrid" in name], "libtagrid is in the extension")
        # Each library, what gives only headers, and tagrid itself.
        if shutil.which("dpkg-query"):
            self.assertEqual(len([name for name in names if name.startswith("tagrid/licenses/")]), 5 + 3 + 1)

        environment = folder / "environment"
        run(sys.executable, "-m", "venv", "--without-pip", environment)
        run(sys.executable, "-m", "pip", "--python", environment / "bin/python", "install", "-q", "--no-index",
            "--no-deps", wheel)
        # All that a user of the wheel has besides, of this machine's Python.
        numpy = folder / "numpy only"
        numpy.mkdir()
        (numpy / "numpy").symlink_to(pathlib.Path(importlib.util.find_spec("numpy").origin).parent)
        site = next(environment.glob("lib/python*/site-packages"))
        program = f"import sys; sys.path.append({str(numpy)!r})\n{MAPPED}"
        said = run(environment / "bin/python", "-I", "-B", "-c", program, site, folder / "a.tag", PATH="")
        outside = {pathlib.Path(file).name for file in said.splitlines() if not file.startswith(str(environment))}
        allowed = r"(ld-linux.*|lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+))\.so[\d.]*|.*\.cpython-.*\.so"
        # Modules of Python itself have libraries of their own, and so has numpy.
        pythons = r"lib(python3|expat|z|bz2|lzma|ffi|crypto|ssl|uuid|blas|lapack|openblas|gfortran|quadmath|mpdec).*"
        self.assertEqual({name for name in outside if not re.fullmatch(f"{allowed}|{pythons}", name)}, set())
        inside = {file for file in said.splitlines() if file.startswith(str(environment))}
        self.assertGreaterEqual(len(inside), 6, said)


if __name__ == "__main__":
    if MISSING:
        print(f"skipped: there is no {', '.join(MISSING)} for {sys.executable} on this machine")
    elif not os.environ.get("TAGRID_LONG"):
        print("skipped: compiles the extension again: set TAGRID_LONG=1")
    else:
        unittest.main(argv=sys.argv[:1])
