"""Builds the package with an installed libtagrid, which pkg-config finds: pip install ./python"""

import glob
import subprocess

from setuptools import Extension, setup


def pkg_config(*arguments):
    return subprocess.run(["pkg-config", *arguments, "tagrid"], check=True, stdout=subprocess.PIPE,
                          text=True).stdout.split()


def pybind11_folders():
    """Those of the Python package; Debian's pybind11-dev has its headers in /usr/include."""
    try:
        import pybind11
    except ImportError:
        return []
    return [pybind11.get_include()]


libraries = pkg_config("--variable=libdir")
setup(
    name="tagrid",
    version=pkg_config("--modversion")[0],
    description="CT volumes as .tag files: read in parts, written from arrays, with meshes and surfaces",
    license="Apache-2.0",
    packages=["tagrid", "tagrid.paraview"],
    package_data={"tagrid": ["py.typed", "*.pyi"]},
    python_requires=">=3.10",
    install_requires=["numpy"],
    extras_require={"dask": ["dask[array]"], "xarray": ["xarray"], "hdf5": ["h5py"]},
    entry_points=open("entry_points.txt").read(),
    ext_modules=[Extension(
        "tagrid._tagrid", sorted(glob.glob("extension/*.cpp")), depends=glob.glob("extension/*.h"), language="c++",
        include_dirs=["extension", *pybind11_folders()],
        extra_compile_args=["-std=c++20", "-fvisibility=hidden", *pkg_config("--cflags")],
        extra_link_args=[*pkg_config("--libs"), *(f"-Wl,-rpath,{folder}" for folder in libraries)])],
)
