// SPDX-License-Identifier: MIT
// Meshes with fewer triangles: those of coarser levels of detail.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/result.h"

namespace risorius::author {

using Triangle = std::array<std::uint32_t, 3>;

/// Triangles over corners: a vertex that a seam of the texture runs through is there once for each
/// side, at equal positions.
struct Surface {
  std::vector<std::array<float, 3>> positions;  // [corners], in any one unit
  /// [corners][attributes]: what is to stay like the positions (texture coordinates, motion). A
  /// difference of 1 counts as much as one of the surface's size.
  std::vector<float> attributes;
  std::size_t attribute_count = 0;  // 32 at most
  std::vector<Triangle> triangles;
};

struct Simplified {
  std::vector<Triangle> triangles;  // over the same corners
  double error = 0.0;               // a share of the surface's size
};

/// A surface with about so many triangles: edges are collapsed where that changes least, corners
/// are never moved. Seams and borders stay where they are; where nothing more can be collapsed it
/// has more triangles than asked for. Of two flat triangles of which one is a sliver the common
/// edge is turned. In: triangles  at most Fails: kInvalidLength (attributes), kInvalidIndex (a
/// triangle's corner), kInvalidValue (a number
///        that is not finite), kInvalidArgument (more than 32 attributes)
/// Source: Garland and Heckbert, "Surface Simplification Using Quadric Error Metrics" (1997), by
/// the
///         library meshoptimizer
core::Result<Simplified> simplify(const Surface& surface, std::size_t triangles);

}  // namespace risorius::author
