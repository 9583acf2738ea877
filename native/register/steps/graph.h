// SPDX-License-Identifier: MIT
// The vertices of a template as a graph, and nodes of the graph that carry its vertices.
#pragma once

#include <span>
#include <utility>

#include "register/matching/types.h"

namespace risorius::registering::steps {

/// The neighbours of each vertex along the edges of triangles. A vertex without triangles has none,
/// such as the second of two coinciding vertices if the triangles use only the first.
class Graph {
 public:
  Graph(std::size_t vertices, const std::vector<Triangle>& triangles);
  std::size_t size() const { return begin_.size() - 1; }
  std::span<const std::uint32_t> of(std::size_t v) const {
    return {next_.data() + begin_[v], begin_[v + 1] - begin_[v]};
  }

 private:
  std::vector<std::size_t> begin_;
  std::vector<std::uint32_t> next_;
};

/// Nodes spread over a surface. Regions with dense vertices have more nodes.
struct Nodes {
  std::vector<std::uint32_t> vertices;              // [N]
  std::vector<std::uint32_t> cell;                  // [V] the nearest node along the surface
  std::vector<std::array<std::uint32_t, 2>> edges;  // nodes whose cells touch
  /// [V] nodes that move a vertex, with weights of sum 1
  std::vector<std::vector<std::pair<std::uint32_t, float>>> carriers;
};

/// Chooses nodes and their carriers. In: count  number of nodes; each connected piece of the
/// surface gets at least one
Nodes spread(const Graph& graph, const Points& points, std::size_t count);

}  // namespace risorius::registering::steps
