#!/usr/bin/env bash
# Makes the pictures in docs/images again, from a phantom and the program's own output.
#   tools/research/pictures.sh [PROGRAM]      PROGRAM: build/release/tagrid by default
set -euo pipefail
cd "$(dirname "$0")/../.."

tagrid=${1:-build/release/tagrid}
tools/install_packages.sh pictures
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT

"$tagrid" phantom --dims 256,256,96 -o "$folder/phantom.nhdr"
"$tagrid" encode "$folder/phantom.nhdr" --quiet
"$tagrid" mesh "$folder/phantom.tag" --quiet
tools/research/slice_and_grid.py "$folder/phantom.nhdr" "$folder/phantom.vtu" 64 docs/images/slice_and_grid.png

# The phantom has no unit; with one, the preview has lengths in millimetres.
echo 'units: "mm" "mm" "mm"' >> "$folder/phantom.nhdr"
"$tagrid" encode "$folder/phantom.nhdr" --max-error 5 -o "$folder/chest.tag" --quiet
"$tagrid" preview "$folder/chest.tag" -o docs/images/preview.png --force --quiet

"$tagrid" phantom --dims 160,160,96 -o "$folder/scan.nhdr"
"$tagrid" encode "$folder/scan.nhdr" --max-error 5 -o "$folder/scan.tag" --quiet
# The package is beside the program where it was built with -DTAGRID_PYTHON=ON.
PYTHONPATH=${tagrid%/*}/python tools/research/pictures/python_tour.py "$folder/scan.tag" docs/images

tools/research/pictures/tour.sh "$tagrid"
