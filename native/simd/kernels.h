// SPDX-License-Identifier: MIT
// The evaluator's inner loops, one table of functions per instruction set.
#pragma once

#include <cstddef>
#include <cstdint>

namespace risorius::simd {

/// Rows of every matrix are padded to this many floats, so that no kernel has a remainder loop.
inline constexpr std::size_t kRowAlignment = 8;

struct Kernels {
  const char* name;

  /// out[r] = sum over i of weights[i] * values[columns[i] * stride + r], i ascending.
  /// In:   values   float32[columns, stride], 32-byte aligned; stride and rows multiples of 8
  ///       columns  the active columns, n of them; weights their control values
  /// Out:  out      float32[rows]; overwritten
  void (*weighted_columns)(const float* values, std::size_t stride, const std::uint32_t* columns,
                           const float* weights, std::size_t n, float* out, std::size_t rows);
};

/// No fused operations and a fixed order of sums: the same bits on every machine.
const Kernels& scalar_kernels();
/// AVX2 with FMA; nullptr where the build or the CPU has none.
const Kernels* avx2_kernels();

/// The table of that name ("scalar", "avx2"), or nullptr. An empty name is the environment variable
/// RISORIUS_SIMD when it is set, else the best that this CPU has.
const Kernels* find_kernels(const char* name);
/// What this CPU can run, for an error message: "scalar, avx2".
const char* available_kernels();

}  // namespace risorius::simd
