// SPDX-License-Identifier: MIT
// The input of a joint rig: a neutral mesh and the displacements of its vertices in each
// expression.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace risorius::author {

using Vector3 = std::array<double, 3>;
using Edge = std::array<std::uint32_t, 2>;

/// A mesh and its expressions. All lengths share one unit, which may be any.
struct Shapes {
  std::vector<Vector3> neutral;  // [vertices]
  /// [vertices][expressions][3]: displacement of a vertex while the expression's control is 1.
  std::vector<float> displacements;
  std::size_t expressions = 0;
  std::vector<Edge> edges;  // of the polygons, each once; the mesh may have several pieces
  /// [vertices] weight of a vertex's squared error, more than 0; empty: all vertices weigh the
  /// same.
  std::vector<double> importance;

  std::size_t vertex_count() const { return neutral.size(); }
  const float* of_vertex(std::size_t v) const { return displacements.data() + v * expressions * 3; }
};

}  // namespace risorius::author
