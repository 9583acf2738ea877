// SPDX-License-Identifier: MIT
// Converts Euler angles to quaternions, compiled once for each instruction set. Loops have constant
// counts, so that the compiler vectorises them under RISORIUS_TARGET. The bits are the same on
// every CPU, except for half angles above kReduced.
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>

#include "simd/kernels.h"
#include "simd/kernels_inline.h"

namespace risorius::simd {

namespace {

constexpr std::size_t kTurns = 16;  // rotations that are converted together
using Turns = float[kTurns];        // one angle or quaternion component of each of them
// The angles about all three axes are in one array, because one loop over all of them is faster
// than three loops: the CPU computes more sines in parallel.
constexpr std::size_t kAngles = 3 * kTurns;
using Angles = float[kAngles];

// Sine and cosine of angles up to 45 degrees, by the polynomials of Cephes. In: r  radians; z  r *
// r
RISORIUS_INLINE float near_sine(float r, float z) {
  return r + r * z * (-1.6666654611e-1f + z * (8.3321608736e-3f + z * -1.9515295891e-4f));
}
RISORIUS_INLINE float near_cosine(float z) {
  return 1.0f - 0.5f * z +
         z * z * (4.166664568298827e-2f + z * (-1.388731625493765e-3f + z * 2.443315711809948e-5f));
}

// Sine and cosine of angles in radians, reduced by quarter turns. The error is below 1e-7 for
// angles up to kReduced (8,192 radians); repair() replaces the results of larger angles.
RISORIUS_INLINE void sine_and_cosine(const Angles& x, Angles& sines, Angles& cosines) {
  constexpr float kRound = 12582912.0f;  // 1.5 * 2^23: adding it rounds to an integer
  for (std::size_t l = 0; l < kAngles; ++l) {
    const float shifted = x[l] * 0.636619772367581343f + kRound, quarters = shifted - kRound;
    const auto n = std::bit_cast<std::uint32_t>(shifted);
    const float r = ((x[l] - quarters * 1.5703125f) - quarters * 4.837512969970703125e-4f) -
                    quarters * 7.54978995489188216e-8f;
    const float z = r * r, s = near_sine(r, z), c = near_cosine(z);
    const std::uint32_t swap = 0u - (n & 1u);
    const auto sb = std::bit_cast<std::uint32_t>(s), cb = std::bit_cast<std::uint32_t>(c);
    sines[l] = std::bit_cast<float>(((sb & ~swap) | (cb & swap)) ^ ((n & 2u) << 30));
    cosines[l] = std::bit_cast<float>(((cb & ~swap) | (sb & swap)) ^ (((n + 1u) & 2u) << 30));
  }
}
// As sine_and_cosine, for angles of at most kNear (0.785 radians), which need no reduction: the
// same bits in half the time. Faces rarely rotate a joint so far that an angle needs a reduction.
RISORIUS_INLINE void near_sine_and_cosine(const Angles& x, Angles& sines, Angles& cosines) {
  for (std::size_t l = 0; l < kAngles; ++l) {
    const float z = x[l] * x[l];
    sines[l] = near_sine(x[l], z);
    cosines[l] = near_cosine(z);
  }
}

constexpr float kNear = 0.785f;      // radians, slightly less than an eighth of a turn
constexpr float kReduced = 8192.0f;  // radians, largest angle that is reduced exactly enough
// For angles that are above kReduced, infinite or NaN: replaces sine and cosine by the results of
// the C library.
void repair(const Angles& x, Angles& sines, Angles& cosines) {
  for (std::size_t l = 0; l < kAngles; ++l) {
    if (std::fabs(x[l]) <= kReduced) continue;
    sines[l] = std::sin(x[l]);
    cosines[l] = std::cos(x[l]);
  }
}

// Converts half angles to quaternions.
// In:  half  radians: of the first rotation of all quaternions, then of the second, then the third
// Out: q     q[0] to q[2] are the components for the axes of the three rotations, in the order of
//            rotation, q[3] is w
template <class Parts>
RISORIUS_INLINE void turn(float parity, const Angles& half, Turns (&q)[4]) {
  alignas(64) Angles sines, cosines;
  if (!Parts::any_beyond(half, std::bit_cast<std::uint32_t>(kNear))) {
    near_sine_and_cosine(half, sines, cosines);
  } else {
    sine_and_cosine(half, sines, cosines);
    if (Parts::any_beyond(half, std::bit_cast<std::uint32_t>(kReduced)))
      repair(half, sines, cosines);
  }
  const float *s0 = sines, *s1 = s0 + kTurns, *s2 = s1 + kTurns;
  const float *c0 = cosines, *c1 = c0 + kTurns, *c2 = c1 + kTurns;
  for (std::size_t l = 0; l < kTurns; ++l) {
    const float cc = c1[l] * c0[l], cs = c1[l] * s0[l], sc = s1[l] * c0[l],
                ss = parity * (s1[l] * s0[l]), sk = s2[l], ck = c2[l];
    q[0][l] = ck * cs - parity * (sk * sc);
    q[1][l] = ck * sc + parity * (sk * cs);
    q[2][l] = sk * cc - ck * ss;
    q[3][l] = ck * cc + sk * ss;
  }
}

// split copies the angles of kTurns rotations from memory into one array for each axis; join copies
// four arrays of quaternion components back to the same places.
// In: at  the offset of each rotation
struct OneByOne {
  RISORIUS_INLINE static void split(const float* rotations, const std::uint32_t* at,
                                    Turns (&angles)[3]) {
    for (std::size_t l = 0; l < kTurns; ++l) {
      for (std::size_t a = 0; a < 3; ++a) angles[a][l] = rotations[at[l] + a];
    }
  }
  RISORIUS_INLINE static void join(const Turns* const (&parts)[4], float* rotations,
                                   const std::uint32_t* at) {
    for (std::size_t l = 0; l < kTurns; ++l) {
      for (std::size_t k = 0; k < 4; ++k) rotations[at[l] + k] = (*parts[k])[l];
    }
  }
  // Whether an angle exceeds a positive limit (given by its bits), or is infinite or NaN. The sign
  // of the difference of the bits is used, because the compiler would not vectorise a comparison.
  RISORIUS_INLINE static bool any_beyond(const Angles& x, std::uint32_t limit) {
    std::uint32_t beyond = 0;
    for (std::size_t l = 0; l < kAngles; ++l) {
      beyond |= limit - (std::bit_cast<std::uint32_t>(x[l]) & 0x7FFFFFFFu);
    }
    return (beyond >> 31) != 0;
  }
};

template <class Parts>
RISORIUS_TARGET void turn_together(const EulerTurns& e, const std::uint32_t* at, float* rotations) {
  alignas(64) Turns angles[3], q[4];
  alignas(64) Angles half;
  Parts::split(rotations, at, angles);
  const Turns* parts[4] = {};
  for (std::size_t a = 0; a < 3; ++a) {
    const Turns& of_axis = angles[e.order[a]];
    float* to = half + a * kTurns;
    for (std::size_t l = 0; l < kTurns; ++l) to[l] = of_axis[l] * e.half_units[a];
    parts[e.order[a]] = &q[a];
  }
  parts[3] = &q[3];
  turn<Parts>(e.parity, half, q);
  Parts::join(parts, rotations, at);
}

// Whether any of three angles is not +0.
RISORIUS_INLINE bool turns(const float* angles) {
  // The angles are copied to two integers, because the compiler would store an array and read it
  // again.
  std::uint64_t two = 0;
  std::uint32_t third = 0;
  std::memcpy(&two, angles, sizeof(two));
  std::memcpy(&third, angles + 2, sizeof(third));
  return (two | third) != 0;
}

// Converts Euler angles to quaternions. Lists in `turning` the rotations that are not 0, which are
// converted in batches, and writes the identity for all others. A batch of sixteen is computed only
// when 32 more have been listed, because the CPU would otherwise have to wait for the entries of
// the list that it has just written.
template <class Parts>
RISORIUS_TARGET void quaternions(const EulerTurns& e, const std::uint16_t* which, std::size_t n,
                                 float* rotations, std::size_t stride) {
  constexpr std::size_t kBehind = 3 * kTurns;
  std::uint32_t turning[17 * kTurns];  // offsets of the listed rotations
  std::size_t count = 0, done = 0;
  float elsewhere = 0;
  for (std::size_t i = 0; i < n; i += kTurns) {
    const std::size_t end = n - i < kTurns ? n : i + kTurns;
    for (std::size_t j = i; j < end; ++j) {
      const std::size_t at = which[j] * stride;
      const bool moves = turns(rotations + at);
      // If the rotation is not 0, turn_together writes its w later. The store below then goes to
      // `elsewhere`, which nothing reads.
      float* w = moves ? &elsewhere : rotations + at + 3;
      *w = 1.0f;
      turning[count] = static_cast<std::uint32_t>(at);
      count += moves ? 1 : 0;
    }
    if (count - done >= kBehind) {
      turn_together<Parts>(e, turning + done, rotations);
      done += kTurns;
    }
    if (count + kTurns <= std::size(turning)) continue;
    for (std::size_t l = done; l < count; ++l) turning[l - done] = turning[l];
    count -= done;
    done = 0;
  }
  for (; count - done >= kTurns; done += kTurns) {
    turn_together<Parts>(e, turning + done, rotations);
  }
  if (count == done) return;
  // The last batch is filled by repeating the last rotation, which does no harm because a batch is
  // read before it is written.
  for (std::size_t l = count; l < done + kTurns; ++l) turning[l] = turning[count - 1];
  turn_together<Parts>(e, turning + done, rotations);
}

}  // namespace

}  // namespace risorius::simd
