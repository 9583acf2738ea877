// SPDX-License-Identifier: MIT
// The change of position that regroup reports for a joint includes the motion of its parents.
#include <cmath>

#include "edit/regrouped.h"

namespace risorius::edit {
namespace {

using namespace regrouping;

TEST(Regroup, NamesThePoseWhereAJointMovedMost) {
  // Control 1, foreign to the region, rotates joint 0 by one degree; its child joint 1 is 10 cm
  // away from it.
  dna::Dna dna = with_outliers(0.0f, 0.0f);
  std::vector<float> places(36, 0.0f);
  places[1] = 10.0f;
  dna.definition.neutral_joint_translations.values = places;
  dna.behavior.joint_groups =
      std::vector{dna.behavior.joint_groups[0], make_group({1, 1}, {1}, {5}, {1.0f})};
  RegroupOptions options = in_one_region();
  options.threshold.rotation_degrees = 2.0;
  options.combinations = 0;
  const Changes changes = must_regroup(dna, options).report.changes;
  EXPECT_NEAR(changes.rotation_degrees.value, 1.0, 1e-6);
  EXPECT_EQ(changes.rotation_degrees.joint, "joint0");
  EXPECT_EQ(changes.translation_mm.value, 0.0);
  EXPECT_NEAR(changes.position_mm.value, 2 * 100 * std::sin(0.5 * 3.14159265358979 / 180), 1e-6);
  EXPECT_EQ(changes.position_mm.joint, "joint1");
  EXPECT_EQ(changes.expressions, 2u);
}

}  // namespace
}  // namespace risorius::edit
