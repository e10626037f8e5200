#!/usr/bin/env bash
# Tests that equal input gives equal files: builds the program with gcc, and with clang and its sanitizers, and compares
# the files that they write, with 1, 2, 3 and 7 threads (with sanitizers 7), from files and pipes, twice, in every
# mode.
#   tools/same_bytes.sh           phantoms of every type; some minutes
#   tools/same_bytes.sh --long    larger phantoms and the real volumes that are there (../shared/data), too, and two builds
#                                 more: with clang as it is released, and with gcc but without vector code
set -euo pipefail
cd "$(dirname "$0")/.."

long=${1:-}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# "gcc" and "sanitized" are builds that often exist already.
declare -A build_folders=([gcc]=build/release [sanitized]=build/asan [clang]=build/same-bytes/clang
  [gcc-scalar]=build/same-bytes/gcc-scalar)
builds=(gcc sanitized)
[ "$long" = --long ] && builds+=(clang gcc-scalar)
configure() {
  case $1 in
    gcc) cmake --preset release ;;
    sanitized) cmake --preset asan ;;
    gcc-scalar) cmake -S . -B "${build_folders[$1]}" -G Ninja -DCMAKE_BUILD_TYPE=Release -DTAGRID_WERROR=ON \
      -DCMAKE_CXX_COMPILER=g++ -DTAGRID_SCALAR=ON ;;
    clang) cmake -S . -B "${build_folders[$1]}" -G Ninja -DCMAKE_BUILD_TYPE=Release -DTAGRID_WERROR=ON \
      -DCMAKE_CXX_COMPILER=clang++ ;;
  esac
}
for build in "${builds[@]}"; do
  echo "Building with $build"
  { configure "$build" && cmake --build "${build_folders[$build]}" --target tagrid; } >"$folder/log" 2>&1 ||
    { cat "$folder/log"; exit 1; }
done
tagrid() { local build=$1; shift; "${build_folders[$build]}/tagrid" "$@"; }

# Fails unless all hashes of the file are equal; each line is "what hash".
hashes=$folder/hashes
expect_one_hash() {
  if [ "$(cut -d' ' -f2 "$hashes" | sort -u | wc -l)" -ne 1 ]; then
    echo "FAILED: $1 differs:" >&2
    cat "$hashes" >&2
    exit 1
  fi
  echo "$1: $(wc -l <"$hashes") runs, $(head -1 "$hashes" | cut -d' ' -f2)"
  : >"$hashes"
}
note() { echo "$1 $(sha256sum | cut -c1-16)" >>"$hashes"; }
: >"$hashes"

# Runs a function for every build, all at the same time; each line of the hashes is written at once.
for_every_build() {
  local build process processes=()
  for build in "${builds[@]}"; do
    "$1" "$build" "${@:2}" &
    processes+=($!)
  done
  for process in "${processes[@]}"; do wait "$process"; done
}
# Every way to encode one volume in one mode.
encode_by() {
  local build=$1 volume=$2 threads; shift 2
  # Sanitizers take several times as long: one run shows what another compiler does.
  local all=(1 2 3 7)
  [ "$build" = sanitized ] && all=(7)
  for threads in "${all[@]}"; do
    tagrid "$build" encode "$volume" "$@" -T "$threads" -o - | note "$build/$threads/file"
  done
  [ "$build" = sanitized ] && return
  tagrid "$build" encode "$volume" "$@" -T 3 -o - | note "$build/3/again"
}
decode_by() { tagrid "$1" decode "$folder/x.tag" -T 3 -o - | note "$1/decode"; }
mesh_by() { tagrid "$1" mesh "$folder/x.tag" -T 3 -o - | note "$1/mesh"; }
encodings() {
  local volume=$1 name=$2; shift 2
  for_every_build encode_by "$volume" "$@"
  expect_one_hash "$name $*"
  # A detached header names a file, so only volumes in a single file go through a pipe, which has no name to be kept.
  case $volume in *.nrrd)
    tagrid gcc encode "$volume" "$@" --strip -o - | note file
    tagrid gcc encode - "$@" --strip -T 3 <"$volume" | note pipe
    expect_one_hash "  from a pipe" ;;
  esac
  # All builds must decode the file of one build to the same volume, and to the same mesh.
  tagrid gcc encode "$volume" "$@" -o "$folder/x.tag" -f
  for_every_build decode_by
  expect_one_hash "  decoded"
  for_every_build mesh_by
  expect_one_hash "  mesh"
}
modes() {
  encodings "$@"
  encodings "$@" --max-error 3
  encodings "$@" --max-error 6 --surface-error 1
  encodings "$@" --mesh-error 9 --max-error 1
  encodings "$@" --grid-only
  encodings "$@" --grid-only --max-error 4
}

dims=66,35,67 cube=8
[ "$long" = --long ] && dims=150,140,160 cube=16
for type in uint8 int8 uint16 int16 uint32 int32 float32 float64; do
  for build in "${builds[@]}"; do
    tagrid "$build" phantom --dims $dims --type $type --seed 3 --format nrrd -f -o "$folder/$type.nrrd"
    note "$build" <"$folder/$type.nrrd"
  done
  expect_one_hash "phantom $type"
done
for type in uint8 int16; do modes "$folder/$type.nrrd" "phantom $type"; done
for effort in fast best; do
  encodings "$folder/uint8.nrrd" "phantom uint8" --effort $effort
  encodings "$folder/int16.nrrd" "phantom int16" --effort $effort --max-error 6 --surface-error 1
  encodings "$folder/uint16.nrrd" "phantom uint16" --effort $effort --max-error 1
done
# A pipe cannot be read twice, so it is copied.
for type in uint8 int16; do encodings "$folder/$type.nrrd" "phantom $type" --psnr 40 --spool "$folder"; done
# The range is given for the same reason.
for type in int32 float32; do modes "$folder/$type.nrrd" "phantom $type" --range -1000:3000; done
for type in uint32 float64; do
  encodings "$folder/$type.nrrd" "phantom $type" --range 0:3000 --max-error 0.5
  encodings "$folder/$type.nrrd" "phantom $type" --range 0:3000 --grid-only --max-error 2.5
done
for type in int8 uint16; do
  encodings "$folder/$type.nrrd" "phantom $type" --cube $cube --brick 3 --max-error 2
  encodings "$folder/$type.nrrd" "phantom $type" --cube $cube --brick 2 --grid-only --max-level 9
done
if [ "$long" = --long ]; then
  for volume in ../shared/data/*.nhdr; do
    [ -e "$volume" ] || { echo "no real volumes: there is no ../shared/data"; break; }
    modes "$volume" "$(basename "$volume")"
  done
fi
echo "the same bytes in every way"
