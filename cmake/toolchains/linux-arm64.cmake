# Builds for Linux on arm64 with Debian's cross compiler. qemu-user runs the programs.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64 -L /usr/aarch64-linux-gnu)
# Nothing of this system fits but its programs.
set(CMAKE_FIND_ROOT_PATH /usr/aarch64-linux-gnu ${TAGRID_CROSS_LIBRARIES})
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES TAGRID_CROSS_LIBRARIES)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
foreach(kind LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
