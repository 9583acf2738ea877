// SPDX-License-Identifier: MIT
// Splits Euler angles into one array for each axis, and joins arrays of quaternion components, with
// AVX2. Include it after RISORIUS_TARGET.
#pragma once

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "simd/kernels_inline.h"
#include "simd/rotations_body.h"

namespace risorius::simd {

namespace {

// Like OneByOne of rotations_body.h, but copies eight rotations together; the registers have the
// fifth to eighth in their upper halves. The function for the sines then loads exactly these
// registers; loads that span two stores of half a register would have to wait for both. split also
// reads the float after the three angles, where join writes w.
struct EightByFour {
  // Transposes the registers in each half: lane i of r[k] becomes lane k of r[i].
  RISORIUS_INLINE static void transpose(__m256 (&r)[4]) {
    const __m256 a = _mm256_unpacklo_ps(r[0], r[1]), b = _mm256_unpackhi_ps(r[0], r[1]),
                 c = _mm256_unpacklo_ps(r[2], r[3]), d = _mm256_unpackhi_ps(r[2], r[3]);
    r[0] = _mm256_shuffle_ps(a, c, _MM_SHUFFLE(1, 0, 1, 0));
    r[1] = _mm256_shuffle_ps(a, c, _MM_SHUFFLE(3, 2, 3, 2));
    r[2] = _mm256_shuffle_ps(b, d, _MM_SHUFFLE(1, 0, 1, 0));
    r[3] = _mm256_shuffle_ps(b, d, _MM_SHUFFLE(3, 2, 3, 2));
  }
  RISORIUS_INLINE static void split(const float* rotations, const std::uint32_t* at,
                                    Turns (&angles)[3]) {
    for (std::size_t l = 0; l < kTurns; l += 8) {
      __m256 r[4];
      for (std::size_t i = 0; i < 4; ++i) {
        const __m128 low = _mm_loadu_ps(rotations + at[l + i]);
        const __m128 high = _mm_loadu_ps(rotations + at[l + 4 + i]);
        r[i] = _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
      }
      transpose(r);
      for (std::size_t a = 0; a < 3; ++a) _mm256_store_ps(&angles[a][l], r[a]);
    }
  }
  RISORIUS_INLINE static void join(const Turns* const (&parts)[4], float* rotations,
                                   const std::uint32_t* at) {
    for (std::size_t l = 0; l < kTurns; l += 8) {
      __m256 r[4];
      for (std::size_t k = 0; k < 4; ++k) r[k] = _mm256_load_ps(&(*parts[k])[l]);
      transpose(r);
      for (std::size_t i = 0; i < 4; ++i) {
        _mm_storeu_ps(rotations + at[l + i], _mm256_castps256_ps128(r[i]));
        _mm_storeu_ps(rotations + at[l + 4 + i], _mm256_extractf128_ps(r[i], 1));
      }
    }
  }
  // Whether an angle exceeds a positive limit (given by its bits), or is infinite or NaN, as in
  // OneByOne::any_beyond, but one instruction collects the sign bits of all lanes.
  RISORIUS_INLINE static bool any_beyond(const Angles& x, std::uint32_t limit) {
    const __m256i most = _mm256_set1_epi32(static_cast<int>(limit)),
                  all_but_sign = _mm256_set1_epi32(0x7FFFFFFF);
    __m256i beyond = _mm256_setzero_si256();
    for (std::size_t l = 0; l < kAngles; l += 8) {
      const __m256i bits = _mm256_castps_si256(_mm256_load_ps(&x[l]));
      beyond =
          _mm256_or_si256(beyond, _mm256_sub_epi32(most, _mm256_and_si256(bits, all_but_sign)));
    }
    return _mm256_movemask_ps(_mm256_castsi256_ps(beyond)) != 0;
  }
};

}  // namespace

}  // namespace risorius::simd
