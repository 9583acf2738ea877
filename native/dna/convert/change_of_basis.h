// SPDX-License-Identifier: MIT
// Converts vectors and Euler angles from one coordinate system to another, in double. Vectors are
// rows: v' = v C and R' = transpose(C) R C, where C is a signed permutation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "dna/dna.h"

namespace risorius::dna::detail {

using Vec3 = std::array<double, 3>;

/// The conventions of the numbers in a file: axes, rotations, winding order and units.
struct System {
  CoordinateSystem axes;
  DescriptorExt ext;
  std::uint16_t translation_unit = 0, rotation_unit = 0;
  bool operator==(const System&) const = default;
};

bool spans_space(const CoordinateSystem& axes);

/// The matrix C: component i of the source becomes component to[i], times sign[i].
struct Basis {
  /// In: source, target  each with three axes in different dimensions
  Basis(const CoordinateSystem& source, const CoordinateSystem& target);

  bool keeps_places() const { return to == std::array<std::size_t, 3>{0, 1, 2}; }
  bool identity() const { return keeps_places() && sign == Vec3{1, 1, 1}; }
  Vec3 operator()(const Vec3& v) const;

  std::array<std::size_t, 3> to{0, 1, 2};
  Vec3 sign{1, 1, 1};
  double determinant = 1;  // -1: one system is the mirror image of the other
};

/// Converts Euler angles from the source's convention and unit to the target's.
class Rotation {
 public:
  /// In: valid systems
  Rotation(const System& source, const System& target, const Basis& basis);

  /// Whether the axes keep their order of rotation. Each angle then only changes its place, sign
  /// and unit.
  bool same_order() const { return same_order_; }
  bool identity() const { return same_order_ && basis_.identity() && factor_ == Vec3{1, 1, 1}; }
  /// The factor by which an angle about a source axis is multiplied. If same_order() is true it
  /// holds for any rotation, otherwise only for rotations about a single axis.
  double factor(std::size_t source_axis) const { return factor_[source_axis]; }
  /// The factor from the source's unit of angles to the target's.
  double unit() const { return unit_; }

  /// The converted angles. In: stored  by source axis. Out: by target axis. If same_order() is
  /// false, a rotation about several axes gets a middle angle from -90 to 90 degrees; in gimbal
  /// lock the last angle is 0.
  Vec3 operator()(const Vec3& stored) const;

 private:
  Basis basis_;
  std::array<std::size_t, 3> from_, into_;  // axes in the order in which their angles are applied
  bool same_order_ = true;
  double unit_ = 1;
  Vec3 to_radians_{}, from_radians_{}, factor_{};
};

}  // namespace risorius::dna::detail
