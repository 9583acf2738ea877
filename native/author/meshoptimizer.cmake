# SPDX-License-Identifier: MIT
# The library `meshoptimizer` from its source package on PyPI; only the simplifier and the codecs are
# compiled. The source lies in build/third_party (our sdist contains it); if it is missing, pip
# fetches it.
set(version 0.2.30a0)
set(sha256 36b18b61a95ba992de804b1e91e86be2ba185925e4e2c1481495f8c68a17f5db)
set(folder "${PROJECT_SOURCE_DIR}/build/third_party/meshoptimizer")
set(files allocator.cpp simplifier.cpp indexcodec.cpp vertexcodec.cpp vertexfilter.cpp)
set(missing ${files})
foreach(file ${files})
  if(EXISTS "${folder}/${file}")
    list(REMOVE_ITEM missing ${file})
  endif()
endforeach()
if(missing)
  find_program(python3 NAMES python3 python REQUIRED)
  set(package "${PROJECT_BINARY_DIR}/meshoptimizer-${version}.tar.gz")
  execute_process(COMMAND "${python3}" -m pip download --quiet --no-deps --no-binary meshoptimizer
                          --dest "${PROJECT_BINARY_DIR}" meshoptimizer==${version}
                  RESULT_VARIABLE code OUTPUT_VARIABLE said ERROR_VARIABLE said)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "PyPI's meshoptimizer ${version} (source) could not be fetched; put its folder "
                        "src/ at ${folder}, or see to it that this works:\n"
                        "${python3} -m pip download --no-deps --no-binary meshoptimizer meshoptimizer==${version}\n${said}")
  endif()
  file(SHA256 "${package}" found)
  if(NOT found STREQUAL sha256)
    message(FATAL_ERROR "${package}: SHA256 ${sha256} was expected, found ${found}")
  endif()
  file(ARCHIVE_EXTRACT INPUT "${package}" DESTINATION "${PROJECT_BINARY_DIR}")
  set(unpacked "${PROJECT_BINARY_DIR}/meshoptimizer-${version}")
  file(MAKE_DIRECTORY "${folder}")
  foreach(file meshoptimizer.h ${files})
    file(COPY_FILE "${unpacked}/src/${file}" "${folder}/${file}")
  endforeach()
  file(REMOVE_RECURSE "${unpacked}" "${package}")
endif()
list(TRANSFORM files PREPEND "${folder}/")
add_library(meshoptimizer STATIC ${files})
set_target_properties(meshoptimizer PROPERTIES UNITY_BUILD OFF) # each file has macros of its own
target_include_directories(meshoptimizer SYSTEM INTERFACE "${PROJECT_SOURCE_DIR}/build/third_party")
if(NOT MSVC)
  # Compile like our own code, for the same bits everywhere, but without our warnings.
  target_compile_options(meshoptimizer PRIVATE -ffp-contract=off -w)
endif()
