// SPDX-License-Identifier: MIT
// Four rows of four floats as four columns, by what every CPU of the platform has.
#pragma once

#include <cstddef>

#if defined(__x86_64__) || defined(_M_X64)
#include <immintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#endif

namespace risorius::simd {

/// In:  from  4 numbers at each of from, from + stride, from + 2 stride and from + 3 stride
/// Out: a, b, c, d  4 numbers each: the first, second, third and fourth of these
inline void turn_four(const float* from, std::size_t stride, float* a, float* b, float* c,
                      float* d) {
#if defined(__x86_64__) || defined(_M_X64)
  __m128 r0 = _mm_loadu_ps(from), r1 = _mm_loadu_ps(from + stride),
         r2 = _mm_loadu_ps(from + 2 * stride), r3 = _mm_loadu_ps(from + 3 * stride);
  _MM_TRANSPOSE4_PS(r0, r1, r2, r3);
  _mm_storeu_ps(a, r0), _mm_storeu_ps(b, r1), _mm_storeu_ps(c, r2), _mm_storeu_ps(d, r3);
#elif defined(__ARM_NEON)
  const float32x4x2_t low = vtrnq_f32(vld1q_f32(from), vld1q_f32(from + stride)),
                      high = vtrnq_f32(vld1q_f32(from + 2 * stride), vld1q_f32(from + 3 * stride));
  vst1q_f32(a, vcombine_f32(vget_low_f32(low.val[0]), vget_low_f32(high.val[0])));
  vst1q_f32(b, vcombine_f32(vget_low_f32(low.val[1]), vget_low_f32(high.val[1])));
  vst1q_f32(c, vcombine_f32(vget_high_f32(low.val[0]), vget_high_f32(high.val[0])));
  vst1q_f32(d, vcombine_f32(vget_high_f32(low.val[1]), vget_high_f32(high.val[1])));
#else
  for (std::size_t r = 0; r < 4; ++r, from += stride) {
    a[r] = from[0], b[r] = from[1], c[r] = from[2], d[r] = from[3];
  }
#endif
}

}  // namespace risorius::simd
