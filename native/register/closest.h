// SPDX-License-Identifier: MIT
// The points of a surface that are closest to other points, and the first point on a ray.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "author/shapes.h"
#include "author/simplify.h"
#include "core/result.h"

namespace risorius::registering {

using author::Triangle;
using author::Vector3;

/// A surface of triangles in a search tree of boxes. It owns its points. Several threads may search
/// at the same time.
class ClosestPoints {
 public:
  static constexpr std::size_t kMostTriangles = 4'000'000;

  struct Hit {
    std::int64_t triangle = -1;  // -1: none
    Vector3 shares{};            // barycentric coordinates of the point, sum 1
    double distance = std::numeric_limits<double>::infinity();
  };
  struct Limits {
    double least_cosine = -1.0;  // least cosine between the normals of a query and its triangle
    double farthest = std::numeric_limits<double>::infinity();
    std::size_t threads = 0;  // 0: one for each core
  };

  /// Builds the search tree.
  /// In: points     [V] in any unit
  ///     triangles  counter-clockwise seen from outside
  /// Fails: kInvalidValue (a point that is not finite), kInvalidIndex (a corner), kLimitExceeded
  static core::Result<ClosestPoints> make(std::vector<Vector3> points,
                                          std::vector<Triangle> triangles);
  ~ClosestPoints();
  ClosestPoints(ClosestPoints&&) noexcept;
  ClosestPoints& operator=(ClosestPoints&&) noexcept;

  /// The closest point of the surface to each query; triangle -1 and an infinite distance if the
  /// limits allow none.
  /// In: normals  one for each query, of any length; triangles with too different normals
  ///              (Limits::least_cosine) are ignored; empty: every triangle counts
  /// Fails: kInvalidLength (normals), kInvalidValue (a query that is not finite)
  core::Result<std::vector<Hit>> nearest(const std::vector<Vector3>& queries,
                                         const std::vector<Vector3>& normals, Limits limits) const;
  /// The first point at which each ray meets the surface, from outside or inside. `distance` is in
  /// the unit of the points. Of the limits, least_cosine is ignored.
  /// Fails: kInvalidLength (directions), kInvalidValue (a ray that is not finite or has no
  ///        direction)
  core::Result<std::vector<Hit>> first_hit(const std::vector<Vector3>& origins,
                                           const std::vector<Vector3>& directions,
                                           Limits limits) const;

 private:
  struct Impl;
  explicit ClosestPoints(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace risorius::registering
