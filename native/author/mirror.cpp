// SPDX-License-Identifier: MIT
// Finds the vertex and the expression on the other side of a symmetric face.
#include "author/mirror.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace risorius::author {

namespace {

double extent(const std::vector<Vector3>& points) {
  double widest = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [low, high] = std::minmax_element(
        points.begin(), points.end(), [k](const auto& a, const auto& b) { return a[k] < b[k]; });
    widest = std::max(widest, (*high)[k] - (*low)[k]);
  }
  return widest;
}

double squared(const Vector3& a, const Vector3& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

/// Vertices sorted by their y, so that only vertices of about the same y are compared.
class ByHeight {
 public:
  explicit ByHeight(const std::vector<Vector3>& points) : points_(points), order_(points.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return points[a][1] < points[b][1] || (points[a][1] == points[b][1] && a < b);
    });
  }

  /// The vertex that is nearest to a point, or Mirror::kNone if none is at most `reach` away.
  std::uint32_t nearest(const Vector3& point, double reach) const {
    const auto from =
        std::lower_bound(order_.begin(), order_.end(), point[1] - reach,
                         [&](std::uint32_t v, double height) { return points_[v][1] < height; });
    std::uint32_t best = Mirror::kNone;
    double least = reach * reach;
    for (auto at = from; at != order_.end() && points_[*at][1] <= point[1] + reach; ++at) {
      const double d = squared(points_[*at], point);
      if (d < least || (d == least && *at < best)) {
        least = d;
        best = *at;
      }
    }
    return best;
  }

 private:
  const std::vector<Vector3>& points_;
  std::vector<std::uint32_t> order_;
};

bool edges_agree(const std::vector<Edge>& edges, const std::vector<std::uint32_t>& other) {
  const auto sorted = [](std::uint32_t a, std::uint32_t b) {
    return Edge{std::min(a, b), std::max(a, b)};
  };
  std::vector<Edge> all;
  for (const Edge& e : edges) all.push_back(sorted(e[0], e[1]));
  std::sort(all.begin(), all.end());
  return std::all_of(edges.begin(), edges.end(), [&](const Edge& e) {
    return std::binary_search(all.begin(), all.end(), sorted(other[e[0]], other[e[1]]));
  });
}

/// The squared length of expression e, and the squared length of its difference from the mirrored
/// expression f. An expression is here a vector of all displacements.
/// In: other  [V] the vertex on the other side
std::array<double, 2> difference(const Shapes& shapes, const std::vector<std::uint32_t>& other,
                                 std::size_t e, std::size_t f) {
  double length = 0.0, apart = 0.0;
  for (std::size_t v = 0; v < shapes.vertex_count(); ++v) {
    const float* a = shapes.of_vertex(v) + e * 3;
    const float* b = shapes.of_vertex(other[v]) + f * 3;
    for (std::size_t k = 0; k < 3; ++k) {
      const double mirrored = k == 0 ? -double{b[k]} : double{b[k]};
      length += double{a[k]} * double{a[k]};
      apart += (double{a[k]} - mirrored) * (double{a[k]} - mirrored);
    }
  }
  return {length, apart};
}

}  // namespace

Mirror find_mirror(const Shapes& shapes) {
  const std::size_t n = shapes.vertex_count();
  Mirror out;
  const double reach = 5e-4 * extent(shapes.neutral);
  const ByHeight by_height(shapes.neutral);
  std::vector<std::uint32_t> other(n);
  for (std::size_t v = 0; v < n; ++v) {
    const Vector3& p = shapes.neutral[v];
    other[v] = by_height.nearest({-p[0], p[1], p[2]}, reach);
    if (other[v] == Mirror::kNone) return out;
  }
  for (std::size_t v = 0; v < n; ++v) {
    if (other[other[v]] != v) return out;
  }
  if (!edges_agree(shapes.edges, other)) return out;
  out.expressions.assign(shapes.expressions, Mirror::kNone);
  for (std::size_t e = 0; e < shapes.expressions; ++e) {
    for (std::size_t f = e; f < shapes.expressions && out.expressions[e] == Mirror::kNone; ++f) {
      if (out.expressions[f] != Mirror::kNone) continue;
      const auto [length, apart] = difference(shapes, other, e, f);
      if (apart <= 0.0025 * length) {
        out.expressions[e] = static_cast<std::uint32_t>(f);
        out.expressions[f] = static_cast<std::uint32_t>(e);
      }
    }
  }
  out.vertices = std::move(other);
  return out;
}

}  // namespace risorius::author
