#!/usr/bin/env bash
# Follows docs/viewing.md in ParaView, checks what it shows, and draws the pictures in docs/paraview again.
#   tools/research/paraview.sh [--tagrid PROGRAM] [--output DIRECTORY]
# Needs pvpython, Xvfb and pillow (Debian: python3-paraview, xvfb, xauth, python3-pil), and the Python package of tagrid, installed
# or built. python3-paraview and python3-vtk9, which the tests need, exclude each other on Debian 12; this does without installing:
#   tools/research/unpack_paraview.sh build/paraview && PVPYTHON=build/paraview/pvpython tools/research/paraview.sh
set -euo pipefail
sources=$(realpath "$(dirname "$0")/../..")

for program in "${PVPYTHON:=pvpython}" xvfb-run; do
  command -v "$program" >/dev/null || { echo "tools/research/paraview.sh: $program is not installed" >&2; exit 74; }
done
exec xvfb-run -a -s "-screen 0 1280x1024x24 -noreset" "$PVPYTHON" "$sources/tools/research/pictures/paraview_page.py" "$@"
