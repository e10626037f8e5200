#!/usr/bin/env bash
# Leads from a fresh Debian 12 to a first .tag file: installs what is missing, builds, makes a volume, encodes
# it, verifies it, and shows the result.
set -euo pipefail
cd "$(dirname "$0")/.."

tools/install_packages.sh build
echo "Building (a minute or two) ..."
cmake --preset release >/dev/null
cmake --build --preset release >/dev/null

tagrid=build/release/tagrid
folder=build/quickstart
mkdir -p "$folder"
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
