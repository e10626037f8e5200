#!/usr/bin/env bash
# Draws the pictures of docs/tour.md again, with the commands of that page.
#   tools/research/pictures/tour.sh [PROGRAM [FOLDER]]      build/release/tagrid and docs/images by default
# The picture of the mesh needs pvpython and Xvfb; see tools/research/paraview.sh.
set -euo pipefail
sources=$(dirname "$(realpath "$0")")/../../..
tagrid=$(realpath "${1:-$sources/build/release/tagrid}")
output=$(realpath -m "${2:-$sources/docs/images}")
pvpython=$(command -v "${PVPYTHON:-pvpython}" || true)
pvpython=${pvpython:+$(realpath "$pvpython")}
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT

cd "$folder"
"$tagrid" phantom --dims 128,128,64 -o scan.nhdr
"$tagrid" encode scan.nhdr --max-error 5
"$tagrid" preview scan.tag -o scan.png
# As large as a page needs: half, and with a palette.
/usr/bin/python3 -c 'import sys
from PIL import Image
Image.open(sys.argv[1]).convert("RGB").reduce(2).quantize(128, dither=Image.Dither.NONE).save(sys.argv[2], optimize=True)' scan.png "$output/tour_preview.png"
if [ -z "$pvpython" ]; then
  echo "tools/research/pictures/tour.sh: pvpython is not installed, so the picture of the mesh stays" >&2
  exit 0
fi
"$tagrid" mesh scan.tag --level 12 -o scan.vtu
xvfb-run -a -s "-screen 0 1280x1024x24 -noreset" "$pvpython" "$sources/tools/research/pictures/tour_mesh.py" scan.vtu "$output/tour_mesh.png"
