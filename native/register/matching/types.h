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
  double weight = 0.0;
};

/// A pair in millimetres.
struct Landmark {
  std::uint32_t vertex = 0;
  Vec3 point = Vec3::Zero();
  double weight = 1.0;
};

}  // namespace risorius::registering::steps
