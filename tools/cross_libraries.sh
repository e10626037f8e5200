#!/usr/bin/env bash
# Builds the libraries of the program for another machine, from Debian's source packages:
#   tools/cross_libraries.sh windows-x64|linux-arm64 FOLDER
# with the compilers that cmake/toolchains names; their sources in FOLDER/sources, the libraries in
# FOLDER/{include,lib}. What is there already is left as it is, except libraries that were made by CMake with other
# options.
set -euo pipefail
cd "$(dirname "$0")/.."
machine=$1
folder=$(realpath -m "$2")
sources=$folder/sources
wanted=(zstd xxhash onetbb zlib bzip2 libpng1.6 libisal libsodium sqlite3)
case "$machine" in
  windows-x64)
    host=x86_64-w64-mingw32 compiler=$host-gcc-posix
    wanted+=(curl libjpeg-turbo tiff pugixml openjpeg2 dcmtk hdf5) ;;
  linux-arm64)
    host=aarch64-linux-gnu compiler=$host-gcc
    wanted+=(libseccomp) ;;
  *) echo "usage: $0 windows-x64|linux-arm64 FOLDER" >&2; exit 64 ;;
esac
if [ "$machine" = windows-x64 ] && ! wine=$(PATH=$PATH:/usr/lib/wine; command -v wine || command -v wine64); then
  echo "wine64 is missing. On Debian: tools/install_packages.sh windows" >&2
  exit 69
fi
tools/debian_source.sh "$sources" "${wanted[@]}"
tools/debian_headers.sh "$folder/include" CLI nlohmann isa-l isa-l.h
if [ "$machine" = linux-arm64 ]; then
  ln -sfn "/usr/include/$(gcc -print-multiarch)/curl" "$folder/include/curl"
elif [ -L "$folder/include/curl" ]; then
  rm "$folder/include/curl"  # a folder of an older script, which would now overwrite the headers of this system
fi
mkdir -p "$folder/lib"

