// SPDX-License-Identifier: MIT
// The kernels for ARM NEON: instructions for the loops of kernels_body.h and skin_body.h, on
// registers of four floats.
#include <bit>

#include "simd/kernels.h"

#if defined(__aarch64__) || defined(_M_ARM64)
#include <arm_neon.h>

#define RISORIUS_TARGET
#include "simd/kernels_inline.h"
#include "simd/rotations_body.h"
#include "simd/skin_body.h"

namespace risorius::simd {

namespace {

// Sums weighted matrices, with one row of the matrix in each register.
struct RowsOfFour {
  struct Sum {
    float32x4_t r[3];
  };
  using Weights = float32x4_t;
  static constexpr std::size_t kTogether = 4;
  RISORIUS_INLINE static Sum zero() {
    return {{vdupq_n_f32(0.0f), vdupq_n_f32(0.0f), vdupq_n_f32(0.0f)}};
  }
  RISORIUS_INLINE static float32x4_t weights(const float* p) { return vld1q_f32(p); }
  template <std::size_t kWeight>
  RISORIUS_INLINE static void add(Sum& sum, float32x4_t weights, const float* row) {
    sum.r[0] = vfmaq_laneq_f32(sum.r[0], vld1q_f32(row), weights, kWeight);
    sum.r[1] = vfmaq_laneq_f32(sum.r[1], vld1q_f32(row + 4), weights, kWeight);
    sum.r[2] = vfmaq_laneq_f32(sum.r[2], vld1q_f32(row + 8), weights, kWeight);
  }
  RISORIUS_INLINE static void finish(const Sum& sum, const float* point, float* out) {
    const float32x4_t p =
        vcombine_f32(vld1_f32(point), vset_lane_f32(1.0f, vld1_dup_f32(point + 2), 1));
    const float32x4_t xy = vpaddq_f32(vmulq_f32(sum.r[0], p), vmulq_f32(sum.r[1], p)),
                      z = vmulq_f32(sum.r[2], p);
    const float32x4_t moved = vaddq_f32(p, vpaddq_f32(xy, vpaddq_f32(z, z)));
    vst1_f32(out, vget_low_f32(moved));
    vst1q_lane_f32(out + 2, moved, 2);
  }
  RISORIUS_INLINE static void pack(const float* matrix, float* row) { pack_rows(matrix, row); }
};

struct V {
  using Skin = RowsOfFour;
  using Reg = float32x4_t;
  static constexpr std::size_t kLanes = 4, kBlocks = 16, kBatchBlocks = 5;
  static constexpr int kBatchFrames = 4;
  RISORIUS_INLINE static Reg zero() { return vdupq_n_f32(0.0f); }
  RISORIUS_INLINE static Reg set(float v) { return vdupq_n_f32(v); }
  RISORIUS_INLINE static Reg load(const float* p) { return vld1q_f32(p); }
  RISORIUS_INLINE static Reg load(const std::uint16_t* p) {
    return vcvt_f32_f16(vreinterpret_f16_u16(vld1_u16(p)));
  }
  RISORIUS_INLINE static void store(float* p, Reg v) { vst1q_f32(p, v); }
  RISORIUS_INLINE static Reg madd(Reg a, Reg b, Reg sum) { return vfmaq_f32(sum, a, b); }
  using Parts = OneByOne;
  using Order = std::uint32_t;
  RISORIUS_INLINE static Order order(std::uint32_t mask) { return mask; }
  RISORIUS_INLINE static void expand(const float* from, std::uint32_t mask, float* to) {
    for (int q = 0; q < 4; ++q, mask >>= 4) {
      const uint8x16_t order = vld1q_u8(kExpandBytes[mask & 15u].data());
      store(to + 4 * q, vreinterpretq_f32_u8(vqtbl1q_u8(vreinterpretq_u8_f32(load(from)), order)));
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

const Kernels* neon_kernels() {
  static constexpr Kernels kernels = make_kernels("neon");
  return &kernels;
}

}  // namespace risorius::simd

#else

namespace risorius::simd {

const Kernels* neon_kernels() { return nullptr; }

}  // namespace risorius::simd

#endif
