# Not tried: see docs/dev/packages.md. In a repository of Spack, this file is packages/tagrid/package.py.
from spack.package import *


class Tagrid(CMakePackage):
    """CT volumes as one file, with an adaptive tetrahedral grid and every voxel within a bound."""

    # Set `git` to the address of the repository, or build a checkout: spack develop --path DIR tagrid@main

    license("Apache-2.0", checked_by="tagrid")

    version("main", branch="main")

    variant("mpi", default=False, description="Build tagrid-mpi, for many processes")
    variant("hdf5_filter", default=False, description="Build the filter for HDF5 files")
    variant("python", default=False, description="Build the Python package")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("ninja", type="build")
    depends_on("pkgconfig", type="build")
    generator("ninja")

    depends_on("tbb")
    depends_on("sqlite")
    depends_on("libsodium")
    depends_on("zstd")
    depends_on("xxhash")
    depends_on("isa-l")
    depends_on("curl")
    depends_on("highway")
    depends_on("cli11", type="build")
    depends_on("fmt")
    depends_on("nlohmann-json", type="build")
    depends_on("zlib-api")
    depends_on("bzip2")
    depends_on("libpng")
    depends_on("libtiff")
    depends_on("dcmtk")
    depends_on("openjpeg")
    depends_on("libjxl")
    depends_on("hdf5~mpi")
    depends_on("c-blosc")
    depends_on("libseccomp")
    depends_on("pugixml")
    depends_on("openvdb")
    depends_on("imath")
    depends_on("boost", type="build")
    depends_on("mpi", when="+mpi")
    depends_on("python@3.10:", when="+python", type=("build", "run"))
    depends_on("py-numpy", when="+python", type=("build", "run"))
    depends_on("py-pybind11@2.10:", when="+python", type="build")
    extends("python", when="+python")

    # gcc 12 and clang 14 are the oldest that build it.
    conflicts("%gcc@:11")
    conflicts("%clang@:13")
    conflicts("platform=darwin")
    conflicts("platform=windows")

    def cmake_args(self):
        args = [
            self.define_from_variant("TAGRID_MPI", "mpi"),
            self.define_from_variant("TAGRID_HDF5", "hdf5_filter"),
            self.define_from_variant("TAGRID_PYTHON", "python"),
            self.define("CMAKE_INSTALL_LIBDIR", "lib"),
        ]
        if self.spec.satisfies("+python"):
            args.append(self.define("TAGRID_PYTHON_PROGRAM", self.spec["python"].command.path))
            args.append(self.define("TAGRID_PYTHON_FOLDER", python_platlib))
        return args

    @run_after("install")
    @on_package_attributes(run_tests=True)
    def check_install(self):
        tagrid = Executable(self.prefix.bin.tagrid)
        with working_dir("check", create=True):
            tagrid("phantom", "--dims", "32,32,32", "-o", "scan.nhdr")
            tagrid("encode", "scan.nhdr", "--max-error", "5")
            tagrid("verify", "scan.tag", "--against", "scan.nhdr")
