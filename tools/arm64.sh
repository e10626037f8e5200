#!/usr/bin/env bash
# Builds for Linux on arm64 with Debian's cross compiler: the program without libraries of the system, build/arm64/tagrid,
# which qemu-user runs here.
#   tools/arm64.sh [BUILD_FOLDER]      default: build/arm64
set -euo pipefail
cd "$(dirname "$0")/.."
build=$(realpath -m "${1:-build/arm64}")
command -v aarch64-linux-gnu-g++ >/dev/null ||
  { echo "The compiler for arm64 is missing. On Debian: tools/install_packages.sh arm64" >&2; exit 69; }
tools/cross_libraries.sh linux-arm64 "$build/libraries"
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/toolchains/linux-arm64.cmake" \
  -DTAGRID_CROSS_LIBRARIES="$build/libraries" -DTAGRID_STATIC=ON -DTAGRID_UNITY=most >"$build/log" ||
  { cat "$build/log" >&2; exit 70; }
cmake --build "$build" --target tagrid >"$build/log" || { cat "$build/log" >&2; exit 70; }
ls -l "$build/tagrid"
