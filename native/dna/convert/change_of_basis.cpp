// SPDX-License-Identifier: MIT
// Converts vectors and Euler angles between coordinate systems, in double. Vectors are rows.
#include "dna/convert/change_of_basis.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace risorius::dna::detail {

namespace {

using Matrix = std::array<Vec3, 3>;

std::array<std::size_t, 3> axis_order(std::uint32_t sequence) {
  constexpr std::array<std::array<std::size_t, 3>, 6> kOrders{
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  return kOrders[sequence];
}

// Replaces r by r times the matrix of a rotation about one axis (the matrix for row vectors).
// In: angle  radians
void rotate(Matrix& r, std::size_t axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  for (Vec3& row : r) {
    const double a = row[u], b = row[v];
    row[u] = a * c - b * s;
    row[v] = a * s + b * c;
  }
}

// The rotation r in the target axes: transpose(C) R C, where C is the matrix of the basis.
Matrix conjugated(const Basis& basis, const Matrix& r) {
  Matrix out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      out[basis.to[i]][basis.to[j]] = basis.sign[i] * basis.sign[j] * r[i][j];
    }
  }
  return out;
}

// The angles, in radians, of the rotation r = Ri Rj Rk about the axes i j k of `order`. The middle
// angle is computed from both its sine and its cosine, because asin alone loses half of the digits
// near gimbal lock.
Vec3 angles_of(const Matrix& r, const std::array<std::size_t, 3>& order) {
  const auto [i, j, k] = order;
  const double parity = j == (i + 1) % 3 ? 1.0 : -1.0;
  const double cosine = std::hypot(r[i][i], r[i][j]);
  Vec3 out{};
  out[j] = std::atan2(-parity * r[i][k], cosine);
  // Below this cosine the outer angles have rounding errors of 1e-16 / 1e-9, as large as the
  // rounding errors of a float. Then only the sum or the difference of the outer angles is known;
  // it is stored in the first outer angle.
  if (cosine < 1e-9) {
    out[i] = std::atan2(-parity * r[k][j], r[j][j]);
  } else {
    out[i] = std::atan2(parity * r[j][k], r[k][k]);
    out[k] = std::atan2(parity * r[i][j], r[i][i]);
  }
  // cos(90 degrees) in double is not exactly 0, so that an angle that should be 0 gets a tiny
  // value. Such angles become 0, so that a row of them can be dropped.
  for (double& angle : out) {
    if (std::abs(angle) < 1e-14) angle = 0;
  }
  return out;
}

}  // namespace

bool spans_space(const CoordinateSystem& axes) {
  const int x = axes.x_axis / 2, y = axes.y_axis / 2, z = axes.z_axis / 2;
  return x < 3 && y < 3 && z < 3 && x != y && y != z && x != z;
}

Basis::Basis(const CoordinateSystem& source, const CoordinateSystem& target) {
  constexpr std::array<double, 6> kSign{-1, 1, 1, -1, 1, -1};  // of left right up down front back
  const std::array<std::uint16_t, 3> from{source.x_axis, source.y_axis, source.z_axis};
  const std::array<std::uint16_t, 3> into{target.x_axis, target.y_axis, target.z_axis};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      if (from[i] / 2 != into[j] / 2) continue;
      to[i] = j;
      sign[i] = kSign[from[i]] * kSign[into[j]];
    }
  }
  const bool cyclic = to[1] == (to[0] + 1) % 3;
  determinant = (cyclic ? 1.0 : -1.0) * sign[0] * sign[1] * sign[2];
}

Vec3 Basis::operator()(const Vec3& v) const {
  Vec3 out{};
  for (std::size_t i = 0; i < 3; ++i) out[to[i]] = sign[i] * v[i];
  return out;
}

Rotation::Rotation(const System& source, const System& target, const Basis& basis)
    : basis_(basis),
      from_(axis_order(source.ext.rotation_sequence)),
      into_(axis_order(target.ext.rotation_sequence)) {
  constexpr double kDegree = std::numbers::pi / 180;
  const double in = source.rotation_unit == 0 ? kDegree : 1.0;
  const double out = target.rotation_unit == 0 ? kDegree : 1.0;
  unit_ = in / out;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = basis.to[i];
    same_order_ = same_order_ && basis.to[from_[i]] == into_[i];
    to_radians_[i] = in * source.ext.rotation_sign[i];
    from_radians_[j] = target.ext.rotation_sign[j] / out;
    // If one system is the mirror image of the other (determinant -1), a rotation about an axis
    // that keeps its direction reverses its sense.
    factor_[i] = basis.determinant * basis.sign[i] * source.ext.rotation_sign[i] *
                 target.ext.rotation_sign[j] * unit_;
  }
}

Vec3 Rotation::operator()(const Vec3& stored) const {
  Vec3 out{};
  if (same_order_ || std::ranges::count(stored, 0.0) >= 2) {
    for (std::size_t i = 0; i < 3; ++i) out[basis_.to[i]] = factor_[i] * stored[i];
    return out;
  }
  Matrix r{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (const std::size_t axis : from_) rotate(r, axis, to_radians_[axis] * stored[axis]);
  out = angles_of(conjugated(basis_, r), into_);
  for (std::size_t i = 0; i < 3; ++i) out[i] *= from_radians_[i];
  return out;
}

}  // namespace risorius::dna::detail
