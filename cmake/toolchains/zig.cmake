# Builds with zig, whose compiler is clang, for the system TAGRID_ZIG_SYSTEM and the processor TAGRID_ZIG_PROCESSOR;
# tools/reader_library.sh makes the programs in TAGRID_ZIG.
set(CMAKE_SYSTEM_NAME ${TAGRID_ZIG_SYSTEM})
set(CMAKE_SYSTEM_PROCESSOR ${TAGRID_ZIG_PROCESSOR})
set(CMAKE_C_COMPILER ${TAGRID_ZIG}/cc)
set(CMAKE_CXX_COMPILER ${TAGRID_ZIG}/c++)
set(CMAKE_AR ${TAGRID_ZIG}/ar CACHE FILEPATH "")
set(CMAKE_RANLIB ${TAGRID_ZIG}/ranlib CACHE FILEPATH "")
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES TAGRID_ZIG TAGRID_ZIG_SYSTEM TAGRID_ZIG_PROCESSOR)
set(CMAKE_CXX_FLAGS_INIT "-include ${CMAKE_CURRENT_LIST_DIR}/libcxx.h")
# Of macOS, zig has all that is needed, and CMake looks for more.
set(CMAKE_INSTALL_NAME_TOOL true CACHE FILEPATH "")
set(CMAKE_OSX_SYSROOT "" CACHE PATH "")
set(CMAKE_OSX_DEPLOYMENT_TARGET "" CACHE STRING "")
# Nothing of this system fits.
foreach(kind LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
