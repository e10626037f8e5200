"""Makes the wheel of a package that tools/reader_wheel.sh has put beside this file, with its library."""

import os
import pathlib
import re

from setuptools import Distribution, setup

try:
    from setuptools.command.bdist_wheel import bdist_wheel
except ImportError:  # before setuptools 70
    from wheel.bdist_wheel import bdist_wheel

PACKAGE = pathlib.Path("tagrid_reader")
if not (PACKAGE / "_version.py").exists():
    raise SystemExit("the library is missing: tools/reader_wheel.sh builds it, and the wheel")


class WithLibrary(Distribution):
    def has_ext_modules(self):
        return True


class ForOneSystem(bdist_wheel):
    """A wheel for every Python of a system: the library is no module of Python."""

    def get_tag(self):
        return "py3", "none", os.environ["TAGRID_READER_PLATFORM"]


setup(
    name="tagrid-reader",
    version=re.search(r'"(.*)"', (PACKAGE / "_version.py").read_text())[1],
    description="Reads CT volumes in .tag files, region by region, as numpy arrays",
    long_description=pathlib.Path("README.md").read_text(),
    long_description_content_type="text/markdown",
    license="Apache-2.0",
    packages=["tagrid_reader"],
    package_data={"tagrid_reader": ["py.typed", "*.so", "*.dylib", "*.dll", "licenses/*"]},
    python_requires=">=3.9",
    install_requires=["numpy"],
    distclass=WithLibrary,
    cmdclass={"bdist_wheel": ForOneSystem},
)
