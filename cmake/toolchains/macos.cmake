# Builds for macOS 11 and later with zig, whose compiler is clang and which has the headers of macOS; see tools/macos.sh, which
# makes these programs in TAGRID_ZIG for one processor, TAGRID_ZIG_PROCESSOR. Nothing here can run what is built.
set(CMAKE_SYSTEM_NAME Darwin)
set(CMAKE_SYSTEM_PROCESSOR ${TAGRID_ZIG_PROCESSOR})
set(CMAKE_C_COMPILER ${TAGRID_ZIG}/cc)
set(CMAKE_CXX_COMPILER ${TAGRID_ZIG}/c++)
set(CMAKE_AR ${TAGRID_ZIG}/ar CACHE FILEPATH "")
set(CMAKE_RANLIB ${TAGRID_ZIG}/ranlib CACHE FILEPATH "")
# There is none, and nothing is installed.
set(CMAKE_INSTALL_NAME_TOOL true CACHE FILEPATH "")
set(CMAKE_OSX_SYSROOT "" CACHE PATH "")
set(CMAKE_OSX_DEPLOYMENT_TARGET "" CACHE STRING "")
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES TAGRID_ZIG TAGRID_ZIG_PROCESSOR)
set(CMAKE_CXX_FLAGS_INIT "-include ${CMAKE_CURRENT_LIST_DIR}/libcxx.h")
