#!/usr/bin/env bash
# Builds for Windows on x86-64, with Debian's mingw-w64: the half of the library that reads blocks, in
# build/windows/reading, also as tagrid_reading.dll, and read_blocks.exe, which needs nothing but Windows; read_blocks_dll.exe
# needs the DLL. With --program, also tagrid.exe and programs that read formats, in build/windows/program.
#   tools/windows.sh [--program] [BUILD_FOLDER]      default: build/windows
set -euo pipefail
cd "$(dirname "$0")/.."
program=
if [ "${1:-}" = --program ]; then
  program=1
  shift
fi
build=$(realpath -m "${1:-build/windows}")
command -v x86_64-w64-mingw32-g++-posix >/dev/null ||
  { echo "mingw-w64 is missing. On Debian: tools/install_packages.sh windows" >&2; exit 69; }
tools/debian_source.sh "$build" zstd
tools/debian_headers.sh "$build/include"
reading=$build/reading
cmake -S . -B "$reading" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/toolchains/windows-x64.cmake" \
  -DTAGRID_READING_ONLY=ON -DTAGRID_UNITY=most -DTAGRID_WERROR=ON -DTAGRID_ZSTD_SOURCES="$build/zstd/lib" -DTAGRID_DEBIAN_HEADERS="$build/include" \
  >"$build/reading.log" || { cat "$build/reading.log" >&2; exit 70; }
cmake --build "$reading" >"$build/reading.log" || { cat "$build/reading.log" >&2; exit 70; }
x86_64-w64-mingw32-gcc-posix -std=c11 -O2 -Iinclude -c tests/library/read_blocks.c -o "$reading/read_blocks.o"
x86_64-w64-mingw32-g++-posix -static "$reading/read_blocks.o" "$reading/libtagrid_reading.a" "$reading/libzstd_decompress.a" \
  "$reading/libxxhash.a" -Wl,--gc-sections -s -o "$reading/read_blocks.exe"
x86_64-w64-mingw32-gcc-posix "$reading/read_blocks.o" "$reading/libtagrid_reading.dll.a" -s -o "$reading/read_blocks_dll.exe"
ls -l "$reading/read_blocks.exe" "$reading/tagrid_reading.dll"
[ -n "$program" ] || exit 0

tools/cross_libraries.sh windows-x64 "$build/libraries"
cmake -S . -B "$build/program" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/toolchains/windows-x64.cmake" \
  -DTAGRID_CROSS_LIBRARIES="$build/libraries" -DTAGRID_STATIC=ON -DTAGRID_STATIC_READERS=ON -DTAGRID_UNITY=most >"$build/program.log" ||
  { cat "$build/program.log" >&2; exit 70; }
cmake --build "$build/program" --target tagrid tagrid-read-{bmp,dicom,hdf5,jp2,png,tiff} tagrid-write-hdf5 >"$build/program.log" ||
  { cat "$build/program.log" >&2; exit 70; }
ls -l "$build"/program/*.exe
