#!/usr/bin/env bash
# Builds a wheel of the Python package tagrid-reader, which only reads: one for all Pythons of a system; see
# docs/dev/packages.md.
#   tools/reader_wheel.sh [SYSTEM] [FOLDER]      SYSTEM: linux-x86_64, by default, linux-aarch64, macos-arm64,
#                                                macos-x86_64 or windows; FOLDER: build/packages
# It is built by tools/reader_library.sh, or by tools/windows.sh; with TAGRID_BUILD=FOLDER, there. With
# TAGRID_READER_LIBRARY=FILE, the wheel has this library of Linux, and nothing is built.
set -euo pipefail
system=${1:-linux-x86_64}
folder=$(realpath -m "${2:-$(dirname "$0")/../build/packages}")
cd "$(dirname "$0")/.."
debian=/usr/share/doc

case "$system" in
  linux-*|macos-*)
    build=$(realpath -m "${TAGRID_BUILD:-build/reader/$system}")
    name=libtagrid_reading.so
    platform=manylinux_2_17_${system#linux-}
    if [[ $system = macos-* ]]; then name=libtagrid_reading.dylib platform=macosx_11_0_${system#macos-}; fi
    library=${TAGRID_READER_LIBRARY:-$build/$name}
    if [ -z "${TAGRID_READER_LIBRARY:-}" ]; then
      tools/reader_library.sh "$system" "$build" >/dev/null
    else
      # The oldest C library that has all symbols.
      libc=$(readelf -V "$library" | grep -o 'GLIBC_2[0-9.]*' | cut -d_ -f2 | { cat; echo 2.5; } | sort -uV | tail -1)
      platform=manylinux_${libc//./_}_$(uname -m)
    fi
    compiler=("$debian"/libstdc++6/copyright)
    if [ -z "${TAGRID_READER_LIBRARY:-}" ]; then compiler=("$build"/licenses/*/copyright); fi
    ;;
  windows)
    build=$(realpath -m "${TAGRID_BUILD:-build/windows}")
    name=tagrid_reading.dll
    library=$build/reading/$name
    tools/windows.sh "$build" >/dev/null
    platform=win_amd64
    compiler=("$debian"/g++-mingw-w64-x86-64-posix/copyright "$debian"/mingw-w64-x86-64-dev/copyright)
    ;;
  *) echo "usage: $0 [linux-x86_64|linux-aarch64|macos-arm64|macos-x86_64|windows] [FOLDER]" >&2; exit 64 ;;
esac

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$folder" "$work/tagrid_reader/licenses"
cp python/reader/{setup.py,pyproject.toml,README.md} "$work"
cp python/reader/tagrid_reader/*.py "$work/tagrid_reader"
while read -r module; do cp "python/tagrid/$module" "$work/tagrid_reader"; done <python/reader/shared_modules.txt
cp -L "$library" "$work/tagrid_reader/$name"
version=$(sed -n 's/^project(tagrid VERSION \([0-9.]*\) .*/\1/p' CMakeLists.txt)
# shellcheck disable=SC2016  # these are the words of CMake
version+=$(sed -n 's/^set(TAGRID_VERSION ${PROJECT_VERSION}\(.*\))/\1/p' CMakeLists.txt)
sed "s/@TAGRID_VERSION@/$version/" python/reader/tagrid_reader/_version.py.in >"$work/tagrid_reader/_version.py"
# The licenses of all that is in the library.
cp LICENSE "$work/tagrid_reader/licenses/tagrid"
if [ -e "$build/zstd/debian/copyright" ] && [ -z "${TAGRID_READER_LIBRARY:-}" ]; then
  cp "$build/zstd/debian/copyright" "$work/tagrid_reader/licenses/libzstd-dev"
fi
for file in "$debian"/{libzstd-dev,libxxhash-dev,libhwy-dev,libfmt-dev}/copyright "${compiler[@]}"; do
  if [ -e "$file" ]; then cp "$file" "$work/tagrid_reader/licenses/$(basename "$(dirname "$file")")"; fi
done
TAGRID_READER_PLATFORM=$platform /usr/bin/python3 -m pip wheel --no-index --no-build-isolation --no-deps -w "$folder" \
  "$work" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 70; }
echo "In $folder:"
cd "$folder" && ls -- tagrid_reader-*"$platform".whl
