# shellcheck shell=bash
# How tools/packages.sh, tools/static.sh and tools/wheel.sh begin; they source it with their arguments. Sets `folder`,
# where packages go, and `build`, where tagrid is built, and goes to the folder of the sources.
# shellcheck disable=SC2034  # used by these scripts
folder=$(realpath -m "${1:-$(dirname "$0")/../build/packages}")
# shellcheck disable=SC2034
build=$(realpath -m "${TAGRID_BUILD:-$(dirname "$0")/../build/release}")
cd "$(dirname "$0")/.." || exit 74

# build_release SET OPTIONS [TARGET ...]: installs this set of packages and builds, unless TAGRID_BUILD names what is built.
build_release() {
  [ -z "${TAGRID_BUILD:-}" ] || return 0
  tools/install_packages.sh "$1"
  echo "Building (some minutes) ..."
  # shellcheck disable=SC2086  # several options
  cmake --preset release $2 >/dev/null
  cmake --build --preset release ${3:+--target "${@:3}"} >/dev/null
}
