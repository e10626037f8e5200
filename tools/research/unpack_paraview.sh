#!/usr/bin/env bash
# Unpacks Debian's ParaView into a folder without installing it, because python3-paraview and python3-vtk9, which the tests
# need, exclude each other.
#   tools/research/unpack_paraview.sh FOLDER      then FOLDER/pvpython and FOLDER/paraview start it, and remove FOLDER to be rid of it
# Downloads about 110 MB, and takes 700 MB. Does nothing if FOLDER has it already. Needs no root.
set -euo pipefail
[ $# -eq 1 ] || { echo "usage: $0 FOLDER" >&2; exit 64; }

folder=$(realpath -m "$1")
mkdir -p "$folder"
exec 9>"$folder/.lock"
flock 9
[ -e "$folder/pvpython" ] && exit 0
# Libraries that are not on this machine; what is missing for Python is not needed to read and draw.
packages=$(apt-get install -s --no-install-recommends paraview python3-paraview | sed -nE 's/^Inst (lib[^ ]*|(python3-)?paraview) .*/\1/p')
work=$(mktemp -d "$folder/.new-XXXXXX")
trap 'rm -rf "$work"' EXIT
mkdir "$work/packages" "$work/root"
# shellcheck disable=SC2086  # a list of names
(cd "$work/packages" && apt-get download -qq $packages)
for package in "$work"/packages/*.deb; do
  dpkg -x "$package" "$work/root"
done
rm -rf "$work/root/usr/share/doc"
rm -rf "$folder/root"
mv "$work/root" "$folder/root"
for program in paraview pvpython; do
  cat > "$work/$program" <<END
#!/bin/sh
export LD_LIBRARY_PATH="$folder/root/usr/lib/$(uname -m)-linux-gnu:$folder/root/usr/lib\${LD_LIBRARY_PATH:+:\$LD_LIBRARY_PATH}"
export PYTHONPATH="$folder/root/usr/lib/python3/dist-packages\${PYTHONPATH:+:\$PYTHONPATH}"
exec "$folder/root/usr/bin/$program" "\$@"
END
  chmod +x "$work/$program"
done
mv "$work/paraview" "$work/pvpython" "$folder"
