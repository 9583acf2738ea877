// SPDX-License-Identifier: MIT
// regroup() divides the joints into regions by the controls that drive them.
#include "edit/regrouped.h"

namespace risorius::edit {
namespace {

using namespace regrouping;

// Two halves of the joints, each moved by its own control. Each control also moves every fifth
// joint of the other half a little; such small values must not join the halves.
TEST(Regroup, FindsRegionsByWhatIsNotSmall) {
  constexpr std::uint16_t kHalf = 40;
  dna::Dna dna = make_face(2, 0, 2 * kHalf);
  Indices outputs;
  std::vector<float> values;
  std::vector<Indices> halves(2);
  for (std::uint16_t j = 0; j < 2 * kHalf; ++j) {
    outputs.push_back(static_cast<std::uint16_t>(j * 9));
    const float small = j % 5 == 0 ? 0.04f : 0.0f;
    values.insert(values.end(), {j < kHalf ? 1.0f : small, j < kHalf ? small : 1.0f});
    halves[j / kHalf].push_back(j);
  }
  dna.behavior.joint_groups =
      std::vector{make_group({2 * kHalf, 2 * kHalf}, {0, 1}, outputs, values)};
  RegroupOptions options;
  options.threshold.translation_mm = 0.5;
  const Regrouped out = must_regroup(dna, options);
  EXPECT_EQ(out.report.regions, halves);
  EXPECT_EQ(out.report.removed, 2u * kHalf / 5);
}

}  // namespace
}  // namespace risorius::edit
