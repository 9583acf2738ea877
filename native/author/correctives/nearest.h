// SPDX-License-Identifier: MIT
// Finds the triangle that is nearest to a point or that a ray meets, in a tree of boxes.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "author/simplify.h"
#include "core/function_ref.h"

namespace risorius::author::detail {

using Vec3 = Eigen::Vector3d;

/// A search tree over the triangles of a surface. It refers to the triangles and positions that the
/// constructor gets; both must outlive the tree.
class Nearest {
 public:
  struct Hit {
    std::uint32_t triangle = 0;
    Vec3 share = Vec3::Zero();  // barycentric coordinates of the nearest point; sum 1
    Vec3 point = Vec3::Zero();
    double distance = 0.0;
  };

  Nearest(std::span<const Triangle> triangles, std::span<const Vec3> positions);

  /// Whether a ray meets a triangle. In: direction  of any length
  bool is_blocked(const Vec3& from, const Vec3& direction) const;
  /// The first triangle that a ray meets, at its front or back, if it is nearer than `reach`.
  /// In: direction  of length 1
  std::optional<Hit> first_hit(const Vec3& from, const Vec3& direction, double reach) const;
  /// The triangle that is nearest to p, if it is nearer than `reach`. Only triangles for whose
  /// index `takes` returns true are searched.
  std::optional<Hit> find(const Vec3& p, double reach,
                          core::FunctionRef<bool(std::uint32_t)> takes) const;

 private:
  struct Box {
    Vec3 low, high;
    std::uint32_t begin = 0, end = 0;  // range in order_
    std::uint32_t second = 0;          // the first child follows its parent; 0: a leaf
  };
  std::uint32_t grow(std::uint32_t begin, std::uint32_t end);
  void look(const Vec3& p, std::uint32_t box, core::FunctionRef<bool(std::uint32_t)> takes,
            double& squared, Hit& best) const;

  std::span<const Triangle> triangles_;
  std::span<const Vec3> positions_;
  std::vector<std::uint32_t> order_;
  std::vector<Vec3> middles_;
  std::vector<Box> boxes_;
};

/// Barycentric coordinates of the point of triangle a, b, c that is nearest to p.
/// Source: Ericson, "Real-Time Collision Detection" (2005), section 5.1.5
Vec3 nearest_shares(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace risorius::author::detail
