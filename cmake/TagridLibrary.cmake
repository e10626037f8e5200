# libtagrid, shared and static: the rooms that pipeline/library needs, behind
# include/tagrid/tagrid.h.
include(CMakePackageConfigHelpers)

# All rooms that a room needs, including itself.
function(tagrid_rooms_of room result)
  set(found ${${result}})
  list(APPEND found ${room})
  get_target_property(links ${room} INTERFACE_LINK_LIBRARIES)
  foreach(link IN LISTS links)
    # Rooms that only its sources see are linked, too: $<LINK_ONLY:room>.
    string(REGEX REPLACE "^\\$<LINK_ONLY:(.*)>$" "\\1" link "${link}")
    if(link MATCHES "^tagrid_(stages|io|pipeline)_" AND NOT link IN_LIST found)
      tagrid_rooms_of(${link} found)
    endif()
  endforeach()
  set(${result} ${found} PARENT_SCOPE)
endfunction()

# Everything except the interface is linked from archives, so that unused code stays out.
add_library(tagrid_shared SHARED $<TARGET_OBJECTS:tagrid_pipeline_library>)
target_link_libraries(tagrid_shared PRIVATE tagrid_pipeline_library)
set(map ${PROJECT_SOURCE_DIR}/cmake/tagrid.map)
target_link_options(tagrid_shared PRIVATE -Wl,--version-script=${map} -Wl,--as-needed)
if(NOT TAGRID_SANITIZE)
  target_link_options(tagrid_shared PRIVATE -Wl,-z,defs)
endif()
set_target_properties(tagrid_shared PROPERTIES
  OUTPUT_NAME tagrid VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR} EXPORT_NAME tagrid
  LINK_DEPENDS ${map} LINKER_LANGUAGE CXX)

tagrid_rooms_of(tagrid_pipeline_library rooms)
set(objects)
foreach(room IN LISTS rooms)
  get_target_property(type ${room} TYPE)
  if(type STREQUAL STATIC_LIBRARY)
    list(APPEND objects $<TARGET_OBJECTS:${room}>)
  endif()
endforeach()
add_library(tagrid_static STATIC ${objects})
set_target_properties(tagrid_static PROPERTIES OUTPUT_NAME tagrid EXPORT_NAME static LINKER_LANGUAGE CXX)
# Libraries by their names, so that an installed tree may be moved, and C projects may link it.
set(TAGRID_STATIC_LIBRARIES tbb fmt zstd xxhash isal stdc++ m pthread)
target_link_libraries(tagrid_static INTERFACE $<INSTALL_INTERFACE:${TAGRID_STATIC_LIBRARIES}>)

foreach(library tagrid_shared tagrid_static)
  target_include_directories(${library} INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>)
endforeach()

install(TARGETS tagrid_shared tagrid_static EXPORT tagridTargets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT libtagrid NAMELINK_COMPONENT libtagrid-dev
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT libtagrid-dev
        INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY include/tagrid DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT libtagrid-dev)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libtagrid COMPONENT libtagrid)
install(FILES docs/library.md LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libtagrid-dev COMPONENT libtagrid-dev)
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libtagrid-dev COMPONENT libtagrid-dev
        PATTERN readers EXCLUDE)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/tagrid)
install(EXPORT tagridTargets NAMESPACE tagrid:: DESTINATION ${package} COMPONENT libtagrid-dev)
configure_file(cmake/tagridConfig.cmake.in tagridConfig.cmake @ONLY)
write_basic_package_version_file(tagridConfigVersion.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${PROJECT_BINARY_DIR}/tagridConfig.cmake ${PROJECT_BINARY_DIR}/tagridConfigVersion.cmake
        DESTINATION ${package} COMPONENT libtagrid-dev)

set(TAGRID_STATIC_PACKAGES "tbb, fmt, libzstd, libxxhash, libisal")
set(TAGRID_STATIC_FLAGS "-lstdc++ -lm -lpthread")
file(RELATIVE_PATH TAGRID_PREFIX_FROM_PKGCONFIG /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
configure_file(cmake/tagrid.pc.in tagrid.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/tagrid.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT libtagrid-dev)
