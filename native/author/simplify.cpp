// SPDX-License-Identifier: MIT
#include "author/simplify.h"

#include <meshoptimizer/meshoptimizer.h>

#include <algorithm>
#include <string>

#include "core/finite.h"

namespace risorius::author {

namespace {

constexpr std::size_t kMostAttributes = 32;  // meshoptimizer's own limit
constexpr float kAnyError = 1e6f;            // the number of triangles is what is asked for

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
  return out;
}

}  // namespace risorius::author
