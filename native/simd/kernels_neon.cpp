// SPDX-License-Identifier: MIT
#include <bit>

#include "simd/kernels.h"

#if defined(__aarch64__) || defined(_M_ARM64)
#include <arm_neon.h>

#define RISORIUS_TARGET
#include "simd/kernels_inline.h"
#include "simd/rotations_body.h"

namespace risorius::simd {

namespace {

struct V {
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
