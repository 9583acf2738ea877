// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <string>

#include "author/fitting/prepare.h"
#include "core/finite.h"

namespace risorius::author::detail {

namespace {

using core::ErrorCode;

core::Status check_mesh(const Shapes& shapes) {
  const std::size_t n = shapes.vertex_count();
  for (const Edge& e : shapes.edges) {
    if (e[0] < n && e[1] < n) continue;
    return core::fail(
        ErrorCode::kInvalidIndex, "edges",
        "an edge has vertex " + std::to_string(std::max(e[0], e[1])) + " of " + std::to_string(n));
  }
  for (std::size_t v = 0; v < n; ++v) {
    for (const double x : shapes.neutral[v]) {
      if (!std::isfinite(x)) {
        return core::fail(ErrorCode::kInvalidValue, "neutral[" + std::to_string(v) + "]",
                          "a finite number was expected");
      }
    }
  }
  if (!shapes.importance.empty() && shapes.importance.size() != n) {
    return core::fail(ErrorCode::kInvalidLength, "importance",
                      std::to_string(n) + " numbers or none were expected, found " +
                          std::to_string(shapes.importance.size()));
  }
  for (std::size_t v = 0; v < shapes.importance.size(); ++v) {
    if (shapes.importance[v] > 0.0 && std::isfinite(shapes.importance[v])) continue;
    return core::fail(ErrorCode::kInvalidValue, "importance[" + std::to_string(v) + "]",
                      "a finite number above 0 was expected");
  }
  return core::ok();
}

core::Status check_displacements(const Shapes& shapes) {
  double most = 0.0;
  for (std::size_t i = 0; i < shapes.displacements.size(); ++i) {
    const float d = shapes.displacements[i];
    if (!core::is_finite(d)) {
      return core::fail(ErrorCode::kInvalidValue,
                        "displacements[" + std::to_string(i / 3 / shapes.expressions) + "][" +
                            std::to_string(i / 3 % shapes.expressions) + "]",
                        "a finite number was expected");
    }
    most = std::max(most, std::abs(double{d}));
  }
  if (most <= 0.0)
    return core::fail(ErrorCode::kInvalidValue, "displacements", "no expression moves a vertex");
  return core::ok();
}

core::Status check_given(const std::vector<GivenJoint>& given, std::size_t expressions) {
  for (std::size_t j = 0; j < given.size(); ++j) {
    const std::uint32_t other = given[j].mirrored;
    if (other == GivenJoint::kUnknown) continue;
    if (other < given.size() && given[other].mirrored == j) continue;
    return core::fail(ErrorCode::kInvalidIndex, "given[" + std::to_string(j) + "]",
                      "a pair of joints that name each other as the other side was expected");
  }
  for (const GivenJoint& g : given) {
    if (g.motions.empty() || g.motions.size() == expressions) continue;
    return core::fail(ErrorCode::kInvalidLength, "given",
                      "motions of " + std::to_string(expressions) +
                          " expressions or none were expected, found " +
                          std::to_string(g.motions.size()));
  }
  return core::ok();
}

core::Status check_pivots(const std::vector<Pivot>& pivots, std::size_t expressions) {
  for (std::size_t i = 0; i < pivots.size(); ++i) {
    const Pivot& pivot = pivots[i];
    const std::string place = "pivots[" + std::to_string(i) + "]";
    for (const double x : pivot.position) {
      if (!std::isfinite(x))
        return core::fail(ErrorCode::kInvalidValue, place, "a finite number was expected");
    }
    for (const std::uint32_t e : pivot.expressions) {
      if (e < expressions) continue;
      return core::fail(ErrorCode::kInvalidIndex, place,
                        "expression " + std::to_string(e) + " of " + std::to_string(expressions));
    }
  }
  return core::ok();
}

core::Status check_numbers(const FitOptions& options) {
  const std::size_t needed = options.given.size() + 2;
  if (options.joints < needed || options.joints > 4096) {
    return core::fail(
        ErrorCode::kInvalidArgument, "joints",
        std::to_string(needed) + " to 4096 were expected, found " + std::to_string(options.joints));
  }
  if (options.influences < 1 || options.influences > 16) {
    return core::fail(ErrorCode::kInvalidArgument, "influences",
                      "1 to 16 were expected, found " + std::to_string(options.influences));
  }
  if (!(options.least_effect >= 0.0 && std::isfinite(options.least_effect))) {
    return core::fail(ErrorCode::kInvalidArgument, "least_effect",
                      "a finite number of 0 or more was expected");
  }
  for (const double x : {options.smoothness, options.emphasis}) {
    if (!(x >= 0.0 && x <= 100.0)) {
      return core::fail(ErrorCode::kInvalidArgument, "smoothness, emphasis",
                        "0 to 100 were expected");
    }
  }
  return core::ok();
}

}  // namespace

core::Status check(const Shapes& shapes, const FitOptions& options) {
  const std::size_t n = shapes.vertex_count(), values = n * shapes.expressions * 3;
  if (n == 0 || shapes.expressions == 0) {
    return core::fail(ErrorCode::kInvalidArgument, "shapes",
                      "a mesh and at least one expression were expected");
  }
  if (shapes.displacements.size() != values) {
    return core::fail(ErrorCode::kInvalidArgument, "displacements",
                      std::to_string(values) + " numbers were expected, found " +
                          std::to_string(shapes.displacements.size()));
  }
  RISORIUS_TRY(check_mesh(shapes));
  RISORIUS_TRY(check_displacements(shapes));
  RISORIUS_TRY(check_given(options.given, shapes.expressions));
  RISORIUS_TRY(check_pivots(options.pivots, shapes.expressions));
  RISORIUS_TRY(check_numbers(options));
  return core::ok();
}

}  // namespace risorius::author::detail
