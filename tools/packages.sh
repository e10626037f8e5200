#!/usr/bin/env bash
# Builds the Debian packages: the program with the page of its viewer, its readers, the library, the HDF5 filter and the
# Python package.
#   tools/packages.sh [FOLDER]      FOLDER: where they go, build/packages by default. Packages that are there are removed.
# With TAGRID_BUILD=FOLDER, it makes packages of what is built in that folder, and builds nothing.
set -euo pipefail
# shellcheck source=tools/package_build.sh
. "$(dirname "$0")/package_build.sh"

build_release packages "-DTAGRID_PYTHON=ON -DTAGRID_HDF5=ON -DTAGRID_WEB=ON"
echo "Making packages ..."
mkdir -p "$folder"
rm -f "$folder"/*tagrid*.deb
(cd "$build" && cpack -G DEB -B "$folder" -Wno-dev >"$folder/cpack.log" 2>&1) || { cat "$folder/cpack.log" >&2; exit 70; }
rm -rf "$folder/_CPack_Packages" "$folder/cpack.log"
grep -q '^TAGRID_WEB:BOOL=ON$' "$build/CMakeCache.txt" ||
  echo "Without the page of \`tagrid view\`: $build is built without TAGRID_WEB"
echo "In $folder:"
cd "$folder" && ls -- *.deb
