#!/usr/bin/env bash
# Installs what is missing, builds, and runs every test.
#   tools/test.sh          the tests that take some minutes, two of them for the fuzzers
#   tools/test.sh --long   also the tests that take hours
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install_packages.sh test
cmake --preset release -DTAGRID_TESTS=ON -DTAGRID_MPI=ON -DTAGRID_HDF5=ON -DTAGRID_PYTHON=ON ${TAGRID_CMAKE_OPTIONS:-} >/dev/null
cmake --build --preset release
# Many tests wait for processes that they have started.
ctest --preset release -j "$((2 * $(nproc)))"
if [ "${1:-}" = --long ]; then
  TAGRID_LONG=1 ctest --preset release -R "RealVolumes|RealRates|Fault|EveryCall|VdbReader|readers/|MemoryLimit|InstalledPrefix" --timeout 36000
  TAGRID_DAMAGES=5000 ctest --preset release -R LargeDamage --timeout 36000
  TAGRID_LONG=1 TAGRID_KILLS=1000 ctest --preset release -R /Kill --timeout 36000
  TAGRID_LONG=1 TAGRID_KILLS=100 ctest --preset release -R "Resume|Mpi" --timeout 36000
  cmake --preset asan >/dev/null
  cmake --build --preset asan --target tagrid tagrid-{read,write}-{hdf5,vdb} tagrid-read-{bmp,dicom,jp2,tiff}
  TAGRID_LONG=1 ctest --preset asan -R readers/ --timeout 36000
  # Not forged files, whose memory sanitizers change, nor commands that are killed, which report nothing.
  TAGRID_SANITIZED_PROGRAM=$PWD/build/asan/tagrid ctest --preset release -R '^tools/' \
    -E 'tools/(Benchmark|Scale|Paper|Streams|Slurm|Documentation|Advice|ForgedFiles)|/Kill\.|WideOpenVdbVolumes' --timeout 36000
  tools/same_bytes.sh --long
  tools/stream_test.sh
  tools/fuzz.sh --long 1
else
  tools/fuzz.sh
fi
