# Debian packages: `cpack -G DEB` in the build folder.
set(CPACK_PACKAGE_NAME tagrid)
set(CPACK_PACKAGE_VENDOR tagrid)
# Who builds the packages maintains them, under the name that Debian's tools use.
set(maintainer "$ENV{DEBFULLNAME}")
set(address "$ENV{DEBEMAIL}")
if(NOT address)
  cmake_host_system_information(RESULT host QUERY FQDN)
  set(address "$ENV{USER}@${host}")
  string(REGEX REPLACE "^@" "root@" address "${address}")
endif()
if(NOT maintainer)
  string(REGEX REPLACE "@.*" "" maintainer "${address}")
endif()
set(TAGRID_MAINTAINER "${maintainer} <${address}>" CACHE STRING "Maintainer of the Debian packages: Name <address>")
set(CPACK_PACKAGE_CONTACT "${TAGRID_MAINTAINER}")
set(CPACK_PACKAGE_VERSION ${TAGRID_DEBIAN_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_STRIP_FILES ON)

set(CPACK_COMPONENTS_ALL tagrid tagrid-readers tagrid-openvdb libtagrid libtagrid-dev)
if(TARGET tagrid_hdf5_plugin)
  list(APPEND CPACK_COMPONENTS_ALL tagrid-hdf5)
endif()
if(TARGET tagrid_python)
  list(APPEND CPACK_COMPONENTS_ALL python3-tagrid)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENT_TAGRID_DESCRIPTION
    "CT volumes as one file\n tagrid turns a CT volume into one .tag file and back: every voxel within a bound, and a\n crack-free tetrahedral grid that is fine where the volume bends.")
set(CPACK_COMPONENT_TAGRID-READERS_DESCRIPTION
    "CT volumes as one file, readers of other formats\n Programs that open volumes for tagrid (DICOM, HDF5, JPEG 2000, TIFF, Zarr), or write them (HDF5, VTKHDF).")
set(CPACK_COMPONENT_TAGRID-OPENVDB_DESCRIPTION
    "CT volumes as one file, OpenVDB\n Programs that read and write OpenVDB files for tagrid.")
set(CPACK_COMPONENT_TAGRID-HDF5_DESCRIPTION
    "CT volumes as one file, filter for HDF5\n A plugin with which programs that use HDF5's library read and write data sets that tagrid compresses.")
set(CPACK_COMPONENT_LIBTAGRID_DESCRIPTION
    "CT volumes as one file, shared library\n libtagrid reads parts of .tag files, and writes .tag files from slices.")
set(CPACK_COMPONENT_LIBTAGRID-DEV_DESCRIPTION
    "CT volumes as one file, files to develop with\n Headers for C and C++, a static library, a CMake package, pkg-config's file and examples.")
set(CPACK_COMPONENT_PYTHON3-TAGRID_DESCRIPTION
    "CT volumes as one file, Python package\n .tag files as arrays that are read in parts, written from arrays, with meshes and surfaces.")

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_TAGRID_PACKAGE_NAME tagrid)
set(CPACK_DEBIAN_TAGRID-READERS_PACKAGE_NAME tagrid-readers)
set(CPACK_DEBIAN_TAGRID-OPENVDB_PACKAGE_NAME tagrid-openvdb)
set(CPACK_DEBIAN_TAGRID-HDF5_PACKAGE_NAME tagrid-hdf5)
set(CPACK_DEBIAN_LIBTAGRID_PACKAGE_NAME libtagrid)
set(CPACK_DEBIAN_LIBTAGRID-DEV_PACKAGE_NAME libtagrid-dev)
set(CPACK_DEBIAN_TAGRID_PACKAGE_SECTION science)
# The program loads the library, with either TLS, when it opens an address.
set(CPACK_DEBIAN_TAGRID_PACKAGE_RECOMMENDS "tagrid-readers (= ${TAGRID_DEBIAN_VERSION}), libcurl4 | libcurl3-gnutls")
set(CPACK_DEBIAN_TAGRID_PACKAGE_SUGGESTS "tagrid-openvdb (= ${TAGRID_DEBIAN_VERSION})")
set(CPACK_DEBIAN_TAGRID-READERS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_TAGRID-OPENVDB_PACKAGE_SECTION science)
set(CPACK_DEBIAN_TAGRID-HDF5_PACKAGE_SECTION science)
# Its library is in no package that is installed yet.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR})
set(CPACK_DEBIAN_TAGRID-HDF5_PACKAGE_DEPENDS "libtagrid (= ${TAGRID_DEBIAN_VERSION})")
set(CPACK_DEBIAN_LIBTAGRID_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBTAGRID-DEV_PACKAGE_SECTION libdevel)
# The loader learns of the new library, and other packages learn which package provides it.
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_LIBTAGRID-DEV_PACKAGE_DEPENDS "libtagrid (= ${TAGRID_DEBIAN_VERSION})")
# Only programs linked with libtagrid.a need them.
set(CPACK_DEBIAN_LIBTAGRID-DEV_PACKAGE_RECOMMENDS "libtbb-dev, libfmt-dev, libzstd-dev, libxxhash-dev, libisal-dev")
set(CPACK_DEBIAN_PYTHON3-TAGRID_PACKAGE_NAME python3-tagrid)
set(CPACK_DEBIAN_PYTHON3-TAGRID_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON3-TAGRID_PACKAGE_DEPENDS
    "libtagrid (= ${TAGRID_DEBIAN_VERSION}), python3 (>= ${TAGRID_PYTHON_VERSION}), python3 (<< ${TAGRID_PYTHON_VERSION}.99), python3-numpy")
set(CPACK_DEBIAN_PYTHON3-TAGRID_PACKAGE_SUGGESTS "python3-dask, python3-xarray, python3-zarr")
include(CPack)
