// SPDX-License-Identifier: MIT
#include "support/face.h"

namespace risorius::rig {
namespace {

using namespace testing_support;

// Corrective 1 is the raw control, corrective 2 is corrective 1.
Rig latency_rig() {
  dna::Dna dna = make_face(1, 2, 1);
  dna.behavior.psds.rows = {1, 2};
  dna.behavior.psds.columns = {0, 1};
  dna.behavior.psds.values = {1.0f, 1.0f};
  dna.behavior.joint_groups = std::vector{make_probe({1, 2})};
  return must_compile(dna);
}

TEST(Instance, CorrectiveOfACorrectiveComesOneFrameLate) {
  const Rig rig = latency_rig();
  Instance face(rig);
  const float half = 0.5f, zero = 0.0f;
  EXPECT_EQ(face.evaluate(&half).controls, (std::vector{0.5f, 0.5f, 0.0f}));
  EXPECT_EQ(face.evaluate(&half).controls, (std::vector{0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(face.evaluate(&zero).controls, (std::vector{0.0f, 0.0f, 0.5f}));
  EXPECT_EQ(face.evaluate(&zero).controls, (std::vector{0.0f, 0.0f, 0.0f}));
}

TEST(Instance, FirstFrameIsTheUnsettledEvaluation) {
  const Rig rig = latency_rig();
  Instance face(rig);
  const float value = 0.75f;
  EXPECT_EQ(face.evaluate(&value).joints, evaluate_once(rig, {value}, 0, false).joints);
}

TEST(Instance, ChangeOfLodForgetsTheFrameBefore) {
  const Rig rig = latency_rig();
  Instance face(rig);
  const float half = 0.5f;
  (void)face.evaluate(&half);
  face.set_lod(0);
  EXPECT_EQ(face.evaluate(&half).controls[2], 0.5f) << "the same LOD is no change";
  face.set_lod(1);
  EXPECT_EQ(face.evaluate(&half).controls[2], 0.0f);
}

TEST(Instance, RequestBeyondTheLastLodIsClampedAndForgetsEachTime) {
  const Rig rig = latency_rig();
  Instance face(rig);
  const float half = 0.5f;
  face.set_lod(7);
  EXPECT_EQ(face.lod(), 1u);
  (void)face.evaluate(&half);
  (void)face.evaluate(&half);
  face.set_lod(7);
  EXPECT_EQ(face.evaluate(&half).controls[2], 0.0f);
}

TEST(Instance, FacesOfOneRigKeepTheirOwnState) {
  const Rig rig = latency_rig();
  Instance a(rig), b(rig);
  const float half = 0.5f;
  (void)a.evaluate(&half);
  EXPECT_EQ(b.evaluate(&half).controls[2], 0.0f);
  EXPECT_EQ(a.evaluate(&half).controls[2], 0.5f);
}

}  // namespace
}  // namespace risorius::rig
