// SPDX-License-Identifier: MIT
// Vectors and Euler angles from one coordinate system to another, in double precision.
// Row vectors throughout: v' = v C and R' = transpose(C) R C, where C is a signed permutation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "dna/dna.h"

namespace risorius::dna::detail {

using Vec3 = std::array<double, 3>;

/// All that a file says about how its numbers are meant.
struct System {
  CoordinateSystem axes;
  DescriptorExt ext;
  std::uint16_t translation_unit = 0, rotation_unit = 0;
  bool operator==(const System&) const = default;
};

bool spans_space(const CoordinateSystem& axes);

/// The matrix C: component i of the source becomes component to[i], times sign[i].
struct Basis {
  /// In: axes that span space.
  Basis(const CoordinateSystem& source, const CoordinateSystem& target);

  bool keeps_places() const { return to == std::array<std::size_t, 3>{0, 1, 2}; }
  bool identity() const { return keeps_places() && sign == Vec3{1, 1, 1}; }
  Vec3 operator()(const Vec3& v) const;

  std::array<std::size_t, 3> to{0, 1, 2};
  Vec3 sign{1, 1, 1};
  double determinant = 1;  // -1: the one is the other's mirror image
};

/// Stored angles to stored angles.
class Rotation {
 public:
  /// In: systems that make sense.
  Rotation(const System& source, const System& target, const Basis& basis);

  /// Angles change places, signs and unit, but do not mix.
  bool same_order() const { return same_order_; }
  bool identity() const { return same_order_ && basis_.identity() && factor_ == Vec3{1, 1, 1}; }
  /// What an angle about a source axis is multiplied by; true of any rotation if the order stays,
  /// and otherwise of rotations about one axis.
  double factor(std::size_t source_axis) const { return factor_[source_axis]; }
  double unit() const { return unit_; }

  /// Without same_order the middle angle comes to lie within 90 degrees; at its pole the last is 0.
  Vec3 operator()(const Vec3& stored) const;

 private:
  Basis basis_;
  std::array<std::size_t, 3> from_, into_;  // axes in the order in which their angles are applied
  bool same_order_ = true;
  double unit_ = 1;
  Vec3 to_radians_{}, from_radians_{}, factor_{};
};

}  // namespace risorius::dna::detail