# archive NAME FLAGS... SOURCE...: a library of some C sources
archive() {
  local name=$1 objects
  shift
  [ -f "$folder/lib/lib$name.a" ] && return
  objects=$(mktemp -d)
  # Under its name only when it is complete.
  (cd "$objects" && "$compiler" -O2 -fPIC -c "$@" && "$host-ar" rcs "lib$name.a" ./*.o && mv "lib$name.a" "$folder/lib")
  rm -rf "$objects"
}

archive zstd -DZSTD_DISABLE_ASM -DZSTD_MULTITHREAD=0 "$sources"/zstd/lib/{common,compress,decompress}/*.c
cp "$sources"/zstd/lib/{zstd,zstd_errors}.h "$folder/include"
archive xxhash "$sources/xxhash/xxhash.c"
archive z "$sources"/zlib/{adler32,compress,crc32,deflate,infback,inffast,inflate,inftrees,trees,uncompr,zutil}.c
cp "$sources"/zlib/{zlib,zconf}.h "$folder/include"
archive bz2 -D_FILE_OFFSET_BITS=64 "$sources"/bzip2/{blocksort,huffman,crctable,randtable,compress,decompress,bzlib}.c
cp "$sources/bzip2/bzlib.h" "$folder/include"
cp "$sources/libpng1.6/scripts/pnglibconf.h.prebuilt" "$sources/libpng1.6/pnglibconf.h"
archive png -DPNG_INTEL_SSE_OPT=0 -DPNG_ARM_NEON_OPT=0 -I"$folder/include" \
  "$sources"/libpng1.6/png{,error,get,mem,pread,read,rio,rtran,rutil,set,trans,wio,write,wtran,wutil}.c
cp "$sources"/libpng1.6/{png,pngconf,pnglibconf}.h "$folder/include"
# Without its assembler: parity needs the portable sources.
archive isal -I"$sources/libisal/include" "$sources"/libisal/erasure_code/ec_base{,_aliases}.c \
  "$sources"/libisal/crc/crc{,64}_base.c "$sources"/libisal/crc/crc_base_aliases.c
if [ ! -f "$folder/lib/libsqlite3.a" ]; then
  # Its one file is made by a program of this machine.
  (cd "$sources/sqlite3" && ./configure --disable-tcl --disable-readline >/dev/null && make -s sqlite3.c >/dev/null)
  archive sqlite3 -DSQLITE_THREADSAFE=1 -DSQLITE_OMIT_LOAD_EXTENSION "$sources/sqlite3/sqlite3.c"
  cp "$sources/sqlite3/sqlite3.h" "$folder/include"
fi
# Without its configuration, it takes its portable sources.
sodium=$sources/libsodium/src/libsodium
cp "$sources/libsodium/builds/msvc/version.h" "$sodium/include/sodium"
mapfile -t of_sodium < <(find "$sodium" -name '*.c')
archive sodium -DCONFIGURED=1 -DSODIUM_STATIC -I"$sodium/include/sodium" "${of_sodium[@]}"
cp -r "$sodium/include/sodium.h" "$sodium/include/sodium" "$folder/include"
# built PACKAGE OPTION...: builds it with CMake and installs it in FOLDER, unless that was done with these options
built() {
  local toolchain=$PWD/cmake/toolchains/$machine.cmake done=$folder/build/$1.done made
  made="$(head -n 1 "$sources/$1/debian/changelog") ${*:2}"
  [ "$(cat "$done" 2>/dev/null)" != "$made" ] || return 0
  rm -rf "$folder/build/$1" "$done"
  mkdir -p "$folder/build/$1"
  # HDF5 looks for what it has found out in the folder where CMake was called.
  { cd "$folder/build/$1" &&
    cmake -S "$sources/$1" -B . -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUILD_SHARED_LIBS=OFF "${@:2}" \
      -DCMAKE_TOOLCHAIN_FILE="$toolchain" -DTAGRID_CROSS_LIBRARIES="$folder" -DCMAKE_INSTALL_PREFIX="$folder" &&
    cmake --build . --target install; } >"$folder/build/$1.log" 2>&1 || { cat "$folder/build/$1.log" >&2; exit 70; }
  cd - >/dev/null
  echo "$made" >"$done"
}

built onetbb -DTBB_TEST=OFF -DTBBMALLOC_BUILD=OFF -DTBB_STRICT=OFF -DTBB_DISABLE_HWLOC_AUTOMATIC_SEARCH=ON \
  -DTBB_ENABLE_IPO=OFF
if [ "$machine" = windows-x64 ]; then
  # HTTP alone, with the encryption and the certificates of Windows.
  built curl -DBUILD_CURL_EXE=OFF -DBUILD_TESTING=OFF -DENABLE_MANUAL=OFF -DHTTP_ONLY=ON -DCURL_USE_SCHANNEL=ON \
    -DCURL_USE_LIBSSH2=OFF -DUSE_LIBIDN2=OFF -DCURL_ZLIB=OFF -DUSE_NGHTTP2=OFF -DCURL_DISABLE_COOKIES=ON
  # For the readers of formats. Those of TIFF and HDF5 are without what few files have.
  built libjpeg-turbo -DENABLE_SHARED=OFF -DWITH_TURBOJPEG=OFF -DWITH_SIMD=OFF
  built tiff -Dold-jpeg=OFF -Djbig=OFF -Dlerc=OFF -Dlzma=OFF -Dwebp=OFF -Dlibdeflate=OFF -Dcxx=OFF -Dtiff-tools=OFF \
    -Dtiff-tests=OFF -Dtiff-contrib=OFF -Dtiff-docs=OFF
  built pugixml
  built openjpeg2 -DBUILD_CODEC=OFF
  without=()
  for library in TIFF PNG XML OPENSSL SNDFILE ICONV ICU STDLIBC_ICONV WRAP OPENJPEG; do
    without+=("-DDCMTK_WITH_$library=OFF")
  done
  # DCMTK: its dictionary is in the library, since there is no file of it where this program runs. While it is built, it
  # runs programs under Wine, whose `winepath` Debian has only as winepath.exe.
  export WINEPREFIX=$folder/build/wine
  printf '#!/bin/sh\nexec "%s" winepath.exe "$@"\n' "$wine" >"$folder/build/winepath"
  chmod +x "$folder/build/winepath"
  built dcmtk "${without[@]}" -DCMAKE_EXE_LINKER_FLAGS=-static -DWINE_CPP_RUNTIME=C: -DWINE_WINE_PROGRAM="$wine" \
    -DWINE_WINEPATH_PROGRAM="$folder/build/winepath" -DBUILD_APPS=OFF \
    -DDCMTK_MODULES="ofstd;oflog;dcmdata;dcmimgle;dcmimage;dcmjpeg;dcmjpls" -DDCMTK_DEFAULT_DICT=builtin \
    -DDCMTK_WIDE_CHAR_FILE_IO_FUNCTIONS=ON -DCMAKE_INSTALL_DATADIC=share/dcmtk
  built hdf5 -DBUILD_TESTING=OFF -DHDF5_BUILD_TOOLS=OFF -DHDF5_BUILD_EXAMPLES=OFF -DHDF5_BUILD_CPP_LIB=OFF \
    -DHDF5_BUILD_HL_LIB=OFF -DHDF5_BUILD_FORTRAN=OFF -DHDF5_ENABLE_Z_LIB_SUPPORT=ON \
    -DH5_HAVE_UNISTD_H=OFF  # with it, it wants fork()
fi
if [ "$machine" = linux-arm64 ] && [ ! -f "$folder/lib/libseccomp.a" ]; then
  (cd "$sources/libseccomp" && ./configure --host="$host" --disable-shared --prefix="$folder" >/dev/null &&
    make -s install >/dev/null)
fi
ls "$folder/lib"
