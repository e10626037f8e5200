#!/usr/bin/env bash
# Leads from a fresh Debian 12 or 13 to a first .tag file: installs what is missing, builds the program, makes a volume, encodes
# it, verifies it, and shows the result. Then it builds the readers of formats with libraries of their own.
set -euo pipefail
cd "$(dirname "$0")/.."

step() { printf '\n== %s (%d s so far)\n' "$1" "$SECONDS"; }
build() { NINJA_STATUS="[%f of %t, %e s] " cmake --build --preset release "$@"; }

step "Installing packages, a minute if none of them is there"
tools/install_packages.sh build
step "Building the program: six to ten minutes with two processors"
# Most rooms are compiled as one file each, which makes a first build shorter.
cmake --preset release -DTAGRID_UNITY=most >/dev/null
build --target tagrid

tagrid=build/release/tagrid
folder=build/quickstart
mkdir -p "$folder"
step "A first file"
echo "Making a phantom of 256 x 256 x 256 voxels in $folder"
"$tagrid" phantom --dims 256,256,256 --type int16 --seed 1 -o "$folder/phantom.nhdr" -f
echo "Encoding it, every voxel within 5 of the original"
"$tagrid" encode "$folder/phantom.nhdr" --max-error 5 -o "$folder/phantom.tag" -f
"$tagrid" verify "$folder/phantom.tag" --against "$folder/phantom.nhdr"
echo
"$tagrid" info "$folder/phantom.tag"
raw=$(stat -c %s "$folder/phantom.raw")
tag=$(stat -c %s "$folder/phantom.tag")
echo
awk -v raw="$raw" -v tag="$tag" 'BEGIN { printf "compression ratio %.2f (%d bytes became %d)\n", raw / tag, raw, tag }'

step "Building the readers of DICOM, TIFF, JPEG 2000, HDF5, Zarr and OpenVDB: a few minutes; interrupt it if unneeded"
build
step "Done: build/release/tagrid"
cat <<'END'
To call it tagrid, as the documents do:
  export PATH="$PWD/build/release:$PATH"
Not built, because this takes longer (docs/dev/packages.md describes packages of everything):
- the page of `tagrid view` (0.8 GB of packages):
  tools/install_packages.sh page && web/build.sh
- the Python module:
  tools/install_packages.sh python
  cmake --preset release -DTAGRID_PYTHON=ON && cmake --build --preset release
  export PYTHONPATH="$PWD/build/release/python"
END
