// SPDX-License-Identifier: MIT
// Tests two functions: the optional check that raw controls are finite, and solver_poses(), which
// gives the distances and weights of the poses of an RBF solver.
#include <gtest/gtest.h>

#include <limits>

#include "rig/finite_controls.h"
#include "rig/pose.h"
#include "rig/stages/rbf.h"
#include "support/face.h"

namespace risorius::rig {
namespace {

using namespace testing_support;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(CheckControls, FiniteValuesPassHoweverLarge) {
  const Rig rig = must_compile(make_face(3, 0, 1));
  const float most = std::numeric_limits<float>::max();
  const float tiny = std::numeric_limits<float>::denorm_min();
  const std::vector<float> raw{most, -most, tiny, -0.0f, 7.0f, -3.0f};
  EXPECT_TRUE(check_finite(rig, raw.data(), 2).has_value());
  EXPECT_TRUE(find_non_finite(rig, raw.data(), 2).empty());
  EXPECT_TRUE(check_finite(rig, nullptr, 0).has_value());
}

TEST(CheckControls, NamesControlFrameAndValue) {
  const Rig rig = must_compile(make_face(3, 0, 1));
  const std::vector<float> raw{0, 0, 0, 0, -kInfinity, 0, kNan, 0, kInfinity};
  const auto status = check_finite(rig, raw.data(), 3);
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().code, core::ErrorCode::kInvalidValue);
  EXPECT_EQ(status.error().where, "raw[1, 1]");
  EXPECT_EQ(status.error().message,
            "raw1 is minus infinite in frame 1, a finite number was expected; the values of 2 more "
            "are not");
  const auto alone = check_finite(rig, raw.data() + 6, 1);
  ASSERT_FALSE(alone.has_value());
  EXPECT_EQ(alone.error().where, "raw[0]");
  EXPECT_EQ(alone.error().message.substr(0, 11), "raw0 is NaN");
}

TEST(CheckControls, FindsEachAndNoMoreThanAsked) {
  const Rig rig = must_compile(make_face(3, 0, 1));
  const std::vector<float> raw{0, kNan, 0, 0, 0, 0, kInfinity, 0, kNan};
  const auto all = find_non_finite(rig, raw.data(), 3);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].frame, 0u);
  EXPECT_EQ(all[0].control, 1u);
  EXPECT_EQ(all[1].frame, 2u);
  EXPECT_EQ(all[1].control, 0u);
  EXPECT_EQ(all[1].value, kInfinity);
  EXPECT_EQ(all[2].control, 2u);
  EXPECT_EQ(find_non_finite(rig, raw.data(), 3, 2).size(), 2u);
}

// Two targets at 0 and 1 of one control, radius 2 and the linear function, which gives the weights
// 1 - distance / 2.
TEST(SolverPoses, GivesDistancesAndWeights) {
  dna::Dna dna = make_face(1, 0, 1);
  dna.descriptor.rotation_unit = 1;
  dna::RbfSolver solver;
  solver.raw_control_indices = {0};
  solver.pose_indices = {0, 1};
  solver.raw_control_values = {0.0f, 1.0f};
  solver.radius = 2.0f;
  solver.automatic_radius = 1;
  solver.function_type = 2;
  solver.weight_threshold = 0.45f;
  dna.rbf_behavior.solvers = std::vector{solver};
  dna.rbf_behavior.poses = std::vector{dna::RbfPose{"p0", 1.0f}, dna::RbfPose{"p1", 0.5f}};
  dna.rbf_behavior.lod_solver_mapping.lods = {0, 0};
  dna.rbf_behavior.lod_solver_mapping.rows = {{0}};
  const Rig rig = must_compile(dna);
  const Pose pose = evaluate_once(rig, {0.25f});
  Workspace work = make_workspace(rig);
  double distances[2];
  float weights[2];
  solver_poses(rig, 0, pose.controls.data(), work, distances, weights);
  EXPECT_DOUBLE_EQ(distances[0], 0.25);
  EXPECT_DOUBLE_EQ(distances[1], 0.75);
  // The values 0.875 and 0.625 are divided by their sum 1.5. The second weight is then halved by
  // its scale, and is below the threshold.
  EXPECT_FLOAT_EQ(weights[0], 0.875f / 1.5f);
  EXPECT_EQ(weights[1], 0.0f);
  EXPECT_EQ(pose.controls[1], weights[0]);
}

}  // namespace
}  // namespace risorius::rig
