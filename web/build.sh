#!/usr/bin/env bash
# Builds the package @tagrid/decoder into web/decoder/dist, with Debian's emscripten, and the page of the viewer with it into
# web/viewer/dist:
#   web/build.sh [BUILD_FOLDER]      default: build/web
# The sources of zstd come from Debian's source package, which this fetches once into the build folder. Nothing of the
# system is changed.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
build=${1:-$root/build/web}
mkdir -p "$build"
build=$(cd "$build" && pwd)

for program in emcmake em++ ninja node esbuild; do
  command -v "$program" >/dev/null || { echo "$program is missing. On Debian: tools/install_packages.sh web" >&2; exit 69; }
done
# Debian's emscripten looks there for the JavaScript that it needs.
export NODE_PATH=${NODE_PATH:-/usr/share/nodejs}

# zstd, without the part that compresses. The lists of source packages are kept beside it, not in the system's.
zstd=$build/zstd
if [ ! -f "$zstd/lib/zstd.h" ]; then
  fetched=$build/zstd.fetched
  rm -rf "$fetched" "$zstd" && mkdir -p "$fetched/state/lists/partial" "$fetched/cache/archives/partial"
  # shellcheck source=/dev/null
  . /etc/os-release
  echo "deb-src ${TAGRID_DEBIAN_MIRROR:-http://deb.debian.org/debian} $VERSION_CODENAME main" >"$fetched/sources.list"
  printf '%s;\n' "Dir::Etc::sourcelist \"$fetched/sources.list\"" 'Dir::Etc::sourceparts "-"' \
    "Dir::State \"$fetched/state\"" "Dir::Cache \"$fetched/cache\"" "APT::Sandbox::User \"$(id -un)\"" >"$fetched/apt.conf"
  (cd "$fetched" && APT_CONFIG=$fetched/apt.conf apt-get update -qq && APT_CONFIG=$fetched/apt.conf apt-get source -qq --download-only zstd)
  mkdir "$fetched/zstd"
  tar -xJf "$fetched"/*.orig.tar.xz -C "$fetched/zstd" --strip-components=1
  mv "$fetched/zstd" "$zstd"
  rm -rf "$fetched"
fi

# Headers of Debian's packages, without those of its C library around them.
include=$build/include
mkdir -p "$include"
for header in hwy fmt xxhash.h xxh3.h; do
  if [ -e "/usr/include/$header" ]; then ln -sfn "/usr/include/$header" "$include/$header"; fi
done
if [ ! -e "$include/hwy" ] || [ ! -e "$include/fmt" ] || [ ! -e "$include/xxhash.h" ]; then
  echo "libhwy-dev, libfmt-dev or libxxhash-dev is missing. On Debian: tools/install_packages.sh web" >&2
  exit 69
fi

for kind in simd scalar; do
  flags="-include $root/web/decoder/libcxx.h"
  [ "$kind" = simd ] && flags="-msimd128 $flags"
  if [ ! -f "$build/$kind/build.ninja" ]; then
    emcmake cmake -S "$root" -B "$build/$kind" -G Ninja -DCMAKE_BUILD_TYPE=Release -DTAGRID_READING_ONLY=ON \
      -DCMAKE_CXX_FLAGS="$flags" -DTAGRID_ZSTD_SOURCES="$zstd/lib" -DTAGRID_DEBIAN_HEADERS="$include" \
      -DTAGRID_WASM_KIND="$kind" >"$build/$kind.log" || { cat "$build/$kind.log" >&2; exit 1; }
  fi
  ninja -C "$build/$kind" tagrid_wasm tagrid_grid_wasm >"$build/$kind.log" || { cat "$build/$kind.log" >&2; exit 1; }
done

dist=$root/web/decoder/dist
mkdir -p "$dist"
cp web/decoder/src/*.js web/decoder/src/*.d.ts LICENSE "$dist"
for name in tagrid_simd tagrid_scalar tagrid_grid_simd tagrid_grid_scalar; do
  cp "$build/${name##*_}/web/decoder/$name.wasm" "$dist"
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
