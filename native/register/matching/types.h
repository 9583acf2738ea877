// SPDX-License-Identifier: MIT
// Types that the steps of a registration share.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "register/register.h"

namespace risorius::registering::steps {

using Vec3 = Eigen::Vector3d;
using Points = std::vector<Vec3>;

/// A surface of triangles with unit vertex normals (0 for a vertex without triangles).
struct Form {
  Points points, normals;
  std::vector<Triangle> triangles;
};

/// The point of the target to which a vertex is pulled. weight 0: the vertex is not pulled.
struct Match {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::Zero();  // of the target at the point, length 1
  double weight = 0.0;         // in the direction of the normal
  double along = 1.0;          // weight across the normal, in shares of `weight`

  /// The matrix of the match's weights times x: weight (n n' + along (1 - n n')) x, with the normal
  /// n.
  Vec3 pulled(const Vec3& x) const {
    return weight * (along * x + (1 - along) * normal * normal.dot(x));
  }
};

/// A vertex of the template and its point on the target, in millimetres.
struct Landmark {
  std::uint32_t vertex = 0;
  Vec3 point = Vec3::Zero();
  double weight = 1.0;
};

}  // namespace risorius::registering::steps
