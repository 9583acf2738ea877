// SPDX-License-Identifier: MIT
// Four floats at a time, with instructions that every CPU of the platform has.
#pragma once

#include <cstddef>

#if defined(__x86_64__) || defined(_M_X64)
#include <immintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#endif

namespace risorius::simd {

/// Four float32, on x86-64 and ARM in one register. If one of the four numbers is NaN, the result
/// of an operation with this number is NaN. This includes at_least and at_most, whose limit must
/// not be NaN.
#if defined(__x86_64__) || defined(_M_X64)
struct Four {
  __m128 v;
  static Four load(const float* p) { return {_mm_loadu_ps(p)}; }
  static Four all(float x) { return {_mm_set1_ps(x)}; }
  void store(float* p) const { _mm_storeu_ps(p, v); }
  Four operator*(Four o) const { return {_mm_mul_ps(v, o.v)}; }
  Four operator+(Four o) const { return {_mm_add_ps(v, o.v)}; }
  // These instructions return the second operand if one is NaN. Therefore v must be second.
  Four at_least(float x) const { return {_mm_max_ps(_mm_set1_ps(x), v)}; }
  Four at_most(float x) const { return {_mm_min_ps(_mm_set1_ps(x), v)}; }
  bool any_but_0() const { return _mm_movemask_ps(_mm_cmpneq_ps(v, _mm_setzero_ps())) != 0; }
  bool any_nan() const { return _mm_movemask_ps(_mm_cmpunord_ps(v, v)) != 0; }
};
#elif defined(__ARM_NEON)
struct Four {
  float32x4_t v;
  static Four load(const float* p) { return {vld1q_f32(p)}; }
  static Four all(float x) { return {vdupq_n_f32(x)}; }
  void store(float* p) const { vst1q_f32(p, v); }
  Four operator*(Four o) const { return {vmulq_f32(v, o.v)}; }
  Four operator+(Four o) const { return {vaddq_f32(v, o.v)}; }
  Four at_least(float x) const { return {vmaxq_f32(vdupq_n_f32(x), v)}; }
  Four at_most(float x) const { return {vminq_f32(vdupq_n_f32(x), v)}; }
  bool any_but_0() const { return vminvq_u32(vceqzq_f32(v)) == 0; }
  bool any_nan() const { return vminvq_u32(vceqq_f32(v, v)) == 0; }
};
#else
struct Four {
  float v[4];
  static Four load(const float* p) { return {{p[0], p[1], p[2], p[3]}}; }
  static Four all(float x) { return {{x, x, x, x}}; }
  void store(float* p) const {
    for (std::size_t i = 0; i < 4; ++i) p[i] = v[i];
  }
  template <class F>
  Four each(F f) const {
    return {{f(v[0], 0), f(v[1], 1), f(v[2], 2), f(v[3], 3)}};
  }
  Four operator*(Four o) const {
    return each([&](float x, std::size_t i) { return x * o.v[i]; });
  }
  Four operator+(Four o) const {
    return each([&](float x, std::size_t i) { return x + o.v[i]; });
  }
  Four at_least(float limit) const {
    return each([&](float x, std::size_t) { return x < limit ? limit : x; });
  }
  Four at_most(float limit) const {
    return each([&](float x, std::size_t) { return x > limit ? limit : x; });
  }
  bool any_but_0() const { return v[0] != 0 || v[1] != 0 || v[2] != 0 || v[3] != 0; }
  bool any_nan() const { return v[0] != v[0] || v[1] != v[1] || v[2] != v[2] || v[3] != v[3]; }
};
#endif

/// Transposes four rows of four numbers.
/// In:  from  rows of 4 numbers at from, from + stride, from + 2 stride and from + 3 stride
/// Out: a, b, c, d  4 numbers each: the first, second, third and fourth number of each row
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
