#!/usr/bin/env bash
# Packs tagrid.exe with the page of the viewer, its documents and the licenses of what is linked into it: a zip archive, and an
# installer, which opens .tag files with the viewer.
#   tools/windows_package.sh [FOLDER]      FOLDER: where they go, build/packages by default
# It is built in build/windows; with TAGRID_BUILD=FOLDER, there.
set -euo pipefail
folder=$(realpath -m "${1:-$(dirname "$0")/../build/packages}")
build=$(realpath -m "${TAGRID_BUILD:-$(dirname "$0")/../build/windows}")
cd "$(dirname "$0")/.."
tools/install_packages.sh windows
tools/windows.sh --program "$build" >/dev/null
tools/install_packages.sh page
web/build.sh >/dev/null
version=$(sed -n 's/^project(tagrid VERSION \([0-9.]*\) .*/\1/p' CMakeLists.txt)
# shellcheck disable=SC2016  # these are the words of CMake
version+=$(sed -n 's/^set(TAGRID_VERSION ${PROJECT_VERSION}\(.*\))/\1/p' CMakeLists.txt)
name=tagrid-$version-windows-x64
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
staged=$work/$name
mkdir -p "$staged/bin" "$staged/share/tagrid" "$staged/share/doc/tagrid/licenses" "$folder"
cp "$build"/program/tagrid{,-read-*,-write-hdf5}.exe "$staged/bin"
x86_64-w64-mingw32-strip "$staged/bin"/*.exe
cp -r web/viewer/dist "$staged/share/tagrid/viewer"
cp -r docs "$staged/share/doc/tagrid"
cp README.md "$staged"
cp LICENSE "$staged/LICENSE.txt"
for source in "$build"/libraries/sources/*/; do
  cp "$source/debian/copyright" "$staged/share/doc/tagrid/licenses/$(basename "$source").txt"
done
for package in libhwy-dev libfmt-dev libcli11-dev nlohmann-json3-dev g++-mingw-w64-x86-64-posix mingw-w64-x86-64-dev; do
  cp "/usr/share/doc/$package/copyright" "$staged/share/doc/tagrid/licenses/$package.txt"
done
rm -f "$folder/$name.zip"
(cd "$work" && zip -qr9 "$folder/$name.zip" "$name")
tools/windows_installer.sh "$version" "$staged" "$folder/$name-setup.exe"
echo "In $folder:"
cd "$folder" && ls -- "$name"*
