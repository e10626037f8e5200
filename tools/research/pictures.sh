#!/usr/bin/env bash
# Redraws the pictures in docs/images, from phantoms and the program's own output.
#   tools/research/pictures.sh [PROGRAM]      PROGRAM: build/release/tagrid by default
# Of those in docs/tour.md, the mesh needs pvpython and Xvfb (see tools/research/paraview.sh), and the viewer the page
# (web/build.sh), node and chromium.
set -euo pipefail
cd "$(dirname "$0")/../.."

tagrid=${1:-build/release/tagrid}
tools/install_packages.sh pictures
directory=$(mktemp -d)
trap 'rm -r "$directory"' EXIT

tools/research/format_figures.py docs/images

"$tagrid" phantom --dims 256,256,96 -o "$directory/phantom.nhdr"
"$tagrid" encode "$directory/phantom.nhdr" --quiet
"$tagrid" mesh "$directory/phantom.tag" --quiet
tools/research/slice_and_grid.py "$directory/phantom.nhdr" "$directory/phantom.vtu" 64 docs/images/slice_and_grid.png

# The phantom has no unit; with one, the preview has lengths in millimeters.
echo 'units: "mm" "mm" "mm"' >> "$directory/phantom.nhdr"
"$tagrid" encode "$directory/phantom.nhdr" --max-error 5 -o "$directory/chest.tag" --quiet
"$tagrid" preview "$directory/chest.tag" -o docs/images/preview.png --force --quiet

"$tagrid" phantom --dims 160,160,96 -o "$directory/scan.nhdr"
"$tagrid" encode "$directory/scan.nhdr" --max-error 5 -o "$directory/scan.tag" --quiet
# The package is beside the program where it was built with -DTAGRID_PYTHON=ON.
PYTHONPATH=${tagrid%/*}/python tools/research/pictures/python_tour.py "$directory/scan.tag" docs/images

# The commands of docs/tour.md.
mkdir "$directory/tour"
"$tagrid" phantom --dims 128,128,64 -o "$directory/tour/scan.nhdr"
"$tagrid" encode "$directory/tour/scan.nhdr" --max-error 5
"$tagrid" preview "$directory/tour/scan.tag" -o "$directory/tour/scan.png"
# As large as a page needs: reduced, and with a palette.
small() { # FACTOR FROM TO
  /usr/bin/python3 -c 'import sys
from PIL import Image
small = Image.open(sys.argv[2]).convert("RGB").reduce(int(sys.argv[1]))
small.quantize(128, dither=Image.Dither.NONE).save(sys.argv[3], optimize=True)' "$@"
}
small 2 "$directory/tour/scan.png" docs/images/tour_preview.png
if [ -e web/viewer/dist/index.html ] && command -v node chromium >/dev/null; then
  # The program finds the page beside itself.
  cp "$tagrid" "$directory/tagrid"
  ln -s "$PWD/web/viewer/dist" "$directory/viewer"
  TAGRID_CHROMIUM=$(command -v chromium) node tools/research/pictures/tour_view.mjs "$directory/tagrid" "$directory/tour/scan.tag" \
    "$directory/view.png"
  small 1 "$directory/view.png" docs/images/tour_view.png
else
  echo "tools/research/pictures.sh: no web/viewer/dist, node or chromium, so the picture of the viewer stays" >&2
fi
pvpython=${PVPYTHON:-pvpython}
if ! command -v "$pvpython" >/dev/null; then
  echo "tools/research/pictures.sh: pvpython is not installed, so the picture of the mesh stays" >&2
  exit 0
fi
"$tagrid" mesh "$directory/tour/scan.tag" --level 12 -o "$directory/tour/scan.vtu"
xvfb-run -a -s "-screen 0 1280x1024x24 -noreset" "$pvpython" tools/research/pictures/tour_mesh.py "$directory/tour/scan.vtu" docs/images/tour_mesh.png
