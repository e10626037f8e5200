#!/usr/bin/env bash
# Builds the Debian packages: the program, its readers, the library, the HDF5 filter and the Python package.
#   tools/packages.sh [FOLDER]      FOLDER: where they go, build/packages by default. Packages that are there are removed.
# With TAGRID_BUILD=FOLDER, it makes packages of what is built in that folder, and builds nothing.
set -euo pipefail
folder=$(realpath -m "${1:-$(dirname "$0")/../build/packages}")
build=$(realpath -m "${TAGRID_BUILD:-$(dirname "$0")/../build/release}")
cd "$(dirname "$0")/.."

if [ -z "${TAGRID_BUILD:-}" ]; then
  tools/install_packages.sh packages
  echo "Building (some minutes) ..."
  cmake --preset release -DTAGRID_PYTHON=ON -DTAGRID_HDF5=ON >/dev/null
  cmake --build --preset release >/dev/null
fi
echo "Making packages ..."
mkdir -p "$folder"
rm -f "$folder"/*tagrid*.deb
(cd "$build" && cpack -G DEB -B "$folder" -Wno-dev >"$folder/cpack.log" 2>&1) || { cat "$folder/cpack.log" >&2; exit 70; }
rm -rf "$folder/_CPack_Packages" "$folder/cpack.log"
echo "In $folder:"
cd "$folder" && ls -- *.deb
