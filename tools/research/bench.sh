#!/usr/bin/env bash
# Compares tagrid with the codecs that Debian has, and with SZ3 and SPERR if their programs (sz3, sperr3d) are
# on the PATH: installs what is missing, builds, and runs tools/research/bench with the given arguments (see --help).
#   tools/research/bench.sh scan.nhdr [other.nhdr ...] [--errors 0,2,5] [--output DIRECTORY]
set -euo pipefail
sources=$(realpath "$(dirname "$0")/../..")

case " $* " in *" --help "* | *" -h "*) exec /usr/bin/python3 -B "$sources/tools/research/bench" --help ;; esac
"$sources/tools/install_packages.sh" bench >&2
cmake -S "$sources" --preset release -DTAGRID_BENCHMARKS=ON >/dev/null
cmake --build "$sources/build/release" --target tagrid bench_programs >&2
exec /usr/bin/python3 -B "$sources/tools/research/bench" "$@"
