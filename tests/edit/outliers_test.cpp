// SPDX-License-Identifier: MIT
// regroup() removes small coefficients of controls that are foreign to a region because they move
// few of its joints, and keeps all others.
#include "edit/regrouped.h"

namespace risorius::edit {
namespace {

using namespace regrouping;

TEST(Regroup, TakesOutWhatIsSmallAndForeign) {
  RegroupOptions options = in_one_region();
  options.threshold.translation_mm = 0.5;
  const Regrouped out = must_regroup(with_outliers(0.049f, 0.051f), options);  // cm
  EXPECT_EQ(out.report.removed, 1u);
  EXPECT_EQ(out.report.before.nonzero - out.report.after.nonzero, 1u);
  EXPECT_NEAR(out.report.changes.translation_mm.value, 0.49, 1e-6);
  EXPECT_EQ(out.report.changes.translation_mm.joint, "joint3");
  EXPECT_EQ(out.report.changes.translation_mm.expression, "raw1");
  EXPECT_EQ(out.report.changes.rotation_degrees.value, 0.0);
  // Joint 5 keeps its small value, because control 0 belongs to the region of joint 5.
  EXPECT_EQ(joints_of(out.dna, {1, 0}, 0)[45], 0.049f);
}

TEST(Regroup, ZeroTakesOutNothing) {
  const Regrouped out = must_regroup(with_outliers(1e-6f, 1e-6f));
  EXPECT_EQ(out.report.removed, 0u);
  EXPECT_EQ(out.report.before.nonzero, out.report.after.nonzero);
}

TEST(Regroup, ACorrectiveThatAnotherReadsStaysInUse) {
  // Control 2 moves one joint a little. Control 3 is a corrective that reads control 2, so that
  // control 2 must stay in use.
  dna::Dna dna = with_outliers(0.0f, 0.0f);
  dna.behavior.psd_count = 2;
  dna.behavior.psds = {{2, 3, 3}, {0, 2, 1}, {1.0f, 1.0f, 1.0f}};
  dna.behavior.joint_groups =
      std::vector{dna.behavior.joint_groups[0], make_group({1, 0}, {2}, {1}, {0.001f}),
                  make_group({1, 1}, {3}, {2}, {5.0f})};
  RegroupOptions options = in_one_region();
  options.threshold.translation_mm = 1.0;
  const Regrouped out = must_regroup(dna, options);
  EXPECT_EQ(out.report.removed, 0u);
  expect_same_function(dna, out.dna, {0.5f, 0.25f});
  dna.behavior.psds = {{2, 3, 3}, {0, 0, 1}, {1.0f, 1.0f, 1.0f}};
  EXPECT_EQ(must_regroup(dna, options).report.removed, 1u);
}

}  // namespace
}  // namespace risorius::edit
