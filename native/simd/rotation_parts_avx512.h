// SPDX-License-Identifier: MIT
// Rotations into arrays of their parts and back by AVX-512. After RISORIUS_TARGET.
#pragma once

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "simd/kernels_inline.h"
#include "simd/rotations_body.h"

namespace risorius::simd {

namespace {

// Sixteen rotations at a time, four to a register: what is stored here is what the sines load,
// which would have to wait for two stores of half a register. The fourth number of each rotation is
// read, and written, with the others.
struct SixteenByFour {
  static_assert(kTurns == 16);
  // With masks: gcc 12 takes the plain ones for reads of something unset.
  static constexpr __mmask16 kAll = 0xFFFF;
  static constexpr __mmask8 kFour = 0xF;
  // Of each quarter: r[k] lane i becomes r[i] lane k.
  RISORIUS_INLINE static void transpose(__m512 (&r)[4]) {
    const __m512 a = _mm512_maskz_unpacklo_ps(kAll, r[0], r[1]),
                 b = _mm512_maskz_unpackhi_ps(kAll, r[0], r[1]),
                 c = _mm512_maskz_unpacklo_ps(kAll, r[2], r[3]),
                 d = _mm512_maskz_unpackhi_ps(kAll, r[2], r[3]);
    r[0] = _mm512_maskz_shuffle_ps(kAll, a, c, _MM_SHUFFLE(1, 0, 1, 0));
    r[1] = _mm512_maskz_shuffle_ps(kAll, a, c, _MM_SHUFFLE(3, 2, 3, 2));
    r[2] = _mm512_maskz_shuffle_ps(kAll, b, d, _MM_SHUFFLE(1, 0, 1, 0));
    r[3] = _mm512_maskz_shuffle_ps(kAll, b, d, _MM_SHUFFLE(3, 2, 3, 2));
  }
  RISORIUS_INLINE static void split(const float* rotations, std::size_t stride,
                                    const std::uint16_t* which, Turns (&angles)[3]) {
    __m512 r[4];
    for (std::size_t i = 0; i < 4; ++i) {
      const auto four = [&](std::size_t l) { return _mm_loadu_ps(rotations + which[l] * stride); };
      r[i] = _mm512_castps128_ps512(four(i));
      r[i] = _mm512_maskz_insertf32x4(kAll, r[i], four(i + 4), 1);
      r[i] = _mm512_maskz_insertf32x4(kAll, r[i], four(i + 8), 2);
      r[i] = _mm512_maskz_insertf32x4(kAll, r[i], four(i + 12), 3);
    }
    transpose(r);
    for (std::size_t a = 0; a < 3; ++a) _mm512_store_ps(angles[a], r[a]);
  }
  RISORIUS_INLINE static void join(const Turns* const (&parts)[4], float* rotations,
                                   std::size_t stride, const std::uint16_t* which) {
    __m512 r[4];
    for (std::size_t k = 0; k < 4; ++k) r[k] = _mm512_load_ps(*parts[k]);
    transpose(r);
    for (std::size_t i = 0; i < 4; ++i) {
      _mm_storeu_ps(rotations + which[i] * stride, _mm512_maskz_extractf32x4_ps(kFour, r[i], 0));
      _mm_storeu_ps(rotations + which[i + 4] * stride,
                    _mm512_maskz_extractf32x4_ps(kFour, r[i], 1));
      _mm_storeu_ps(rotations + which[i + 8] * stride,
                    _mm512_maskz_extractf32x4_ps(kFour, r[i], 2));
      _mm_storeu_ps(rotations + which[i + 12] * stride,
                    _mm512_maskz_extractf32x4_ps(kFour, r[i], 3));
    }
  }
};

}  // namespace

}  // namespace risorius::simd
