// SPDX-License-Identifier: MIT
// Points spread evenly over a surface, and how it bends around points.
#pragma once

#include <array>

#include "register/matching/types.h"

namespace risorius::registering::steps {

/// How far the middle of the surface within each of kRadii lies above a point, along its normal and
/// in shares of the radius: below 0 on a ridge, above 0 in a groove.
using Bend = std::array<double, 3>;
inline constexpr std::array<double, 3> kRadii{6.0, 12.0, 24.0};  // mm

struct Samples {
  Points points, normals;
  std::vector<Bend> bends;
  std::vector<std::uint8_t> border;  // not 0: on a triangle at the border of the surface
  double spacing = 1.0;
};

/// Normals of vertices, by the angles of their triangles; 0 where there is none.
Points vertex_normals(const Points& points, const std::vector<Triangle>& triangles);
/// [T] bit k: the edge from corner k to the next belongs to no other triangle.
std::vector<std::uint8_t> border_edges(const std::vector<Triangle>& triangles);
/// About `count` points, without bends.
Samples sample(const Form& form, const std::vector<std::uint8_t>& borders, std::size_t count);
/// In: normals  of `points`, length 1
std::vector<Bend> bends(const Points& points, const Points& normals, const Samples& around,
                        std::size_t threads);

}  // namespace risorius::registering::steps
