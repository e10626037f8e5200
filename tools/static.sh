#!/usr/bin/env bash
# Builds the program without libraries of the system, in an archive with its page and documents; see docs/packages.md.
#   tools/static.sh [FOLDER]      FOLDER: where the archive goes, build/packages by default.
# It is built in build/static. Debian has no archives of oneTBB and ISA-L, so their source packages are built there.
set -euo pipefail
# shellcheck source=tools/package_build.sh
. "$(dirname "$0")/package_build.sh"
build=$PWD/build/static
libraries=$build/libraries

tools/install_packages.sh static
tools/debian_source.sh "$build/sources" onetbb libisal
mkdir -p "$libraries/lib"
echo "Building (some minutes) ..."
if [ ! -f "$libraries/lib/libtbb.a" ]; then
  cmake -S "$build/sources/onetbb" -B "$build/onetbb" -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUILD_SHARED_LIBS=OFF -DTBB_TEST=OFF \
    -DTBBMALLOC_BUILD=OFF -DTBB_STRICT=OFF -DTBB_DISABLE_HWLOC_AUTOMATIC_SEARCH=ON -DTBB_ENABLE_IPO=OFF \
    -DCMAKE_INSTALL_PREFIX="$libraries" >"$build/onetbb.log" 2>&1 || { cat "$build/onetbb.log" >&2; exit 70; }
  cmake --build "$build/onetbb" --target install >/dev/null
fi
if ! nm "$libraries/lib/libisal.a" 2>/dev/null | grep -q crc32_iscsi; then
  # Only what parity and Zarr need. `units` are folders of its sources.
  make -s -C "$build/sources/libisal" -f Makefile.unx -j "$(nproc)" lib units="erasure_code crc" >"$build/libisal.log" 2>&1 ||
    { cat "$build/libisal.log" >&2; exit 70; }
  cp "$build/sources/libisal/bin/isa-l.a" "$libraries/lib/libisal.a"
fi
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DTAGRID_STATIC=ON -DTAGRID_WEB=ON -DTAGRID_UNITY=most \
  -DCMAKE_PREFIX_PATH="$libraries" -DCMAKE_INSTALL_PREFIX=/usr >/dev/null
cmake --build "$build" >/dev/null

version=$("$build/tagrid" --version | sed -n '1s/^tagrid \([^ ]*\).*/\1/p')
name=tagrid-$version-linux-$(uname -m)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$build" --prefix "$work/$name" --component tagrid --strip >/dev/null
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
