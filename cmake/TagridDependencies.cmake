# Every library that tagrid uses, found by CMake's own means. docs/design.md says why each is used.
find_package(PkgConfig QUIET)

macro(tagrid_require package debian_package)
  find_package(${package} ${ARGN} QUIET)
  if(NOT ${package}_FOUND)
    message(FATAL_ERROR "${package} was not found. On Debian: apt-get install ${debian_package}\n"
                        "tools/quickstart.sh installs everything that is needed.")
  endif()
endmacro()

# For libraries without a CMake package: makes an imported target from the header and the library.
function(tagrid_require_library target header library debian_package)
  find_path(${library}_INCLUDE_DIR ${header})
  find_library(${library}_LIBRARY ${library})
  if(NOT ${library}_INCLUDE_DIR OR NOT ${library}_LIBRARY)
    message(FATAL_ERROR "${library} (${header}) was not found. On Debian: apt-get install ${debian_package}\n"
                        "tools/quickstart.sh installs everything that is needed.")
  endif()
  add_library(${target} UNKNOWN IMPORTED GLOBAL)
  set_target_properties(${target} PROPERTIES IMPORTED_LOCATION ${${library}_LIBRARY}
                                             INTERFACE_INCLUDE_DIRECTORIES ${${library}_INCLUDE_DIR})
endfunction()

function(tagrid_require_header target header debian_package)
  find_path(${target}_INCLUDE_DIR ${header})
  if(NOT ${target}_INCLUDE_DIR)
    message(FATAL_ERROR "${header} was not found. On Debian: apt-get install ${debian_package}\n"
                        "tools/quickstart.sh installs everything that is needed.")
  endif()
  add_library(${target} INTERFACE)
  target_include_directories(${target} INTERFACE ${${target}_INCLUDE_DIR})
endfunction()

# Debian has fmt as a shared library, and as headers.
macro(tagrid_require_fmt_headers)
  tagrid_require_header(tagrid_fmt fmt/format.h libfmt-dev)
  target_compile_definitions(tagrid_fmt INTERFACE FMT_HEADER_ONLY)
  add_library(fmt::fmt ALIAS tagrid_fmt)
endmacro()

if(TAGRID_READING_ONLY)
  include(TagridReadingDependencies)
  return()
endif()

if(TAGRID_STATIC)
  set(CMAKE_FIND_LIBRARY_SUFFIXES .a)
endif()
tagrid_require(Threads libc6-dev)
tagrid_require(TBB libtbb-dev)
if(TAGRID_STATIC)
  get_target_property(kind TBB::tbb TYPE)
  if(NOT kind STREQUAL STATIC_LIBRARY)
    message(FATAL_ERROR "${TBB_DIR} is not a static oneTBB; tools/static.sh builds one")
  endif()
  tagrid_require_fmt_headers()
else()
  tagrid_require(fmt libfmt-dev)
endif()
tagrid_require(ZLIB zlib1g-dev)
tagrid_require(BZip2 libbz2-dev)
# Static where there is such a library: to load another library takes 0.2 ms of every start of the program.
find_library(TAGRID_STATIC_PNG libpng16.a)
if(TAGRID_STATIC_PNG)
  set(PNG_LIBRARY_RELEASE ${TAGRID_STATIC_PNG} CACHE FILEPATH "libpng")
endif()
tagrid_require(PNG libpng-dev)
tagrid_require_library(zstd::libzstd zstd.h zstd libzstd-dev)
tagrid_require_library(xxhash::xxhash xxhash.h xxhash libxxhash-dev)
tagrid_require_header(tagrid_hwy hwy/highway.h libhwy-dev)
tagrid_require_header(tagrid_cli11 CLI/CLI.hpp libcli11-dev)
tagrid_require_header(tagrid_json nlohmann/json.hpp nlohmann-json3-dev)
# For the index of an archive; static as libpng is.
find_library(TAGRID_STATIC_SQLITE libsqlite3.a)
if(TAGRID_STATIC_SQLITE)
  set(SQLite3_LIBRARY ${TAGRID_STATIC_SQLITE} CACHE FILEPATH "SQLite")
endif()
tagrid_require(SQLite3 libsqlite3-dev)
# For the programs that read formats. The program itself has the rooms that they use, and does not need it.
tagrid_require_library(seccomp::seccomp seccomp.h seccomp libseccomp-dev)
get_target_property(seccomp_library seccomp::seccomp IMPORTED_LOCATION)
set(seccomp_if_needed -Wl,--push-state,--as-needed,${seccomp_library},--pop-state)
# For addresses. Only the header: who reads one loads the library.
tagrid_require_header(tagrid_curl curl/curl.h libcurl4-openssl-dev)
# For parity and the checksums of Zarr. Only what writes or repairs it loads the library.
tagrid_require_library(isal::isal isa-l.h isal libisal-dev)
get_target_property(isal_library isal::isal IMPORTED_LOCATION)
set(isal_if_needed -Wl,--push-state,--as-needed,${isal_library},--pop-state)
if(NOT TAGRID_STATIC)
  # For the programs that read and write OpenVDB files.
  tagrid_require_library(openvdb::openvdb openvdb/openvdb.h openvdb libopenvdb-dev)
  tagrid_require(Imath libimath-dev)
  tagrid_require_header(tagrid_boost boost/any.hpp libboost-dev)
endif()
if(TAGRID_MPI)
  tagrid_require(MPI "libopenmpi-dev openmpi-bin" COMPONENTS CXX)
endif()
if(TAGRID_TESTS)
  tagrid_require(GTest libgtest-dev)
  tagrid_require(rapidcheck librapidcheck-dev)
endif()

include(TagridVectors)
