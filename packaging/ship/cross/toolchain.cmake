# SPDX-License-Identifier: MIT
# Toolchain of cross.sh and wheels.sh. In: RISORIUS_TARGET, a name of RISORIUS_TOOLS' compilers (zig's,
# see zig.sh); or aarch64-linux-gnu, Debian's compiler and an emulator for programs. RISORIUS_PREFIX
# holds the packages of the target.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES RISORIUS_TARGET RISORIUS_TOOLS RISORIUS_PREFIX)
string(REGEX MATCH "^[^-]+" CMAKE_SYSTEM_PROCESSOR ${RISORIUS_TARGET})
if(RISORIUS_TARGET STREQUAL "aarch64-linux-gnu")
  set(CMAKE_SYSTEM_NAME Linux)
  set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
  set(CMAKE_EXE_LINKER_FLAGS_INIT -static)  # the emulator finds no libraries of the target
  set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64)
else()
  set(CMAKE_SYSTEM_NAME Darwin)
  if(RISORIUS_TARGET MATCHES "windows")
    set(CMAKE_SYSTEM_NAME Windows)
  elseif(RISORIUS_TARGET MATCHES "linux")
    set(CMAKE_SYSTEM_NAME Linux)
  endif()
  set(CMAKE_C_COMPILER ${RISORIUS_TOOLS}/${RISORIUS_TARGET}-cc)
  set(CMAKE_CXX_COMPILER ${RISORIUS_TOOLS}/${RISORIUS_TARGET}-c++)
  set(CMAKE_RC_COMPILER ${RISORIUS_TOOLS}/rc)
  set(CMAKE_AR ${RISORIUS_TOOLS}/ar)
  set(CMAKE_RANLIB ${RISORIUS_TOOLS}/ranlib)
  set(CMAKE_OSX_SYSROOT "")
  set(CMAKE_INSTALL_NAME_TOOL /bin/false)  # CMake wants one; nothing has an install name
  # The linker strips: a strip afterwards would break the signature that macOS wants.
  set(CMAKE_MODULE_LINKER_FLAGS_INIT -s)
  if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
    # Of the C++ library inside nobody else may find anything, operator new least of all.
    string(APPEND CMAKE_MODULE_LINKER_FLAGS_INIT
           " -Wl,--version-script=${CMAKE_CURRENT_LIST_DIR}/exports.map")
  endif()
  set(CMAKE_STRIP /bin/true)
  # zig knows no bundles; Python loads a library as well.
  set(CMAKE_USER_MAKE_RULES_OVERRIDE ${CMAKE_CURRENT_LIST_DIR}/rules.cmake)
  # The first link for a target compiles its C and C++ libraries.
  set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
endif()
# Nothing of the machine that compiles: its headers are of another system.
set(CMAKE_FIND_ROOT_PATH ${RISORIUS_PREFIX})
set(CMAKE_PREFIX_PATH ${RISORIUS_PREFIX})
foreach(kind LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
