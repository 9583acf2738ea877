// SPDX-License-Identifier: MIT
#include "register/closest.h"

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <utility>

#include "author/correctives/nearest.h"
#include "core/parallel_for.h"

namespace risorius::registering {

using author::detail::Nearest;
using author::detail::Vec3;
using core::ErrorCode;
using core::fail;

namespace {

Vec3 vec(const Vector3& v) { return {v[0], v[1], v[2]}; }

bool is_finite(const Vector3& v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

core::Status check_finite(const std::vector<Vector3>& values, const char* name) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!is_finite(values[i])) {
      return fail(ErrorCode::kInvalidValue, std::string(name) + "[" + std::to_string(i) + "]",
                  "finite numbers were expected");
    }
  }
  return core::ok();
}

ClosestPoints::Hit hit_of(const Nearest::Hit& found) {
  return {static_cast<std::int64_t>(found.triangle),
          {found.share[0], found.share[1], found.share[2]},
          found.distance};
}

}  // namespace

struct ClosestPoints::Impl {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
  std::vector<Vec3> normals;  // unit normals of the triangles; 0 for a triangle without area
  std::unique_ptr<Nearest> tree;
};

ClosestPoints::ClosestPoints(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ClosestPoints::~ClosestPoints() = default;
ClosestPoints::ClosestPoints(ClosestPoints&&) noexcept = default;
ClosestPoints& ClosestPoints::operator=(ClosestPoints&&) noexcept = default;

core::Result<ClosestPoints> ClosestPoints::make(std::vector<Vector3> points,
                                                std::vector<Triangle> triangles) {
  RISORIUS_TRY(check_finite(points, "points"));
  if (triangles.size() > kMostTriangles) {
    return fail(ErrorCode::kLimitExceeded, "triangles",
                "at most " + std::to_string(kMostTriangles) + " triangles were expected, found " +
                    std::to_string(triangles.size()));
  }
  auto impl = std::make_unique<Impl>();
  impl->points.reserve(points.size());
  for (const Vector3& p : points) impl->points.push_back(vec(p));
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (const std::uint32_t corner : triangles[t]) {
      if (corner < points.size()) continue;
      return fail(ErrorCode::kInvalidIndex, "triangles[" + std::to_string(t) + "]",
                  "a vertex below " + std::to_string(points.size()) + " was expected, found " +
                      std::to_string(corner));
    }
  }
  impl->triangles = std::move(triangles);
  impl->normals.reserve(impl->triangles.size());
  for (const Triangle& t : impl->triangles) {
    const Vec3 &a = impl->points[t[0]], &b = impl->points[t[1]], &c = impl->points[t[2]];
    impl->normals.push_back((b - a).cross(c - a).stableNormalized());
  }
  impl->tree = std::make_unique<Nearest>(impl->triangles, impl->points);
  return ClosestPoints(std::move(impl));
}

core::Result<std::vector<ClosestPoints::Hit>> ClosestPoints::nearest(
    const std::vector<Vector3>& queries, const std::vector<Vector3>& normals, Limits limits) const {
  RISORIUS_TRY(check_finite(queries, "queries"));
  if (!normals.empty() && normals.size() != queries.size()) {
    return fail(ErrorCode::kInvalidLength, "normals",
                std::to_string(queries.size()) + " normals were expected, found " +
                    std::to_string(normals.size()));
  }
  std::vector<Hit> out(queries.size());
  const bool any = normals.empty() || limits.least_cosine <= -1.0;
  core::parallel_for(
      queries.size(), limits.threads,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const Vec3 normal = any ? Vec3::Zero() : vec(normals[i]).stableNormalized();
          const auto takes = [&](std::uint32_t t) {
            return any || normal.dot(impl_->normals[t]) >= limits.least_cosine;
          };
          if (const auto found = impl_->tree->find(vec(queries[i]), limits.farthest, takes)) {
            out[i] = hit_of(*found);
          }
        }
      },
      16);
  return out;
}

core::Result<std::vector<ClosestPoints::Hit>> ClosestPoints::first_hit(
    const std::vector<Vector3>& origins, const std::vector<Vector3>& directions,
    Limits limits) const {
  RISORIUS_TRY(check_finite(origins, "origins"));
  RISORIUS_TRY(check_finite(directions, "directions"));
  if (directions.size() != origins.size()) {
    return fail(ErrorCode::kInvalidLength, "directions",
                std::to_string(origins.size()) + " directions were expected, found " +
                    std::to_string(directions.size()));
  }
  for (std::size_t i = 0; i < directions.size(); ++i) {
    if (vec(directions[i]).squaredNorm() > 0) continue;
    return fail(ErrorCode::kInvalidValue, "directions[" + std::to_string(i) + "]",
                "a direction was expected, found a vector of length 0");
  }
  std::vector<Hit> out(origins.size());
  core::parallel_for(
      origins.size(), limits.threads,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const Vec3 direction = vec(directions[i]).stableNormalized();
          if (const auto found =
                  impl_->tree->first_hit(vec(origins[i]), direction, limits.farthest)) {
            out[i] = hit_of(*found);
          }
        }
      },
      16);
  return out;
}

}  // namespace risorius::registering
