// SPDX-License-Identifier: MIT
// Regrouped faces, and checks that the tests of native/edit share.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <utility>
#include <vector>

#include "edit/regroup.h"
#include "simd/kernels.h"
#include "support/face.h"

namespace risorius::edit::regrouping {

using namespace testing_support;
using Indices = std::vector<std::uint16_t>;

inline Regrouped must_regroup(const dna::Dna& dna, RegroupOptions options = {}) {
  options.timed = 0;
  core::Result<Regrouped> result = regroup(dna, options);
  if (!result) {
    ADD_FAILURE() << result.error().describe();
    std::abort();
  }
  return std::move(result).value();
}

inline std::vector<float> joints_of(const dna::Dna& dna, const std::vector<float>& raw,
                                    std::uint32_t lod,
                                    compile::Rotation rotation = compile::Rotation::kEuler) {
  compile::CompileOptions options;
  options.kernels = simd::find_kernels("scalar");
  options.rotation = rotation;
  const auto rig = compile::compile(dna, options);
  if (!rig) return {};
  return evaluate_once(rig.value(), raw, lod).joints;
}

// Expects that two faces give the same joints to the last bit for the raw controls `raw`, at every
// LOD, with rotations as Euler angles and as quaternions.
inline void expect_same_function(const dna::Dna& a, const dna::Dna& b,
                                 const std::vector<float>& raw) {
  for (std::uint32_t lod = 0; lod < a.descriptor.lod_count; ++lod) {
    for (const auto rotation : {compile::Rotation::kEuler, compile::Rotation::kQuaternion}) {
      const auto wanted = joints_of(a, raw, lod, rotation);
      ASSERT_FALSE(wanted.empty());
      EXPECT_EQ(joints_of(b, raw, lod, rotation), wanted) << "LOD " << lod;
    }
  }
}

inline Indices list(const core::Array<std::uint16_t>& a) { return Indices(a.begin(), a.end()); }

// Control 0 moves joint 0 and control 1 moves joint 1. Both are in one group, whose matrix has
// zeros for the other joint.
inline dna::Dna two_joints() {
  dna::Dna dna = make_face(2, 0, 2);
  dna.behavior.joint_groups =
      std::vector{make_group({4, 1}, {1, 0}, {9, 0, 10, 1}, {5, 0, 0, 2, 6, 0, 0, 3})};
  return dna;
}

// Twelve joints in one region. Control 0 moves all of them, joint 5 by `small`. Control 1,
// which is foreign to the region, moves joint 3 by `small` and joint 4 by `large`.
inline dna::Dna with_outliers(float small, float large) {
  dna::Dna dna = make_face(2, 0, 12);
  Indices outputs;
  std::vector<float> values;
  for (std::uint16_t j = 0; j < 12; ++j) {
    outputs.push_back(static_cast<std::uint16_t>(j * 9));
    values.insert(values.end(), {j == 5 ? small : 1.0f, j == 3 ? small : j == 4 ? large : 0.0f});
  }
  dna.behavior.joint_groups = std::vector{make_group({12, 12}, {0, 1}, outputs, values)};
  return dna;
}

inline RegroupOptions in_one_region() {
  RegroupOptions options;
  options.regions = {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}};
  return options;
}

}  // namespace risorius::edit::regrouping
