// SPDX-License-Identifier: MIT
// Euler angles to quaternions, for the file of each instruction set: loops of a constant count, of
// which the compiler makes vectors under RISORIUS_TARGET. Their bits are the same on every CPU.
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "simd/kernels.h"
#include "simd/kernels_inline.h"

namespace risorius::simd {

namespace {

constexpr std::size_t kTurns = 16;
using Turns = float[kTurns];

// Sine and cosine by Cephes' polynomials after a reduction by quarter turns; error below 1e-7.
RISORIUS_INLINE void sine_and_cosine(const Turns& x, Turns& sines, Turns& cosines) {
  constexpr float kRound = 12582912.0f;  // 1.5 * 2^23: what is added to it ends as an integer
  for (std::size_t l = 0; l < kTurns; ++l) {
    const float shifted = x[l] * 0.636619772367581343f + kRound, quarters = shifted - kRound;
    const auto n = std::bit_cast<std::uint32_t>(shifted);
    const float r = ((x[l] - quarters * 1.5703125f) - quarters * 4.837512969970703125e-4f) -
                    quarters * 7.54978995489188216e-8f;
    const float z = r * r;
    const float s =
        r + r * z * (-1.6666654611e-1f + z * (8.3321608736e-3f + z * -1.9515295891e-4f));
    const float c =
        1.0f - 0.5f * z +
        z * z * (4.166664568298827e-2f + z * (-1.388731625493765e-3f + z * 2.443315711809948e-5f));
    const std::uint32_t swap = 0u - (n & 1u);
    const auto sb = std::bit_cast<std::uint32_t>(s), cb = std::bit_cast<std::uint32_t>(c);
    sines[l] = std::bit_cast<float>(((sb & ~swap) | (cb & swap)) ^ ((n & 2u) << 30));
    cosines[l] = std::bit_cast<float>(((cb & ~swap) | (sb & swap)) ^ (((n + 1u) & 2u) << 30));
  }
}

// Angles too large for the reduction, infinities and NaN.
RISORIUS_INLINE bool any_beyond(const Turns& x) {
  constexpr std::uint32_t kLimit = 0x46000000u;  // the bits of 8192
  std::uint32_t beyond = 0;
  for (std::size_t l = 0; l < kTurns; ++l) {
    beyond |= (std::bit_cast<std::uint32_t>(x[l]) & 0x7FFFFFFFu) > kLimit ? 1u : 0u;
  }
  return beyond != 0;
}
void repair(const Turns& x, Turns& sines, Turns& cosines) {
  for (std::size_t l = 0; l < kTurns; ++l) {
    if (std::fabs(x[l]) <= 8192.0f) continue;
    sines[l] = std::sin(x[l]);
    cosines[l] = std::cos(x[l]);
  }
}

// Half angles in the order of rotation to quaternions, w last.
RISORIUS_INLINE void turn(float parity, const Turns (&half)[3], Turns (&q)[4]) {
  Turns s[3], c[3];
  for (std::size_t a = 0; a < 3; ++a) {
    sine_and_cosine(half[a], s[a], c[a]);
    if (any_beyond(half[a])) repair(half[a], s[a], c[a]);
  }
  for (std::size_t l = 0; l < kTurns; ++l) {
    const float cc = c[1][l] * c[0][l], cs = c[1][l] * s[0][l], sc = s[1][l] * c[0][l],
                ss = parity * (s[1][l] * s[0][l]), sk = s[2][l], ck = c[2][l];
    q[0][l] = ck * cs - parity * (sk * sc);
    q[1][l] = ck * sc + parity * (sk * cs);
    q[2][l] = sk * cc - ck * ss;
    q[3][l] = ck * cc + sk * ss;
  }
}

RISORIUS_TARGET void quaternions(const EulerTurns& e, const std::uint16_t* which, std::size_t n,
                                 float* rotations, std::size_t stride) {
  Turns half[3] = {}, q[4];
  for (std::size_t i = 0; i < n; i += kTurns) {
    const std::size_t count = n - i < kTurns ? n - i : kTurns;
    for (std::size_t l = 0; l < count; ++l) {
      const float* from = rotations + which[i + l] * stride;
      for (std::size_t a = 0; a < 3; ++a) half[a][l] = from[e.order[a]] * e.half_units[a];
    }
    turn(e.parity, half, q);
    for (std::size_t l = 0; l < count; ++l) {
      float* to = rotations + which[i + l] * stride;
      for (std::size_t a = 0; a < 3; ++a) to[e.order[a]] = q[a][l];
      to[3] = q[3][l];
    }
  }
}

}  // namespace

}  // namespace risorius::simd
