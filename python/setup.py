"""Builds the package with an installed libtagrid, which pkg-config finds: pip install ./python, or pip wheel ./python

libtagrid.a is linked into the extension. Other libraries that not every Linux has are copied into the package, under
names of their own, so that the wheel needs nothing but numpy: see docs/dev/packages.md.
"""

import glob
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

try:
    from setuptools.command.bdist_wheel import bdist_wheel
except ImportError:  # before setuptools 70
    from wheel.bdist_wheel import bdist_wheel

# What the manylinux wheels of PEP 600 may expect of a system, of what is used here.
EVERYWHERE = re.compile(r"(ld-linux.*|lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+))\.so\.\d+")
# Compiled in, without a library to copy.
HEADERS = ("libhwy-dev", "pybind11-dev", "libfmt-dev")


def output(*command):
    return subprocess.run([str(part) for part in command], check=True, stdout=subprocess.PIPE, text=True).stdout


def pkg_config(*arguments):
    return output("pkg-config", *arguments, "tagrid").split()


def pybind11_folders():
    """Those of the Python package; Debian's pybind11-dev has its headers in /usr/include."""
    try:
        import pybind11
    except ImportError:
        return []
    return [pybind11.get_include()]


def needed(file):
    return re.findall(r"\(NEEDED\).*\[(.*)\]", output("readelf", "-d", file))


def found_by_loader(file):
    return dict(re.findall(r"^\s*(\S+) => (\S+) \(", output("ldd", file), re.MULTILINE))


def debian_package(file):
    """The package that a file belongs to, or None where there is no such package, or no dpkg."""
    if not shutil.which("dpkg-query"):
        return None
    found = subprocess.run(["dpkg-query", "-S", file], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return found.stdout.split(":")[0] if found.returncode == 0 else None


class SelfContained(build_ext):
    """Builds the extension, and copies the libraries that it needs beside it, with their licenses."""

    def run(self):
        super().run()
        if self.inplace:
            return
        if not shutil.which("patchelf"):
            raise SystemExit("patchelf was not found. On Debian: apt-get install patchelf")
        package = pathlib.Path(self.build_lib) / "tagrid"
        extension, = package.glob("_tagrid.*.so")
        self.copies = package / "libs"
        self.licenses = package / "licenses"
        for folder in (self.copies, self.licenses):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
        self.names = {}
        self.bundle(extension, "$ORIGIN/libs")
        prefix = pathlib.Path(pkg_config("--variable=prefix")[0])
        self.copy_license("tagrid", prefix / "share/doc/libtagrid-dev/LICENSE")
        for name in HEADERS:
            self.copy_license(name, pathlib.Path("/usr/share/doc") / name / "copyright")

    def bundle(self, file, path):
        """Makes `file` use copies of what it needs, which the loader looks for at `path`."""
        where = found_by_loader(file)
        for name in needed(file):
            if EVERYWHERE.fullmatch(name):
                continue
            if name not in where:
                raise SystemExit(f"{file} needs {name}, which the loader does not find: set LD_LIBRARY_PATH")
            if name not in self.names:
                self.copy_library(name, pathlib.Path(where[name]).resolve())
            subprocess.run(["patchelf", "--replace-needed", name, self.names[name], file], check=True)
        subprocess.run(["patchelf", "--set-rpath", path, file], check=True)

    def copy_library(self, name, source):
        # Another module of the process may have loaded a library of this name, in another version.
        stem, _, version = name.partition(".so")
        self.names[name] = f"{stem}-{hashlib.sha256(source.read_bytes()).hexdigest()[:8]}.so{version}"
        copy = self.copies / self.names[name]
        shutil.copyfile(source, copy)
        copy.chmod(0o755)
        subprocess.run(["patchelf", "--set-soname", copy.name, copy], check=True)
        self.bundle(copy, "$ORIGIN")
        owner = debian_package(source)
        self.copy_license(owner or stem, pathlib.Path("/usr/share/doc") / (owner or stem) / "copyright")

    def copy_license(self, name, source):
        if source.exists():
            shutil.copyfile(source, self.licenses / name)
        else:
            print(f"warning: there is no {source}; add the license of {name} before you give the wheel away",
                  file=sys.stderr)


class ForThisLibc(bdist_wheel):
    """A wheel for systems whose C library is at least as new as that of this machine."""

    def get_tag(self):
        python, abi, system = super().get_tag()
        if system.startswith("linux_"):
            version = os.confstr("CS_GNU_LIBC_VERSION").removeprefix("glibc ").replace(".", "_")
            system = system.replace("linux_", f"manylinux_{version}_", 1)
        return python, abi, system


libraries = pkg_config("--static", "--libs")
archive = f"{pkg_config('--variable=libdir')[0]}/libtagrid.a"
setup(
    name="tagrid",
    version=pkg_config("--variable=release")[0],
    description="CT volumes as .tag files: read in parts, written from arrays, with meshes and surfaces",
    license="Apache-2.0",
    # napari lists packages with its own.
    classifiers=["Framework :: napari", "Programming Language :: Python :: 3", "Topic :: Scientific/Engineering :: Image Processing"],
    packages=["tagrid", "tagrid.paraview"],
    package_data={"tagrid": ["py.typed", "*.pyi", "napari.yaml"]},
    python_requires=">=3.10",
    install_requires=["numpy"],
    extras_require={"dask": ["dask[array]"], "xarray": ["xarray"], "hdf5": ["h5py"]},
    entry_points=open("entry_points.txt").read(),
    cmdclass={"build_ext": SelfContained, "bdist_wheel": ForThisLibc},
    ext_modules=[Extension(
        "tagrid._tagrid", sorted(glob.glob("extension/*.cpp")), depends=[*glob.glob("extension/*.h"), archive],
        language="c++",
        include_dirs=["extension", *pybind11_folders()],
        extra_compile_args=["-std=c++20", "-g0", "-fvisibility=hidden", *pkg_config("--cflags")],
        extra_link_args=["-Wl,--as-needed,--exclude-libs,ALL,--gc-sections,--strip-all",
                         *(archive if flag == "-ltagrid" else flag for flag in libraries)])],
)
