#!/usr/bin/env bash
# Builds a wheel of the Python package, which needs nothing but numpy; see docs/dev/packages.md.
#   tools/wheel.sh [FOLDER]      FOLDER: where it goes, build/packages by default.
# With TAGRID_BUILD=FOLDER, it uses the library that is built in that folder, and builds no other.
set -euo pipefail
# shellcheck source=tools/package_build.sh
. "$(dirname "$0")/package_build.sh"

build_release wheel -DTAGRID_PYTHON=ON tagrid_shared tagrid_static
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
