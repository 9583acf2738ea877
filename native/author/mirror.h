// SPDX-License-Identifier: MIT
// Pairs of vertices and of expressions on the two sides of a face.
#pragma once

#include <cstdint>
#include <vector>

#include "author/shapes.h"

namespace risorius::author {

struct Mirror {
  std::vector<std::uint32_t> vertices;     // [V] the vertex on the other side, itself in the middle
  std::vector<std::uint32_t> expressions;  // [E] the expression of the other side, or kNone
  bool empty() const { return vertices.empty(); }
  static constexpr std::uint32_t kNone = 0xffffffffu;
};

/// The mirror of a mesh across the plane x = 0; empty if the mesh is not symmetric. Two vertices
/// are a pair if one is, after mirroring, nearer to the other than 0.0005 of the longest side of
/// the mesh's bounding box, and if mirrored edges are edges, too. Two
/// expressions are a pair if one differs from the mirrored other by at most 5 % of its own length,
/// both as vectors of all displacements.
Mirror find_mirror(const Shapes& shapes);

}  // namespace risorius::author
