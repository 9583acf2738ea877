// SPDX-License-Identifier: MIT
#include "simd/kernels.h"

namespace risorius::simd {

namespace {

void weighted_columns(const float* values, std::size_t stride, const std::uint32_t* columns,
                      const float* weights, std::size_t n, float* out, std::size_t rows) {
  for (std::size_t r = 0; r < rows; ++r) out[r] = 0.0f;
  for (std::size_t i = 0; i < n; ++i) {
    const float* column = values + columns[i] * stride;
    for (std::size_t r = 0; r < rows; ++r) out[r] += weights[i] * column[r];
  }
}

}  // namespace

const Kernels& scalar_kernels() {
  static constexpr Kernels kernels{"scalar", weighted_columns};
  return kernels;
}

}  // namespace risorius::simd
