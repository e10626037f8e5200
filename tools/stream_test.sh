#!/usr/bin/env bash
# Tests that a volume eight times as tall takes no more memory: a phantom goes through a pipe and is encoded
# and decoded. The peak resident memory of both is compared with that of a shorter phantom of the same width.
#   tools/stream_test.sh [WIDTH] [SLICES]     1024 512: 1 GB and 8 GB of int16
set -euo pipefail
cd "$(dirname "$0")/.."

width=${1:-1024}
slices=${2:-512}
tagrid=${TAGRID:-build/release/tagrid}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# Runs "$@", and writes its peak memory in KB to the file $peak.
measured() { python3 -c '
import os, subprocess, sys, resource
status = subprocess.call(sys.argv[2:])
open(sys.argv[1], "w").write(str(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss))
sys.exit(status)' "$@"; }

run() {
  local nz=$1
  "$tagrid" phantom --dims "$width,$width,$nz" --type int16 --seed 1 -o - |
    tee >(cksum >"$folder/original") |
    measured "$folder/encode" "$tagrid" encode - --dims "$width,$width,$nz" --type int16 -o "$folder/$nz.tag" -f
  measured "$folder/decode" "$tagrid" decode - <"$folder/$nz.tag" | cksum >"$folder/decoded"
  sleep 1
  cmp "$folder/original" "$folder/decoded" || { echo "FAILED: $nz slices were not restored" >&2; exit 1; }
  echo "$nz slices: encode $(($(cat "$folder/encode") / 1024)) MB, decode $(($(cat "$folder/decode") / 1024)) MB," \
    "file $(stat -c %s "$folder/$nz.tag") bytes"
  rm "$folder/$nz.tag"
}

run "$slices"
short_encode=$(cat "$folder/encode") short_decode=$(cat "$folder/decode")
run $((8 * slices))
for what in encode decode; do
  short=short_$what
  if [ "$(cat "$folder/$what")" -gt $((${!short} * 105 / 100)) ]; then
    echo "FAILED: $what needs more memory for the taller volume" >&2
    exit 1
  fi
done
echo "memory does not grow with the number of slices"
