// SPDX-License-Identifier: MIT
// Twist and swing setups. From: dna-format 12.5
#include <algorithm>

#include "compile/parts.h"

namespace risorius::compile {

namespace {

using rig::RigData;
using rig::TwistSwing;

// A setup without four inputs has no rotation to spread.
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
  for (const dna::TwistSwingSetup& s : swings) add_setup(s, TwistSwing::kSwing, out);
  for (const dna::TwistSwingSetup& t : twists) {
    const auto swing = std::ranges::find(swings, t.input_control_indices,
                                         &dna::TwistSwingSetup::input_control_indices);
    const bool merged = swing != swings.end();
    add_setup(t, merged ? TwistSwing::kUntwist : TwistSwing::kTwist, out);
  }
}

}  // namespace risorius::compile
