// SPDX-License-Identifier: MIT
// Samples points evenly over a surface, and measures its bending around points.
#pragma once

#include <array>

#include "register/matching/types.h"

namespace risorius::registering::steps {

/// The mean height of the surface within each of kRadii around a point, measured along the point's
/// normal and divided by the radius: below 0 on a ridge, above 0 in a groove.
using Bend = std::array<double, 3>;
inline constexpr std::array<double, 3> kRadii{6.0, 12.0, 24.0};  // mm

struct Samples {
  Points points, normals;
  std::vector<Bend> bends;
  std::vector<std::uint8_t> border;  // not 0: on a triangle at the border of the surface
  double spacing = 1.0;              // mm between neighbouring samples
};

/// Unit normals of vertices, weighted by the angles of their triangles; 0 without triangles.
Points vertex_normals(const Points& points, const std::vector<Triangle>& triangles);
/// [T] bit k is set if no other triangle has the edge from corner k to the next one.
std::vector<std::uint8_t> border_edges(const std::vector<Triangle>& triangles);
/// About `count` points, evenly spread over the surface. Their `bends` are not computed.
Samples sample(const Form& form, const std::vector<std::uint8_t>& borders, std::size_t count);
/// The bending of the surface `around` at points. In: normals  of `points`, length 1
std::vector<Bend> bends(const Points& points, const Points& normals, const Samples& around,
                        std::size_t threads);

}  // namespace risorius::registering::steps
