// SPDX-License-Identifier: MIT
// Rebuilds the joint groups of a face as dense groups of regions of joints.
#include "edit/regroup.h"

#include <algorithm>
#include <cmath>

#include "compile/compile.h"
#include "dna/validate.h"
#include "edit/units.h"

namespace risorius::edit {

namespace {

using core::ErrorCode;
using core::fail;
using core::Status;

constexpr int kMostPasses = 16;
constexpr std::uint32_t kMostPoses = 1000000;

Status check_regions(const dna::Dna& dna, const RegroupOptions& options) {
  const std::size_t joints = dna.definition.joint_names.size();
  std::vector<std::size_t> region(joints, 0);
  for (std::size_t r = 0; r < options.regions.size(); ++r) {
    const std::string where = "regions[" + std::to_string(r) + "]";
    if (options.regions[r].empty()) {
      return fail(ErrorCode::kInvalidArgument, where, "a region without joints");
    }
    for (std::size_t i = 0; i < options.regions[r].size(); ++i) {
      const std::uint16_t joint = options.regions[r][i];
      const std::string at = where + "[" + std::to_string(i) + "]";
      if (joint >= joints) {
        return fail(ErrorCode::kInvalidIndex, at,
                    "joint " + std::to_string(joint) + ", but there are " + std::to_string(joints) +
                        " joints");
      }
      if (region[joint] != 0) {
        return fail(ErrorCode::kInvalidArgument, at,
                    "joint " + std::to_string(joint) + " (" + dna.definition.joint_names[joint] +
                        ") is in regions[" + std::to_string(region[joint] - 1) + "] already");
      }
      region[joint] = r + 1;
    }
  }
  return core::ok();
}

Status check_options(const dna::Dna& dna, const RegroupOptions& o) {
  for (const double v :
       {o.threshold.translation_mm, o.threshold.rotation_degrees, o.threshold.scale}) {
    if (!(std::isfinite(v) && v >= 0.0)) {
      return fail(ErrorCode::kInvalidArgument, "threshold",
                  "a number from 0 was expected, found " + std::to_string(v));
    }
  }
  if (!(o.foreign_share >= 0.0 && o.foreign_share <= 1.0)) {
    return fail(ErrorCode::kInvalidArgument, "foreign_share",
                "0 to 1 was expected, found " + std::to_string(o.foreign_share));
  }
  if (std::max(o.combinations, o.timed) > kMostPoses) {
    return fail(ErrorCode::kInvalidArgument, o.timed > kMostPoses ? "timed" : "combinations",
                "more than " + std::to_string(kMostPoses) + " poses");
  }
  return check_regions(dna, o);
}

GroupSizes sizes_of(const dna::Dna& dna) {
  GroupSizes out;
  for (const dna::JointGroup& g : dna.behavior.joint_groups) {
    ++out.groups;
    out.rows += g.output_indices.size();
    out.coefficients += g.values.size();
    out.nonzero += static_cast<std::uint64_t>(
        std::ranges::count_if(g.values, [](float v) { return v != 0.0f; }));
  }
  return out;
}

std::vector<std::vector<std::uint16_t>> list_regions(const detail::Regions& regions) {
  std::vector<std::vector<std::uint16_t>> out(regions.count);
  for (std::size_t j = 0; j < regions.of_joint.size(); ++j) {
    if (regions.of_joint[j] == detail::kNoRegion) continue;
    out[regions.of_joint[j]].push_back(static_cast<std::uint16_t>(j));
  }
  return out;
}

// Finds regions and removes small coefficients from columns foreign to their region, in each pass
// first with the regions by significant coefficients, then with the regions by all coefficients.
// Repeats this until none is removed, so that a second regroup changes nothing, but at most
// kMostPasses times. Out: the last regions by all coefficients.
detail::Regions settle(const dna::Dna& dna, const RegroupOptions& options,
                       std::vector<detail::Unit>& units, std::uint64_t& removed) {
  const detail::Effects effects(dna, options.threshold);
  const auto clean = [&] {
    detail::find_layers(dna, units);
    detail::remove_zero_rows(units);
  };
  const auto remove = [&](const detail::Regions& regions) {
    const auto n = detail::remove_outliers(dna, regions, effects, options.foreign_share, units);
    if (n > 0) clean();
    removed += n;
    return n;
  };
  clean();
  for (int pass = 0;; ++pass) {
    const bool last = pass == kMostPasses || effects.nothing_is_small();
    std::uint64_t n = 0;
    if (!last) n += remove(detail::find_regions(dna, units, effects, options, true));
    detail::Regions regions = detail::find_regions(dna, units, effects, options, false);
    if (!last) n += remove(regions);
    if (n == 0) return regions;
  }
}

}  // namespace

core::Result<Regrouped> regroup(const dna::Dna& dna, const RegroupOptions& options) {
  std::vector<dna::Warning> warnings;
  RISORIUS_TRY(dna::validate(dna, warnings));
  RISORIUS_TRY(check_options(dna, options));
  if (const auto rig = compile::compile(dna); !rig) return core::Unexpected{rig.error()};
  Regrouped out{dna, {}};
  std::vector<detail::Unit> units = detail::list_units(dna);
  const detail::Regions regions = settle(dna, options, units, out.report.removed);
  auto groups = detail::build_groups(dna, units, regions);
  if (!groups) return core::Unexpected{groups.error()};
  out.dna.behavior.joint_groups = std::move(groups).value();
  out.report.before = sizes_of(dna);
  out.report.after = sizes_of(out.dna);
  out.report.regions = list_regions(regions);
  RISORIUS_TRY(detail::compare(dna, out.dna, options, out.report));
  return out;
}

}  // namespace risorius::edit
