#!/usr/bin/env bash
# Installs what is missing, builds, and runs the tests.
#   tools/test.sh          the tests that take some minutes, two of them for the fuzzers
#   tools/test.sh --quick  without those of them that take longest
#   tools/test.sh --long   every test, also those that take hours
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install_packages.sh test
# emscripten takes 0.8 GB, so it is not installed for this alone.
web=OFF
if command -v emcc >/dev/null && command -v node >/dev/null && command -v esbuild >/dev/null; then web=ON; fi
cmake --preset release -DTAGRID_TESTS=ON -DTAGRID_WEB=$web -DTAGRID_MPI=ON -DTAGRID_HDF5=ON -DTAGRID_PYTHON=ON ${TAGRID_CMAKE_OPTIONS:-} >/dev/null
cmake --build --preset release
# Many tests wait for processes that they have started.
if [ "${1:-}" != --long ]; then
  left_out='^slow$'
  if [ "${1:-}" = --quick ]; then left_out='^(slow|thorough)$'; fi
  ctest --preset release -j "$((2 * $(nproc)))" -LE "$left_out"
  echo "Left out, as they take minutes (tools/test.sh --long runs them):"
  ctest --preset release -N -L "$left_out" | grep '#'
  [ "$web" = ON ] || echo "Left out, as emscripten, node or esbuild is missing (tools/install_packages.sh web): web/"
  tools/fuzz.sh
else
  tools/install_packages.sh site
  ctest --preset release -j "$((2 * $(nproc)))"
  for set in windows arm64 reader; do tools/install_packages.sh "$set"; done
  TAGRID_LONG=1 ctest --preset release -L '^longer$' --timeout 36000
  TAGRID_DAMAGES=5000 ctest --preset release -R LargeDamage --timeout 36000
  TAGRID_LONG=1 TAGRID_KILLS=1000 ctest --preset release -R /Kill --timeout 36000
  TAGRID_LONG=1 TAGRID_KILLS=100 ctest --preset release -R "Resume|Mpi" --timeout 36000
  tools/install_packages.sh slurm
  TAGRID_LONG=1 ctest --preset release -R tools/RealSlurm --timeout 36000
  cmake --preset asan -DTAGRID_EVERY_TEST=ON >/dev/null
  cmake --build --preset asan --target tagrid tagrid-{read,write}-{hdf5,vdb} tagrid-read-{bmp,dicom,jp2,png,tiff,zarr,zeiss} {stages,io,pipeline}_tests
  TAGRID_LONG=1 ctest --preset asan -L '^every-asan$' --timeout 36000
  cmake --preset tsan -DTAGRID_EVERY_TEST=ON >/dev/null
  cmake --build --preset tsan --target pipeline_tests race_check
  ctest --preset tsan -L '^every-tsan$' --timeout 36000
  TAGRID_SANITIZED_PROGRAM=$PWD/build/asan/tagrid ctest --preset release -L '^every-command-asan$' --timeout 36000
  tools/same_bytes.sh --long
  tools/stream_test.sh
  tools/fuzz.sh --long 1
  # What this release of Debian has older versions of.
  if grep -qx 'VERSION_ID="12"' /etc/os-release; then tools/in_debian.sh 13 tools/test.sh; fi
fi
