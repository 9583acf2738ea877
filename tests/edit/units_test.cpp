// SPDX-License-Identifier: MIT
// regroup() splits the joint groups into units (one row, or all rotation rows of a quaternion
// joint). The new groups of units must give the joints that the old groups gave.
#include "edit/regrouped.h"

namespace risorius::edit {
namespace {

using namespace regrouping;

TEST(Regroup, ThresholdsCountInTheFilesUnits) {
  dna::Dna dna = with_outliers(0.00049f, 0.00051f);
  dna.descriptor.translation_unit = 1;  // metres
  RegroupOptions options = in_one_region();
  options.threshold.translation_mm = 0.5;
  EXPECT_EQ(must_regroup(dna, options).report.removed, 1u);
}

TEST(Regroup, KeepsQuaternionJointsWhole) {
  // Controls are out of order and one occurs twice. Both matter, because the product of rotations
  // depends on the order.
  dna::Dna dna = make_face(3, 0, 3);
  dna.behavior.joint_groups =
      std::vector{make_group({4, 3}, {2, 0, 2, 1}, {12, 14, 13, 0},
                             {40, 0, 1e-4f, 0, 0, 50, 0, 0, 0, 0, 60, 1e-4f, 1, 2, 3, 4}),
                  make_group({2, 1}, {1, 0}, {22, 21}, {30, 1e-4f, 20, 70})};
  dna.joint_behavior_metadata.joint_representations =
      std::vector{dna::JointRepresentation{}, {0, 1, 0}, {0, 1, 0}};
  RegroupOptions options;
  options.regions = {{0, 1, 2}};
  options.threshold = {1.0, 1.0, 1.0};
  options.foreign_share = 1.0;
  const Regrouped out = must_regroup(dna, options);
  EXPECT_EQ(out.report.removed, 0u);
  expect_same_function(dna, out.dna, {0.3f, 0.5f, 0.9f});
}

TEST(Regroup, TheLastWriterOfARowStillWins) {
  // The second group overwrites row 0 of the first one at LOD 0 but does not write this row at LOD
  // 1. The third group overwrites row 9 of the first one at every LOD.
  dna::Dna dna = make_face(2, 0, 2);
  dna.behavior.joint_groups =
      std::vector{make_group({2, 2}, {0}, {0, 9}, {1, 2}), make_group({2, 1}, {1}, {1, 0}, {3, 4}),
                  make_group({1, 1}, {0, 1}, {9}, {0, 0})};
  const Regrouped out = must_regroup(dna);
  EXPECT_EQ(out.report.after.rows, 4u);
  expect_same_function(dna, out.dna, {0.5f, 0.25f});
}

TEST(Regroup, TheLastGroupThatTurnsAQuaternionJointStillWins) {
  dna::Dna dna = make_face(2, 0, 1);
  dna.behavior.joint_groups =
      std::vector{make_group({2, 2}, {0}, {3, 4}, {30, 40}), make_group({1, 0}, {1}, {5}, {50})};
  dna.joint_behavior_metadata.joint_representations =
      std::vector{dna::JointRepresentation{0, 1, 0}};
  expect_same_function(dna, must_regroup(dna).dna, {0.5f, 0.25f});
}

TEST(Regroup, LodsThatDoNotNestStay) {
  dna::Dna dna = make_face(2, 0, 2, 3);
  dna.behavior.joint_groups = std::vector{make_group({1, 2, 0}, {0}, {0, 1}, {1, 2}),
                                          make_group({2, 1, 1}, {0, 1}, {2, 9}, {3, 4, 5, 6})};
  RegroupOptions options;
  options.regions = {{0, 1}};
  expect_same_function(dna, must_regroup(dna, options).dna, {0.5f, 0.25f});
}

TEST(Regroup, AHiddenRowThatKeepsACorrectiveInUseStays) {
  dna::Dna dna = make_face(2, 2, 2);
  dna.behavior.psds = {{2, 3, 3}, {0, 2, 1}, {1.0f, 1.0f, 1.0f}};
  dna.behavior.joint_groups =
      std::vector{make_group({1, 1}, {2}, {0}, {7}), make_group({2, 2}, {3}, {1, 0}, {5, 6})};
  const Regrouped out = must_regroup(dna);
  expect_same_function(dna, out.dna, {0.5f, 0.25f});
  EXPECT_NE(joints_of(out.dna, {0.5f, 0.25f}, 0)[0], 0.0f);
}

TEST(Regroup, AJointOfZerosIsStillTheRigs) {
  dna::Dna dna = make_face(1, 0, 2);
  dna.behavior.joint_groups =
      std::vector{make_group({3, 3}, {0}, {0, 9, 10}, {1, 0, 0}), make_group({0, 0}, {0}, {}, {})};
  const Regrouped out = must_regroup(dna);
  EXPECT_EQ(out.report.after.rows, 2u);
  const rig::Rig before = must_compile(dna), after = must_compile(out.dna);
  EXPECT_EQ(Indices(after.joints_written.begin(), after.joints_written.end()),
            Indices(before.joints_written.begin(), before.joints_written.end()));
}

}  // namespace
}  // namespace risorius::edit
