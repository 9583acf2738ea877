// SPDX-License-Identifier: MIT
#include "simd/cpu.h"
#include "simd/kernels.h"

#if defined(__x86_64__) || defined(_M_X64)
#include <immintrin.h>

#if defined(_MSC_VER) && !defined(__clang__)
#define RISORIUS_TARGET
#else
#define RISORIUS_TARGET __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,fma,f16c")))
#endif
#include "simd/kernels_inline.h"
#include "simd/rotation_parts_avx512.h"

namespace risorius::simd {

namespace {

struct V {
  using Parts = SixteenByFour;
  using Reg = __m512;
  static constexpr std::size_t kLanes = 16, kBlocks = 8, kBatchBlocks = 3;
  static constexpr int kBatchFrames = 8;
  RISORIUS_INLINE static Reg zero() { return _mm512_setzero_ps(); }
  RISORIUS_INLINE static Reg set(float v) { return _mm512_set1_ps(v); }
  RISORIUS_INLINE static Reg load(const float* p) { return _mm512_loadu_ps(p); }
  RISORIUS_INLINE static Reg load(const std::uint16_t* p) {
    // With a mask: gcc 12 takes the plain one for a read of something unset.
    return _mm512_maskz_cvtph_ps(0xFFFF, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)));
  }
  RISORIUS_INLINE static void store(float* p, Reg v) { _mm512_storeu_ps(p, v); }
  RISORIUS_INLINE static Reg madd(Reg a, Reg b, Reg sum) { return _mm512_fmadd_ps(a, b, sum); }
  using Order = std::uint32_t;
  RISORIUS_INLINE static Order order(std::uint32_t mask) { return mask; }
  RISORIUS_INLINE static void expand(const float* from, std::uint32_t mask, float* to) {
    store(to, _mm512_maskz_expand_ps(static_cast<__mmask16>(mask), load(from)));
  }
  RISORIUS_INLINE static void expand_more(const float* from, std::uint32_t mask, float* to) {
    const auto places = static_cast<__mmask16>(mask);
    _mm512_mask_storeu_ps(to, places, _mm512_maskz_expand_ps(places, load(from)));
  }
  // Where many frames have the same order: which value each place takes is found once, and to
  // permute takes half as long as to expand.
  struct Orders {
    __mmask16 places;
    __m512i values;
  };
  RISORIUS_INLINE static Orders orders(std::uint32_t mask) {
    const auto places = static_cast<__mmask16>(mask);
    const __m512i all = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    return {places, _mm512_maskz_expand_epi32(places, all)};
  }
  RISORIUS_INLINE static void expand(const float* from, const Orders& order, float* to) {
    store(to, _mm512_maskz_permutexvar_ps(order.places, order.values, load(from)));
  }
  RISORIUS_INLINE static void expand_more(const float* from, const Orders& order, float* to) {
    _mm512_mask_storeu_ps(to, order.places,
                          _mm512_maskz_permutexvar_ps(order.places, order.values, load(from)));
  }
};

}  // namespace

}  // namespace risorius::simd

#include "simd/kernels_body.h"

namespace risorius::simd {

const Kernels* avx512_kernels() {
  static constexpr Kernels kernels = make_kernels("avx512", {.floats = 6, .halves = 6});
  static const bool supported = cpu_has_avx512();
  return supported ? &kernels : nullptr;
}

}  // namespace risorius::simd

#else

namespace risorius::simd {

const Kernels* avx512_kernels() { return nullptr; }

}  // namespace risorius::simd

#endif
