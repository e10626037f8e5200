# Builds for Windows on x86-64 with Debian's mingw-w64, whose `posix` compilers have the threads of C++. Wine runs the programs.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR AMD64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
# Debian's wine64 lies outside of PATH.
find_program(TAGRID_WINE NAMES wine wine64 PATHS /usr/lib/wine NO_CMAKE_FIND_ROOT_PATH)
set(CMAKE_CROSSCOMPILING_EMULATOR ${TAGRID_WINE})
# Nothing of this system fits but its programs.
set(CMAKE_FIND_ROOT_PATH /usr/x86_64-w64-mingw32 ${TAGRID_CROSS_LIBRARIES})
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES TAGRID_CROSS_LIBRARIES)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
foreach(kind LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
