// SPDX-License-Identifier: MIT
#include <cstdlib>
#include <cstring>

#include "simd/kernels.h"

namespace risorius::simd {

const Kernels* find_kernels(const char* name) {
  if (name == nullptr || *name == '\0') name = std::getenv("RISORIUS_SIMD");
  if (name == nullptr || *name == '\0') {
    const Kernels* best = avx2_kernels();
    return best != nullptr ? best : &scalar_kernels();
  }
  if (std::strcmp(name, "scalar") == 0) return &scalar_kernels();
  if (std::strcmp(name, "avx2") == 0) return avx2_kernels();
  return nullptr;
}

const char* available_kernels() { return avx2_kernels() != nullptr ? "scalar, avx2" : "scalar"; }

}  // namespace risorius::simd
