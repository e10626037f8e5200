# A room is a folder of sources with one subject, and a static library. It may include its own
# headers, as "<layer>/<room>/...", and those of the rooms that it links. Other rooms are not on its
# include path, so the include rule needs no reviewer. Links are PUBLIC if its headers include
# headers of the other room, and PRIVATE if only its sources do. main() belongs to a program, and is
# left out. All stages pass over samples, and so do rooms that are FAST. Others take no time but their
# compilation, which is shorter with fewer optimizations.
# If the files of a room are compiled together, those that are ALONE are not. Nor are those that are APART, if the library is
# for others (TAGRID_UNITY=most): they need zlib and bzip2, set signals or read the environment, or need what does. Within the
# file of a room they would bring that into all programs that link the library's archive
# (tests/library/installed_prefix_test.py).
# A source such as posix_files.cpp has a twin, windows_files.cpp; one of them is compiled.
if(WIN32)
  set(TAGRID_SYSTEM windows)
  set(TAGRID_OTHER_SYSTEM posix)
else()
  set(TAGRID_SYSTEM posix)
  set(TAGRID_OTHER_SYSTEM windows)
endif()
function(tagrid_room folder)
  cmake_parse_arguments(PARSE_ARGV 1 sees "FAST" "" "PUBLIC;PRIVATE;ALONE;APART")
  file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$|/${TAGRID_OTHER_SYSTEM}_[a-z_]*\\.cpp$")
  tagrid_target_names(room ${folder})
  tagrid_target_names(public ${sees_PUBLIC})
  tagrid_target_names(private ${sees_PRIVATE})
  set(view ${PROJECT_BINARY_DIR}/rooms/${room})
  cmake_path(GET folder PARENT_PATH parent)
  file(MAKE_DIRECTORY ${view}/${parent})
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${folder} ${view}/${folder} SYMBOLIC)
  foreach(name IN LISTS sees_ALONE sees_APART)
    set(source ${PROJECT_SOURCE_DIR}/${folder}/${name}.cpp)
    if(NOT source IN_LIST sources)
      message(FATAL_ERROR "${folder} has no source ${name}.cpp")
    elseif(name IN_LIST sees_ALONE OR TAGRID_APART)
      set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
  endforeach()
  if(sources)
    add_library(${room} STATIC ${sources})
    target_include_directories(${room} PUBLIC ${view})
    target_link_libraries(${room} PUBLIC ${public} PRIVATE ${private})
    string(REGEX REPLACE "/.*" "" layer ${folder})
    if(NOT layer STREQUAL stages AND NOT sees_FAST)
      target_compile_options(${room} PRIVATE $<$<NOT:$<CONFIG:Debug>>:${TAGRID_FEW_OPTIMIZATIONS}>)
    endif()
    if(layer IN_LIST TAGRID_UNITY OR folder IN_LIST TAGRID_UNITY)
      set_target_properties(${room} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 0)
      # A type of one file is not a type of many because the compiler sees several at once.
      target_compile_options(${room} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
    endif()
  else()
    add_library(${room} INTERFACE)
    target_include_directories(${room} INTERFACE ${view})
    target_link_libraries(${room} INTERFACE ${public} ${private})
  endif()
  get_property(layer_rooms DIRECTORY PROPERTY TAGRID_ROOMS)
  set_property(DIRECTORY PROPERTY TAGRID_ROOMS ${layer_rooms} ${room})
endfunction()

# "stages/values/voxels" is the target tagrid_stages_values_voxels; names of other libraries stay as they are.
function(tagrid_target_names result)
  set(names ${ARGN})
  list(TRANSFORM names REPLACE "^((stages|io|pipeline|tools)/.*)$" "tagrid_\\1")
  list(TRANSFORM names REPLACE "/" "_" REGEX "^tagrid_")
  set(${result} ${names} PARENT_SCOPE)
endfunction()

# All rooms of this folder, for the targets that test them.
function(tagrid_layer name)
  get_property(layer_rooms DIRECTORY PROPERTY TAGRID_ROOMS)
  add_library(tagrid_${name} INTERFACE)
  target_link_libraries(tagrid_${name} INTERFACE ${layer_rooms})
endfunction()
