// SPDX-License-Identifier: MIT
// Reduces the triangles of a mesh with meshoptimizer, then mends slivers: triangles that are
// almost lines.
#include "author/simplify.h"

#include <meshoptimizer/meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "core/finite.h"

namespace risorius::author {

namespace {

constexpr std::size_t kMostAttributes = 32;  // meshoptimizer's own limit
constexpr float kAnyError = 1e6f;            // the target is the number of triangles, not the error

core::Status check(const Surface& surface) {
  using core::ErrorCode;
  const std::size_t corners = surface.positions.size();
  if (surface.attribute_count > kMostAttributes) {
    return core::fail(ErrorCode::kInvalidArgument, "attributes",
                      "at most 32 were expected, found " + std::to_string(surface.attribute_count));
  }
  if (surface.attributes.size() != corners * surface.attribute_count) {
    return core::fail(ErrorCode::kInvalidLength, "attributes",
                      std::to_string(corners * surface.attribute_count) +
                          " numbers were expected, found " +
                          std::to_string(surface.attributes.size()));
  }
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const std::uint32_t most =
        *std::max_element(surface.triangles[t].begin(), surface.triangles[t].end());
    if (most < corners) continue;
    return core::fail(ErrorCode::kInvalidIndex, "triangles[" + std::to_string(t) + "]",
                      "corner " + std::to_string(most) + " of " + std::to_string(corners));
  }
  const auto finite = [](float x) { return core::is_finite(x); };
  for (std::size_t c = 0; c < corners; ++c) {
    if (std::all_of(surface.positions[c].begin(), surface.positions[c].end(), finite)) continue;
    return core::fail(ErrorCode::kInvalidValue, "positions[" + std::to_string(c) + "]",
                      "finite numbers were expected");
  }
  if (!std::all_of(surface.attributes.begin(), surface.attributes.end(), finite)) {
    return core::fail(ErrorCode::kInvalidValue, "attributes", "finite numbers were expected");
  }
  return core::ok();
}

using Point = std::array<double, 3>;

constexpr int kPasses = 8;
// A triangle is a sliver if its area divided by its squared longest edge is below this; an
// equilateral triangle has 0.43.
constexpr double kSliver = 0.06;
constexpr double kBetter = 1.5;     // factor by which the worse of two triangles has to improve
constexpr double kAsOneFace = 0.8;  // least cosine between the new normals and the old mean
constexpr double kGap = 0.04;  // largest distance of the old from the new edge / the shorter edge

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Point& a) { return std::sqrt(dot(a, a)); }

/// Mends slivers of a mesh: flips the common edge of two triangles if one of them is a sliver and
/// both lie in nearly one plane. No corner moves.
class Slivers {
 public:
  Slivers(const Surface& surface, std::vector<Triangle>& triangles)
      : surface_(surface), triangles_(triangles), place_(surface.positions.size()) {
    std::map<std::array<float, 3>, std::uint32_t> places;
    for (std::size_t c = 0; c < place_.size(); ++c) {
      place_[c] =
          places.try_emplace(surface.positions[c], static_cast<std::uint32_t>(c)).first->second;
    }
  }

  void mend() {
    for (int pass = 0; pass < kPasses; ++pass) {
      if (!turn_some()) return;
    }
  }

 private:
  struct Side {
    std::uint32_t triangle = 0, other = 0;  // a triangle at the edge, and its corner off the edge
  };
  using Edge = std::pair<std::uint32_t, std::uint32_t>;

  Point point(std::uint32_t corner) const {
    const auto& p = surface_.positions[corner];
    return {p[0], p[1], p[2]};
  }
  Point normal(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return cross(minus(point(b), point(a)), minus(point(c), point(a)));
  }
  double quality(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    const double longest =
        std::max({length(minus(point(b), point(a))), length(minus(point(c), point(b))),
                  length(minus(point(a), point(c)))});
    return longest > 0 ? 0.5 * length(normal(a, b, c)) / (longest * longest) : 0.0;
  }
  Edge by_place(std::uint32_t a, std::uint32_t b) const {
    return std::minmax(place_[a], place_[b]);
  }

  bool turn_some() {
    // The keys of `sides` are pairs of corners, not of positions: two triangles on the two sides of
    // a seam do not share an edge, so that the seam is never flipped.
    std::map<Edge, std::vector<Side>> sides;
    std::map<Edge, int> edges;
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
        sides[std::minmax(a, b)].push_back({t, triangles_[t][(k + 2) % 3]});
        ++edges[by_place(a, b)];
      }
    }
    std::vector<bool> touched(triangles_.size(), false);
    bool turned = false;
    for (const auto& [edge, found] : sides) {
      if (found.size() != 2 || touched[found[0].triangle] || touched[found[1].triangle]) continue;
      if (edges[by_place(found[0].other, found[1].other)] > 0 || !turn(edge, found)) continue;
      edges[by_place(found[0].other, found[1].other)] += 2;
      touched[found[0].triangle] = touched[found[1].triangle] = turned = true;
    }
    return turned;
  }

  bool turn(const Edge& edge, const std::vector<Side>& found) {
    Triangle& first = triangles_[found[0].triangle];
    std::uint32_t a = edge.first, b = edge.second;
    const std::uint32_t c = found[0].other, d = found[1].other;
    const auto at = static_cast<std::size_t>(std::ranges::find(first, a) - first.begin());
    if (first[(at + 1) % 3] != b) std::swap(a, b);
    const double before = std::min(quality(a, b, c), quality(b, a, d));
    if (before > kSliver) return false;
    if (std::min(quality(a, d, c), quality(d, b, c)) < kBetter * before + 1e-6) return false;
    const Point ab = minus(point(b), point(a)), cd = minus(point(d), point(c));
    const Point across = cross(ab, cd);
    const double apart = std::abs(dot(across, minus(point(c), point(a))));
    if (apart > kGap * std::min(length(ab), length(cd)) * length(across)) return false;
    const Point one = normal(a, b, c), two = normal(b, a, d);
    const Point both{one[0] + two[0], one[1] + two[1], one[2] + two[2]};
    for (const Point& n : {normal(a, d, c), normal(d, b, c)}) {
      if (dot(n, both) < kAsOneFace * length(n) * length(both)) return false;
    }
    first = {a, d, c};
    triangles_[found[1].triangle] = {d, b, c};
    return true;
  }

  const Surface& surface_;
  std::vector<Triangle>& triangles_;
  std::vector<std::uint32_t> place_;  // [corners] the first corner at its place
};

}  // namespace

core::Result<Simplified> simplify(const Surface& surface, std::size_t triangles) {
  RISORIUS_TRY(check(surface));
  Simplified out;
  if (triangles >= surface.triangles.size()) {
    out.triangles = surface.triangles;
    return out;
  }
  out.triangles.resize(surface.triangles.size());
  const std::vector<float> weights(std::max<std::size_t>(surface.attribute_count, 1), 1.0f);
  float error = 0.0f;
  const std::size_t found = meshopt_simplifyWithAttributes(
      out.triangles.front().data(), surface.triangles.front().data(), 3 * surface.triangles.size(),
      surface.positions.front().data(), surface.positions.size(), sizeof(surface.positions.front()),
      surface.attributes.data(), surface.attribute_count * sizeof(float), weights.data(),
      surface.attribute_count, nullptr, 3 * triangles, kAnyError, 0, &error);
  out.triangles.resize(found / 3);
  out.error = static_cast<double>(error);
  Slivers(surface, out.triangles).mend();
  return out;
}

}  // namespace risorius::author
