// SPDX-License-Identifier: MIT
// Samples points evenly over a surface, and measures its bending around points.
#include "register/matching/samples.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel_for.h"

namespace risorius::registering::steps {

namespace {

/// Samples sorted into cubes of a grid, so that a search visits only nearby samples.
class Grid {
 public:
  Grid(const Points& points, double side) : side_(side) {
    if (points.empty()) return;
    low_ = points[0];
    Vec3 high = low_;
    for (const Vec3& p : points) {
      low_ = low_.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    while (count(high) > kMostCubes) side_ *= 2;
    for (int k = 0; k < 3; ++k) size_[k] = along(high, k) + 1;
    begin_.assign(static_cast<std::size_t>(size_[0] * size_[1] * size_[2]) + 1, 0);
    for (const Vec3& p : points) ++begin_[cube(p) + 1];
    for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
    order_.resize(points.size());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t i = 0; i < points.size(); ++i) order_[next[cube(points[i])]++] = i;
  }

  /// Calls visit(index) for all samples within a radius of p, and for some that are farther away.
  template <class Visit>
  void around(const Vec3& p, double radius, const Visit& visit) const {
    if (order_.empty()) return;
    std::array<long, 3> from{}, to{};
    for (int k = 0; k < 3; ++k) {
      from[k] = std::clamp(along(p - Vec3::Constant(radius), k), 0L, size_[k] - 1);
      to[k] = std::clamp(along(p + Vec3::Constant(radius), k), 0L, size_[k] - 1);
    }
    for (long x = from[0]; x <= to[0]; ++x) {
      for (long y = from[1]; y <= to[1]; ++y) {
        const auto row = static_cast<std::size_t>((x * size_[1] + y) * size_[2]);
        const std::size_t first = begin_[row + static_cast<std::size_t>(from[2])];
        const std::size_t last = begin_[row + static_cast<std::size_t>(to[2]) + 1];
        for (std::size_t i = first; i < last; ++i) visit(order_[i]);
      }
    }
  }

 private:
  static constexpr double kMostCubes = 4e6;
  long along(const Vec3& p, int k) const {
    return static_cast<long>(std::floor((p[k] - low_[k]) / side_));
  }
  double count(const Vec3& high) const {
    double cubes = 1;
    for (int k = 0; k < 3; ++k) cubes *= std::floor((high[k] - low_[k]) / side_) + 1;
    return cubes;
  }
  std::size_t cube(const Vec3& p) const {
    return static_cast<std::size_t>((along(p, 0) * size_[1] + along(p, 1)) * size_[2] +
                                    along(p, 2));
  }

  double side_;
  Vec3 low_ = Vec3::Zero();
  std::array<long, 3> size_{1, 1, 1};
  std::vector<std::uint32_t> begin_, order_;
};

Bend bend_of(const Vec3& point, const Vec3& normal, const Samples& around, const Grid& grid) {
  std::array<double, kRadii.size()> sum{}, above{};
  grid.around(point, kRadii.back(), [&](std::uint32_t i) {
    if (around.normals[i].dot(normal) <= 0) return;  // the other side of an ear or a lip
    const Vec3 way = around.points[i] - point;
    const double squared = way.squaredNorm();
    for (std::size_t k = 0; k < kRadii.size(); ++k) {
      const double share = 1 - squared / (kRadii[k] * kRadii[k]);
      if (share <= 0) continue;
      sum[k] += share;
      above[k] += share * way.dot(normal) / kRadii[k];
    }
  });
  Bend bend{};
  for (std::size_t k = 0; k < kRadii.size(); ++k) bend[k] = sum[k] > 0 ? above[k] / sum[k] : 0.0;
  return bend;
}

}  // namespace

Points vertex_normals(const Points& points, const std::vector<Triangle>& triangles) {
  Points normals(points.size(), Vec3::Zero());
  for (const Triangle& t : triangles) {
    const Vec3 flat =
        (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]).stableNormalized();
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 a = points[t[(k + 1) % 3]] - points[t[k]],
                 b = points[t[(k + 2) % 3]] - points[t[k]];
      normals[t[k]] += std::atan2(a.cross(b).norm(), a.dot(b)) * flat;
    }
  }
  for (Vec3& n : normals) n.stableNormalize();
  return normals;
}

std::vector<std::uint8_t> border_edges(const std::vector<Triangle>& triangles) {
  struct Side {
    std::uint32_t low, high, triangle;
    std::uint8_t bit;
    bool operator<(const Side& other) const {
      return std::pair(low, high) < std::pair(other.low, other.high);
    }
  };
  std::vector<Side> sides;
  sides.reserve(triangles.size() * 3);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]);
      sides.push_back({low, high, t, static_cast<std::uint8_t>(1U << k)});
    }
  }
  std::sort(sides.begin(), sides.end());
  std::vector<std::uint8_t> borders(triangles.size(), 0);
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const bool before = i > 0 && !(sides[i - 1] < sides[i]);
    const bool after = i + 1 < sides.size() && !(sides[i] < sides[i + 1]);
    if (!before && !after) borders[sides[i].triangle] |= sides[i].bit;
  }
  return borders;
}

Samples sample(const Form& form, const std::vector<std::uint8_t>& borders, std::size_t count) {
  Samples out;
  std::vector<double> areas;
  areas.reserve(form.triangles.size());
  double all = 0;
  for (const Triangle& t : form.triangles) {
    const Vec3 &a = form.points[t[0]], &b = form.points[t[1]], &c = form.points[t[2]];
    areas.push_back((b - a).cross(c - a).norm() / 2);
    all += areas.back();
  }
  if (!(all > 0)) return out;
  const double each = all / static_cast<double>(count);
  out.spacing = std::sqrt(each);
  double open = 0.5;
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    const Triangle& t = form.triangles[i];
    for (open += areas[i] / each; open >= 1; open -= 1) {
      // Points of Roberts' sequence are evenly spread in a square. Points beyond its diagonal are
      // reflected into the triangle.
      ++number;
      double u = std::fmod(static_cast<double>(number) * 0.7548776662466927, 1.0);
      double v = std::fmod(static_cast<double>(number) * 0.5698402909980532, 1.0);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const auto mix = [&](const Points& of) -> Vec3 {
        return (1 - u - v) * of[t[0]] + u * of[t[1]] + v * of[t[2]];
      };
      out.points.push_back(mix(form.points));
      out.normals.push_back(mix(form.normals).stableNormalized());
      out.border.push_back(borders[i]);
    }
  }
  return out;
}

std::vector<Bend> bends(const Points& points, const Points& normals, const Samples& around,
                        std::size_t threads) {
  std::vector<Bend> out(points.size());
  const Grid grid(around.points, kRadii.back() / 3);
  core::parallel_for(
      points.size(), threads,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          out[i] = bend_of(points[i], normals[i], around, grid);
        }
      },
      8);
  return out;
}

}  // namespace risorius::registering::steps
