# Not tried: see docs/dev/packages.md. An overlay port of the sources around it:
#   vcpkg install tagrid --overlay-ports=packaging/vcpkg --triplet x64-linux-dynamic
set(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../..")
# libtagrid.so and libtagrid.a come from one build, so there is nothing to choose.
set(VCPKG_POLICY_SKIP_CRT_LINKAGE_CHECK enabled)

# vcpkg has no libseccomp.
find_path(seccomp_header seccomp.h)
if(NOT seccomp_header)
  message(FATAL_ERROR "tagrid needs libseccomp of the system. On Debian: apt-get install libseccomp-dev")
endif()

vcpkg_find_acquire_program(PKGCONFIG)
vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS
    "-DPKG_CONFIG_EXECUTABLE=${PKGCONFIG}"
    -DCMAKE_INSTALL_LIBDIR=lib)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/tagrid)
vcpkg_fixup_pkgconfig()
vcpkg_copy_tools(TOOL_NAMES tagrid AUTO_CLEAN)
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
