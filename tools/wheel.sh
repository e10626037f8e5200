#!/usr/bin/env bash
# Builds a wheel of the Python package, which needs nothing but numpy; see docs/packages.md.
#   tools/wheel.sh [FOLDER]      FOLDER: where it goes, build/packages by default.
# With TAGRID_BUILD=FOLDER, it uses the library that is built in that folder, and builds no other.
set -euo pipefail
folder=$(realpath -m "${1:-$(dirname "$0")/../build/packages}")
build=$(realpath -m "${TAGRID_BUILD:-$(dirname "$0")/../build/release}")
cd "$(dirname "$0")/.."

if [ -z "${TAGRID_BUILD:-}" ]; then
  tools/install_packages.sh wheel
  echo "Building (some minutes) ..."
  cmake --preset release -DTAGRID_PYTHON=ON >/dev/null
  cmake --build --preset release --target tagrid_shared tagrid_static >/dev/null
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$build" --prefix "$work/prefix" --component libtagrid-dev >/dev/null
# pip builds in the folder of the sources.
cp -r python "$work/python"
echo "Making the wheel ..."
pkgconfig=$(dirname "$(find "$work/prefix" -name tagrid.pc)")
PKG_CONFIG_PATH=$pkgconfig /usr/bin/python3 -m pip wheel -v --no-index --no-build-isolation --no-deps -w "$folder" "$work/python" \
  >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 70; }
grep '^ *warning: .*license' "$work/log" >&2 || true
echo "In $folder:"
cd "$folder" && ls -- *.whl
