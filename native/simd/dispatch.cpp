// SPDX-License-Identifier: MIT
// Chooses a table of kernels, the inner loops for one instruction set: by name, by the environment
// variable RISORIUS_SIMD, or the best table that the CPU supports.
#include <array>
#include <cstdlib>
#include <string>
#include <string_view>

#include "simd/kernels.h"

namespace risorius::simd {

namespace {

// The tables of functions, the best last; null if the CPU does not support one.
std::array<const Kernels*, 5> tables() {
  return {&scalar_kernels(), sse4_kernels(), neon_kernels(), avx2_kernels(), avx512_kernels()};
}

}  // namespace

const Kernels* find_kernels(const char* name) {
  if (name == nullptr || *name == '\0') name = std::getenv("RISORIUS_SIMD");
  const std::string_view wanted = name == nullptr ? "" : name;
  const Kernels* found = nullptr;
  for (const Kernels* table : tables()) {
    if (table != nullptr && (wanted.empty() || wanted == table->name)) found = table;
  }
  return found;
}

const Kernels& usual_kernels() {
  const Kernels* found = find_kernels(nullptr);
  return found != nullptr ? *found : scalar_kernels();
}

const char* available_kernels() {
  static const std::string names = [] {
    std::string text;
    for (const Kernels* table : tables()) {
      if (table != nullptr) text += (text.empty() ? "" : ", ") + std::string(table->name);
    }
    return text;
  }();
  return names.c_str();
}

}  // namespace risorius::simd
