// SPDX-License-Identifier: MIT
// An edited Dna may hold anything: compile gives a Rig, or an error that names the field.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <limits>
#include <numeric>
#include <ostream>

#include "dna/validate.h"
#include "rig/block.h"
#include "support/face.h"
#include "support/full_face.h"

namespace risorius::compile {
namespace {

using namespace testing_support;
using core::ErrorCode;

// A valid face: two raw controls, and one GUI control, corrective, joint group, channel and map.
dna::Dna good_face() {
  dna::Dna dna = make_face(2, 1, 2);
  dna.definition.gui_control_names = names("gui", 1);
  dna.definition.blend_shape_channel_names = names("shape", 1);
  dna.definition.animated_map_names = names("map", 1);
  dna.behavior.gui_to_raw = {{0}, {1}, {0.0f}, {1.0f}, {1.0f}, {0.0f}};
  dna.behavior.psds.rows = {2, 2};
  dna.behavior.psds.columns = {0, 1};
  dna.behavior.psds.values = {1.0f, 1.0f};
  dna.behavior.joint_groups = std::vector{make_group({2, 1}, {0, 2}, {0, 17}, {1, 2, 3, 4})};
  dna.behavior.blend_shape_channels.lods = {1, 1};
  dna.behavior.blend_shape_channels.input_indices = {2};
  dna.behavior.blend_shape_channels.output_indices = {0};
  dna.behavior.animated_maps.lods = {1, 0};
  dna.behavior.animated_maps.conditionals = {{2}, {0}, {0.0f}, {1.0f}, {1.0f}, {0.0f}};
  return dna;
}

TEST(Compile, AcceptsTheFaceThatTheOthersBreak) { EXPECT_TRUE(compile(good_face()).has_value()); }

struct Damage {
  const char* name;
  std::function<void(dna::Dna&)> apply;
  ErrorCode code;
  const char* where;
};
void PrintTo(const Damage& damage, std::ostream* out) { *out << damage.where; }

const std::vector<Damage> kDamages{
    {"GroupInput", [](auto& d) { d.behavior.joint_groups[0].input_indices = {0, 3}; },
     ErrorCode::kInvalidIndex, "behavior.joint_groups[0].input_indices[1]"},
    {"GroupOutput", [](auto& d) { d.behavior.joint_groups[0].output_indices = {0, 18}; },
     ErrorCode::kInvalidIndex, "behavior.joint_groups[0].output_indices[1]"},
    {"GroupValues", [](auto& d) { d.behavior.joint_groups[0].values = {1.0f, 2.0f, 3.0f}; },
     ErrorCode::kInvalidLength, "behavior.joint_groups[0].values"},
    {"GroupRows", [](auto& d) { d.behavior.joint_groups[0].lods = {3, 1}; },
     ErrorCode::kInvalidValue, "behavior.joint_groups[0].lods[0]"},
    {"GroupLods", [](auto& d) { d.behavior.joint_groups[0].lods = {2}; }, ErrorCode::kInvalidLength,
     "behavior.joint_groups[0].lods"},
    {"PsdColumn", [](auto& d) { d.behavior.psds.columns = {0, 3}; }, ErrorCode::kInvalidIndex,
     "behavior.psds.columns[1]"},
    {"PsdRow", [](auto& d) { d.behavior.psds.rows = {3, 2}; }, ErrorCode::kInvalidIndex,
     "behavior.psds.rows[0]"},
    {"PsdValues", [](auto& d) { d.behavior.psds.values = {1.0f}; }, ErrorCode::kInvalidLength,
     "behavior.psds"},
    {"GuiInput", [](auto& d) { d.behavior.gui_to_raw.input_indices = {1}; },
     ErrorCode::kInvalidIndex, "behavior.gui_to_raw.input_indices[0]"},
    {"GuiOutput", [](auto& d) { d.behavior.gui_to_raw.output_indices = {2}; },
     ErrorCode::kInvalidIndex, "behavior.gui_to_raw.output_indices[0]"},
    {"GuiLength", [](auto& d) { d.behavior.gui_to_raw.cut_values = {}; }, ErrorCode::kInvalidLength,
     "behavior.gui_to_raw"},
    {"ShapeInput", [](auto& d) { d.behavior.blend_shape_channels.input_indices = {3}; },
     ErrorCode::kInvalidIndex, "behavior.blend_shape_channels.input_indices[0]"},
    {"ShapeOutput", [](auto& d) { d.behavior.blend_shape_channels.output_indices = {1}; },
     ErrorCode::kInvalidIndex, "behavior.blend_shape_channels.output_indices[0]"},
    {"ShapeRows", [](auto& d) { d.behavior.blend_shape_channels.lods = {2, 1}; },
     ErrorCode::kInvalidValue, "behavior.blend_shape_channels.lods[0]"},
    {"MapInput", [](auto& d) { d.behavior.animated_maps.conditionals.input_indices = {3}; },
     ErrorCode::kInvalidIndex, "behavior.animated_maps.input_indices[0]"},
    {"MapOutput", [](auto& d) { d.behavior.animated_maps.conditionals.output_indices = {1}; },
     ErrorCode::kInvalidIndex, "behavior.animated_maps.output_indices[0]"},
    {"MapLods", [](auto& d) { d.behavior.animated_maps.lods = {1}; }, ErrorCode::kInvalidLength,
     "behavior.animated_maps.lods"},
    {"NeutralLength", [](auto& d) { d.definition.neutral_joint_rotations.values = {0, 0, 0}; },
     ErrorCode::kInvalidLength, "definition.neutral_joint_rotations"},
    {"LodCount", [](auto& d) { d.descriptor.lod_count = 65535; }, ErrorCode::kInvalidValue,
     "descriptor.lod_count"},
    {"Parent", [](auto& d) { d.definition.joint_parents = {0, 2}; }, ErrorCode::kInvalidIndex,
     "definition.joint_parents[1]"},
};

class CompileDamaged : public testing::TestWithParam<Damage> {};

TEST_P(CompileDamaged, IsAnErrorWithTheField) {
  dna::Dna dna = good_face();
  GetParam().apply(dna);
  const auto result = compile(dna);
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code, GetParam().code) << result.error().describe();
  EXPECT_EQ(result.error().where, GetParam().where);
  EXPECT_FALSE(result.error().message.empty());
}

INSTANTIATE_TEST_SUITE_P(Every, CompileDamaged, testing::ValuesIn(kDamages),
                         [](const auto& about) { return std::string(about.param.name); });

TEST(Compile, NamesTheLayersThatAreNotEvaluated) {
  dna::Dna dna = good_face();
  dna::TwistSwingSetup setup;
  setup.output_joint_indices = {0};
  setup.blend_weights = {1.0f};
  setup.input_control_indices = {0, 0, 0, 0};
  dna.twist_swing_behavior.twists = std::vector{setup};
  EXPECT_TRUE(must_compile(dna).ignored_layers().empty());
  dna.unknown_layers.push_back({{'n', 'e', 'w', '1'}, 0x10000, {}});
  EXPECT_EQ(must_compile(dna).ignored_layers(), std::vector<std::string>{"new1"});
}

TEST(Compile, NeutralJointsTurnAsTheRigWritesRotations) {
  const dna::Dna face = testing_support::make_full_face();
  CompileOptions options;
  options.rotation = Rotation::kQuaternion;
  const rig::Rig angles = must_compile(face);
  const core::Result<rig::Rig> turned = compile(face, options);
  ASSERT_TRUE(turned.has_value()) << turned.error().describe();
  // The last joint has a neutral rotation of 90 degrees about z.
  const float* a = angles.neutral_joints.data() + 2 * 9 + 3;
  EXPECT_EQ(std::vector<float>(a, a + 6), (std::vector<float>{0, 0, 90, 1, 1, 1}));
  const float* q = turned.value().neutral_joints.data() + 2 * 10 + 3;
  const float half = std::sqrt(0.5f);
  const float wanted[] = {0, 0, half, half, 1, 1, 1};
  for (int i = 0; i < 7; ++i) EXPECT_NEAR(q[i], wanted[i], 1e-6f) << i;
}

// A twist setup with the same inputs as a swing setup becomes kUntwist, a twist setup with other
// inputs kTwist.
TEST(Compile, SwingsComeBeforeTwistsAndAreToldApart) {
  dna::Dna dna = good_face();
  dna::TwistSwingSetup alone, shared;
  alone.output_joint_indices = shared.output_joint_indices = {0};
  alone.blend_weights = shared.blend_weights = {1.0f};
  alone.input_control_indices = {0, 0, 0, 1};
  shared.input_control_indices = {0, 1, 0, 1};
  dna.twist_swing_behavior.twists = std::vector{alone, shared};
  dna.twist_swing_behavior.swings = std::vector{shared};
  std::vector<std::uint32_t> kinds;
  const rig::Rig rig = must_compile(dna);
  for (const rig::TwistSwing& s : rig.twist_swings) kinds.push_back(s.kind);
  using rig::TwistSwing;
  const std::vector<std::uint32_t> wanted{TwistSwing::kSwing, TwistSwing::kTwist,
                                          TwistSwing::kUntwist};
  EXPECT_EQ(kinds, wanted);
}

TEST(Compile, ChoicesThatTheFormatDoesNotKnowStayInsideTheRig) {
  dna::Dna dna = good_face();
  dna::RbfSolver solver;
  solver.raw_control_indices = {0, 1, 0, 1};
  solver.pose_indices = {0};
  solver.raw_control_values = {0.0f, 0.0f, 0.0f, 1.0f};
  solver.twist_axis = solver.function_type = solver.solver_type = solver.normalize_method = 9;
  std::vector<dna::RbfSolver> solvers;
  for (const std::uint16_t method : std::vector<std::uint16_t>{0, 1, 2, 3, 9}) {
    solver.distance_method = method;
    solvers.push_back(solver);
  }
  dna.rbf_behavior.solvers = solvers;
  dna.rbf_behavior.poses = std::vector{dna::RbfPose{"p", 1.0f}};
  dna.rbf_behavior.lod_solver_mapping.lods = {0, 0};
  dna.rbf_behavior.lod_solver_mapping.rows = {{0, 1, 2, 3, 4}};
  dna::TwistSwingSetup setup;
  setup.output_joint_indices = {0};
  setup.blend_weights = {1.0f};
  setup.input_control_indices = {0, 0, 0, 0};
  setup.twist_axis = 9;
  dna.twist_swing_behavior.swings = std::vector{setup};
  const rig::Rig rig = must_compile(dna);
  for (const rig::RbfSolver& s : rig.rbf_solvers) EXPECT_LT(s.axis, 3u);
  EXPECT_LT(rig.twist_swings[0].axis, 3u);
  EXPECT_TRUE(rig::open_rig(rig.block(), nullptr, rig::BlockCheck::kFull, *rig.kernels));
}

TEST(Compile, AGroupMayListItsControlsInAnyOrder) {
  // Sorted by control, the first four columns are 0, 2, 1, 3. They are not adjacent, although the
  // last one is three behind the first.
  const std::vector<std::uint16_t> inputs = {0, 2, 1, 3, 5, 4, 6, 7};
  constexpr std::size_t kRows = 9;
  std::vector<std::uint16_t> outputs(kRows);
  std::iota(outputs.begin(), outputs.end(), std::uint16_t{0});
  std::vector<float> values(kRows * inputs.size());
  std::iota(values.begin(), values.end(), 1.0f);
  dna::Dna dna = make_face(inputs.size(), 0, 1);
  dna.behavior.joint_groups = std::vector{make_group({kRows, kRows}, inputs, outputs, values)};
  const rig::Rig rig = must_compile(dna);
  for (std::size_t column = 0; column < inputs.size(); ++column) {
    std::vector<float> raw(inputs.size(), 0.0f);
    raw[inputs[column]] = 1.0f;
    const rig::Pose pose = evaluate_once(rig, raw);
    for (std::size_t row = 0; row < kRows; ++row) {
      EXPECT_EQ(pose.joints[row], values[row * inputs.size() + column]);
    }
  }
}

TEST(Compile, GeometryIsNotLookedAt) {
  dna::Dna dna = good_face();
  dna::Mesh mesh;
  mesh.face_layouts = {7};  // refers to no vertex
  mesh.face_offsets = {0, 1};
  dna.geometry.meshes = std::vector{mesh};
  std::vector<dna::Warning> warnings;
  EXPECT_FALSE(dna::validate(dna, warnings));
  EXPECT_TRUE(dna::validate_behavior(dna, warnings));
  const rig::Rig with = must_compile(dna), without = must_compile(good_face());
  EXPECT_TRUE(std::ranges::equal(with.block(), without.block()));
}

TEST(Compile, SolversBeyondAnyFaceAreRefused) {
  dna::Dna dna = good_face();
  dna::RbfSolver solver;
  solver.pose_indices = std::vector<std::uint16_t>(2000, 0);
  solver.solver_type = 1;
  dna.rbf_behavior.solvers = std::vector{solver};
  dna.rbf_behavior.poses = std::vector{dna::RbfPose{"p", 1.0f}};
  const auto rig = compile(dna);
  ASSERT_FALSE(rig.has_value());
  EXPECT_EQ(rig.error().code, core::ErrorCode::kLimitExceeded);
}

TEST(Compile, ControlsOfNetworksAndPosesFollowTheCorrectives) {
  dna::Dna dna = good_face();
  dna.machine_learned_behavior.ml_control_names = {"m0", "m1"};
  dna.rbf_behavior_ext.pose_control_names = {"p0", "p1", "p2"};
  dna.behavior.joint_groups[0].input_indices = {0, 7};
  const rig::Rig rig = must_compile(dna);
  EXPECT_EQ(rig.control_count, 2u + 1u + 2u + 3u);
  EXPECT_EQ(evaluate_once(rig, {1.0f, 1.0f}).controls[7], 0.0f);
}

TEST(Compile, ControlsOfLayersThatWereNotLoadedKeepTheirPlaces) {
  dna::Dna dna = good_face();
  dna.unread_controls = {0, 2, 3};
  EXPECT_EQ(must_compile(dna).control_count, 8u);
}

TEST(Compile, RigKeepsNothingOfTheDna) {
  auto dna = std::make_unique<dna::Dna>(good_face());
  const rig::Rig rig = must_compile(*dna);
  dna.reset();
  EXPECT_EQ(evaluate_once(rig, {1.0f, 0.5f}).blend_shapes[0], 0.5f);
}

TEST(Compile, ShortColumnsHaveNoPadding) {
  const dna::Dna dna = good_face();
  const rig::Rig rig = must_compile(dna);
  std::size_t values = 0;
  for (const dna::JointGroup& g : dna.behavior.joint_groups) values += g.values.size();
  EXPECT_LE(rig.joint_values.size(), values + simd::kWidest);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(rig.joint_values.data()) % 64, 0u);
}

