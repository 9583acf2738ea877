// SPDX-License-Identifier: MIT
// Nothing but kernels: functions carry the target attribute one by one, because a file compiled
// with -mavx2 could give the linker an inline standard function that older CPUs cannot run.
#include "simd/cpu.h"
#include "simd/kernels.h"

#if defined(__x86_64__) || defined(_M_X64)
#include <immintrin.h>

#if defined(_MSC_VER) && !defined(__clang__)
#define RISORIUS_TARGET_AVX2
#else
#define RISORIUS_TARGET_AVX2 __attribute__((target("avx2,fma")))
#endif

namespace risorius::simd {

namespace {

// Eight registers of eight rows hide the latency of the fused multiply-add.
RISORIUS_TARGET_AVX2 void block_64(const float* values, std::size_t stride,
                                   const std::uint32_t* columns, const float* weights,
                                   std::size_t n, float* out) {
  __m256 a0 = _mm256_setzero_ps(), a1 = a0, a2 = a0, a3 = a0, a4 = a0, a5 = a0, a6 = a0, a7 = a0;
  for (std::size_t i = 0; i < n; ++i) {
    const float* c = values + columns[i] * stride;
    const __m256 w = _mm256_broadcast_ss(weights + i);
    a0 = _mm256_fmadd_ps(w, _mm256_loadu_ps(c), a0);
    a1 = _mm256_fmadd_ps(w, _mm256_loadu_ps(c + 8), a1);
    a2 = _mm256_fmadd_ps(w, _mm256_loadu_ps(c + 16), a2);
    a3 = _mm256_fmadd_ps(w, _mm256_loadu_ps(c + 24), a3);
    a4 = _mm256_fmadd_ps(w, _mm256_loadu_ps(c + 32), a4);
    a5 = _mm256_fmadd_ps(w, _mm256_loadu_ps(c + 40), a5);
    a6 = _mm256_fmadd_ps(w, _mm256_loadu_ps(c + 48), a6);
    a7 = _mm256_fmadd_ps(w, _mm256_loadu_ps(c + 56), a7);
  }
  _mm256_storeu_ps(out, a0);
  _mm256_storeu_ps(out + 8, a1);
  _mm256_storeu_ps(out + 16, a2);
  _mm256_storeu_ps(out + 24, a3);
  _mm256_storeu_ps(out + 32, a4);
  _mm256_storeu_ps(out + 40, a5);
  _mm256_storeu_ps(out + 48, a6);
  _mm256_storeu_ps(out + 56, a7);
}

RISORIUS_TARGET_AVX2 void block_8(const float* values, std::size_t stride,
                                  const std::uint32_t* columns, const float* weights, std::size_t n,
                                  float* out) {
  __m256 even = _mm256_setzero_ps(), odd = even;
  std::size_t i = 0;
  for (; i + 1 < n; i += 2) {
    even = _mm256_fmadd_ps(_mm256_broadcast_ss(weights + i),
                           _mm256_loadu_ps(values + columns[i] * stride), even);
    odd = _mm256_fmadd_ps(_mm256_broadcast_ss(weights + i + 1),
                          _mm256_loadu_ps(values + columns[i + 1] * stride), odd);
  }
  if (i < n) {
    even = _mm256_fmadd_ps(_mm256_broadcast_ss(weights + i),
                           _mm256_loadu_ps(values + columns[i] * stride), even);
  }
  _mm256_storeu_ps(out, _mm256_add_ps(even, odd));
}

void weighted_columns(const float* values, std::size_t stride, const std::uint32_t* columns,
                      const float* weights, std::size_t n, float* out, std::size_t rows) {
  std::size_t r = 0;
  for (; r + 64 <= rows; r += 64) block_64(values + r, stride, columns, weights, n, out + r);
  for (; r < rows; r += 8) block_8(values + r, stride, columns, weights, n, out + r);
}

}  // namespace

const Kernels* avx2_kernels() {
  static constexpr Kernels kernels{"avx2", weighted_columns};
  static const bool supported = cpu_has_avx2_fma();
  return supported ? &kernels : nullptr;
}

}  // namespace risorius::simd

#else

namespace risorius::simd {

const Kernels* avx2_kernels() { return nullptr; }

}  // namespace risorius::simd

#endif
