// SPDX-License-Identifier: MIT
// What the steps of a registration share.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "register/register.h"

namespace risorius::registering::steps {

using Vec3 = Eigen::Vector3d;
using Points = std::vector<Vec3>;

/// A surface of triangles with the normals of its vertices, of length 1 (0: of no triangle).
struct Form {
  Points points, normals;
  std::vector<Triangle> triangles;
};

/// Where a vertex is to go. weight 0: nothing is known.
struct Match {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::Zero();  // of the target there, length 1
  double weight = 0.0;         // along the normal
  double along = 1.0;          // weight in the plane of the target, in shares of `weight`

  /// weight (n n' + along (1 - n n')) x
  Vec3 pulled(const Vec3& x) const {
    return weight * (along * x + (1 - along) * normal * normal.dot(x));
  }
};

/// A pair in millimetres.
struct Landmark {
  std::uint32_t vertex = 0;
  Vec3 point = Vec3::Zero();
  double weight = 1.0;
};

}  // namespace risorius::registering::steps
