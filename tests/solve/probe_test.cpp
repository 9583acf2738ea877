// SPDX-License-Identifier: MIT
// Tests Probe on a skin with known motion: an arm with two joints, a blend shape and a corrective.
#include "solve/probe.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "support/face.h"

namespace risorius::solve {
namespace {

using testing_support::make_face;
using testing_support::make_group;
using testing_support::must_compile;

constexpr double kRadians = 0.017453292519943295;

/// An arm of two joints. Raw control 0 rotates the elbow, 10 units from the shoulder, by 90 degrees
/// about z. Raw control 1 is a shape that lifts vertex 0 by 2 along z before skinning. The product
/// of both controls moves the shoulder by 4 along x.
dna::Dna arm() {
  dna::Dna dna = make_face(2, 1, 2, 1);
  dna.definition.joint_parents = {0, 0};
  dna.definition.neutral_joint_translations.values = {1, 10, 2, 0, 0, 0};  // planes of x, y, z
  dna.definition.blend_shape_channel_names = {"lift"};
  dna.behavior.psds.rows = {2, 2};
  dna.behavior.psds.columns = {0, 1};
  dna.behavior.psds.values = {1.0f, 1.0f};
  dna.behavior.joint_groups =
      std::vector<dna::JointGroup>{make_group({2}, {0, 2}, {9 + 5, 0}, {90.0f, 0.0f, 0.0f, 4.0f})};
  dna.behavior.blend_shape_channels.lods = {1};
  dna.behavior.blend_shape_channels.input_indices = {1};
  dna.behavior.blend_shape_channels.output_indices = {0};
  dna::Mesh mesh;
  mesh.positions.values = {13, 5, 2, 2, 0, 7};  // (13, 2, 0) on the elbow, (5, 2, 7) on both
  mesh.skin_offsets = {0, 1, 3};
  mesh.skin_weights = {1.0f, 0.75f, 0.25f};
  mesh.skin_joint_indices = {1, 0, 1};
  dna::BlendShapeTarget target;
  target.deltas.values = {0, 0, 2};
  target.vertex_indices = {0};
  mesh.blend_shape_targets = std::vector<dna::BlendShapeTarget>{target};
  dna.geometry.meshes = std::vector<dna::Mesh>{mesh};
  return dna;
}

core::Result<Surface> surface_of(const dna::Dna& dna, std::uint32_t lod = 0) {
  return make_surface(dna, std::make_shared<rig::Rig>(must_compile(dna)), lod);
}

/// The position of a vertex, computed by hand from the two raw controls. The elbow is at (11, 2, 0)
/// in the neutral pose.
std::array<double, 3> expected(std::size_t vertex, double turn, double lift) {
  const double c = std::cos(90 * kRadians * turn), s = std::sin(90 * kRadians * turn);
  const double shift = 4 * turn * lift;
  const auto carried = [&](double x, double y, double z) {
    return std::array<double, 3>{11 + c * (x - 11) - s * (y - 2) + shift,
                                 2 + s * (x - 11) + c * (y - 2), z};
  };
  if (vertex == 0) return carried(13, 2, 2 * lift);
  const std::array<double, 3> elbow = carried(5, 2, 7);
  return {0.75 * (5 + shift) + 0.25 * elbow[0], 0.75 * 2 + 0.25 * elbow[1], 7};
}

TEST(Probe, BringsVerticesWhereJointsAndShapesDo) {
  const Surface surface = surface_of(arm()).value();
  const std::vector<Point> points{{0, 1}, {0, 0}};
  Probe probe(surface, points);
  for (const float turn : {0.0f, 0.25f, 1.0f}) {
    for (const float lift : {0.0f, 0.5f, 1.0f}) {
      const std::vector<float> raw{turn, lift};
      std::vector<double> found(6);
      probe.positions(raw.data(), found.data());
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(found[k], expected(1, double{turn}, double{lift})[k], 1e-5) << turn << lift;
        EXPECT_NEAR(found[3 + k], expected(0, double{turn}, double{lift})[k], 1e-5) << turn << lift;
      }
    }
  }
}

TEST(Probe, DerivativesCountCorrectives) {
  const Surface surface = surface_of(arm()).value();
  const std::vector<Point> points{{0, 0}, {0, 1}};
  Probe probe(surface, points);
  const std::vector<float> raw{0.5f, 0.25f}, high{1, 1};
  const std::vector<std::uint8_t> free{1, 1};
  const Jacobian found = probe.jacobian(raw.data(), high.data(), free.data());
  ASSERT_EQ(found.blocks.size(), 1u);
  ASSERT_EQ(found.blocks[0].controls, (std::vector<std::uint32_t>{0, 1}));
  for (std::size_t c = 0; c < 2; ++c) {
    for (std::size_t p = 0; p < 2; ++p) {
      // The expected derivative is a difference quotient with the step of the tested code, of
      // positions computed by hand.
      const auto there = expected(p, 0.5 + (c == 0 ? kStep : 0), 0.25 + (c == 1 ? kStep : 0));
      const auto here = expected(p, 0.5, 0.25);
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(double{found.blocks[0].values[c * 96 + 3 * p + k]},
                    (there[k] - here[k]) / kStep, 2e-3)
            << c << p << k;
      }
    }
  }
}

