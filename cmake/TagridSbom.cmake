# What a build contains and needs, as an SPDX 2.3 document: tagrid.spdx.json, installed beside the documents. Versions are
# those of the files that were found, or of the source packages of a build for another machine.

# Sets of_DEBIAN, of_NAME, of_LICENSE, of_FILE, of_MODULE, of_RELATION and of_SOURCE.
macro(tagrid_fields line)
  string(REPLACE "|" ";" fields "${line}")
  set(fields_of_a_line DEBIAN NAME LICENSE FILE MODULE RELATION SOURCE)
  foreach(field value IN ZIP_LISTS fields_of_a_line fields)
    set(of_${field} "${value}")
  endforeach()
  string(MAKE_C_IDENTIFIER "TAGRID_FOUND_${of_NAME}" place)
endmacro()

function(tagrid_write_sbom)
  # A dependency of docs/dev/design.md a line: Debian's packages, name, license, a file that says where it was found, its module of
  # pkg-config, its relationship with tagrid, and the folder of its sources where it is built for another machine.
  set(png DYNAMIC_LINK)
  if(TAGRID_STATIC_PNG)
    set(png STATIC_LINK)
  endif()
  set(sqlite DYNAMIC_LINK)
  if(TAGRID_STATIC_SQLITE)
    set(sqlite STATIC_LINK)
  endif()
  set(sodium DYNAMIC_LINK)
  if(TAGRID_STATIC_SODIUM)
    set(sodium STATIC_LINK)
  endif()
  set(dependencies
    "libtbb-dev|oneTBB|Apache-2.0|tbb/tbb.h|tbb|DYNAMIC_LINK|onetbb"
    "libzstd-dev|Zstandard|BSD-3-Clause OR GPL-2.0-only|zstd.h|libzstd|DYNAMIC_LINK|zstd"
    "libxxhash-dev|xxHash|BSD-2-Clause|xxhash.h|libxxhash|DYNAMIC_LINK|xxhash"
    "libisal-dev|ISA-L|BSD-3-Clause|isa-l.h|libisal|DYNAMIC_LINK|libisal"
    "libcurl4-openssl-dev, libcurl4-gnutls-dev|curl|curl|curl/curl.h|libcurl|OPTIONAL_DEPENDENCY_OF|curl"
    "libhwy-dev|Highway|Apache-2.0|hwy/highway.h|libhwy|STATIC_LINK"
    "libsqlite3-dev|SQLite|blessing|sqlite3.h|sqlite3|${sqlite}|sqlite3"
    "libsodium-dev|libsodium|ISC|sodium.h|libsodium|${sodium}|libsodium"
    "libcli11-dev|CLI11|BSD-3-Clause|CLI/CLI.hpp|CLI11|STATIC_LINK"
    "libfmt-dev|fmt|MIT|fmt/format.h|fmt|DYNAMIC_LINK"
    "nlohmann-json3-dev|JSON for Modern C++|MIT|nlohmann/json.hpp|nlohmann_json|STATIC_LINK"
    "zlib1g-dev|zlib|Zlib|zlib.h|zlib|DYNAMIC_LINK|zlib"
    "libbz2-dev|bzip2|bzip2-1.0.6|bzlib.h|bzip2|DYNAMIC_LINK|bzip2"
    "libpng-dev|libpng|libpng-2.0|png.h|libpng|${png}|libpng1.6"
    "libtiff-dev|libtiff|libtiff|tiffio.h|libtiff-4|DYNAMIC_LINK|tiff"
    "libdcmtk-dev|DCMTK|BSD-3-Clause|dcmtk/dcmdata/dctk.h|dcmtk|DYNAMIC_LINK|dcmtk"
    "libopenjp2-7-dev|OpenJPEG|BSD-2-Clause|openjpeg.h|libopenjp2|DYNAMIC_LINK|openjpeg2"
    "libjxl-dev|libjxl|BSD-3-Clause|jxl/decode.h|libjxl|DYNAMIC_LINK"
    "libgsf-1-dev|libgsf|LGPL-2.1-only|gsf/gsf.h|libgsf-1|DYNAMIC_LINK"
    "libglib2.0-dev|GLib|LGPL-2.1-or-later|glib-2.0/glib.h|glib-2.0|DYNAMIC_LINK"
    "libhdf5-dev|HDF5|BSD-3-Clause|hdf5.h|hdf5|DYNAMIC_LINK|hdf5"
    "pkgconf|pkgconf|ISC|../bin/pkgconf|-|BUILD_TOOL_OF"
    "libblosc-dev|Blosc|BSD-3-Clause|blosc.h|blosc|DYNAMIC_LINK"
    "libseccomp-dev|libseccomp|LGPL-2.1-only|seccomp.h|libseccomp|DYNAMIC_LINK|libseccomp"
    "libpugixml-dev|pugixml|MIT|pugixml.hpp|pugixml|DYNAMIC_LINK|pugixml"
    "libopenvdb-dev|OpenVDB|MPL-2.0|openvdb/openvdb.h|OpenVDB|DYNAMIC_LINK"
    "libimath-dev|Imath|BSD-3-Clause|Imath/ImathConfig.h|Imath|DYNAMIC_LINK"
    "libboost-dev|Boost|BSL-1.0|boost/any.hpp|-|STATIC_LINK")
  if(TAGRID_STATIC)
    # Without the library that it cannot load, and without what it has no readers for.
    set(left_out jxl|gsf|glib|blosc|openvdb|imath|boost)
    if(NOT TAGRID_CROSS_LIBRARIES)
      string(APPEND left_out |curl)
    endif()
    if(NOT TAGRID_STATIC_READERS)
      string(APPEND left_out |tiff|dcmtk|openjp2|hdf5|pugixml)
    endif()
    list(FILTER dependencies EXCLUDE REGEX "^lib(${left_out})|^pkgconf")
    if(TAGRID_STATIC_READERS)
      # What libtiff and HDF5 use in turn.
      list(APPEND dependencies
        "libjpeg-dev|libjpeg-turbo|IJG|jpeglib.h|libjpeg|DYNAMIC_LINK|libjpeg-turbo"
        "libwebp-dev|libwebp|BSD-3-Clause|webp/decode.h|libwebp|DYNAMIC_LINK|libwebp"
        "libdeflate-dev|libdeflate|MIT|libdeflate.h|libdeflate|DYNAMIC_LINK|libdeflate"
        "liblzma-dev|XZ Utils|LicenseRef-public-domain|lzma.h|liblzma|DYNAMIC_LINK|xz-utils"
        "libaec-dev|libaec|BSD-2-Clause|libaec.h|-|DYNAMIC_LINK|libaec")
    endif()
    list(TRANSFORM dependencies REPLACE "DYNAMIC_LINK|OPTIONAL_DEPENDENCY_OF" "STATIC_LINK")
  endif()
  if(TARGET tagrid_python)
    list(APPEND dependencies
      "pybind11-dev|pybind11|BSD-3-Clause|pybind11/pybind11.h|pybind11|STATIC_LINK"
      "python3-dev|Python|Python-2.0|Python.h|python-${TAGRID_PYTHON_VERSION}|RUNTIME_DEPENDENCY_OF"
      "python3-numpy|NumPy|BSD-3-Clause|numpy/__init__.py|-|RUNTIME_DEPENDENCY_OF")
  endif()
  if(TAGRID_MPI)
    list(APPEND dependencies "libopenmpi-dev, openmpi-bin|Open MPI|BSD-3-Clause-Open-MPI|mpi.h|ompi|DYNAMIC_LINK")
  endif()

  set(sources ${TAGRID_CROSS_LIBRARIES}/sources)
  if(TAGRID_CROSS_LIBRARIES)
    set(built)
    foreach(line IN LISTS dependencies)
      tagrid_fields("${line}")
      if(NOT of_SOURCE OR EXISTS ${sources}/${of_SOURCE})
        list(APPEND built "${line}")
      endif()
    endforeach()
    set(dependencies "${built}")
  endif()

  # Where each is, and which packages of Debian these files belong to: one call of dpkg for all, as each takes long.
  set(files)
  foreach(line IN LISTS dependencies)
    tagrid_fields("${line}")
    find_path(${place} ${of_FILE} HINTS ${HDF5_INCLUDE_DIRS} ${MPI_CXX_INCLUDE_DIRS} PATHS /usr/lib/python3/dist-packages
              PATH_SUFFIXES python${TAGRID_PYTHON_VERSION} openjpeg-2.5 openjpeg-2.4 libgsf-1)
    mark_as_advanced(${place})
    if(${place})
      cmake_path(SET file NORMALIZE "${${place}}/${of_FILE}")
      file(REAL_PATH "${file}" real)
      list(APPEND files "${file}" "${real}")
    endif()
  endforeach()
  find_program(TAGRID_DPKG_QUERY dpkg-query)
  mark_as_advanced(TAGRID_DPKG_QUERY)
  set(owners "")
  set(versions "")
  if(TAGRID_DPKG_QUERY)
    execute_process(COMMAND ${TAGRID_DPKG_QUERY} -S ${files} OUTPUT_VARIABLE owners ERROR_QUIET)
    string(REGEX MATCHALL "[^\n:]+(:[a-z0-9]+)?: /" packages "${owners}")
    list(TRANSFORM packages REPLACE ": /$" "")
    list(REMOVE_DUPLICATES packages)
    execute_process(COMMAND ${TAGRID_DPKG_QUERY} -W -f "\${Package} \${Version}\\n" ${packages} OUTPUT_VARIABLE versions ERROR_QUIET)
  endif()

  set(packages "")
  set(relations "")
  foreach(line IN LISTS dependencies)
    tagrid_fields("${line}")
    cmake_path(SET file NORMALIZE "${${place}}/${of_FILE}")
    file(REAL_PATH "${file}" real)
    set(version "")
    set(more "")
    set(owner "")
    set(kind "")
    if(TAGRID_CROSS_LIBRARIES AND of_SOURCE)
      file(STRINGS ${sources}/${of_SOURCE}/debian/changelog changed LIMIT_COUNT 1)
      if(changed MATCHES "^([^ ]+) \\(([^)]+)\\)")
        set(owner ${CMAKE_MATCH_1})
        set(version ${CMAKE_MATCH_2})
        set(kind "?arch=source")
      endif()
    elseif("\n${owners}" MATCHES "\n([^\n:]+)[^\n]*: (${file}|${real})\n")
      set(owner ${CMAKE_MATCH_1})
      string(REPLACE "." "\\." name "${owner}")
      string(REPLACE "+" "\\+" name "${name}")
      if("\n${versions}" MATCHES "\n${name} ([^\n]+)")
        set(version ${CMAKE_MATCH_1})
      endif()
    endif()
    if(owner)
      string(REPLACE "+" "%2B" encoded "${version}")
      string(REPLACE ":" "%3A" encoded "${encoded}")
      string(REPLACE "~" "%7E" encoded "${encoded}")
      set(more ",\n      \"externalRefs\": [{\"referenceCategory\": \"PACKAGE-MANAGER\", \"referenceType\": \"purl\", \"referenceLocator\": \"pkg:deb/debian/${owner}@${encoded}${kind}\"}]")
    elseif(PKG_CONFIG_EXECUTABLE AND NOT of_MODULE STREQUAL "-")
      execute_process(COMMAND ${PKG_CONFIG_EXECUTABLE} --modversion ${of_MODULE} OUTPUT_VARIABLE version ERROR_QUIET
                      OUTPUT_STRIP_TRAILING_WHITESPACE)
    endif()
    if(version)
      string(PREPEND more ",\n      \"versionInfo\": \"${version}\"")
    endif()
    string(REGEX REPLACE "[^A-Za-z0-9]+" "-" id "SPDXRef-${of_NAME}")
    string(APPEND packages ",
    {
      \"SPDXID\": \"${id}\",
      \"name\": \"${of_NAME}\",
      \"downloadLocation\": \"NOASSERTION\",
      \"filesAnalyzed\": false,
      \"licenseConcluded\": \"NOASSERTION\",
      \"licenseDeclared\": \"${of_LICENSE}\",
      \"copyrightText\": \"NOASSERTION\",
      \"comment\": \"Debian: ${of_DEBIAN}\"${more}
    }")
    set(first SPDXRef-tagrid)
    set(second ${id})
    if(of_RELATION MATCHES "_OF$")
      set(first ${id})
      set(second SPDXRef-tagrid)
    endif()
    string(APPEND relations ",
    {\"spdxElementId\": \"${first}\", \"relationshipType\": \"${of_RELATION}\", \"relatedSpdxElement\": \"${second}\"}")
  endforeach()

  string(TIMESTAMP created UTC)
  string(UUID id NAMESPACE 6ba7b811-9dad-11d1-80b4-00c04fd430c8 NAME "${packages}${relations}${created}" TYPE SHA1)
  file(WRITE ${PROJECT_BINARY_DIR}/tagrid.spdx.json "{
  \"spdxVersion\": \"SPDX-2.3\",
  \"dataLicense\": \"CC0-1.0\",
  \"SPDXID\": \"SPDXRef-DOCUMENT\",
  \"name\": \"tagrid-${TAGRID_VERSION}\",
  \"documentNamespace\": \"https://spdx.org/spdxdocs/tagrid-${TAGRID_VERSION}-${id}\",
  \"creationInfo\": {\"created\": \"${created}\", \"creators\": [\"Tool: CMake-${CMAKE_VERSION}\"]},
  \"packages\": [
    {
      \"SPDXID\": \"SPDXRef-tagrid\",
      \"name\": \"tagrid\",
      \"versionInfo\": \"${TAGRID_VERSION}\",
      \"downloadLocation\": \"NOASSERTION\",
      \"filesAnalyzed\": false,
      \"licenseConcluded\": \"Apache-2.0\",
      \"licenseDeclared\": \"Apache-2.0\",
      \"copyrightText\": \"NOASSERTION\"
    }${packages}
  ],
  \"relationships\": [
    {\"spdxElementId\": \"SPDXRef-DOCUMENT\", \"relationshipType\": \"DESCRIBES\", \"relatedSpdxElement\": \"SPDXRef-tagrid\"}${relations}
  ]
}
")
endfunction()

tagrid_write_sbom()
install(FILES ${PROJECT_BINARY_DIR}/tagrid.spdx.json DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT tagrid)
