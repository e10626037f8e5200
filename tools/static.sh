#!/usr/bin/env bash
# Builds the program and its readers without libraries of the system, in an archive with its page and documents; see
# docs/dev/packages.md.
#   tools/static.sh [FOLDER]      FOLDER: where the archive goes, build/packages by default.
# It is built in build/static. Debian has no static libraries of oneTBB, ISA-L and DCMTK; that of HDF5 needs libcurl, and
# that of libtiff one under the GPL. So their source packages are built there.
set -euo pipefail
# shellcheck source=tools/package_build.sh
. "$(dirname "$0")/package_build.sh"
build=$PWD/build/static
libraries=$build/libraries

tools/install_packages.sh static
tools/debian_source.sh "$build/sources" onetbb libisal dcmtk hdf5 tiff
mkdir -p "$libraries/lib"
echo "Building (some minutes) ..."
# static_library NAME PACKAGE OPTION...: installs libNAME.a and its headers, if it is not there
static_library() {
  local name=$1 package=$2
  [ -f "$libraries/lib/lib$name.a" ] && return
  mkdir -p "$build/$package"
  # HDF5 looks for what it has found out in the folder where CMake was called.
  { cd "$build/$package" && cmake -S "$build/sources/$package" -B . -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUILD_SHARED_LIBS=OFF \
      -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DCMAKE_INSTALL_PREFIX="$libraries" "${@:3}" &&
    cmake --build . --target install; } >"$build/$package.log" 2>&1 || { cat "$build/$package.log" >&2; exit 70; }
  cd - >/dev/null
}
static_library tbb onetbb -DTBB_TEST=OFF -DTBBMALLOC_BUILD=OFF -DTBB_STRICT=OFF -DTBB_DISABLE_HWLOC_AUTOMATIC_SEARCH=ON \
  -DTBB_ENABLE_IPO=OFF
without=()
for library in TIFF PNG XML OPENSSL SNDFILE ICONV ICU STDLIBC_ICONV WRAP OPENJPEG; do without+=("-DDCMTK_WITH_$library=OFF"); done
# Its dictionary is in the library: there is no file of it where this program runs.
static_library dcmdata dcmtk "${without[@]}" -DBUILD_APPS=OFF -DDCMTK_MODULES="ofstd;oflog;dcmdata;dcmimgle;dcmimage;dcmjpeg;dcmjpls" \
  -DDCMTK_DEFAULT_DICT=builtin -DCMAKE_INSTALL_DATADIC=share
# Without what few files have: a library under the GPL, and one that is large.
static_library tiff tiff -Djbig=OFF -Dlerc=OFF -Dcxx=OFF
static_library hdf5 hdf5 -DBUILD_TESTING=OFF -DHDF5_BUILD_TOOLS=OFF -DHDF5_BUILD_EXAMPLES=OFF -DHDF5_BUILD_CPP_LIB=OFF \
  -DHDF5_BUILD_HL_LIB=OFF -DHDF5_BUILD_FORTRAN=OFF -DHDF5_ENABLE_Z_LIB_SUPPORT=ON -DHDF5_ENABLE_SZIP_SUPPORT=ON
if ! nm "$libraries/lib/libisal.a" 2>/dev/null | grep -q crc32_iscsi; then
  # Only what parity and Zarr need. `units` are folders of its sources.
  make -s -C "$build/sources/libisal" -f Makefile.unx -j "$(nproc)" lib units="erasure_code crc" >"$build/libisal.log" 2>&1 ||
    { cat "$build/libisal.log" >&2; exit 70; }
  cp "$build/sources/libisal/bin/isa-l.a" "$libraries/lib/libisal.a"
fi
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DTAGRID_STATIC=ON -DTAGRID_STATIC_READERS=ON -DTAGRID_WEB=ON -DTAGRID_UNITY=most \
  -DCMAKE_PREFIX_PATH="$libraries" -DCMAKE_INSTALL_PREFIX=/usr >/dev/null
cmake --build "$build" >/dev/null

version=$("$build/tagrid" --version | sed -n '1s/^tagrid \([^ ]*\).*/\1/p')
name=tagrid-$version-linux-$(uname -m)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$build" --prefix "$work/$name" --component tagrid --strip >/dev/null
cmake --install "$build" --prefix "$work/$name" --component tagrid-readers --strip >/dev/null
# The licenses of what is linked into the program: of the packages on its list of dependencies, and of the compiler's.
licenses=$work/$name/share/doc/tagrid/licenses
mkdir "$licenses"
for package in $(sed -n 's/.*"comment": "Debian: \([^",]*\).*/\1/p' "$build/tagrid.spdx.json") libc6-dev "libstdc++-$(g++ -dumpversion)-dev"; do
  cp "/usr/share/doc/$package/copyright" "$licenses/$package"
done
mkdir -p "$folder"
tar -C "$work" --sort=name --owner=0 --group=0 --numeric-owner -czf "$folder/$name.tar.gz" "$name"
echo "In $folder:"
cd "$folder" && ls -- *.tar.gz
