# SPDX-License-Identifier: MIT
# Read by CMake after what it knows of the system that is compiled for.
if(APPLE)
  set(CMAKE_SHARED_MODULE_CREATE_CXX_FLAGS -shared)
endif()
