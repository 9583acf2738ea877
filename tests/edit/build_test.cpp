// SPDX-License-Identifier: MIT
// regroup() makes a dense joint group of each region, a set of joints that the same controls drive:
// its rows, columns and coefficients, and their order.
#include "edit/regrouped.h"

namespace risorius::edit {
namespace {

using namespace regrouping;

TEST(Regroup, MakesADenseGroupOfEachRegion) {
  RegroupOptions options;
  options.regions = {{1}, {0}};
  const Regrouped out = must_regroup(two_joints(), options);
  const auto& groups = out.dna.behavior.joint_groups;
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(groups[0], [] {
    dna::JointGroup g = make_group({2, 0}, {0}, {0, 1}, {2, 3});
    g.joint_indices = {0};
    return g;
  }());
  EXPECT_EQ(groups[1], [] {
    dna::JointGroup g = make_group({2, 1}, {1}, {9, 10}, {5, 6});
    g.joint_indices = {1};
    return g;
  }());
  EXPECT_EQ(out.report.before.coefficients, 8u);
  EXPECT_EQ(out.report.after.coefficients, 4u);
  EXPECT_EQ(out.report.after.nonzero, 4u);
  EXPECT_EQ(out.report.regions, (std::vector<Indices>{{0}, {1}}));
  expect_same_function(two_joints(), out.dna, {0.25f, 0.75f});
}

TEST(Regroup, PutsWhatCoarserLodsUseFirst) {
  dna::Dna dna = make_face(1, 0, 2, 3);
  dna.behavior.joint_groups = std::vector{make_group({2, 1, 0}, {0}, {5, 0}, {1, 2}),
                                          make_group({2, 2, 1}, {0}, {7, 1}, {3, 4})};
  RegroupOptions options;
  options.regions = {{0}};
  const Regrouped out = must_regroup(dna, options);
  ASSERT_EQ(out.dna.behavior.joint_groups.size(), 1u);
  const dna::JointGroup& g = out.dna.behavior.joint_groups[0];
  EXPECT_EQ(list(g.lods), (Indices{4, 3, 1}));
  EXPECT_EQ(list(g.output_indices), (Indices{7, 1, 5, 0}));
  expect_same_function(dna, out.dna, {0.5f});
}

}  // namespace
}  // namespace risorius::edit
