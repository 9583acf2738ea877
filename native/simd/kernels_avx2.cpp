// SPDX-License-Identifier: MIT
// The kernels for AVX2 with FMA and F16C: instructions for the loops of kernels_body.h and
// skin_body.h, on registers of eight floats, one in each lane. A piece copies consecutive values to
// the places of a block of 16 places whose bit is set in the mask of the piece.
#include <array>
#include <bit>

#include "simd/kernels.h"

#if defined(__x86_64__) || defined(_M_X64)
#include <immintrin.h>

#if defined(_MSC_VER) && !defined(__clang__)
#define RISORIUS_TARGET
#else
#define RISORIUS_TARGET __attribute__((target("avx2,fma,f16c")))
#endif
#include "simd/kernels_inline.h"
#include "simd/rotation_parts_avx2.h"
#include "simd/skin_body.h"

namespace risorius::simd {

namespace {

// For each mask of eight places, an entry for each place: the index of the value that the place
// gets, with bit 7 set, or 0 if the place gets none. The shuffle uses only the lowest three bits,
// the blend only the highest.
constexpr auto kExpandOrders = [] {
  std::array<std::array<std::uint8_t, 8>, 256> orders{};
  for (std::size_t mask = 0; mask < 256; ++mask) {
    std::uint8_t next = 0x80;
    for (std::size_t p = 0; p < 8; ++p) {
      if (((mask >> p) & 1u) != 0) orders[mask][p] = next++;
    }
  }
  return orders;
}();

// Sums weighted matrices, with two columns of the matrix in each register.
struct ColumnsByTwo {
  struct Sum {
    __m256 c[2];
  };
  using Weights = __m256;
  static constexpr std::size_t kTogether = 4;
  RISORIUS_INLINE static Sum zero() { return {{_mm256_setzero_ps(), _mm256_setzero_ps()}}; }
  RISORIUS_INLINE static __m256 weights(const float* p) {
    return _mm256_broadcast_ps(reinterpret_cast<const __m128*>(p));
  }
  template <std::size_t kWeight>
  RISORIUS_INLINE static void add(Sum& sum, __m256 weights, const float* row) {
    const __m256 w = _mm256_permute_ps(weights, kWeight * 0x55);
    sum.c[0] = _mm256_fmadd_ps(w, _mm256_load_ps(row), sum.c[0]);
    sum.c[1] = _mm256_fmadd_ps(w, _mm256_load_ps(row + 8), sum.c[1]);
  }
  RISORIUS_INLINE static void finish(const Sum& sum, const float* point, float* out) {
    const __m256 first = _mm256_insertf128_ps(_mm256_broadcast_ss(point),
                                              _mm_broadcast_ss(point + 1), 1),
                 second =
                     _mm256_insertf128_ps(_mm256_broadcast_ss(point + 2), _mm_set1_ps(1.0f), 1);
    const __m256 both = _mm256_fmadd_ps(sum.c[0], first, _mm256_mul_ps(sum.c[1], second));
    const __m128 by = _mm_add_ps(_mm256_castps256_ps128(both), _mm256_extractf128_ps(both, 1));
    const __m128 p = _mm_setr_ps(point[0], point[1], point[2], 0.0f);
    const __m128 moved = _mm_add_ps(p, by);
    _mm_storel_pi(reinterpret_cast<__m64*>(out), moved);
    _mm_store_ss(out + 2, _mm_movehl_ps(moved, moved));
  }
  // Products of the matrix's columns with the coordinates x y z 1 of a point: column 0 * x + column
  // 2 * z in the lower half, column 1 * y + column 3 in the upper half.
  // In: numbers  four numbers, of which three from kFirst on are the point
  template <int kFirst>
  RISORIUS_INLINE static __m256 products(const Sum& sum, const float* numbers) {
    constexpr int x = kFirst, y = x + 1, z = x + 2;
    const __m256 both = _mm256_broadcast_ps(reinterpret_cast<const __m128*>(numbers));
    const __m256 first = _mm256_permutevar_ps(both, _mm256_setr_epi32(x, x, x, x, y, y, y, y)),
                 second =
                     _mm256_blend_ps(_mm256_permute_ps(both, z * 0x55), _mm256_set1_ps(1.0f), 0xF0);
    return _mm256_fmadd_ps(sum.c[0], first, _mm256_mul_ps(sum.c[1], second));
  }
  // Writes the moved points of four consecutive vertices, 12 floats.
  RISORIUS_INLINE static void finish_four(const Sum* sums, const float* points, float* out) {
    const __m256 a = products<0>(sums[0], points), b = products<0>(sums[1], points + 3),
                 c = products<0>(sums[2], points + 6), d = products<1>(sums[3], points + 8);
    const __m256 ab = _mm256_add_ps(_mm256_permute2f128_ps(a, b, 0x20),
                                    _mm256_permute2f128_ps(a, b, 0x31)),
                 cd = _mm256_add_ps(_mm256_permute2f128_ps(c, d, 0x20),
                                    _mm256_permute2f128_ps(c, d, 0x31));
    const __m128 by_a = _mm256_castps256_ps128(ab), by_b = _mm256_extractf128_ps(ab, 1),
                 by_c = _mm256_castps256_ps128(cd), by_d = _mm256_extractf128_ps(cd, 1);
    const __m128 by[3] = {
        _mm_insert_ps(by_a, by_b, 0x30), _mm_shuffle_ps(by_b, by_c, _MM_SHUFFLE(1, 0, 2, 1)),
        _mm_blend_ps(_mm_permute_ps(by_d, _MM_SHUFFLE(2, 1, 0, 0)), _mm_permute_ps(by_c, 0xAA), 1)};
    __m128 moved[3];
    for (std::size_t i = 0; i < 3; ++i) moved[i] = _mm_add_ps(_mm_loadu_ps(points + 4 * i), by[i]);
    for (std::size_t i = 0; i < 3; ++i) _mm_storeu_ps(out + 4 * i, moved[i]);
  }
  RISORIUS_INLINE static void pack(const float* matrix, float* row) { pack_columns(matrix, row); }
};

struct V {
  using Parts = EightByFour;
  using Skin = ColumnsByTwo;
  using Reg = __m256;
  static constexpr std::size_t kLanes = 8, kBlocks = 12, kBatchBlocks = 3;
  static constexpr int kBatchFrames = 4;
  RISORIUS_INLINE static Reg zero() { return _mm256_setzero_ps(); }
  // Batches need all sixteen registers: twelve for sums, three for rows, one for a weight. Without
  // the empty asm statement Clang 22 loads the next weight too early, and moves sums to memory in
  // the innermost loop.
  RISORIUS_INLINE static Reg set(float v) {
    Reg all = _mm256_set1_ps(v);
#if defined(__GNUC__)
    __asm__ volatile("" : "+x"(all));
#endif
    return all;
  }
  RISORIUS_INLINE static Reg load(const float* p) { return _mm256_loadu_ps(p); }
  RISORIUS_INLINE static Reg load(const std::uint16_t* p) {
    return _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
  }
  RISORIUS_INLINE static void store(float* p, Reg v) { _mm256_storeu_ps(p, v); }
  RISORIUS_INLINE static Reg madd(Reg a, Reg b, Reg sum) { return _mm256_fmadd_ps(a, b, sum); }
  // Half of a piece, eight places. order: an entry of kExpandOrders; from: the number of the
  // piece's values that go to earlier places; any: whether a place of this half gets a value.
  struct Half {
    __m256i order;
    std::size_t from;
    bool any;
  };
  RISORIUS_INLINE static Half half(std::uint32_t mask, std::uint32_t before) {
    const auto* order = reinterpret_cast<const __m128i*>(kExpandOrders[mask].data());
    return {_mm256_cvtepi8_epi32(_mm_loadl_epi64(order)),
            static_cast<std::size_t>(std::popcount(before)), mask != 0};
  }
  RISORIUS_INLINE static void expand_8(const float* from, const Half& half, Reg rest, float* to) {
    const Reg values = _mm256_permutevar8x32_ps(load(from + half.from), half.order);
    store(to, _mm256_blendv_ps(rest, values, _mm256_castsi256_ps(half.order)));
  }
  struct Order {
    Half low, high;
  };
  RISORIUS_INLINE static Order order(std::uint32_t mask) {
    return {half(mask & 0xFFu, 0), half(mask >> 8, mask & 0xFFu)};
  }
  RISORIUS_INLINE static void expand(const float* from, const Order& o, float* to) {
    expand_8(from, o.low, zero(), to);
    expand_8(from, o.high, zero(), to + 8);
  }
  // Places without a value are rewritten with their old values, because a masked store takes 12
  // cycles on some CPUs. Two thirds of the extra pieces write only
  // places in one half of a block.
  RISORIUS_INLINE static void expand_more(const float* from, const Order& o, float* to) {
    if (o.low.any) expand_8(from, o.low, load(to), to);
    if (o.high.any) expand_8(from, o.high, load(to + 8), to + 8);
  }
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