TEST(Compile, ColumnsOfAVectorAndMoreBeginOnWholeOnes) {
  dna::Dna dna = make_face(2, 0, 5);
  std::vector<std::uint16_t> outputs(17);
  std::iota(outputs.begin(), outputs.end(), std::uint16_t{0});
  dna.behavior.joint_groups =
      std::vector{make_group({17, 0}, {0, 1}, outputs, std::vector<float>(34, 1.0f)),
                  make_group({2, 0}, {0, 1}, {18, 19}, {1, 1, 1, 1})};
  const rig::Rig rig = must_compile(dna);
  ASSERT_EQ(rig.joint_columns.size(), 4u);
  for (const rig::JointColumn& column : rig.joint_columns) {
    if (rig.joint_groups[column.group].row_count == 17) {
      EXPECT_EQ(column.offset % simd::kWidest, 0u);
    } else {
      EXPECT_EQ(column.offset % simd::kWidest, 1u) << "behind the 17 rows";
    }
  }
}

TEST(Compile, AColumnAtRestMayNotBeReadWhereACoefficientIsNotFinite) {
  dna::Dna dna = make_face(1, 0, 1);
  dna.behavior.joint_groups = std::vector{make_group({1, 0}, {0}, {0}, {1.0f})};
  EXPECT_EQ(must_compile(dna).control_reads.size(), 4u);  // [LODs, controls + 1]
  const float infinity = std::numeric_limits<float>::infinity();
  dna.behavior.joint_groups = std::vector{make_group({1, 0}, {0}, {0}, {infinity})};
  EXPECT_TRUE(must_compile(dna).control_reads.empty());
}

