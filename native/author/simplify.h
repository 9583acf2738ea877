// SPDX-License-Identifier: MIT
// Meshes with fewer triangles, for coarser levels of detail.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/result.h"

namespace risorius::author {

using Triangle = std::array<std::uint32_t, 3>;

/// Triangles over corners. A vertex on a seam of the texture has two corners at the same position,
/// one for each side.
struct Surface {
  std::vector<std::array<float, 3>> positions;  // [corners], in any one unit
  /// [corners][attributes]: values to preserve like the positions (texture coordinates, motion). A
  /// difference of 1 counts as much as a distance of the surface's size.
  std::vector<float> attributes;
  std::size_t attribute_count = 0;  // 32 at most
  std::vector<Triangle> triangles;
};

struct Simplified {
  std::vector<Triangle> triangles;  // over the same corners
  double error = 0.0;               // distance from the input divided by the input's size
};

/// A surface with at most `triangles` triangles if possible. Edges are collapsed at places where
/// this changes the surface least; corners are never moved. Seams and borders are preserved, so
/// that the result may have more than `triangles` triangles. The common edge of two triangles
/// that lie in nearly one plane is flipped if one of them is a sliver. A surface that already has
/// at most `triangles` triangles is returned unchanged.
/// Fails: kInvalidLength (attributes), kInvalidIndex (a triangle's corner),
///        kInvalidValue (a number that is not finite), kInvalidArgument (more than 32 attributes)
/// Source: Garland and Heckbert, "Surface Simplification Using Quadric Error Metrics" (1997), as
///         implemented in the library meshoptimizer
core::Result<Simplified> simplify(const Surface& surface, std::size_t triangles);

}  // namespace risorius::author
