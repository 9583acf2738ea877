// SPDX-License-Identifier: MIT
// Finds the triangle that is nearest to a point or that a ray meets, in a tree of boxes.
#include "author/correctives/nearest.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace risorius::author::detail {

namespace {

constexpr std::uint32_t kLeaf = 6;  // triangles of a box that is not divided further

double squared_to_box(const Vec3& p, const Vec3& low, const Vec3& high) {
  return (p - p.cwiseMax(low).cwiseMin(high)).squaredNorm();
}

/// Whether a ray passes through a box (Kay and Kajiya 1986).
/// In: inverse  1 / the ray's direction, for each axis
bool passes(const Vec3& from, const Vec3& inverse, const Vec3& low, const Vec3& high) {
  const Vec3 a = (low - from).cwiseProduct(inverse), b = (high - from).cwiseProduct(inverse);
  return std::max(a.cwiseMin(b).maxCoeff(), 0.0) <= a.cwiseMax(b).minCoeff();
}

/// The point at which the ray from `from` along `way` meets triangle a, b, c. Its parts are the
/// barycentric coordinates of b and of c, and the distance from `from` divided by the length of
/// `way`. Nullopt if the ray misses the triangle or is parallel to it.
/// Source: Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection" (1997)
std::optional<Vec3> meeting(const Vec3& from, const Vec3& way, const Vec3& a, const Vec3& b,
                            const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, across = way.cross(ac);
  const double turn = ab.dot(across);
  if (std::abs(turn) < 1e-12) return std::nullopt;
  const Vec3 to = from - a, up = to.cross(ab);
  const double u = to.dot(across) / turn, v = way.dot(up) / turn, times = ac.dot(up) / turn;
  if (!(u >= 0 && v >= 0 && u + v <= 1 && times > 0)) return std::nullopt;
  return Vec3(u, v, times);
}

}  // namespace

Vec3 nearest_shares(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const double sum = va + vb + vc;
  if (!(sum > 0)) return {1, 0, 0};  // a triangle without an area
  return {va / sum, vb / sum, vc / sum};
}

Nearest::Nearest(std::span<const Triangle> triangles, std::span<const Vec3> positions)
    : triangles_(triangles), positions_(positions), order_(triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  middles_.reserve(triangles.size());
  for (const Triangle& t : triangles) {
    middles_.push_back((positions[t[0]] + positions[t[1]] + positions[t[2]]) / 3.0);
  }
  if (!order_.empty()) grow(0, static_cast<std::uint32_t>(order_.size()));
}

std::uint32_t Nearest::grow(std::uint32_t begin, std::uint32_t end) {
  const auto at = static_cast<std::uint32_t>(boxes_.size());
  Box box{positions_[triangles_[order_[begin]][0]], positions_[triangles_[order_[begin]][0]], begin,
          end, 0};
  for (std::uint32_t i = begin; i < end; ++i) {
    for (const std::uint32_t corner : triangles_[order_[i]]) {
      box.low = box.low.cwiseMin(positions_[corner]);
      box.high = box.high.cwiseMax(positions_[corner]);
    }
  }
  boxes_.push_back(box);
  if (end - begin <= kLeaf) return at;
  Eigen::Index axis = 0;
  (box.high - box.low).maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     return middles_[a][axis] != middles_[b][axis]
                                ? middles_[a][axis] < middles_[b][axis]
                                : a < b;
                   });
  grow(begin, middle);
  boxes_[at].second = grow(middle, end);
  return at;
}

std::optional<Nearest::Hit> Nearest::find(const Vec3& p, double reach,
                                          core::FunctionRef<bool(std::uint32_t)> takes) const {
  double squared = reach * reach;
  Hit best;
  const double before = squared;
  if (!boxes_.empty()) look(p, 0, takes, squared, best);
  if (!(squared < before)) return std::nullopt;
  best.distance = std::sqrt(squared);
  return best;
}

bool Nearest::is_blocked(const Vec3& from, const Vec3& direction) const {
  const Vec3 inverse = direction.cwiseInverse();
  std::vector<std::uint32_t> open;
  if (!boxes_.empty()) open.push_back(0);
  while (!open.empty()) {
    const std::uint32_t at = open.back();
    const Box& box = boxes_[at];
    open.pop_back();
    if (!passes(from, inverse, box.low, box.high)) continue;
    if (box.second != 0) {
      open.push_back(at + 1);
      open.push_back(box.second);
      continue;
    }
    for (std::uint32_t i = box.begin; i < box.end; ++i) {
      const Triangle& t = triangles_[order_[i]];
      if (meeting(from, direction, positions_[t[0]], positions_[t[1]], positions_[t[2]]))
        return true;
    }
  }
  return false;
}

std::optional<Nearest::Hit> Nearest::first_hit(const Vec3& from, const Vec3& direction,
                                               double reach) const {
  const Vec3 inverse = direction.cwiseInverse();
  std::optional<Hit> best;
  std::vector<std::uint32_t> open;
  if (!boxes_.empty()) open.push_back(0);
  while (!open.empty()) {
    const std::uint32_t at = open.back();
    const Box& box = boxes_[at];
    open.pop_back();
    if (!passes(from, inverse, box.low, box.high)) continue;
    if (squared_to_box(from, box.low, box.high) >= reach * reach) continue;
    if (box.second != 0) {
      open.push_back(at + 1);
      open.push_back(box.second);
      continue;
    }
    for (std::uint32_t i = box.begin; i < box.end; ++i) {
      const Triangle& t = triangles_[order_[i]];
      const Vec3 &a = positions_[t[0]], &b = positions_[t[1]], &c = positions_[t[2]];
      const std::optional<Vec3> met = meeting(from, direction, a, b, c);
      if (!met || (*met)[2] >= reach) continue;
      reach = (*met)[2];
      const Vec3 share(1 - (*met)[0] - (*met)[1], (*met)[0], (*met)[1]);
      best = Hit{order_[i], share, from + reach * direction, reach};
    }
  }
  return best;
}

void Nearest::look(const Vec3& p, std::uint32_t at, core::FunctionRef<bool(std::uint32_t)> takes,
                   double& squared, Hit& best) const {
  const Box& box = boxes_[at];
  if (squared_to_box(p, box.low, box.high) >= squared) return;
  if (box.second != 0) {
    const Box &first = boxes_[at + 1], &second = boxes_[box.second];
    const bool turned =
        squared_to_box(p, second.low, second.high) < squared_to_box(p, first.low, first.high);
    look(p, turned ? box.second : at + 1, takes, squared, best);
    look(p, turned ? at + 1 : box.second, takes, squared, best);
    return;
  }
  for (std::uint32_t i = box.begin; i < box.end; ++i) {
    const Triangle& t = triangles_[order_[i]];
    const Vec3 &a = positions_[t[0]], &b = positions_[t[1]], &c = positions_[t[2]];
    const Vec3 share = nearest_shares(p, a, b, c);
    const Vec3 point = share[0] * a + share[1] * b + share[2] * c;
    const double here = (p - point).squaredNorm();
    if (here >= squared || !takes(order_[i])) continue;
    squared = here;
    best = {order_[i], share, point, 0.0};
  }
}

}  // namespace risorius::author::detail