TEST(Compile, TheLastGroupThatTurnsAQuaternionJointWinsWhateverItsLods) {
  const dna::JointGroup first = make_group({1, 0}, {0}, {3}, {30});
  const dna::JointGroup last = make_group({1, 1}, {0}, {4}, {40});
  dna::Dna both = make_face(1, 0, 1), one = both;
  both.behavior.joint_groups = std::vector{first, last};
  one.behavior.joint_groups = std::vector{last};
  for (dna::Dna* dna : {&both, &one}) {
    dna->joint_behavior_metadata.joint_representations =
        std::vector{dna::JointRepresentation{0, 1, 0}};
  }
  EXPECT_EQ(evaluate_once(must_compile(both), {1.0f}).joints,
            evaluate_once(must_compile(one), {1.0f}).joints);
}

// Both LODs have joint 0, only LOD 0 has joint 1. Column 1 rotates no joint, and column 5 only a
// joint with Euler angles. LOD 1 finds column 3 empty and swaps it with 4, and then swaps column 0
// with 4: unlike a stable sort, this changes the order of the other columns.
TEST(Compile, ColumnsOfQuaternionsStandAsTheLodsSwappedThem) {
  const std::vector<bool> quaternions{true, true, false};
  const dna::JointGroup g = make_group({3, 1}, {0, 1, 2, 3, 4, 5}, {3, 13, 22},
                                       {0, 0, 1, 0, 1, 0,    // joint 0
                                        1, 0, 1, 1, 0, 0,    // joint 1
                                        1, 1, 1, 1, 1, 1});  // Euler angles
  const std::vector<std::uint32_t> both{4, 2, 0, 3}, finest{0, 2, 3, 4};
  EXPECT_EQ(quaternion_column_order(g, 2, quaternions), both);
  EXPECT_EQ(quaternion_column_order(g, 1, quaternions), finest);
}

