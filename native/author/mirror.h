// SPDX-License-Identifier: MIT
// Which vertex and which expression lie on the other side.
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

/// The mirror of a mesh across the plane x = 0, empty where it has none.
/// A vertex lies on the other side where one is nearer than 0.0005 of the mesh's size and edges
/// agree; expressions belong together where they differ by less than 5 % of their length.
Mirror find_mirror(const Shapes& shapes);

}  // namespace risorius::author
