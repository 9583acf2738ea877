// SPDX-License-Identifier: MIT
// Opens the bytes of compiled faces: open_rig refuses changed bytes, or takes them as a face that
// is safe to evaluate.
#include "rig/block.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <random>

#include "rig/stages/evaluate.h"
#include "rig/stages/instance.h"
#include "rig/stages/rbf.h"
#include "rig/stages/tables.h"
#include "support/face.h"
#include "support/stride.h"

namespace risorius::rig {
namespace {

using namespace testing_support;
using BlockBytes = core::AlignedVector<std::uint8_t>;

dna::Dna face_with_everything() {
  dna::Dna dna = make_face(3, 2, 4, 2);
  dna.definition.gui_control_names = names("gui", 2);
  dna.behavior.gui_to_raw.input_indices = {0, 1};
  dna.behavior.gui_to_raw.output_indices = {0, 2};
  for (auto* values : {&dna.behavior.gui_to_raw.from_values, &dna.behavior.gui_to_raw.cut_values}) {
    *values = {0.0f, 0.0f};
  }
  for (auto* values : {&dna.behavior.gui_to_raw.to_values, &dna.behavior.gui_to_raw.slope_values}) {
    *values = {1.0f, 1.0f};
  }
  dna.behavior.psds.rows = {3, 3, 4};
  dna.behavior.psds.columns = {0, 1, 3};
  dna.behavior.psds.values = {1.0f, 1.0f, 0.5f};
  dna.behavior.joint_groups = std::vector{make_probe({0, 3, 4})};
  dna.joint_behavior_metadata.joint_representations =
      std::vector<dna::JointRepresentation>(4, dna::JointRepresentation{0, 1, 0});
  return dna;
}

// A face with a network that reads a pose of a solver, a solver that reads a corrective, a swing
// setup, and a joint that the network moves.
dna::Dna face_that_learns() {
  dna::Dna dna = make_face(5, 2, 4, 2);
  dna.definition.lod_joint_mapping.lods = {0, 0};
  dna.definition.lod_joint_mapping.rows = {{0, 1, 2, 3}};
  dna.behavior.psds.rows = {5, 5, 6};
  dna.behavior.psds.columns = {0, 1, 9};
  dna.behavior.psds.values = {1.0f, 1.0f, 1.0f};
  dna.machine_learned_behavior.ml_control_names = {"m0", "m1"};
  dna::NeuralNetworkLayer layer;
  layer.biases = {0.125f, 0.25f};
  layer.weights = {1.0f, 0.5f, -1.0f, 2.0f};
  layer.activation_function = 3;
  dna::NeuralNetwork network;
  network.input_indices = {0, 9};
  network.output_indices = {7, 8};
  network.layers = std::vector{layer, layer};
  dna.machine_learned_behavior.neural_networks = std::vector{network};
  dna.machine_learned_behavior.lod_neural_network_mapping.lods = {0, 0};
  dna.machine_learned_behavior.lod_neural_network_mapping.rows = {{0}};
  dna.machine_learned_behavior.region_names = {{"nose"}};
  dna.machine_learned_behavior.region_network_indices = {{{0}}};
  dna.machine_learned_behavior_ext.joints.input_indices = {7, 8};
  dna.machine_learned_behavior_ext.joints.output_indices = {2 * 9, 2 * 9 + 4};
  dna::RbfSolver solver;
  solver.raw_control_indices = {1, 2, 3, 5};
  solver.pose_indices = {0, 1};
  solver.raw_control_values = {0.0f, 0.0f, 0.0f, 1.0f, 1.0f, 0.0f, 0.0f, 0.0f};
  solver.solver_type = 1;
  solver.distance_method = 2;
  dna.rbf_behavior.solvers = std::vector{solver};
  dna.rbf_behavior.poses = std::vector{dna::RbfPose{"p0", 1.0f}, dna::RbfPose{"p1", 1.0f}};
  dna.rbf_behavior.lod_solver_mapping.lods = {0, 0};
  dna.rbf_behavior.lod_solver_mapping.rows = {{0}};
  dna::TwistSwingSetup setup;
  setup.blend_weights = {0.5f};
  setup.output_joint_indices = {3};
  setup.input_control_indices = {1, 2, 3, 4};
  dna.twist_swing_behavior.swings = std::vector{setup};
  dna.behavior.joint_groups = std::vector{make_probe({0, 5, 6, 7, 9})};
  return dna;
}

BlockBytes bytes_of(const Rig& rig) { return BlockBytes(rig.block().begin(), rig.block().end()); }

core::Result<Rig> opened(const BlockBytes& bytes, BlockCheck check) {
  return open_rig(bytes, nullptr, check, simd::scalar_kernels());
}

TEST(Block, EvaluatesAsTheRigThatItCameFrom) {
  const Rig rig = must_compile(face_with_everything());
  const BlockBytes bytes = bytes_of(rig);
  for (const BlockCheck check : {BlockCheck::kHeader, BlockCheck::kFull}) {
    const auto again = open_rig(bytes, nullptr, check, *rig.kernels);
    ASSERT_TRUE(again.has_value()) << again.error().describe();
    EXPECT_EQ(again->raw_control_names(), rig.raw_control_names());
    EXPECT_EQ(again->gui_control_names(), rig.gui_control_names());
    for (const std::vector<float>& raw : {std::vector{0.5f, 0.25f, 1.0f}, {0.0f, 0.0f, 0.0f}}) {
      EXPECT_EQ(evaluate_once(*again, raw).joints, evaluate_once(rig, raw).joints);
      EXPECT_EQ(evaluate_once(*again, raw).controls, evaluate_once(rig, raw).controls);
    }
  }
}

// The same faces are compiled while stack and heap have other old content. Equal bytes show that no
// byte is left uninitialised.
TEST(Block, EqualFacesAreEqualBytes) {
  const auto dirty = [](int value) {
    volatile unsigned char stack[65536];
    for (auto& byte : stack) byte = static_cast<unsigned char>(value);
    std::vector<BlockBytes> heap;
    for (std::size_t size = 16; size < 65536; size *= 2) {
      heap.emplace_back(size, static_cast<std::uint8_t>(value));
    }
  };
  for (const dna::Dna& dna : {face_with_everything(), face_that_learns()}) {
    dirty(0xAA);
    const BlockBytes first = bytes_of(must_compile(dna));
    dirty(0x55);
    EXPECT_EQ(first, bytes_of(must_compile(dna)));
  }
}

TEST(Block, EveryPrefixIsRefused) {
  const BlockBytes whole = bytes_of(must_compile(face_with_everything()));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const BlockBytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    for (const BlockCheck check : {BlockCheck::kHeader, BlockCheck::kFull}) {
      ASSERT_FALSE(opened(cut, check).has_value()) << size;
    }
  }
}

TEST(Block, EveryChangedByteIsFoundByTheFullCheck) {
  const BlockBytes whole = bytes_of(must_compile(face_with_everything()));
  const auto [first, step] = shared_steps();
  for (std::size_t at = first; at < whole.size(); at += step) {
    for (const int change : {0x01, 0x80, 0xFF}) {
      BlockBytes changed = whole;
      changed[at] = static_cast<std::uint8_t>(changed[at] ^ change);
      ASSERT_FALSE(opened(changed, BlockCheck::kFull).has_value()) << at;
    }
  }
}

int damage_each_byte(const BlockBytes& whole) {
  int refused = 0;
  const auto [first, step] = shared_steps();
  for (std::size_t at = first; at < whole.size(); at += step) {
    for (const int value : {0x00, 0x01, 0x7F, 0xFF}) {
      BlockBytes changed = whole;
      changed[at] = static_cast<std::uint8_t>(value);
      seal_block(changed);
      const auto rig = opened(changed, BlockCheck::kFull);
      if (!rig) {
        ++refused;
        continue;
      }
      Workspace work = make_batch_workspace(*rig);
      Pose pose = make_pose(*rig);
      const std::vector<float> raw(rig->raw_count, 1.0f), gui(rig->gui_count, 1.0f);
      std::vector<float> out(rig->raw_count);
      for (std::uint32_t lod = 0; lod <= rig->lod_count; ++lod) {
        evaluate(*rig, raw.data(), lod, true, work, pose);
        evaluate_frames(*rig, raw.data(), 1, lod, false, work, view(pose));
      }
      Instance face(*rig);
      (void)face.evaluate(raw.data());
      std::vector<double> distances(rig->solver_poses);
      std::vector<float> weights(rig->solver_poses);
      for (std::uint32_t i = 0; i < rig->rbf_solvers.size(); ++i) {
        solver_poses(*rig, i, pose.controls.data(), work, distances.data(), weights.data());
      }
      gui_to_raw(*rig, gui.data(), out.data());
      std::vector<float> back(rig->gui_count);
      raw_to_gui(*rig, raw.data(), back.data());
      (void)rig->raw_control_names();
    }
  }
  return refused;
}

// One byte after the other is changed and the hash corrected. The check of indices must reject the
// bytes, or evaluation must be safe.
TEST(Block, ChangedBytesUnderARightHashDoNoHarm) {
  int refused = 0;
  for (const dna::Dna& dna : {face_with_everything(), face_that_learns()}) {
    refused += damage_each_byte(bytes_of(must_compile(dna)));
  }
  EXPECT_GT(refused, 500 / static_cast<int>(shared_steps().step));
}

// The first element of one of the rig's arrays, in a copy of its block.
template <class T>
T& first_of(BlockBytes& copy, const Rig& rig, std::span<const T> array) {
  const auto at = reinterpret_cast<const std::uint8_t*>(array.data()) - rig.block().data();
  return *reinterpret_cast<T*>(copy.data() + at);
}

std::string refused_field(BlockBytes& changed) {
  seal_block(changed);
  const auto rig = opened(changed, BlockCheck::kFull);
  return rig ? "taken" : rig.error().where;
}

// The pieces of a LOD copy rows of the joint groups to the pose. If the groups do not compute one
// of these rows at this LOD, the pose would contain its value of an earlier frame.
TEST(Block, RowsThatNothingComputesAreRefused) {
  const Rig rig = must_compile(face_with_everything());
  BlockBytes level = bytes_of(rig);
  first_of(level, rig, std::span(rig.joint_group_lods)) -= 1;
  EXPECT_EQ(refused_field(level), "rig.joint_pieces");
}

TEST(Block, RowsOfGroupsFollowEachOther) {
  dna::Dna dna = face_with_everything();
  dna.behavior.joint_groups = std::vector{make_probe({0}), make_probe({3, 4})};
  const Rig rig = must_compile(dna);
  BlockBytes rows = bytes_of(rig);
  first_of(rows, rig, std::span(rig.joint_groups)).rows_begin = 1;
  EXPECT_EQ(refused_field(rows), "rig.joint_groups");
}

// If a group has many rows, the kernels add whole SIMD vectors to its rows. No such vector may
// contain rows of another group.
TEST(Block, LongGroupsHaveWholeVectorsToThemselves) {
  constexpr std::uint16_t kLong = 18;
  std::vector<std::uint16_t> outputs(kLong);
  for (std::uint16_t i = 0; i < kLong; ++i) outputs[i] = i;
  dna::Dna dna = make_face(2, 0, 3, 1);
  dna.behavior.joint_groups =
      std::vector{make_group({1}, {0}, {20}, {1.0f}),
                  make_group({kLong}, {1}, outputs, std::vector<float>(kLong, 1.0f)),
                  make_group({1}, {0}, {21}, {1.0f})};
  const Rig rig = must_compile(dna);
  EXPECT_EQ(rig.joint_groups[1].rows_begin, 16u);
  EXPECT_EQ(rig.joint_groups[2].rows_begin, 48u);
  BlockBytes closer = bytes_of(rig);
  const std::size_t last = 2;
  (&first_of(closer, rig, std::span(rig.joint_groups)))[last].rows_begin = 34;
  EXPECT_EQ(refused_field(closer), "rig.joint_groups");
}

TEST(Block, ColumnsByGroupStayInTheirMatrix) {
  const Rig rig = must_compile(face_with_everything());
  BlockBytes control = bytes_of(rig), offset = bytes_of(rig);
  first_of(control, rig, std::span(rig.group_columns)).weight = rig.control_count;
  EXPECT_EQ(refused_field(control), "rig.group_columns");
  first_of(offset, rig, std::span(rig.group_columns)).offset =
      static_cast<std::uint32_t>(rig.joint_values.size());
  EXPECT_EQ(refused_field(offset), "rig.group_columns");
  BlockBytes begin = bytes_of(rig);
  first_of(begin, rig, std::span(rig.joint_groups)).columns_begin = 1;
  EXPECT_EQ(refused_field(begin), "rig.joint_groups");
}

// Values of shape_begins and shapes_of_controls, and inputs and first rows of map_runs, that lie
// beyond the arrays that they index are rejected.
TEST(Block, ChannelsAndRunsStayInWhatTheyCountIn) {
  dna::Dna dna = face_with_everything();
  dna.definition.blend_shape_channel_names = names("shape", 2);
  dna.behavior.blend_shape_channels.lods = {2, 2};
  dna.behavior.blend_shape_channels.input_indices = {2, 0};
  dna.behavior.blend_shape_channels.output_indices = {1, 0};
  dna.definition.animated_map_names = names("map", 1);
  dna.behavior.animated_maps.lods = {1, 1};
  dna.behavior.animated_maps.conditionals = {{1}, {0}, {0.0f}, {1.0f}, {1.0f}, {0.0f}};
  const Rig rig = must_compile(dna);
  BlockBytes begins = bytes_of(rig), shape = bytes_of(rig), input = bytes_of(rig),
             row = bytes_of(rig);
  first_of(begins, rig, std::span(rig.shape_begins)) = 1000;
  EXPECT_EQ(refused_field(begins), "rig.shape_begins");
  first_of(shape, rig, std::span(rig.shapes_of_controls)) =
      static_cast<std::uint16_t>(rig.shape_inputs.size());
  EXPECT_EQ(refused_field(shape), "rig.shapes_of_controls");
  first_of(input, rig, std::span(rig.map_runs)).input =
      static_cast<std::uint16_t>(rig.control_count);
  EXPECT_EQ(refused_field(input), "rig.map_runs");
  first_of(row, rig, std::span(rig.map_runs)).begin =
      static_cast<std::uint32_t>(rig.map_rows.size());
  EXPECT_EQ(refused_field(row), "rig.map_runs");
}

TEST(Block, GroupsNameTheBlocksThatTheyWrite) {
  const Rig rig = must_compile(face_with_everything());
  for (const bool beyond : {false, true}) {
    BlockBytes changed = bytes_of(rig);
    JointGroup& group = first_of(changed, rig, std::span(rig.joint_groups));
    group.blocks_end = beyond ? 0x10000000u : group.blocks_begin;
    EXPECT_EQ(refused_field(changed), "rig.joint_groups");
  }
}

// Evaluation finds the extra pieces of a block of 16 joint attributes by a binary search, so extra
// pieces must be sorted by Piece::block.
TEST(Block, ExtraPiecesOutOfOrderAreRefused) {
  dna::Dna dna = make_face(1, 0, 4);
  dna.behavior.joint_groups = std::vector{make_group({4, 4}, {0}, {2, 0, 22, 20}, {1, 2, 3, 4})};
  const Rig rig = must_compile(dna);
  ASSERT_EQ(rig.extra_pieces.size(), 4u);  // one in each block of each LOD
  BlockBytes changed = bytes_of(rig);
  first_of(changed, rig, std::span(rig.extra_pieces)).block = 2;
  EXPECT_EQ(refused_field(changed), "rig.extra_pieces");
}

TEST(Block, ChannelsOfARunFollowEachOther) {
  dna::Dna dna = make_face(3, 0, 1);
  dna.definition.blend_shape_channel_names = names("shape", 3);
  dna.behavior.blend_shape_channels.lods = {3, 2};
  dna.behavior.blend_shape_channels.input_indices = {1, 2, 0};
  dna.behavior.blend_shape_channels.output_indices = {0, 1, 2};
  const Rig rig = must_compile(dna);
  EXPECT_EQ(rig.shape_run, 2u);
  constexpr std::size_t kRigHeader = 32;  // bytes before the RigHeader
  for (const std::uint32_t run : {3u, 4u}) {
    BlockBytes changed = bytes_of(rig);
    std::memcpy(changed.data() + kRigHeader + offsetof(RigHeader, shape_run), &run, sizeof(run));
    EXPECT_EQ(refused_field(changed), "rig.header") << run;
  }
}

// mask_count is the number of masks of the networks' regions. The rig's bytes have no array of this
// length, so a few bytes could demand a large workspace if no other check limited mask_count.
TEST(Block, ScratchIsHeldAgainstTheBlock) {
  const Rig rig = must_compile(face_with_everything());
  constexpr std::size_t kRigHeader = 32;  // bytes before the RigHeader
  BlockBytes forged = bytes_of(rig);
  const std::uint32_t regions = 0x00FFFFFF;  // 64 MB of masks
  std::memcpy(forged.data() + kRigHeader + offsetof(RigHeader, mask_count), &regions,
              sizeof(regions));
  EXPECT_EQ(refused_field(forged), "rig.header");
}

// A network whose last layer has more rows than the operation has values would overwrite values of
// another operation.
TEST(Block, ANetworkWritesNoMoreThanItsOwnValues) {
  const Rig rig = must_compile(face_that_learns());
  BlockBytes changed = bytes_of(rig);
  MlOperation* operations = &first_of(changed, rig, std::span(rig.ml_operations));
  int networks = 0, scatters = 0;
  for (std::size_t i = 0; i < rig.ml_operations.size(); ++i) {
    MlOperation& operation = operations[i];
    if (operation.kind == MlOperation::kMlp && networks++ == 0) operation.value_count -= 1;
    // Another operation gets the value that the network lost, so that the sum of all value_count
    // still equals the number in the header.
    if (operation.kind == MlOperation::kScatter && scatters++ == 0) {
      operation.values_begin = 0, operation.value_count = 1;
    }
  }
  ASSERT_GT(networks * scatters, 0);
  seal_block(changed);
  const auto forged = opened(changed, BlockCheck::kFull);
  ASSERT_TRUE(forged.has_value()) << forged.error().describe();
  const std::vector<float> raw(5, 0.5f);
  const auto whole = evaluate_once(rig, raw), cut = evaluate_once(*forged, raw);
  EXPECT_EQ(cut.controls[7], whole.controls[7]);
  for (const float value : cut.controls) EXPECT_TRUE(std::isfinite(value));
}

TEST(Block, BytesThatAreNotAlignedAreRefused) {
  const BlockBytes whole = bytes_of(must_compile(face_with_everything()));
  BlockBytes shifted(whole.size() + 1);
  std::copy(whole.begin(), whole.end(), shifted.begin() + 1);
  const auto rig =
      open_rig(std::span(shifted).subspan(1), nullptr, BlockCheck::kHeader, simd::scalar_kernels());
  ASSERT_FALSE(rig.has_value());
  EXPECT_EQ(rig.error().code, core::ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace risorius::rig