TEST(Probe, GoesToTheSideThatALimitLeaves) {
  const Surface surface = surface_of(arm()).value();
  const std::vector<Point> points{{0, 0}};
  Probe probe(surface, points);
  const std::vector<float> raw{1, 0}, high{1, 1};
  const std::vector<std::uint8_t> free{1, 0};
  const Jacobian found = probe.jacobian(raw.data(), high.data(), free.data());
  ASSERT_EQ(found.blocks[0].controls, (std::vector<std::uint32_t>{0}));
  const auto there = expected(0, 1 - kStep, 0), here = expected(0, 1, 0);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(double{found.blocks[0].values[k]}, (here[k] - there[k]) / kStep, 2e-3);
  }
}

TEST(Probe, AShapeThatAStepTakesToNothingCounts) {
  const Surface surface = surface_of(arm()).value();
  const std::vector<Point> points{{0, 0}};
  Probe probe(surface, points);
  const auto step = static_cast<float>(kStep);
  // The control is at its highest value, so that the step must go down, to 0.
  const std::vector<float> raw{0, step}, high{1, step};
  const std::vector<std::uint8_t> free{0, 1};
  const Jacobian found = probe.jacobian(raw.data(), high.data(), free.data());
  ASSERT_EQ(found.blocks[0].controls, (std::vector<std::uint32_t>{1}));
  EXPECT_NEAR(found.blocks[0].values[2], 2.0f, 2e-3f);  // the whole shape along z
}

TEST(Probe, IsTheSameAfterDerivatives) {
  const Surface surface = surface_of(arm()).value();
  const std::vector<Point> points{{0, 0}, {0, 1}};
  Probe probe(surface, points);
  const std::vector<float> raw{0.25f, 0.5f}, high{1, 1};
  const std::vector<std::uint8_t> free{1, 1};
  std::vector<double> before(6), after(6);
  probe.positions(raw.data(), before.data());
  const Jacobian first = probe.jacobian(raw.data(), high.data(), free.data());
  const Jacobian second = probe.jacobian(raw.data(), high.data(), free.data());
  probe.positions(raw.data(), after.data());
  EXPECT_EQ(before, after);
  EXPECT_EQ(first.blocks[0].values, second.blocks[0].values);
}

TEST(Surface, RefusesALodThatIsNotThere) {
  const core::Result<Surface> made = surface_of(arm(), 1);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().where, "lod");
}

TEST(Surface, RefusesTheRigOfAnotherFile) {
  dna::Dna other = make_face(3, 0, 4);
  const auto rig = std::make_shared<rig::Rig>(must_compile(other));
  const core::Result<Surface> made = make_surface(arm(), rig, 0);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().where, "rig");
}

}  // namespace
}  // namespace risorius::solve
