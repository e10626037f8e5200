#!/usr/bin/env bash
# Fuzzes the code that reads untrusted input: builds the targets of tests/fuzz with clang and sanitizers,
# makes seeds from the golden files, and runs the targets, two at a time. Fails on any crash, hang or excess
# of memory; the input is then in build/asan/findings and should go to tests/regressions/<target>/.
#   tools/fuzz.sh [--seconds N] [--long HOURS] [--corpus DIR] [TARGET ...]
#     without       the same inputs every time, so that a change fails by what it did, not by chance: a few seconds a target
#     --seconds N   of every target, other inputs every time; what was learned stays in DIR
#     --long HOURS  the same in hours
#     --corpus DIR  by default build/asan/corpus. DIR/runs.tsv has a line for each run of a target, also of other clones;
#                   tools/research/fuzz_table.py DIR sums them up
set -euo pipefail
cd "$(dirname "$0")/.."

seconds=
corpora=$PWD/build/asan/corpus
targets=()
while [ $# -gt 0 ]; do
  case "$1" in
    --seconds) seconds=$2; shift 2 ;;
    --long) seconds=$(($2 * 3600)); shift 2 ;;
    --corpus) corpora=$(realpath -m "$2"); shift 2 ;;
    -*) echo "usage: $0 [--seconds N] [--long HOURS] [--corpus DIR] [TARGET ...]" >&2; exit 64 ;;
    *) targets+=("$1"); shift ;;
  esac
done
[ ${#targets[@]} -gt 0 ] || targets=(file blocks brick header nrrd nifti metaimage vendors other_volumes record numbers index bmp png dicom part)

tools/install_packages.sh fuzz
cmake --preset asan >/dev/null
cmake --build --preset asan --target make_fuzz_seeds "${targets[@]/#/fuzz_}"
build=$PWD/build/asan
"$build/tests/make_fuzz_seeds" tests/golden/1.0 "$build/seeds"
mkdir -p "$build/findings" "$build/logs"

same_addresses=()
if setarch -R true 2>/dev/null; then
  same_addresses=(setarch -R)
elif [ -z "$seconds" ]; then
  echo "Addresses cannot be fixed here, so inputs differ from run to run."
fi
# Where the inputs are the same every time: how many.
declare -A runs=([header]=40000 [brick]=1500 [index]=20000 [nrrd]=6000 [nifti]=2500 [metaimage]=12000 [vendors]=4000 [other_volumes]=12000 [bmp]=25000 [png]=25000 [dicom]=20000 [record]=80000 [part]=25000 [numbers]=120000 [file]=1200 [blocks]=5000)
# Inputs of golden files are the largest there are; the rest is small, for many runs a second.
declare -A longest=([header]=2048 [brick]=8192 [index]=4096 [nrrd]=4096 [nifti]=1024 [metaimage]=2048 [vendors]=2048 [other_volumes]=2048 [bmp]=2048 [png]=2048 [dicom]=2048 [record]=1024 [part]=4096 [numbers]=64 [file]=8192 [blocks]=8192)

fuzz() {
  local target=$1 corpus run effort
  if [ -n "$seconds" ]; then
    corpus=$corpora/$target
    run=()
    # The entropic schedule looks through the whole corpus at each rare edge: of a large one, this takes half the time.
    effort=(-max_total_time="$seconds" -entropic=0)
  else
    corpus=$build/first_corpus/$target
    rm -rf "$corpus"
    # The fuzzer's choices follow addresses, too, and what it finds in its corpus now and then.
    run=("${same_addresses[@]}")
    effort=(-seed=1 -reload=0 -runs="${runs[$target]}")
  fi
  mkdir -p "$corpus" "tests/regressions/$target"
  # Findings of the corpus, of the seeds and of earlier troubles come first. Leaks are looked for as well.
  "${run[@]}" "$build/tests/fuzz_$target" "${effort[@]}" -max_len="${longest[$target]}" -timeout=10 \
    -rss_limit_mb=1024 -malloc_limit_mb=256 -print_final_stats=1 -artifact_prefix="$build/findings/$target-" \
    "$corpus" "$build/seeds/$target" "tests/regressions/$target" >"$build/logs/$target" 2>&1
}

commit=$(git rev-parse --short=8 HEAD 2>/dev/null || echo unknown)
failed=0
report() {
  local target=$1 status=$2 log=$build/logs/$1
  local executions coverage edges
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  coverage=$(grep -o 'cov: [0-9]* ft: [0-9]*' "$log" | tail -1 || true)
  edges=$(sed -n 's/.*(\([0-9]*\) inline 8-bit counters).*/\1/p' "$log" | head -1)
  printf '%-8s %12s executions, %s, of %s edges in the program\n' \
    "$target" "${executions:-no}" "${coverage:-no coverage}" "${edges:-?}"
  if [ -n "$seconds" ]; then
    local covered
    covered=$(sed -n 's/^cov: \([0-9]*\) .*/\1/p' <<<"$coverage")
    printf '%s\t%s\t%s\t%s\t%s\t%s\t%s\t%s\n' "$(date -u +%F)" "$commit" "$target" "$seconds" \
      "${executions:-0}" "${covered:-0}" "${edges:-0}" "$status" >>"$corpora/runs.tsv"
  fi
  [ "$status" -eq 0 ] && return
  failed=1
  echo "$target: failed with status $status; the end of $log:"
  tail -40 "$log"
}

for ((i = 0; i < ${#targets[@]}; i += 2)); do
  declare -A running=()
  for target in "${targets[@]:i:2}"; do
    fuzz "$target" &
    running[$target]=$!
  done
  for target in "${targets[@]:i:2}"; do
    status=0
    wait "${running[$target]}" || status=$?
    report "$target" "$status"
  done
done
exit "$failed"
