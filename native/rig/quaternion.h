// SPDX-License-Identifier: MIT
// Rotations of joints that are represented as quaternions. Conventions: CONVENTIONS.md.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>

namespace risorius::rig {

struct Quaternion {
  float x = 0, y = 0, z = 0, w = 1;
};

/// The Hamilton product a b: the rotation b and then the rotation a.
inline Quaternion multiply(const Quaternion& a, const Quaternion& b) {
  return {
      a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
      a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

/// The determinant of a 3x3 matrix in row order. It is negative if the matrix mirrors.
inline float determinant(std::span<const float, 9> m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
         m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/// A file's convention of Euler angles: axes in the order of rotation, sign of each axis, radians
/// per unit.
struct EulerConvention {
  std::array<std::uint8_t, 3> order{0, 1, 2};
  std::uint8_t zero = 0;  // an explicit padding byte, so that equal faces give equal bytes
  std::array<float, 3> signs{1, 1, 1};
  float radians_per_unit = 1;
};

/// Converts Euler angles to a quaternion. In: angles  about x y z, in the unit of the convention
inline Quaternion from_euler(const EulerConvention& c, const std::array<float, 3>& angles) {
  Quaternion q;
  for (const std::uint8_t axis : c.order) {
    const float half = 0.5f * angles[axis] * c.signs[axis] * c.radians_per_unit;
    const float s = std::sin(half);
    const Quaternion step{axis == 0 ? s : 0.0f, axis == 1 ? s : 0.0f, axis == 2 ? s : 0.0f,
                          std::cos(half)};
    q = multiply(step, q);
  }
  return q;
}

/// Converts a quaternion to Euler angles, the inverse of from_euler. In: q  of length 1. Out:
/// angles about x y z; in gimbal lock the last angle of the order is 0
inline std::array<float, 3> to_euler(const EulerConvention& c, const Quaternion& q) {
  const float m[3][3] = {
      // Row i is the image of axis i (row vectors).
      {1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y)},
      {2 * (q.x * q.y - q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z), 2 * (q.y * q.z + q.w * q.x)},
      {2 * (q.x * q.z + q.w * q.y), 2 * (q.y * q.z - q.w * q.x), 1 - 2 * (q.x * q.x + q.y * q.y)}};
  const int i = c.order[0], j = c.order[1], k = c.order[2];
  // +1 for the cyclic orders xyz, yzx, zxy and -1 for the others.
  const float parity = (j == (i + 1) % 3) ? 1.0f : -1.0f;
  const float sine = -parity * m[i][k];
  float first, middle, last;
  if (std::fabs(sine) < 1.0f) {
    middle = std::asin(sine);
    first = std::atan2(parity * m[j][k], m[k][k]);
    last = std::atan2(parity * m[i][j], m[i][i]);
  } else {
    middle = std::copysign(1.57079632679489662f, sine);
    first = std::atan2(-parity * m[k][j], m[j][j]);
    last = 0.0f;
  }
  std::array<float, 3> angles{};
  angles[static_cast<std::size_t>(i)] = first;
  angles[static_cast<std::size_t>(j)] = middle;
  angles[static_cast<std::size_t>(k)] = last;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    angles[axis] *= c.signs[axis] / c.radians_per_unit;
  }
  return angles;
}

}  // namespace risorius::rig
