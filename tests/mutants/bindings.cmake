# SPDX-License-Identifier: MIT
# For the build in which mutants are tried: the bindings take minutes to optimise and hold no mutant.
if(RISORIUS_BUILD_BINDINGS)
  cmake_language(DEFER CALL target_compile_options _native PRIVATE -O0 -g0)
endif()
