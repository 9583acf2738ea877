// SPDX-License-Identifier: MIT
// Makes small faces in memory and evaluates them.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "compile/compile.h"
#include "rig/stages/evaluate.h"
#include "support/bare_face.h"

namespace risorius::testing_support {

inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

inline dna::JointGroup make_group(std::vector<std::uint16_t> lods,
                                  std::vector<std::uint16_t> inputs,
                                  std::vector<std::uint16_t> outputs, std::vector<float> values) {
  dna::JointGroup g;
  g.lods = std::move(lods);
  g.input_indices = std::move(inputs);
  g.output_indices = std::move(outputs);
  g.values = std::move(values);
  return g;
}

/// A joint group for all LODs whose row r copies control inputs[r] to joint attribute r (attribute
/// r % 9 of joint r / 9), so that Pose::joints shows the values of these controls.
inline dna::JointGroup make_probe(const std::vector<std::uint16_t>& inputs, std::size_t lods = 2) {
  const std::size_t n = inputs.size();
  std::vector<std::uint16_t> outputs(n);
  std::vector<float> identity(n * n, 0.0f);
  for (std::size_t i = 0; i < n; ++i) {
    outputs[i] = static_cast<std::uint16_t>(i);
    identity[i * n + i] = 1.0f;
  }
  return make_group(std::vector<std::uint16_t>(lods, static_cast<std::uint16_t>(n)), inputs,
                    outputs, identity);
}

inline rig::Rig must_compile(const dna::Dna& dna, const simd::Kernels* kernels = nullptr) {
  compile::CompileOptions options;
  options.kernels = kernels;
  core::Result<rig::Rig> result = compile::compile(dna, options);
  if (!result) {
    ADD_FAILURE() << result.error().describe();
    std::abort();
  }
  return std::move(result).value();
}

inline rig::Pose evaluate_once(const rig::Rig& rig, const std::vector<float>& raw,
                               std::uint32_t lod = 0, bool settle = true) {
  rig::Workspace work = rig::make_workspace(rig);
  rig::Pose pose = rig::make_pose(rig);
  rig::evaluate(rig, raw.data(), lod, settle, work, pose);
  return pose;
}

}  // namespace risorius::testing_support
