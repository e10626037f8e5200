#!/usr/bin/env bash
# Writes a report of the paper: its figures, its table and its claims beside those of the program. Installs what is
# missing, builds, and runs tools/research/paper with the given arguments (see --help).
#   tools/research/paper.sh [--quick] [--output DIRECTORY]      DIRECTORY: paper-report by default; open its index.html
set -euo pipefail
sources=$(realpath "$(dirname "$0")/../..")

case " $* " in *" --help "* | *" -h "*) exec /usr/bin/python3 -B "$sources/tools/research/paper" --help ;; esac
"$sources/tools/install_packages.sh" paper >&2
cmake -S "$sources" --preset release -DTAGRID_MPI=ON >/dev/null
cmake --build "$sources/build/release" --target tagrid tagrid-mpi >&2
exec /usr/bin/python3 -B "$sources/tools/research/paper" "$@"
