#!/usr/bin/env bash
set -euxo pipefail
# shellcheck disable=SC2086
cmake $CMAKE_ARGS -G Ninja -S . -B build-conda -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$PREFIX" \
  -DCMAKE_INSTALL_LIBDIR=lib -DTAGRID_HDF5=ON
cmake --build build-conda --parallel "$CPU_COUNT"
cmake --install build-conda
