#!/usr/bin/env bash
# Builds the package @tagrid/decoder into web/decoder/dist, with Debian's emscripten, and the page of the viewer with it into
# web/viewer/dist:
#   web/build.sh [BUILD_FOLDER]      default: build/web
# BUILD_FOLDER/fuzzed has the package with modules that accept every checksum, for tests with damaged files.
# The sources of zstd come from Debian's source package, which this fetches once into the build folder.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
build=${1:-$root/build/web}
mkdir -p "$build"
build=$(cd "$build" && pwd)

for program in emcmake em++ ninja node esbuild; do
  command -v "$program" >/dev/null || { echo "$program is missing. On Debian: tools/install_packages.sh page" >&2; exit 69; }
done
# Debian's emscripten looks there for the JavaScript that it needs.
export NODE_PATH=${NODE_PATH:-/usr/share/nodejs}

# zstd, of which the part that decompresses is compiled.
tools/debian_source.sh "$build" zstd

include=$build/include
tools/debian_headers.sh "$include"

for kind in simd scalar; do
  flags="-include $root/cmake/toolchains/libcxx.h"
  [ "$kind" = simd ] && flags="-msimd128 $flags"
  if [ ! -f "$build/$kind/build.ninja" ]; then
    emcmake cmake -S "$root" -B "$build/$kind" -G Ninja -DCMAKE_BUILD_TYPE=Release -DTAGRID_READING_ONLY=ON \
      -DCMAKE_CXX_FLAGS="$flags" -DTAGRID_ZSTD_SOURCES="$build/zstd/lib" -DTAGRID_DEBIAN_HEADERS="$include" \
      -DTAGRID_WASM_KIND="$kind" >"$build/$kind.log" || { cat "$build/$kind.log" >&2; exit 1; }
  fi
  ninja -C "$build/$kind" tagrid_{,fuzzed_}{,grid_}wasm >"$build/$kind.log" || { cat "$build/$kind.log" >&2; exit 1; }
done

dist=$root/web/decoder/dist
mkdir -p "$dist"
cp web/decoder/src/*.js web/decoder/src/*.d.ts LICENSE "$dist"
fuzzed=$build/fuzzed
mkdir -p "$fuzzed"
cp web/decoder/src/*.js web/decoder/package.json "$fuzzed"
for name in tagrid_simd tagrid_scalar tagrid_grid_simd tagrid_grid_scalar; do
  cp "$build/${name##*_}/web/decoder/$name.wasm" "$dist"
  cp "$build/${name##*_}/web/decoder/fuzzed/$name.wasm" "$fuzzed"
  printf '%s %s bytes, %s in gzip\n' "$name.wasm" "$(stat -c %s "$dist/$name.wasm")" \
    "$(gzip -9 -n <"$dist/$name.wasm" | wc -c)"
done

# The page is few files, each of which is a request.
viewer=$root/web/viewer/dist
rm -rf "$viewer" && mkdir -p "$viewer/decoder"
bundled() { esbuild "$1" --bundle --format=esm --minify --log-level=warning --alias:@tagrid/decoder="$dist/index.js" --outfile="$2"; }
bundled web/viewer/src/viewer.js "$viewer/viewer.js"
bundled web/viewer/src/viewer.css "$viewer/viewer.css"
bundled "$dist/worker.js" "$viewer/decoder/worker.js"
cp web/viewer/src/index.html "$viewer"
cp "$dist"/*.wasm "$dist/LICENSE" "$viewer/decoder"
