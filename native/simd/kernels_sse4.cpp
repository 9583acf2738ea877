// SPDX-License-Identifier: MIT
// The kernels for SSE4.1: instructions for the loops of kernels_body.h, rotations_body.h and
// skin_body.h, on registers of four floats, one in each lane. The results have the same bits as the
// results of the scalar kernels.
#include <bit>

#include "simd/kernels.h"

#if defined(__x86_64__) || defined(_M_X64)
#include <immintrin.h>

#if defined(_MSC_VER) && !defined(__clang__)
#define RISORIUS_TARGET
#else
#define RISORIUS_TARGET __attribute__((target("sse4.1")))
#endif
#include "simd/kernels_inline.h"
#include "simd/rotations_body.h"
#include "simd/skin_body.h"

namespace risorius::simd {

namespace {

// Copies Euler angles from memory to an array for each axis (split) and quaternion components back
// (join), like OneByOne of rotations_body.h, but four rotations together. split also reads the
// float after the three angles, where join writes w.
struct FourByFour {
  RISORIUS_INLINE static void split(const float* rotations, const std::uint32_t* at,
                                    Turns (&angles)[3]) {
    for (std::size_t l = 0; l < kTurns; l += 4) {
      __m128 r[4];
      for (std::size_t i = 0; i < 4; ++i) r[i] = _mm_loadu_ps(rotations + at[l + i]);
      _MM_TRANSPOSE4_PS(r[0], r[1], r[2], r[3]);
      for (std::size_t a = 0; a < 3; ++a) _mm_store_ps(&angles[a][l], r[a]);
    }
  }
  RISORIUS_INLINE static void join(const Turns* const (&parts)[4], float* rotations,
                                   const std::uint32_t* at) {
    for (std::size_t l = 0; l < kTurns; l += 4) {
      __m128 r[4];
      for (std::size_t k = 0; k < 4; ++k) r[k] = _mm_load_ps(&(*parts[k])[l]);
      _MM_TRANSPOSE4_PS(r[0], r[1], r[2], r[3]);
      for (std::size_t i = 0; i < 4; ++i) _mm_storeu_ps(rotations + at[l + i], r[i]);
    }
  }
  // Whether an angle exceeds a positive limit (given by its bits), or is infinite or NaN, as in
  // OneByOne::any_beyond, but one instruction collects the sign bits of all lanes.
  RISORIUS_INLINE static bool any_beyond(const Angles& x, std::uint32_t limit) {
    const __m128i most = _mm_set1_epi32(static_cast<int>(limit)),
                  all_but_sign = _mm_set1_epi32(0x7FFFFFFF);
    __m128i beyond = _mm_setzero_si128();
    for (std::size_t l = 0; l < kAngles; l += 4) {
      const __m128i bits = _mm_castps_si128(_mm_load_ps(&x[l]));
      beyond = _mm_or_si128(beyond, _mm_sub_epi32(most, _mm_and_si128(bits, all_but_sign)));
    }
    return _mm_movemask_ps(_mm_castsi128_ps(beyond)) != 0;
  }
};

// Sums weighted matrices, with one row of the matrix in each register.
struct RowsOfFour {
  struct Sum {
    __m128 r[3];
  };
  using Weights = __m128;
  static constexpr std::size_t kTogether = 2;
  RISORIUS_INLINE static Sum zero() {
    return {{_mm_setzero_ps(), _mm_setzero_ps(), _mm_setzero_ps()}};
  }
  RISORIUS_INLINE static __m128 weights(const float* p) { return _mm_loadu_ps(p); }
  template <std::size_t kWeight>
  RISORIUS_INLINE static void add(Sum& sum, __m128 weights, const float* row) {
    const __m128 w = _mm_shuffle_ps(weights, weights, kWeight * 0x55);
    sum.r[0] = _mm_add_ps(sum.r[0], _mm_mul_ps(w, _mm_load_ps(row)));
    sum.r[1] = _mm_add_ps(sum.r[1], _mm_mul_ps(w, _mm_load_ps(row + 4)));
    sum.r[2] = _mm_add_ps(sum.r[2], _mm_mul_ps(w, _mm_load_ps(row + 8)));
  }
  RISORIUS_INLINE static void finish(const Sum& sum, const float* point, float* out) {
    const __m128 p = _mm_setr_ps(point[0], point[1], point[2], 1.0f);
    const __m128 xy = _mm_hadd_ps(_mm_mul_ps(sum.r[0], p), _mm_mul_ps(sum.r[1], p)),
                 z = _mm_mul_ps(sum.r[2], p);
    const __m128 moved = _mm_add_ps(p, _mm_hadd_ps(xy, _mm_hadd_ps(z, z)));
    _mm_storel_pi(reinterpret_cast<__m64*>(out), moved);
    _mm_store_ss(out + 2, _mm_movehl_ps(moved, moved));
  }
  RISORIUS_INLINE static void pack(const float* matrix, float* row) { pack_rows(matrix, row); }
};

// The vectors of kernels_body.h. madd() rounds the product and the sum separately, as the scalar
// functions do, so that the bits are the same.
struct V {
  using Parts = FourByFour;
  using Skin = RowsOfFour;
  using Reg = __m128;
  static constexpr std::size_t kLanes = 4, kBlocks = 12, kBatchBlocks = 3;
  static constexpr int kBatchFrames = 4;
  RISORIUS_INLINE static Reg zero() { return _mm_setzero_ps(); }
  RISORIUS_INLINE static Reg set(float v) { return _mm_set1_ps(v); }
  RISORIUS_INLINE static Reg load(const float* p) { return _mm_loadu_ps(p); }
  RISORIUS_INLINE static Reg load(const std::uint16_t* p) {  // from_half of half.h
    const __m128i half = _mm_cvtepu16_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)));
    const __m128i bits = _mm_slli_epi32(_mm_and_si128(half, _mm_set1_epi32(0x7FFF)), 13);
    const __m128 magnitude = _mm_mul_ps(_mm_castsi128_ps(bits), _mm_set1_ps(0x1p112f));
    const __m128i sign = _mm_slli_epi32(_mm_and_si128(half, _mm_set1_epi32(0x8000)), 16);
    return _mm_or_ps(magnitude, _mm_castsi128_ps(sign));
  }
  RISORIUS_INLINE static void store(float* p, Reg v) { _mm_storeu_ps(p, v); }
  RISORIUS_INLINE static Reg madd(Reg a, Reg b, Reg sum) {
    return _mm_add_ps(sum, _mm_mul_ps(a, b));
  }
  using Order = std::uint32_t;
  RISORIUS_INLINE static Order order(std::uint32_t mask) { return mask; }
  RISORIUS_INLINE static void expand(const float* from, std::uint32_t mask, float* to) {
    for (std::size_t q = 0; q < 4; ++q, mask >>= 4) {
      const __m128i order =
          _mm_loadu_si128(reinterpret_cast<const __m128i*>(kExpandBytes[mask & 15u].data()));
      store(to + 4 * q, _mm_castsi128_ps(_mm_shuffle_epi8(_mm_castps_si128(load(from)), order)));
      from += std::popcount(mask & 15u);
    }
  }
  RISORIUS_INLINE static void expand_more(const float* from, std::uint32_t mask, float* to) {
    place_bits(from, mask, to);
  }
};

}  // namespace

}  // namespace risorius::simd

#include "simd/kernels_body.h"

namespace risorius::simd {

const Kernels* sse4_kernels() {
  static constexpr Kernels kernels = make_kernels("sse4");
  static const bool supported = cpu_has_sse4();
  return supported ? &kernels : nullptr;
}

}  // namespace risorius::simd

#else

namespace risorius::simd {

const Kernels* sse4_kernels() { return nullptr; }

}  // namespace risorius::simd

#endif
