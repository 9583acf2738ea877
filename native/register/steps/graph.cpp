// SPDX-License-Identifier: MIT
// Builds the graph of a template's vertices, and spreads nodes over it that carry the vertices.
#include "register/steps/graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <set>

namespace risorius::registering::steps {

namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr double kReach = 2.2;  // radius in which a node moves vertices, in spacings of nodes

using Open = std::pair<double, std::uint32_t>;
using Queue = std::priority_queue<Open, std::vector<Open>, std::greater<>>;

/// Lengths of edges for the distance between nodes. Short edges count as longer than they are, so
/// that dense regions get more nodes.
class Metric {
 public:
  Metric(const Graph& graph, const Points& points) : points_(points) {
    double sum = 0;
    std::size_t count = 0;
    for (std::uint32_t v = 0; v < graph.size(); ++v) {
      for (const std::uint32_t other : graph.of(v)) {
        sum += (points[v] - points[other]).norm();
        ++count;
      }
    }
    mean_ = count > 0 ? sum / static_cast<double>(count) : 1.0;
  }
  double operator()(std::uint32_t a, std::uint32_t b) const {
    return std::sqrt((points_[a] - points_[b]).norm() * mean_);
  }

 private:
  const Points& points_;
  double mean_ = 1.0;
};

/// Makes vertex `from` a node. Updates `distance` and `cell` of the vertices to which it is the
/// nearest node.
void grow(const Graph& graph, const Metric& metric, std::uint32_t from, std::uint32_t node,
          std::vector<double>& distance, std::vector<std::uint32_t>& cell) {
  Queue open;
  distance[from] = 0;
  cell[from] = node;
  open.emplace(0.0, from);
  while (!open.empty()) {
    const auto [far, v] = open.top();
    open.pop();
    if (far > distance[v]) continue;
    for (const std::uint32_t next : graph.of(v)) {
      const double there = far + metric(v, next);
      if (there >= distance[next]) continue;
      distance[next] = there;
      cell[next] = node;
      open.emplace(there, next);
    }
  }
}

std::vector<std::array<std::uint32_t, 2>> touching(const Graph& graph,
                                                   const std::vector<std::uint32_t>& cell) {
  std::set<std::array<std::uint32_t, 2>> found;
  for (std::uint32_t v = 0; v < graph.size(); ++v) {
    for (const std::uint32_t next : graph.of(v)) {
      if (cell[v] < cell[next]) found.insert({cell[v], cell[next]});
    }
  }
  return {found.begin(), found.end()};
}

/// Sets each vertex's carriers: the nodes within `reach` along the surface, with weights that fall
/// off smoothly with the distance.
void carry(const Graph& graph, const Metric& metric, double reach, Nodes& nodes) {
  nodes.carriers.assign(graph.size(), {});
  std::vector<double> distance(graph.size(), kFar);
  std::vector<std::uint32_t> seen;
  for (std::uint32_t n = 0; n < nodes.vertices.size(); ++n) {
    Queue open;
    distance[nodes.vertices[n]] = 0;
    seen.assign(1, nodes.vertices[n]);
    open.emplace(0.0, nodes.vertices[n]);
    while (!open.empty()) {
      const auto [far, v] = open.top();
      open.pop();
      if (far > distance[v]) continue;
      for (const std::uint32_t next : graph.of(v)) {
        const double there = far + metric(v, next);
        if (there >= reach || there >= distance[next]) continue;
        if (distance[next] == kFar) seen.push_back(next);
        distance[next] = there;
        open.emplace(there, next);
      }
    }
    for (const std::uint32_t v : seen) {
      const double t = 1 - distance[v] * distance[v] / (reach * reach);
      if (t > 1e-3) nodes.carriers[v].emplace_back(n, static_cast<float>(t * t * t));
      distance[v] = kFar;
    }
  }
  for (std::uint32_t v = 0; v < graph.size(); ++v) {
    auto& of = nodes.carriers[v];
    if (of.empty()) of.emplace_back(nodes.cell[v], 1.0F);
    float sum = 0;
    for (const auto& [node, share] : of) sum += share;
    for (auto& [node, share] : of) share /= sum;
  }
}

}  // namespace

Graph::Graph(std::size_t vertices, const std::vector<Triangle>& triangles) {
  std::vector<std::array<std::uint32_t, 2>> ways;
  ways.reserve(triangles.size() * 6);
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if (a == b) continue;
      ways.push_back({a, b});
      ways.push_back({b, a});
    }
  }
  std::sort(ways.begin(), ways.end());
  ways.erase(std::unique(ways.begin(), ways.end()), ways.end());
  begin_.assign(vertices + 1, 0);
  next_.reserve(ways.size());
  for (const auto& way : ways) {
    ++begin_[way[0] + 1];
    next_.push_back(way[1]);
  }
  for (std::size_t v = 0; v < vertices; ++v) begin_[v + 1] += begin_[v];
}

Nodes spread(const Graph& graph, const Points& points, std::size_t count) {
  const Metric metric(graph, points);
  const std::size_t vertices = graph.size();
  count = std::min(count, vertices);
  Nodes nodes;
  nodes.cell.assign(vertices, 0);
  std::vector<double> distance(vertices, kFar);
  // The vertex that is farthest from all nodes is the next node. Distances in the heap may be
  // outdated and too large; they are then replaced.
  std::priority_queue<Open> farthest;
  for (std::uint32_t v = 0; v < vertices; ++v) farthest.emplace(kFar, v);
  double spacing = 0;
  while (!farthest.empty()) {
    const auto [far, v] = farthest.top();
    farthest.pop();
    if (far > distance[v]) {
      farthest.emplace(distance[v], v);
      continue;
    }
    if (nodes.vertices.size() >= count && far < kFar) break;
    if (!(far > 0)) break;
    spacing = far < kFar ? far : spacing;
    grow(graph, metric, v, static_cast<std::uint32_t>(nodes.vertices.size()), distance, nodes.cell);
    nodes.vertices.push_back(v);
  }
  nodes.edges = touching(graph, nodes.cell);
  carry(graph, metric, std::max(kReach * spacing, 1e-9), nodes);
  return nodes;
}

}  // namespace risorius::registering::steps
