// SPDX-License-Identifier: MIT
// Positions of joints in the face. Private to native/edit. In double, so that rounding does not
// hide the difference of two poses.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dna/dna.h"
#include "rig/quaternion.h"

namespace risorius::edit::detail {

using Vector = std::array<double, 3>;

struct Turn {
  double x = 0, y = 0, z = 0, w = 1;
};

/// The translation, rotation and scale of a joint in its parent's space.
struct Local {
  Vector translation{};
  Turn rotation;
  Vector scale{1, 1, 1};
};

/// The angle between two rotations in degrees.
double degrees_between(const Turn& a, const Turn& b);

/// The joints of a face. It computes their positions in evaluated poses.
class Skeleton {
 public:
  Skeleton(const dna::Dna& dna, const rig::EulerConvention& euler);
  std::size_t joint_count() const { return parents_.size(); }
  /// A joint's transform relative to its parent in a pose. In: delta  tx ty tz rx ry rz sx sy sz,
  /// the joint's attributes in the pose
  Local local(std::size_t joint, const float* delta) const;
  /// Computes the positions of all joints in the face. In: locals  [joints]
  /// Out: positions  [joints], in the file's units and axes
  void place(const std::vector<Local>& locals, std::vector<Vector>& positions) const;

 private:
  Turn turn(const std::array<double, 3>& angles) const;

  rig::EulerConvention euler_;
  std::vector<Vector> translations_, rotations_;
  std::vector<bool> quaternions_;
  std::vector<std::uint32_t> parents_;  // a root is its own parent
  std::vector<std::uint32_t> order_;    // parents before children
};

}  // namespace risorius::edit::detail
