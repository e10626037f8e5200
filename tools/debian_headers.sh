#!/usr/bin/env bash
# Links the headers of Debian's Highway, fmt and xxHash, without those of its C library around them, for a compiler of
# another system; and those of others in /usr/include:
#   tools/debian_headers.sh FOLDER [HEADER ...]
set -euo pipefail
mkdir -p "$1"
for header in hwy fmt xxhash.h xxh3.h "${@:2}"; do
  if [ -e "/usr/include/$header" ]; then ln -sfn "/usr/include/$header" "$1/$header"; fi
done
if [ ! -e "$1/hwy" ] || [ ! -e "$1/fmt" ] || [ ! -e "$1/xxhash.h" ]; then
  echo "libhwy-dev, libfmt-dev or libxxhash-dev is missing. On Debian: tools/install_packages.sh page" >&2
  exit 69
fi
