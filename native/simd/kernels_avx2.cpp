// SPDX-License-Identifier: MIT
#include "simd/cpu.h"
#include "simd/kernels.h"

#if defined(__x86_64__) || defined(_M_X64)
#include <immintrin.h>

#if defined(_MSC_VER) && !defined(__clang__)
#define RISORIUS_TARGET
#else
#define RISORIUS_TARGET __attribute__((target("avx2,fma,f16c")))
#endif
#include "simd/kernels_inline.h"

namespace risorius::simd {

namespace {

struct V {
  using Reg = __m256;
  static constexpr std::size_t kLanes = 8, kBlocks = 12, kBatchBlocks = 3;
  static constexpr int kBatchFrames = 4;
  RISORIUS_INLINE static Reg zero() { return _mm256_setzero_ps(); }
  RISORIUS_INLINE static Reg set(float v) { return _mm256_set1_ps(v); }
  RISORIUS_INLINE static Reg load(const float* p) { return _mm256_loadu_ps(p); }
  RISORIUS_INLINE static Reg load(const std::uint16_t* p) {
    return _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
  }
  RISORIUS_INLINE static void store(float* p, Reg v) { _mm256_storeu_ps(p, v); }
  RISORIUS_INLINE static Reg madd(Reg a, Reg b, Reg sum) { return _mm256_fmadd_ps(a, b, sum); }
};

}  // namespace

}  // namespace risorius::simd

#include "simd/kernels_body.h"

namespace risorius::simd {

const Kernels* avx2_kernels() {
  static constexpr Kernels kernels = make_kernels("avx2");
  static const bool supported = cpu_has_avx2();
  return supported ? &kernels : nullptr;
}

}  // namespace risorius::simd

#else

namespace risorius::simd {

const Kernels* avx2_kernels() { return nullptr; }

}  // namespace risorius::simd

#endif
