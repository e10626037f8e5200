#!/usr/bin/env bash
# Fetches Debian's source packages, for libraries that Debian has in another form than is needed here:
#   tools/debian_source.sh FOLDER PACKAGE ...      unpacks each into FOLDER/PACKAGE, with Debian's patches
# What is there already is left as it is. The lists of source packages are kept beside it: nothing of the system is changed.
set -euo pipefail
folder=$(realpath -m "$1")
shift

wanted=()
for package in "$@"; do
  [ -d "$folder/$package" ] || wanted+=("$package")
done
[ ${#wanted[@]} -gt 0 ] || exit 0
fetched=$folder/fetched
rm -rf "$fetched" && mkdir -p "$fetched/state/lists/partial" "$fetched/cache/archives/partial"
# shellcheck source=/dev/null
. /etc/os-release
echo "deb-src ${TAGRID_DEBIAN_MIRROR:-http://deb.debian.org/debian} $VERSION_CODENAME main" >"$fetched/sources.list"
printf '%s;\n' "Dir::Etc::sourcelist \"$fetched/sources.list\"" 'Dir::Etc::sourceparts "-"' \
  "Dir::State \"$fetched/state\"" "Dir::Cache \"$fetched/cache\"" "APT::Sandbox::User \"$(id -un)\"" >"$fetched/apt.conf"
export APT_CONFIG=$fetched/apt.conf
cd "$fetched"
apt-get update -qq
for package in "${wanted[@]}"; do
  mkdir "$package"
  (cd "$package" && apt-get source -qq "$package" >"$fetched/$package.log" 2>&1) || { cat "$fetched/$package.log" >&2; exit 69; }
  mv "$package"/*/ "$folder/$package"
done
rm -rf "$fetched"
