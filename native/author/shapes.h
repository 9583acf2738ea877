// SPDX-License-Identifier: MIT
// What a joint rig is made from: a neutral mesh and where each expression moves its vertices.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace risorius::author {

using Vector3 = std::array<double, 3>;
using Edge = std::array<std::uint32_t, 2>;

/// A mesh and its expressions. Lengths are in any one unit.
struct Shapes {
  std::vector<Vector3> neutral;  // [vertices]
  /// [vertices][expressions][3]: what the expression adds to the vertex where its control is 1.
  std::vector<float> displacements;
  std::size_t expressions = 0;
  std::vector<Edge> edges;  // of the polygons, each once; a mesh may be in pieces
  /// [vertices] how much a vertex' squared error counts, more than 0; empty: all alike.
  std::vector<double> importance;

  std::size_t vertex_count() const { return neutral.size(); }
  const float* of_vertex(std::size_t v) const { return displacements.data() + v * expressions * 3; }
};

}  // namespace risorius::author
