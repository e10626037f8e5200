# The half of libtagrid that reads a block at a time, behind include/tagrid/tagrid_blocks.h, as one static library. The
# same sources are in the rooms of the whole library. Here, a source that includes or links anything else does not
# build.
set(rooms stages/grid stages/sample stages/bound stages/criterion stages/entropy stages/activity stages/values/prediction
          stages/values/best stages/values/few stages/values/points stages/values/sides stages/values/transform
          stages/values/voxels stages/values/wavefront stages/values/wide stages/brick io/bytes)
set(sources io/errors/errors.cpp io/text/text.cpp io/volume/volume_info.cpp
            io/metadata/entries.cpp io/metadata/fields.cpp io/metadata/geometry.cpp io/metadata/metadata.cpp
            io/parity/layout.cpp
            stages/mesh/plane_edges.cpp
            io/tag/blocks.cpp io/tag/bricks.cpp io/tag/header.cpp io/tag/index.cpp io/tag/members.cpp io/tag/pages.cpp
            pipeline/reading/region.cpp
            pipeline/library/blocks.cpp pipeline/library/general.cpp pipeline/library/volume.cpp)
list(TRANSFORM sources PREPEND ${PROJECT_SOURCE_DIR}/)
foreach(room IN LISTS rooms)
  file(GLOB of_room CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${room}/*.cpp)
  list(APPEND sources ${of_room})
endforeach()

add_library(tagrid_reading STATIC ${sources})
target_include_directories(tagrid_reading PRIVATE ${PROJECT_SOURCE_DIR} PUBLIC ${PROJECT_SOURCE_DIR}/include)
target_link_libraries(tagrid_reading PUBLIC zstd::libzstd xxhash::xxhash PRIVATE tagrid_hwy fmt::fmt)
target_compile_definitions(tagrid_reading PRIVATE TAGRID_VERSION="${TAGRID_VERSION}")
if(EMSCRIPTEN)
  # A module is linked once, at a place of its own.
  set_target_properties(tagrid_reading zstd_decompress xxhash PROPERTIES POSITION_INDEPENDENT_CODE OFF)
  target_compile_options(tagrid_reading PUBLIC -fwasm-exceptions)
  target_link_options(tagrid_reading PUBLIC -fwasm-exceptions)
  # Only the coder of 8 and 16 bits gains from loops that are unrolled, and what is not done for each sample may be slow.
  set(small ${sources})
  list(FILTER small INCLUDE REGEX "/(io|pipeline|stages/brick)/")
  set_source_files_properties(${small} PROPERTIES COMPILE_OPTIONS -Os)
  set(plain ${sources})
  list(FILTER plain EXCLUDE REGEX "/(io|pipeline|stages/brick|stages/values/wavefront)/")
  set_source_files_properties(${plain} PROPERTIES COMPILE_OPTIONS "-O2;-fno-unroll-loops")
endif()
# A folder at a time, as in TagridRooms.cmake, without the files that are ALONE there.
if(TAGRID_UNITY)
  set(together ${sources})
  list(FILTER together EXCLUDE REGEX "/(coder_[a-z0-9]+|checksum)\\.cpp$")
  foreach(source IN LISTS together)
    cmake_path(GET source PARENT_PATH folder)
    cmake_path(RELATIVE_PATH folder BASE_DIRECTORY ${PROJECT_SOURCE_DIR})
    string(MAKE_C_IDENTIFIER ${folder} group)
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${group})
  endforeach()
  set_target_properties(tagrid_reading PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  target_compile_options(tagrid_reading PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endif()
# Whoever links it drops what only encoding needs.
target_compile_options(tagrid_reading PRIVATE -ffunction-sections -fdata-sections)
if(EMSCRIPTEN)
  add_subdirectory(web/decoder)
  return()
endif()

# The same as a shared library, for what calls C functions by their names, such as the Python package in python/reader.
# It exports what tagrid_blocks.h declares and what that needs of tagrid.h, and has the library of C++ in it.
file(STRINGS include/tagrid/tagrid_blocks.h exported REGEX "^TAGRID_API [^(]*tagrid_[a-z_]+\\(")
list(TRANSFORM exported REPLACE "^[^(]*(tagrid_[a-z_]+)\\(.*" "\\1")
list(APPEND exported tagrid_version tagrid_status_text tagrid_info_init_sized)
list(JOIN exported "\n" names)
list(JOIN exported "; " symbols)
add_library(tagrid_reading_shared SHARED $<TARGET_OBJECTS:tagrid_reading>)
if(TAGRID_DEBIAN_HEADERS)
  target_link_libraries(tagrid_reading_shared PRIVATE zstd::libzstd xxhash::xxhash)
else()
  # Archives, where the system has them: then it needs nothing but the C library.
  find_library(TAGRID_STATIC_ZSTD NAMES libzstd.a zstd REQUIRED)
  find_library(TAGRID_STATIC_XXHASH NAMES libxxhash.a xxhash REQUIRED)
  target_link_libraries(tagrid_reading_shared PRIVATE ${TAGRID_STATIC_ZSTD} ${TAGRID_STATIC_XXHASH})
endif()
if(WIN32)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/reading.def CONTENT "EXPORTS\n@names@\n" @ONLY)
  target_sources(tagrid_reading_shared PRIVATE ${PROJECT_BINARY_DIR}/reading.def)
  target_link_options(tagrid_reading_shared PRIVATE -static)
elseif(APPLE)
  list(TRANSFORM exported PREPEND _)
  list(JOIN exported "\n" names)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/reading.txt CONTENT "@names@\n" @ONLY)
  target_link_options(tagrid_reading_shared PRIVATE -Wl,-exported_symbols_list,${PROJECT_BINARY_DIR}/reading.txt -Wl,-dead_strip)
  set_target_properties(tagrid_reading_shared PROPERTIES INSTALL_NAME_DIR "@rpath" BUILD_WITH_INSTALL_NAME_DIR ON)
else()
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/reading.map CONTENT "{ global: @symbols@; local: *; };\n" @ONLY)
  target_link_options(tagrid_reading_shared PRIVATE -Wl,--version-script=${PROJECT_BINARY_DIR}/reading.map
                                                    -Wl,--as-needed -Wl,-z,defs -static-libstdc++)
endif()
if(NOT APPLE)
  target_link_options(tagrid_reading_shared PRIVATE -Wl,--gc-sections -s)
endif()
set_target_properties(tagrid_reading_shared PROPERTIES OUTPUT_NAME tagrid_reading LINKER_LANGUAGE CXX)
if(WIN32)
  set_target_properties(tagrid_reading_shared PROPERTIES PREFIX "")
endif()
