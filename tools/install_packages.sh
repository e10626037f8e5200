#!/usr/bin/env bash
# Installs a named set of Debian packages if they are missing: for building, testing, also on a cluster, fuzzing, comparing
# with other codecs, and making packages, the page of the viewer, the pictures of the documents, their site and the report of
# the paper.
#   tools/install_packages.sh build|mpi|python|page|packages|static|windows|arm64|reader|wheel|test|web|slurm|fuzz|oss_fuzz|bench|pictures|paper|site
# The sets are chosen by their names.
# shellcheck disable=SC2034
set -euo pipefail

build=(g++ cmake ninja-build libtbb-dev libzstd-dev libxxhash-dev libisal-dev libcurl4-openssl-dev libhwy-dev libsqlite3-dev libsodium-dev libcli11-dev libfmt-dev nlohmann-json3-dev zlib1g-dev libbz2-dev libpng-dev
  libtiff-dev libseccomp-dev libpugixml-dev libdcmtk-dev libopenjp2-7-dev libjxl-dev libgsf-1-dev libglib2.0-dev libhdf5-dev libblosc-dev pkgconf
  libopenvdb-dev libimath-dev libboost-dev)
mpi=("${build[@]}" libopenmpi-dev openmpi-bin)
python=("${build[@]}" pybind11-dev python3-dev python3-numpy)
# The decoder for browsers, and the page of the viewer: 0.8 GB.
page=(emscripten esbuild nodejs ninja-build cmake libhwy-dev libfmt-dev libxxhash-dev dpkg-dev)
packages=("${python[@]}" "${page[@]}" dpkg-dev file)
# The program without libraries of the system: some are built from Debian's sources, and ISA-L is written for nasm.
static=("${page[@]}" "${build[@]}" nasm make dpkg-dev)
wheel=("${python[@]}" python3-pip python3-setuptools python3-wheel python3-venv patchelf)
test=("${mpi[@]}" "${wheel[@]}" libgtest-dev libgmock-dev librapidcheck-dev clang clang-format mandoc openssl shellcheck zsh
  libopenvdb-tools python3 python3-yaml pkgconf dpkg-dev file shared-mime-info libglib2.0-bin jq zstd
  python3-numpy python3-tifffile libtiff-tools python3-nibabel plastimatch teem-apps python3-pil
  python3-pydicom strace dcmtk dicom3tools libgdcm-tools python3-h5py python3-mrcfile python3-fabio hdf5-tools python3-vtk9 xvfb xauth libgl1-mesa-dri fonts-dejavu-core libopenjp2-tools
  openjph-tools libjxl-tools python3-olefile
  gmsh python3-gmsh python3-meshio calculix-ccx python3-dask python3-xarray python3-zarr python3-fsspec python3-aiohttp mypy)
# As much again as the page, for a browser to test it with.
web=("${page[@]}" chromium)
fuzz=("${test[@]}" libclang-rt-dev)
# In an image that has clang; see packaging/oss-fuzz.
oss_fuzz=("${build[@]}" libgtest-dev libgmock-dev librapidcheck-dev zip)
slurm=("${test[@]}" slurm-wlm munge)
# For building on this machine for others, whose libraries are built from Debian's sources.
cross=(gcc libc6-dev cmake ninja-build make tcl libhwy-dev libfmt-dev libxxhash-dev libcli11-dev nlohmann-json3-dev libcurl4-openssl-dev libisal-dev dpkg-dev)
windows=("${cross[@]}" g++-mingw-w64-x86-64-posix wine64 nsis zip)
# With a compiler from npm.
reader=("${cross[@]}" lld npm python3-pip python3-setuptools python3-wheel)
arm64=("${cross[@]}" g++-aarch64-linux-gnu qemu-user gperf)
bench=("${build[@]}" python3 python3-numpy gnuplot-nox libbenchmark-dev libcharls-dev libjxl-tools zfp zstd)
pictures=("${python[@]}" python3-pil python3-matplotlib)
# The site of the documents, see tools/site.sh.
site=(python3-sphinx python3-myst-parser furo python3-breathe doxygen python3-numpy)
paper=("${mpi[@]}" python3 python3-numpy python3-pil python3-vtk9 xvfb libgl1-mesa-dri fonts-dejavu-core)

case "${1:-}" in
  build|mpi|python|page|packages|static|windows|arm64|reader|wheel|test|web|slurm|fuzz|oss_fuzz|bench|pictures|paper|site) declare -n wanted=$1 ;;
  *) echo "usage: $0 build|mpi|python|page|packages|static|windows|arm64|reader|wheel|test|web|slurm|fuzz|oss_fuzz|bench|pictures|paper|site" >&2; exit 64 ;;
esac

missing=()
for package in "${wanted[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

sudo=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "Neither root nor sudo: ask an administrator to install ${missing[*]}" >&2; exit 74; }
  sudo=(sudo)
fi
echo "Installing ${missing[*]}"
"${sudo[@]}" apt-get update -qq
DEBIAN_FRONTEND=noninteractive "${sudo[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
