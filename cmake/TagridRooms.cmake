# A room is a folder of sources with one subject, and a static library. It may include its own
# headers, as "<layer>/<room>/...", and those of the rooms that it links. Other rooms are not on its
# include path, so the include rule needs no reviewer. Links are PUBLIC if its headers include
# headers of the other room, and PRIVATE if only its sources do. main() belongs to a program, and is
# left out. All stages pass over samples, and so do rooms that are FAST. Others take no time but their
# compilation, which is shorter with fewer optimizations.
function(tagrid_room folder)
  cmake_parse_arguments(PARSE_ARGV 1 sees "FAST" "" "PUBLIC;PRIVATE")
  file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  tagrid_target_names(room ${folder})
  tagrid_target_names(public ${sees_PUBLIC})
  tagrid_target_names(private ${sees_PRIVATE})
  set(view ${PROJECT_BINARY_DIR}/rooms/${room})
  cmake_path(GET folder PARENT_PATH parent)
  file(MAKE_DIRECTORY ${view}/${parent})
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${folder} ${view}/${folder} SYMBOLIC)
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
      list(TRANSFORM TAGRID_SINGLE_FILES PREPEND ${PROJECT_SOURCE_DIR}/ OUTPUT_VARIABLE single)
      set_source_files_properties(${single} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
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