// Two rows of a joint group write the same angle; LOD 1 has only the first row. The angle must be
// converted to a quaternion at LOD 1, too.
TEST(Compile, AnAngleWrittenTwiceIsTurnedAtEveryLod) {
  dna::Dna dna = make_face(1, 0, 1);
  dna.behavior.joint_groups = std::vector{make_group({2, 1}, {0}, {3, 3}, {60, 90})};
  CompileOptions options;
  options.rotation = Rotation::kQuaternion;
  const auto rig = compile(dna, options);
  ASSERT_TRUE(rig);
  EXPECT_NEAR(evaluate_once(rig.value(), {1.0f}, 0).joints[3], 0.70710678f, 1e-6f);
  EXPECT_NEAR(evaluate_once(rig.value(), {1.0f}, 1).joints[3], 0.5f, 1e-6f);
}

// Each of 60,000 correctives reads the next one, and the last one reads the raw control. The time
// must not grow with the square of their number.
TEST(Compile, LongChainOfCorrectivesCompilesInTime) {
  constexpr std::uint16_t n = 60000;
  dna::Dna dna = make_face(1, n, 1, 1);
  std::vector<std::uint16_t> rows, columns;
  for (std::uint16_t i = 1; i <= n; ++i) {
    rows.push_back(i);
    columns.push_back(i == n ? std::uint16_t{0} : static_cast<std::uint16_t>(i + 1));
  }
  dna.definition.blend_shape_channel_names = names("shape", 1);
  dna.behavior.blend_shape_channels.lods = {n};
  dna.behavior.blend_shape_channels.input_indices = rows;
  dna.behavior.blend_shape_channels.output_indices = std::vector<std::uint16_t>(n, 0);
  dna.behavior.psds.rows = rows;
  dna.behavior.psds.columns = columns;
  dna.behavior.psds.values = std::vector<float>(n, 1.0f);
  const std::clock_t begin = std::clock();  // the process's own time, independent of other load
  EXPECT_EQ(evaluate_once(must_compile(dna), {0.5f}).controls[1], 0.5f);
  EXPECT_LT(std::clock() - begin, 2 * CLOCKS_PER_SEC);
}

}  // namespace
}  // namespace risorius::compile
