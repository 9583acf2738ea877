// SPDX-License-Identifier: MIT
// Converts poses of joints to transforms of bones in other axes and units.
#include "rig/outputs/bone_space.h"

#include <gtest/gtest.h>

#include "rig/stages/evaluate.h"

namespace risorius::rig {
namespace {

constexpr float kHalf = 0.70710678f;  // sine and cosine of 45 degrees

// Converts from a file with y up, in cm, to a space with z up, in m: x stays, y becomes z, and z
// becomes -y.
SpaceConvention y_up() {
  SpaceConvention convention;
  convention.axes = {1, 0, 0, 0, 0, -1, 0, 1, 0};
  convention.scale = 0.01f;
  convention.euler.radians_per_unit = 3.14159265f / 180;
  return convention;
}

struct Channels {
  std::vector<float> location, rotation, scale;
};

Channels channels_of(const SpaceConvention& convention, const std::vector<float>& neutral,
                     const std::vector<float>& deltas, const std::vector<std::uint32_t>& bones) {
  const auto joints = static_cast<std::uint32_t>(neutral.size() / 3);
  const BoneSpace space = make_bone_space(convention, neutral.data(), joints, bones);
  Channels out{std::vector<float>(bones.size() * 3), std::vector<float>(bones.size() * 4),
               std::vector<float>(bones.size() * 3)};
  evaluate_bones(space, deltas.data(), out.location.data(), out.rotation.data(), out.scale.data());
  return out;
}

void expect_near(const std::vector<float>& found, const std::vector<float>& wanted) {
  ASSERT_EQ(found.size(), wanted.size());
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], wanted[i], 1e-6f) << i;
}

TEST(BoneSpace, AxesAndUnitsAreExchanged) {
  const Channels out =
      channels_of(y_up(), {0, 0, 0}, {100, 200, 300, 0, 90, 0, 0.1f, 0.2f, 0.3f}, {0});
  expect_near(out.location, {1, -3, 2});
  expect_near(out.rotation, {kHalf, 0, 0, kHalf});  // the file's y axis becomes z
  expect_near(out.scale, {1.1f, 1.3f, 1.2f});
}

TEST(BoneSpace, MirroredAxesTurnTheOtherWay) {
  SpaceConvention convention = y_up();
  convention.axes = {-1, 0, 0, 0, 0, -1, 0, 1, 0};
  expect_near(channels_of(convention, {0, 0, 0}, {0, 0, 0, 0, 90, 0, 0, 0, 0}, {0}).rotation,
              {kHalf, 0, 0, -kHalf});
  expect_near(channels_of(convention, {0, 0, 0}, {0, 0, 0, 90, 0, 0, 0, 0, 0}, {0}).rotation,
              {kHalf, kHalf, 0, 0});
}

TEST(BoneSpace, TheNeutralPoseIsTheRest) {
  const Channels out = channels_of(y_up(), {0, 90, 0}, {100, 0, 0, 0, 90, 0, 0, 0, 0}, {0});
  expect_near(out.rotation, {kHalf, 0, 0, kHalf});
  expect_near(out.location, {0, -1, 0});  // x, seen in axes that are turned by 90 degrees about z
}

TEST(BoneSpace, BonesMayBeSomeJointsInAnyOrder) {
  const std::vector<float> deltas{1, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0,
                                  0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0};
  SpaceConvention plain;
  expect_near(channels_of(plain, std::vector<float>(9, 0.0f), deltas, {2, 0}).location,
              {3, 0, 0, 1, 0, 0});
}

}  // namespace
}  // namespace risorius::rig
