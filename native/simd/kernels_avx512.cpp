// SPDX-License-Identifier: MIT
// The kernels for AVX-512: instructions for the loops of kernels_body.h, rotations_body.h and
// skin_body.h, on registers of 16 floats, one in each lane. A piece copies consecutive values to
// the places of a block of 16 places whose bit is set in the mask of the piece.
#include "simd/kernels.h"

#if defined(__x86_64__) || defined(_M_X64)
#include <immintrin.h>

#if defined(_MSC_VER) && !defined(__clang__)
#define RISORIUS_TARGET
#else
#define RISORIUS_TARGET __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,fma,f16c")))
#endif
#include "simd/kernels_inline.h"
#include "simd/rotations_body.h"
#include "simd/skin_body.h"

namespace risorius::simd {

namespace {

// Copies Euler angles from memory to an array for each axis (split) and quaternion components back
// (join), like OneByOne of rotations_body.h, but sixteen rotations together, four in a register.
// The function for the sines then loads exactly these registers; loads that span two stores of half
// a register would have to wait for both. split also reads the float after the three angles, where
// join writes w.
struct SixteenByFour {
  static_assert(kTurns == 16);
  // Intrinsics with masks are used, because gcc 12 warns about reads of unset values in intrinsics
  // without masks.
  static constexpr __mmask16 kAll = 0xFFFF;
  static constexpr __mmask8 kFour = 0xF;
  // Transposes the registers in each quarter: lane i of r[k] becomes lane k of r[i].
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
  RISORIUS_INLINE static void split(const float* rotations, const std::uint32_t* at,
                                    Turns (&angles)[3]) {
    __m512 r[4];
    for (std::size_t i = 0; i < 4; ++i) {
      const auto four = [&](std::size_t l) { return _mm_loadu_ps(rotations + at[l]); };
      r[i] = _mm512_castps128_ps512(four(i));
      r[i] = _mm512_maskz_insertf32x4(kAll, r[i], four(i + 4), 1);
      r[i] = _mm512_maskz_insertf32x4(kAll, r[i], four(i + 8), 2);
      r[i] = _mm512_maskz_insertf32x4(kAll, r[i], four(i + 12), 3);
    }
    transpose(r);
    for (std::size_t a = 0; a < 3; ++a) _mm512_store_ps(angles[a], r[a]);
  }
  RISORIUS_INLINE static void join(const Turns* const (&parts)[4], float* rotations,
                                   const std::uint32_t* at) {
    __m512 r[4];
    for (std::size_t k = 0; k < 4; ++k) r[k] = _mm512_load_ps(*parts[k]);
    transpose(r);
    for (std::size_t i = 0; i < 4; ++i) {
      _mm_storeu_ps(rotations + at[i], _mm512_maskz_extractf32x4_ps(kFour, r[i], 0));
      _mm_storeu_ps(rotations + at[i + 4], _mm512_maskz_extractf32x4_ps(kFour, r[i], 1));
      _mm_storeu_ps(rotations + at[i + 8], _mm512_maskz_extractf32x4_ps(kFour, r[i], 2));
      _mm_storeu_ps(rotations + at[i + 12], _mm512_maskz_extractf32x4_ps(kFour, r[i], 3));
    }
  }
  // Whether an angle exceeds a positive limit (given by its bits), or is infinite or NaN, as in
  // OneByOne::any_beyond, but one instruction collects the sign bits of all lanes.
  RISORIUS_INLINE static bool any_beyond(const Angles& x, std::uint32_t limit) {
    const __m512i most = _mm512_set1_epi32(static_cast<int>(limit)),
                  all_but_sign = _mm512_set1_epi32(0x7FFFFFFF);
    __m512i beyond = _mm512_setzero_si512();
    for (std::size_t l = 0; l < kAngles; l += 16) {
      const __m512i bits = _mm512_castps_si512(_mm512_load_ps(&x[l]));
      beyond =
          _mm512_or_si512(beyond, _mm512_sub_epi32(most, _mm512_and_si512(bits, all_but_sign)));
    }
    return _mm512_movepi32_mask(beyond) != 0;
  }
};

// Sums weighted matrices, with all columns of the matrix in one register. Each vertex has two sums:
// an addition takes four cycles, so that four vertices with one sum each would allow only one
// addition per cycle. Intrinsics with masks are used, because gcc 12 warns about reads of unset
// values in intrinsics without masks.
struct AllColumns {
  static constexpr __mmask16 kAll = 0xFFFF;
  static constexpr __mmask8 kThree = 7, kFour = 0xF, kEight = 0xFF;
  static constexpr std::size_t kTogether = 4;
  struct Sum {
    __m512 even, odd;
    RISORIUS_INLINE __m512 whole() const { return _mm512_add_ps(even, odd); }
  };
  using Weights = __m512;
  RISORIUS_INLINE static Sum zero() { return {_mm512_setzero_ps(), _mm512_setzero_ps()}; }
  RISORIUS_INLINE static __m512 weights(const float* p) {
    return _mm512_maskz_broadcast_f32x4(kAll, _mm_loadu_ps(p));
  }
  template <std::size_t kWeight>
  RISORIUS_INLINE static void add(Sum& sum, __m512 weights, const float* row) {
    const __m512 w = _mm512_maskz_permute_ps(kAll, weights, kWeight * 0x55);
    __m512& part = kWeight % 2 == 0 ? sum.even : sum.odd;
    part = _mm512_fmadd_ps(w, _mm512_load_ps(row), part);
  }
  RISORIUS_INLINE static void finish(const Sum& sum, const float* point, float* out) {
    const __m128 p = _mm_maskz_loadu_ps(kThree, point);
    const __m512 with_1 =
        _mm512_maskz_broadcast_f32x4(kAll, _mm_insert_ps(p, _mm_set_ss(1.0f), 0x30));
    const __m512i column = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
    const __m512 products =
        _mm512_mul_ps(sum.whole(), _mm512_maskz_permutexvar_ps(kAll, column, with_1));
    const __m256 two = _mm256_add_ps(_mm512_maskz_extractf32x8_ps(kEight, products, 0),
                                     _mm512_maskz_extractf32x8_ps(kEight, products, 1));
    const __m128 one =
        _mm_add_ps(_mm256_castps256_ps128(two), _mm256_maskz_extractf32x4_ps(kFour, two, 1));
    _mm_mask_storeu_ps(out, kThree, _mm_add_ps(p, one));
  }
  // Products of the matrix's columns with the coordinates x y z 1 of point kVertex, one column in
  // each quarter.
  // In: four  the twelve coordinates of four points, then 1
  template <int kVertex>
  RISORIUS_INLINE static __m512 products(const Sum& sum, __m512 four) {
    constexpr int x = 3 * kVertex, y = x + 1, z = x + 2, w = 12;
    const __m512i column = _mm512_setr_epi32(x, x, x, x, y, y, y, y, z, z, z, z, w, w, w, w);
    return _mm512_mul_ps(sum.whole(), _mm512_maskz_permutexvar_ps(kAll, column, four));
  }
  // The four quarters of the result: a's first plus a's third quarter, a's second plus a's fourth,
  // and the same two sums of b.
  RISORIUS_INLINE static __m512 halves(__m512 a, __m512 b) {
    return _mm512_add_ps(_mm512_maskz_shuffle_f32x4(kAll, a, b, 0x44),
                         _mm512_maskz_shuffle_f32x4(kAll, a, b, 0xEE));
  }
  // Writes the moved points of four consecutive vertices, 12 floats. A masked read would be slower
  // than the two reads; a masked write is not slower.
  RISORIUS_INLINE static void finish_four(const Sum* sums, const float* points, float* out) {
    const __m256 last = _mm256_insertf128_ps(_mm256_set1_ps(1.0f), _mm_loadu_ps(points + 8), 0);
    const __m512 first = _mm512_maskz_broadcast_f32x8(kAll, _mm256_loadu_ps(points));
    const __m512 four = _mm512_maskz_insertf32x8(kAll, first, last, 1);
    const __m512 ab = halves(products<0>(sums[0], four), products<1>(sums[1], four)),
                 cd = halves(products<2>(sums[2], four), products<3>(sums[3], four));
    const __m512 by = _mm512_add_ps(_mm512_maskz_shuffle_f32x4(kAll, ab, cd, 0x88),
                                    _mm512_maskz_shuffle_f32x4(kAll, ab, cd, 0xDD));
    const __m512i close = _mm512_setr_epi32(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, 3, 3, 3, 3);
    const __m512 moved = _mm512_add_ps(four, _mm512_maskz_permutexvar_ps(kAll, close, by));
    _mm512_mask_storeu_ps(out, 0xFFF, moved);
  }
  RISORIUS_INLINE static void pack(const float* matrix, float* row) { pack_columns(matrix, row); }
};

struct V {
  using Parts = SixteenByFour;
  using Skin = AllColumns;
  using Reg = __m512;
  static constexpr std::size_t kLanes = 16, kBlocks = 8, kBatchBlocks = 3;
  static constexpr int kBatchFrames = 8;
  RISORIUS_INLINE static Reg zero() { return _mm512_setzero_ps(); }
  RISORIUS_INLINE static Reg set(float v) { return _mm512_set1_ps(v); }
  RISORIUS_INLINE static Reg load(const float* p) { return _mm512_loadu_ps(p); }
  RISORIUS_INLINE static Reg load(const std::uint16_t* p) {
    // The intrinsic with a mask is used, because gcc 12 warns about a read of unset values in the
    // intrinsic without a mask.
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
  // A decoded mask, used if a piece is placed in several frames: the index of each place's value is
  // found once, and a permutation takes half the time of an expansion.
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
