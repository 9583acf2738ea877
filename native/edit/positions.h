// SPDX-License-Identifier: MIT
// Where joints stand in the face. Private to native/edit. In double: differences of two poses must
// not drown in rounding.
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

/// A joint against its parent.
struct Local {
  Vector translation{};
  Turn rotation;
  Vector scale{1, 1, 1};
};

/// The degrees between two rotations.
double degrees_between(const Turn& a, const Turn& b);

/// Joints of a face in poses that an evaluation gave.
class Skeleton {
 public:
  Skeleton(const dna::Dna& dna, const rig::EulerConvention& euler);
  std::size_t joint_count() const { return parents_.size(); }
  /// In: delta  tx ty tz rx ry rz sx sy sz, the joint's part of a pose
  Local local(std::size_t joint, const float* delta) const;
  /// In: locals of all joints. Out: their places in the file's units and axes.
  void place(const std::vector<Local>& locals, std::vector<Vector>& positions) const;

 private:
  Turn turn(const std::array<double, 3>& angles) const;

  rig::EulerConvention euler_;
  std::vector<Vector> translations_, rotations_;
  std::vector<bool> quaternions_;
  std::vector<std::uint32_t> parents_;  // a root is its own
  std::vector<std::uint32_t> order_;    // parents before children
};

}  // namespace risorius::edit::detail
