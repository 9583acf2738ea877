// SPDX-License-Identifier: MIT
// Tests each stage of an evaluation on faces that are small enough to compute by hand.
#include "rig/stages/evaluate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>

#include "rig/stages/instance.h"
#include "rig/stages/tables.h"
#include "support/face.h"

namespace risorius::rig {
namespace {

using namespace testing_support;

// ---- joints

TEST(EvaluateJoints, MatrixTimesControlsUnclamped) {
  dna::Dna dna = make_face(2, 0, 2);
  dna.behavior.joint_groups =
      std::vector{make_group({3, 2}, {1, 0}, {0, 10, 17}, {1, 2, 4, 8, -16, 32})};
  const Rig rig = must_compile(dna);
  const Pose pose = evaluate_once(rig, {2.0f, -0.5f});
  EXPECT_EQ(pose.joints[0], 3.5f);
  EXPECT_EQ(pose.joints[10], 14.0f);
  EXPECT_EQ(pose.joints[17], 72.0f);
}

TEST(EvaluateJoints, LowerLodUsesLeadingRowsAndLeavesTheRestZero) {
  dna::Dna dna = make_face(1, 0, 1);
  dna.behavior.joint_groups = std::vector{make_group({3, 1}, {0}, {2, 1, 0}, {1, 2, 3})};
  const Rig rig = must_compile(dna);
  const Pose high = evaluate_once(rig, {1.0f}, 0), low = evaluate_once(rig, {1.0f}, 1);
  EXPECT_EQ(high.joints[0], 3.0f);
  EXPECT_EQ(low.joints[2], 1.0f);
  EXPECT_EQ(low.joints[1], 0.0f);
  EXPECT_EQ(low.joints[0], 0.0f);
}

TEST(EvaluateJoints, LodBeyondTheLastIsTheLast) {
  dna::Dna dna = make_face(1, 0, 1);
  dna.behavior.joint_groups = std::vector{make_group({2, 1}, {0}, {0, 1}, {1, 2})};
  const Rig rig = must_compile(dna);
  EXPECT_EQ(evaluate_once(rig, {1.0f}, 4000000000u).joints, evaluate_once(rig, {1.0f}, 1).joints);
}

TEST(EvaluateJoints, LastGroupThatWritesARowWins) {
  dna::Dna dna = make_face(2, 0, 1);
  dna.behavior.joint_groups =
      std::vector{make_group({1, 1}, {0}, {4}, {1}), make_group({1, 0}, {1}, {4}, {10})};
  const Rig rig = must_compile(dna);
  EXPECT_EQ(evaluate_once(rig, {1.0f, 1.0f}, 0).joints[4], 10.0f);
  EXPECT_EQ(evaluate_once(rig, {1.0f, 0.0f}, 0).joints[4], 0.0f) << "a zero is written as well";
  EXPECT_EQ(evaluate_once(rig, {1.0f, 1.0f}, 1).joints[4], 1.0f) << "no row at this LOD";
}

// Of four joints, the first rotates at both LODs, the second only at LOD 0, the third is only
// translated, and the fourth does not move. Each joint must get the w of its quaternion, whatever
// the memory of the pose contained before.
TEST(EvaluateJoints, EveryQuaternionHasItsW) {
  dna::Dna dna = make_face(1, 0, 4);
  dna.behavior.joint_groups =
      std::vector{make_group({3, 2}, {0}, {3, 18, 12}, {0.5f, 2.0f, 0.25f})};
  compile::CompileOptions options;
  options.rotation = compile::Rotation::kQuaternion;
  const Rig rig = compile::compile(dna, options).value();
  Workspace work = make_workspace(rig);
  Pose pose = make_pose(rig);
  Instance face(rig);
  for (const std::uint32_t lod : {0u, 1u}) {
    face.set_lod(lod);
    for (const float raw : {0.0f, 1.0f}) {
      std::ranges::fill(pose.joints, kNan);
      evaluate(rig, &raw, lod, true, work, pose);
      const double first = 0.25 * raw * std::numbers::pi / 180;
      const double second = lod == 0 ? 0.125 * raw * std::numbers::pi / 180 : 0.0;
      for (const std::vector<float>& joints : {pose.joints, face.evaluate(&raw).joints}) {
        EXPECT_NEAR(joints[6], std::cos(first), 1e-7);
        EXPECT_NEAR(joints[3], std::sin(first), 1e-8);
        EXPECT_NEAR(joints[16], std::cos(second), 1e-7);
        EXPECT_NEAR(joints[13], std::sin(second), 1e-8);
        EXPECT_EQ(joints[26], 1.0f);
        EXPECT_EQ(joints[36], 1.0f);
      }
    }
  }
}

TEST(EvaluateJoints, PoseOfTheFrameBeforeDoesNotShine) {
  dna::Dna dna = make_face(1, 0, 1);
  dna.behavior.joint_groups = std::vector{make_group({2, 1}, {0}, {0, 1}, {1, 2})};
  const Rig rig = must_compile(dna);
  Workspace work = make_workspace(rig);
  Pose pose = make_pose(rig);
  const float one = 1.0f, zero = 0.0f;
  evaluate(rig, &one, 0, true, work, pose);
  evaluate(rig, &one, 1, true, work, pose);
  EXPECT_EQ(pose.joints[1], 0.0f);
  evaluate(rig, &zero, 0, true, work, pose);
  EXPECT_EQ(pose.joints[0], 0.0f);
}

TEST(EvaluateJoints, NanStaysInTheGroupsThatHaveItAsAColumn) {
  dna::Dna dna = make_face(2, 0, 2);
  dna.behavior.joint_groups =
      std::vector{make_group({1, 1}, {0}, {0}, {1}), make_group({1, 1}, {1}, {9}, {1})};
  const Pose pose = evaluate_once(must_compile(dna), {kNan, 1.0f});
  EXPECT_TRUE(std::isnan(pose.joints[0]));
  EXPECT_EQ(pose.joints[9], 1.0f);
}

// ---- correctives

// A rig whose control 2 is a corrective of controls 0 and 1.
// In: columns  the control of each factor of the corrective
//     values   the weight of each factor
Rig corrective_rig(std::vector<std::uint16_t> columns, std::vector<float> values) {
  dna::Dna dna = make_face(2, 1, 1);
  dna.behavior.psds.rows = std::vector<std::uint16_t>(columns.size(), 2);
  dna.behavior.psds.columns = std::move(columns);
  dna.behavior.psds.values = std::move(values);
  dna.behavior.joint_groups = std::vector{make_probe({2})};
  return must_compile(dna);
}

TEST(EvaluateCorrectives, ProductOfFactorsClampedToUnitRange) {
  const Rig rig = corrective_rig({0, 1}, {1, 1});
  EXPECT_EQ(evaluate_once(rig, {0.5f, 0.25f}).controls[2], 0.125f);
  EXPECT_EQ(evaluate_once(rig, {2.0f, 0.25f}).controls[2], 0.25f);
  EXPECT_EQ(evaluate_once(rig, {-1.0f, 0.25f}).controls[2], 0.0f);
}

TEST(EvaluateCorrectives, WeightsMultiplyAndOnlyTheUpperEndIsClamped) {
  EXPECT_EQ(evaluate_once(corrective_rig({0, 1}, {2, 4}), {0.5f, 0.125f}).controls[2], 0.5f);
  EXPECT_EQ(evaluate_once(corrective_rig({0, 1}, {2, 4}), {1.0f, 1.0f}).controls[2], 1.0f);
  EXPECT_EQ(evaluate_once(corrective_rig({0, 1}, {-2, 4}), {1.0f, 0.5f}).controls[2], -4.0f);
}

TEST(EvaluateCorrectives, RawControlsKeepTheirUnclampedValue) {
  const Pose pose = evaluate_once(corrective_rig({0, 1}, {1, 1}), {3.0f, -2.0f});
  EXPECT_EQ(pose.controls[0], 3.0f);
  EXPECT_EQ(pose.controls[1], -2.0f);
}

TEST(EvaluateCorrectives, NanFactorSpoilsTheCorrective) {
  const Rig rig = corrective_rig({0, 1}, {1, 1});  // the order of the factors must not matter
  EXPECT_TRUE(std::isnan(evaluate_once(rig, {kNan, 1.0f}).controls[2]));
  EXPECT_TRUE(std::isnan(evaluate_once(rig, {1.0f, kNan}).controls[2]));
  EXPECT_EQ(evaluate_once(rig, {0.0f, kNan}).controls[2], 0.0f);
  EXPECT_EQ(evaluate_once(rig, {kNan, 0.0f}).controls[2], 0.0f);
}

// Three correctives (controls 1 to 3) of one raw control. Entry i makes columns[i] a factor of the
// corrective rows[i], with the value 0.5.
dna::Dna chain(std::vector<std::uint16_t> rows, std::vector<std::uint16_t> columns) {
  dna::Dna dna = make_face(1, 3, 1);
  dna.behavior.psds.values = std::vector<float>(rows.size(), 0.5f);
  dna.behavior.psds.rows = std::move(rows);
  dna.behavior.psds.columns = std::move(columns);
  dna.behavior.joint_groups = std::vector{make_probe({1, 2, 3})};
  return dna;
}

TEST(EvaluateCorrectives, SettlingFollowsAChainAgainstTheOrderOfIndices) {
  const Rig rig = must_compile(chain({1, 2, 3}, {2, 3, 0}));  // 1 reads 2 reads 3 reads raw
  const Pose settled = evaluate_once(rig, {1.0f}), first = evaluate_once(rig, {1.0f}, 0, false);
  EXPECT_EQ(settled.controls, (std::vector{1.0f, 0.125f, 0.25f, 0.5f}));
  EXPECT_EQ(first.controls, (std::vector{1.0f, 0.0f, 0.0f, 0.5f}));
}

TEST(EvaluateCorrectives, FirstCallReadsNoCorrectiveEvenInTheOrderOfIndices) {
  const Rig rig = must_compile(chain({1, 2, 3}, {0, 1, 2}));
  EXPECT_EQ(evaluate_once(rig, {1.0f}).controls, (std::vector{1.0f, 0.5f, 0.25f, 0.125f}));
  EXPECT_EQ(evaluate_once(rig, {1.0f}, 0, false).controls, (std::vector{1.0f, 0.5f, 0.0f, 0.0f}));
}

TEST(EvaluateCorrectives, CycleStaysAtRest) {
  const Rig rig = must_compile(chain({1, 2, 3, 1}, {2, 1, 0, 0}));  // 1 reads 2 and raw, 2 reads 1
  EXPECT_EQ(evaluate_once(rig, {1.0f}).controls, (std::vector{1.0f, 0.0f, 0.0f, 0.5f}));
  const Rig self = must_compile(chain({1, 2, 3}, {1, 1, 0}));  // 1 reads itself, 2 depends on it
  EXPECT_EQ(evaluate_once(self, {1.0f}).controls, (std::vector{1.0f, 0.0f, 0.0f, 0.5f}));
}

TEST(EvaluateCorrectives, CorrectiveThatNothingUsesAtTheLodStaysZero) {
  dna::Dna dna = chain({1, 2, 3}, {0, 0, 0});
  dna.behavior.joint_groups =
      // The joint group uses control 2 only at LOD 0, and does not use control 3.
      std::vector{make_group({2, 1}, {1, 2}, {0, 1}, {1, 0, 0, 1})};
  const Rig rig = must_compile(dna);
  EXPECT_EQ(evaluate_once(rig, {1.0f}, 0).controls, (std::vector{1.0f, 0.5f, 0.5f, 0.0f}));
  EXPECT_EQ(evaluate_once(rig, {1.0f}, 1).controls, (std::vector{1.0f, 0.5f, 0.0f, 0.0f}));
}

// ---- conditional tables

struct Row {
  std::uint16_t input, output;
  float from, to, slope, cut;
};

Rig table_rig(const std::vector<Row>& rows) {
  std::vector<std::uint16_t> inputs, outputs;
  std::vector<float> from, to, slope, cut;
  for (const Row& r : rows) {
    inputs.push_back(r.input);
    outputs.push_back(r.output);
    from.push_back(r.from);
    to.push_back(r.to);
    slope.push_back(r.slope);
    cut.push_back(r.cut);
  }
  dna::Dna dna = make_face(2, 0, 1);
  dna.definition.gui_control_names = names("gui", 2);
  dna.behavior.gui_to_raw = {inputs, outputs, from, to, slope, cut};
  return must_compile(dna);
}

float mapped(const Rig& rig, float gui, float other = 0.0f) {
  const float in[2] = {gui, other};
  float raw[2] = {9.0f, 9.0f};
  gui_to_raw(rig, in, raw);
  return raw[0];
}

TEST(EvaluateTable, BothBoundsAreInside) {
  const Rig rig = table_rig({{0, 0, 0.25f, 0.5f, 1, 0}});
  EXPECT_EQ(mapped(rig, 0.25f), 0.25f);
  EXPECT_EQ(mapped(rig, 0.5f), 0.5f);
  EXPECT_EQ(mapped(rig, 0.24f), 0.0f) << "outside every range there is nothing";
  EXPECT_EQ(mapped(rig, 0.51f), 0.0f);
}

TEST(EvaluateTable, ReversedBoundsAreSwapped) {
  EXPECT_EQ(mapped(table_rig({{0, 0, 1, 0, 0.5f, 0}}), 0.5f), 0.25f);
}

TEST(EvaluateTable, OfARunOnlyTheFirstMatchCounts) {
  const Rig rig = table_rig({{0, 0, 0, 0.5f, 1, 0}, {0, 0, 0.5f, 1, 0.5f, 0.25f}});
  EXPECT_EQ(mapped(rig, 0.5f), 0.5f) << "both rows hold at the joint; they must not add";
  EXPECT_EQ(mapped(rig, 1.0f), 0.75f);
}

TEST(EvaluateTable, RowsOfOtherRunsAddUp) {
  const Rig rig =
      table_rig({{0, 0, 0, 1, 0.25f, 0}, {1, 0, 0, 1, 0.25f, 0}, {0, 0, 0, 1, 0.5f, 0}});
  EXPECT_EQ(mapped(rig, 0.5f, 1.0f), 0.125f + 0.25f + 0.25f);
}

TEST(EvaluateTable, ResultIsClampedAfterTheSum) {
  const Rig rig = table_rig({{0, 0, 0, 1, 2, 0}, {1, 0, 0, 1, -1, 0}});
  EXPECT_EQ(mapped(rig, 1.0f, 0.5f), 1.0f);
  EXPECT_EQ(mapped(rig, 0.0f, 0.5f), 0.0f);
  EXPECT_EQ(mapped(rig, 0.5f, 0.25f), 0.75f) << "1 - 0.25: the parts are not clamped";
}

TEST(EvaluateTable, OutputsThatNoRowNamesAreZero) {
  const Rig rig = table_rig({{0, 0, 0, 1, 1, 0}});
  const float in[2] = {1.0f, 1.0f};
  float raw[2] = {9.0f, 9.0f};
  gui_to_raw(rig, in, raw);
  EXPECT_EQ(raw[1], 0.0f);
}

TEST(EvaluateTable, NanReachesTheOutputsOfItsInput) {
  EXPECT_TRUE(std::isnan(mapped(table_rig({{0, 0, 0, 1, 1, 0}}), kNan)));
  EXPECT_EQ(mapped(table_rig({{1, 0, 0, 1, 1, 0}}), kNan, 0.5f), 0.5f);
}

TEST(EvaluateMaps, LodUsesLeadingRowsEvenInsideARun) {
  dna::Dna dna = make_face(1, 0, 1);
  dna.definition.animated_map_names = names("map", 1);
  dna.behavior.animated_maps.lods = {2, 1};
  dna.behavior.animated_maps.conditionals = {{0, 0},       {0, 0},       {0.0f, 0.5f},
                                             {0.5f, 1.0f}, {1.0f, 1.0f}, {0.0f, 0.0f}};
  const Rig rig = must_compile(dna);
  EXPECT_EQ(evaluate_once(rig, {0.75f}, 0).animated_maps[0], 0.75f);
  EXPECT_EQ(evaluate_once(rig, {0.75f}, 1).animated_maps[0], 0.0f);
  EXPECT_EQ(evaluate_once(rig, {0.25f}, 1).animated_maps[0], 0.25f);
}

// A run consists of successive rows with the same input and output. The evaluator skips a run while
// its input is 0, if the run adds nothing for the input 0. The result must equal a loop over all
// rows.
TEST(EvaluateMaps, ManyRowsOfManyControlsAreTheirSumInOrder) {
  constexpr std::uint16_t kRaw = 40, kMaps = 7;
  constexpr std::size_t kRows = 300;
  std::mt19937 random(5);
  const auto number = [&](int low, int high) {
    return static_cast<float>(std::uniform_int_distribution(low * 8, high * 8)(random)) / 8;
  };
  dna::Dna dna = make_face(kRaw, 0, 1);
  dna.definition.animated_map_names = names("map", kMaps);
  dna::Conditionals& rows = dna.behavior.animated_maps.conditionals;
  std::vector<std::uint16_t> inputs, outputs;
  std::vector<float> from, to, slope, cut;
  for (std::size_t i = 0; i < kRows; ++i) {
    // With the same input and output as the row before, the row belongs to its run.
    const bool same = i > 0 && random() % 2 == 0;
    inputs.push_back(same ? inputs.back() : static_cast<std::uint16_t>(random() % kRaw));
    outputs.push_back(same ? outputs.back() : static_cast<std::uint16_t>(random() % kMaps));
    from.push_back(number(-1, 1)), to.push_back(number(-1, 1));
    slope.push_back(number(-1, 1) / 3), cut.push_back(random() % 4 == 0 ? number(-1, 1) / 7 : 0.0f);
  }
  rows = {inputs, outputs, from, to, slope, cut};
  dna.behavior.animated_maps.lods = {kRows, kRows / 2 + 1};
  const Rig rig = must_compile(dna);
  for (int frame = 0; frame < 60; ++frame) {
    std::vector<float> raw(kRaw);
    for (float& v : raw) v = static_cast<int>(random() % 60) < frame ? number(-1, 1) : 0.0f;
    if (frame % 10 == 9) raw[random() % kRaw] = kNan;
    for (const std::uint32_t lod : {0u, 1u}) {
      std::vector<float> sums(kMaps);
      const std::size_t count = lod == 0 ? kRows : kRows / 2 + 1;
      bool found = false;  // whether an earlier row of this run counts
      for (std::size_t i = 0; i < count; ++i) {
        const bool begins = i == 0 || inputs[i] != inputs[i - 1] || outputs[i] != outputs[i - 1];
        const float v = raw[inputs[i]];
        const bool holds = std::min(from[i], to[i]) <= v && v <= std::max(from[i], to[i]);
        found = !begins && found;
        if (!found && (holds || std::isnan(v))) sums[outputs[i]] += slope[i] * v + cut[i];
        found = found || holds;
      }
      const Pose pose = evaluate_once(rig, raw, lod);
      for (std::size_t m = 0; m < kMaps; ++m) {
        const float wanted = sums[m] < 0.0f ? 0.0f : (sums[m] > 1.0f ? 1.0f : sums[m]);
        if (std::isnan(wanted)) {
          EXPECT_TRUE(std::isnan(pose.animated_maps[m]));
        } else {
          EXPECT_EQ(pose.animated_maps[m], wanted) << frame << " " << lod << " " << m;
        }
      }
    }
  }
}

// ---- blend shapes

// If few controls are active, the evaluator visits only the channels of each active control; if
// many are active, it visits all channels. The result must be the same.
TEST(EvaluateShapes, ChannelsFollowTheirControlsHoweverManyAreActive) {
  constexpr std::uint16_t kRaw = 64, kShapes = 150;
  std::mt19937 random(6);
  dna::Dna dna = make_face(kRaw, 0, 1);
  dna.definition.blend_shape_channel_names = names("shape", kShapes + 2);
  std::vector<std::uint16_t> inputs(kShapes), outputs(kShapes);
  std::iota(outputs.begin(), outputs.end(), std::uint16_t{1});
  std::ranges::shuffle(outputs, random);
  for (std::uint16_t& input : inputs) input = static_cast<std::uint16_t>(random() % kRaw);
  dna.behavior.blend_shape_channels.lods = {kShapes, 90};
  dna.behavior.blend_shape_channels.input_indices = inputs;
  dna.behavior.blend_shape_channels.output_indices = outputs;
  const Rig rig = must_compile(dna);
  ASSERT_EQ(rig.shape_begins.size(), kRaw + 1u);
  Workspace work = make_batch_workspace(rig);
  for (const std::size_t active : {0, 1, 9, 64}) {
    std::vector<float> raw(kRaw);
    for (std::size_t c = 0; c < active; ++c) raw[c * 7u % kRaw] = 1.0f + static_cast<float>(c);
    for (const std::uint32_t lod : {0u, 1u}) {
      std::vector<float> wanted(kShapes + 2u);
      for (std::size_t i = 0; i < (lod == 0 ? kShapes : 90u); ++i)
        wanted[outputs[i]] = raw[inputs[i]];
      Pose pose = make_pose(rig);
      std::fill(pose.blend_shapes.begin(), pose.blend_shapes.end(), kNan);
      evaluate(rig, raw.data(), lod, true, work, view(pose));
      EXPECT_EQ(pose.blend_shapes, wanted) << active << " " << lod;
    }
  }
}

TEST(EvaluateShapes, CopyTheirControlUnclampedAndTheLastWins) {
  dna::Dna dna = make_face(2, 0, 1);
  dna.definition.blend_shape_channel_names = names("shape", 3);
  dna.behavior.blend_shape_channels.lods = {3, 1};
  dna.behavior.blend_shape_channels.input_indices = {0, 1, 0};
  dna.behavior.blend_shape_channels.output_indices = {2, 0, 0};
  const Rig rig = must_compile(dna);
  EXPECT_EQ(evaluate_once(rig, {2.5f, -1.0f}, 0).blend_shapes, (std::vector{2.5f, 0.0f, 2.5f}));
  EXPECT_EQ(evaluate_once(rig, {2.5f, -1.0f}, 1).blend_shapes, (std::vector{0.0f, 0.0f, 2.5f}));
}

TEST(EvaluateShapes, ARunOfChannelsIsCutByTheLodAndLeavesTheOthersZero) {
  dna::Dna dna = make_face(3, 0, 1);
  dna.definition.blend_shape_channel_names = names("shape", 6);
  dna.behavior.blend_shape_channels.lods = {4, 2};
  dna.behavior.blend_shape_channels.input_indices = {0, 1, 2, 0};
  dna.behavior.blend_shape_channels.output_indices = {1, 2, 3, 5};
  const Rig rig = must_compile(dna);
  EXPECT_EQ(rig.shape_run, 3u);
  Workspace work = make_workspace(rig);
  Pose pose = make_pose(rig);
  for (const auto& [lod, expected] :
       {std::pair{0u, std::vector{0.0f, 2.0f, 3.0f, 4.0f, 0.0f, 2.0f}},
        std::pair{1u, std::vector{0.0f, 2.0f, 3.0f, 0.0f, 0.0f, 0.0f}}}) {
    std::fill(pose.blend_shapes.begin(), pose.blend_shapes.end(), kNan);
    const float raw[3] = {2.0f, 3.0f, 4.0f};
    evaluate(rig, raw, lod, true, work, pose);
    EXPECT_EQ(pose.blend_shapes, expected) << lod;
  }
}

// ---- empty faces

TEST(Evaluate, EmptyFaceGivesAnEmptyPose) {
  const Rig rig = must_compile(dna::Dna{});
  const Pose pose = evaluate_once(rig, {});
  EXPECT_TRUE(pose.joints.empty());
  EXPECT_TRUE(pose.controls.empty());
}

// A fault that fuzzing found: pointer arithmetic on the null pointer of a pose without joints.
TEST(Evaluate, EmptyFaceHasNoQuaternions) {
  compile::CompileOptions options;
  options.rotation = compile::Rotation::kQuaternion;
  const core::Result<Rig> rig = compile::compile(make_face(1, 0, 0), options);
  ASSERT_TRUE(rig);
  EXPECT_TRUE(evaluate_once(*rig, {1.0f}).joints.empty());
  Instance face(*rig);
  const float raw = 1.0f;
  EXPECT_TRUE(face.evaluate(&raw).joints.empty());
}

TEST(Evaluate, FaceWithoutLodsRests) {
  const Rig rig = must_compile(make_face(1, 1, 2, 0));
  const Pose pose = evaluate_once(rig, {1.0f});
  EXPECT_EQ(pose.joints, std::vector<float>(18, 0.0f));
  EXPECT_EQ(pose.controls, (std::vector{1.0f, 0.0f}));
}

TEST(Evaluate, GroupWithoutRowsOrColumnsDoesNothing) {
  dna::Dna dna = make_face(1, 0, 1);
  dna.behavior.joint_groups = std::vector{
      make_group({}, {0}, {}, {}), make_group({0, 0}, {}, {}, {}), make_group({1, 1}, {}, {3}, {})};
  EXPECT_EQ(evaluate_once(must_compile(dna), {1.0f}).joints, std::vector<float>(9, 0.0f));
}

}  // namespace
}  // namespace risorius::rig
