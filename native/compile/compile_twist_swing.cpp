// SPDX-License-Identifier: MIT
// Compiles twist and swing setups: four controls are a rotation, whose twist about an axis or swing
// of that axis is distributed over joints. From: dna-format 12.5
#include <algorithm>
#include <cstdint>
#include <set>
#include <vector>

#include "compile/parts.h"

namespace risorius::compile {

namespace {

using rig::RigData;
using rig::TwistSwing;

// Adds a twist or swing setup. A setup without four inputs is skipped: it has no rotation to
// distribute.
void add_setup(const dna::TwistSwingSetup& source, TwistSwing::Kind kind, RigData& out) {
  if (source.input_control_indices.size() != 4) return;
  TwistSwing setup;
  std::ranges::copy(source.input_control_indices, setup.inputs);
  setup.axis = source.twist_axis < 3 ? source.twist_axis : 0;
  setup.kind = kind;
  setup.outputs_begin = static_cast<std::uint32_t>(out.twist_swing_outputs.size());
  for (std::size_t i = 0; i < source.output_joint_indices.size(); ++i) {
    out.twist_swing_outputs.push_back({source.output_joint_indices[i], source.blend_weights[i]});
  }
  setup.outputs_end = static_cast<std::uint32_t>(out.twist_swing_outputs.size());
  out.twist_swings.push_back(setup);
}

}  // namespace

void detail::compile_twist_and_swing(const dna::Dna& dna, RigData& out) {
  const auto& [twists, swings] = dna.twist_swing_behavior;
  std::set<std::vector<std::uint16_t>> swung;
  const auto inputs = [](const dna::TwistSwingSetup& s) {
    return std::vector<std::uint16_t>(s.input_control_indices.begin(),
                                      s.input_control_indices.end());
  };
  for (const dna::TwistSwingSetup& s : swings) {
    add_setup(s, TwistSwing::kSwing, out);
    if (s.input_control_indices.size() == 4) swung.insert(inputs(s));
  }
  for (const dna::TwistSwingSetup& t : twists) {
    const bool merged = t.input_control_indices.size() == 4 && swung.contains(inputs(t));
    add_setup(t, merged ? TwistSwing::kUntwist : TwistSwing::kTwist, out);
  }
}

}  // namespace risorius::compile
