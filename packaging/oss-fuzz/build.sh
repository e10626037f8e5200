#!/bin/bash -eu
# Builds the fuzzers into $OUT, as OSS-Fuzz calls it, in the directory of the sources: CC, CXX, CFLAGS, CXXFLAGS and
# LIB_FUZZING_ENGINE are set.

# The libraries of the distribution are built for its own C++ library.
export CXXFLAGS="${CXXFLAGS//-stdlib=libc++/} -DTAGRID_SANITIZED"

# shellcheck disable=SC2016  # the dynamic linker replaces $ORIGIN
cmake -S . -B "$WORK/build" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO=-g1 \
  -DCMAKE_BUILD_RPATH='$ORIGIN/lib' -DCMAKE_EXE_LINKER_FLAGS=-Wl,--disable-new-dtags \
  -DTAGRID_TESTS=ON -DTAGRID_FUZZ=ON -DTAGRID_FUZZING_ENGINE="$LIB_FUZZING_ENGINE" -DTAGRID_UNITY=most
cmake --build "$WORK/build" --target fuzzers make_fuzz_seeds

"$WORK/build/tests/make_fuzz_seeds" tests/golden/1.0 "$WORK/seeds"
mkdir -p "$OUT/lib"
sed -n 's/^void \(.*\)(Bytes bytes);$/\1/p' tests/fuzz/targets.h | while read -r target; do
  fuzzer=$WORK/build/tests/fuzz_$target
  cp "$fuzzer" "$OUT/"
  seeds=("$WORK/seeds/$target")
  if [ -d "tests/regressions/$target" ]; then seeds+=("tests/regressions/$target"); fi
  find "${seeds[@]}" -type f -print0 | xargs -0 zip -qj "$OUT/fuzz_${target}_seed_corpus.zip"
  # Fuzzers run in an image that has the C library and nothing else.
  ldd "$fuzzer" | awk '$3 ~ /^\// && $1 !~ /^(libc|libm|libdl|libpthread|librt|libresolv)\.so/ {print $3}' |
    xargs cp -Lu -t "$OUT/lib"
done
