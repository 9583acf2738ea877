// SPDX-License-Identifier: MIT
#include "author/correct.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "author/correctives/topology.h"
#include "core/finite.h"

namespace risorius::author {

using core::ErrorCode;

struct SkinChecker::Impl {
  detail::Topology topology;
};

namespace {

core::Status check_finite(const std::vector<Vector3>& rows, const std::string& name) {
  for (std::size_t v = 0; v < rows.size(); ++v) {
    if (std::ranges::all_of(rows[v], [](double x) { return std::isfinite(x); })) continue;
    return core::fail(ErrorCode::kInvalidValue, name + "[" + std::to_string(v) + "]",
                      "finite numbers were expected");
  }
  return core::ok();
}

core::Status check_length(std::size_t found, std::size_t expected, const std::string& name) {
  if (found == expected) return core::ok();
  return core::fail(
      ErrorCode::kInvalidLength, name,
      std::to_string(expected) + " rows were expected, found " + std::to_string(found));
}

core::Status check(const Skin& skin) {
  RISORIUS_TRY(check_finite(skin.neutral, "neutral"));
  const auto& offsets = skin.face_offsets;
  if (offsets.empty() || offsets.front() != 0 || offsets.back() != skin.corners.size() ||
      !std::ranges::is_sorted(offsets)) {
    return core::fail(ErrorCode::kInvalidLength, "face_offsets",
                      "ascending from 0 to the number of corners was expected");
  }
  for (std::size_t c = 0; c < skin.corners.size(); ++c) {
    if (skin.corners[c] < skin.neutral.size()) continue;
    return core::fail(
        ErrorCode::kInvalidIndex, "corners[" + std::to_string(c) + "]",
        "vertex " + std::to_string(skin.corners[c]) + " of " + std::to_string(skin.neutral.size()));
  }
  if (skin.corners.size() < 3) {
    return core::fail(ErrorCode::kInvalidLength, "corners", "a face at least was expected");
  }
  for (std::size_t s = 0; s < skin.solids.size(); ++s) {
    for (const Triangle& t : skin.solids[s].triangles) {
      if (std::ranges::max(t) < skin.solids[s].vertices) continue;
      return core::fail(ErrorCode::kInvalidIndex, "solids[" + std::to_string(s) + "]",
                        "vertex " + std::to_string(std::ranges::max(t)) + " of " +
                            std::to_string(skin.solids[s].vertices));
    }
  }
  if (!(skin.mm > 0.0) || !std::isfinite(skin.mm)) {
    return core::fail(ErrorCode::kInvalidValue, "mm", "a number above 0 was expected");
  }
  return core::ok();
}

std::vector<detail::Vec3> scaled(const std::vector<Vector3>& rows, double scale) {
  std::vector<detail::Vec3> to;
  to.reserve(rows.size());
  for (const Vector3& p : rows) to.emplace_back(scale * detail::Vec3(p[0], p[1], p[2]));
  return to;
}

core::Result<detail::Placed> placed(const detail::Topology& topology, const SkinPose& pose) {
  const Skin& skin = topology.skin;
  RISORIUS_TRY(check_length(pose.skin.size(), skin.neutral.size(), "skin"));
  RISORIUS_TRY(check_length(pose.solids.size(), skin.solids.size(), "solids"));
  RISORIUS_TRY(check_finite(pose.skin, "skin"));
  detail::Placed out;
  out.skin = scaled(pose.skin, skin.mm);
  for (std::size_t s = 0; s < pose.solids.size(); ++s) {
    const std::string name = "solids[" + std::to_string(s) + "]";
    RISORIUS_TRY(check_length(pose.solids[s].size(), skin.solids[s].vertices, name));
    RISORIUS_TRY(check_finite(pose.solids[s], name));
    out.solids.push_back(scaled(pose.solids[s], skin.mm));
  }
  return out;
}

core::Status check_faults(const detail::Topology& topology, const SkinFaults& faults) {
  RISORIUS_TRY(check_length(faults.depth.size(), topology.neutral.size(), "depth"));
  RISORIUS_TRY(check_length(faults.stretch.size(), topology.face_count(), "stretch"));
  return check_length(faults.fold.size(), topology.hinges.size(), "fold");
}

}  // namespace

SkinChecker::SkinChecker(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SkinChecker::~SkinChecker() = default;
SkinChecker::SkinChecker(SkinChecker&&) noexcept = default;
SkinChecker& SkinChecker::operator=(SkinChecker&&) noexcept = default;

core::Result<SkinChecker> SkinChecker::make(Skin skin) {
  RISORIUS_TRY(check(skin));
  return SkinChecker(std::make_unique<Impl>(Impl{detail::make_topology(std::move(skin))}));
}

const std::vector<bool>& SkinChecker::shown() const { return impl_->topology.shown; }

core::Result<std::vector<SkinChecker::Place>> SkinChecker::nearest(
    const std::vector<Vector3>& points, const std::vector<Vector3>& normals) const {
  RISORIUS_TRY(check_finite(points, "points"));
  RISORIUS_TRY(check_finite(normals, "normals"));
  if (!normals.empty()) RISORIUS_TRY(check_length(normals.size(), points.size(), "normals"));
  constexpr double kAlike = 0.3;  // cosine
  const auto& topology = impl_->topology;
  const detail::Nearest surface(topology.triangles, topology.neutral);
  const auto ways = scaled(normals, 1.0);
  const auto places = scaled(points, topology.skin.mm);
  const auto any = [](std::uint32_t) { return true; };
  std::vector<Place> out;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto alike = [&](std::uint32_t t) {
      return ways.empty() || topology.triangle_normals[t].dot(ways[i]) > kAlike * ways[i].norm();
    };
    constexpr double kAnywhere = std::numeric_limits<double>::infinity();
    auto hit = surface.find(places[i], kAnywhere, alike);
    if (!hit) hit = surface.find(places[i], kAnywhere, any);
    out.push_back({topology.triangles[hit->triangle],
                   {hit->share[0], hit->share[1], hit->share[2]},
                   hit->distance});
  }
  return out;
}

core::Result<SkinFaults> SkinChecker::look(const SkinPose& pose) const {
  const auto& topology = impl_->topology;
  auto here = placed(topology, pose);
  if (!here) return std::move(here).propagate();
  const detail::SolidSurfaces solids(topology, *here);
  return find_faults(topology, here->skin,
                     find_contacts(topology, topology.whole, solids, here->skin));
}

core::Result<FaultSums> SkinChecker::sum(const SkinFaults& faults,
                                         const SkinFaults& allowed) const {
  RISORIUS_TRY(check_faults(impl_->topology, faults));
  RISORIUS_TRY(check_faults(impl_->topology, allowed));
  return sum_faults(impl_->topology, faults, allowed);
}

core::Result<Repair> SkinChecker::repair(const SkinPose& pose, const SkinFaults& allowed,
                                         const std::vector<std::vector<Vector3>>& without) const {
  auto here = placed(impl_->topology, pose);
  if (!here) return std::move(here).propagate();
  RISORIUS_TRY(check_faults(impl_->topology, allowed));
  std::vector<std::vector<detail::Vec3>> others;
  for (std::size_t i = 0; i < without.size(); ++i) {
    const std::string name = "without[" + std::to_string(i) + "]";
    RISORIUS_TRY(check_length(without[i].size(), impl_->topology.neutral.size(), name));
    RISORIUS_TRY(check_finite(without[i], name));
    others.push_back(scaled(without[i], impl_->topology.skin.mm));
  }
  return repair_pose(impl_->topology, *here, allowed, others);
}

}  // namespace risorius::author
