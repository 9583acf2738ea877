// SPDX-License-Identifier: MIT
// Tests Morph on a mesh of three vertices: compiles its blend shape targets, and adds them with
// weights.
#include "rig/outputs/morph.h"

#include "support/face.h"

namespace risorius::rig {
namespace {

using namespace testing_support;

dna::BlendShapeTarget make_target(std::uint16_t channel, std::vector<std::uint32_t> vertices,
                                  std::vector<float> planes) {
  dna::BlendShapeTarget t;
  t.blend_shape_channel_index = channel;
  t.vertex_indices = std::move(vertices);
  t.deltas.values = std::move(planes);
  return t;
}

// A face with three channels and a mesh of three vertices, which has the given targets.
dna::Dna face_with_mesh(std::vector<dna::BlendShapeTarget> targets) {
  dna::Dna dna = make_face(0, 0, 1);
  dna.definition.blend_shape_channel_names = names("shape", 3);
  dna.definition.mesh_names = names("mesh", 1);
  dna::Mesh mesh;
  mesh.positions.values = std::vector<float>(9, 0.0f);
  mesh.blend_shape_targets = std::move(targets);
  dna.geometry.meshes = std::vector{mesh};
  return dna;
}

Morph must_compile_morph(const dna::Dna& dna,
                         const std::array<float, 9>& m = {1, 0, 0, 0, 1, 0, 0, 0, 1}) {
  auto result = compile::compile_morph(dna, 0, m);
  EXPECT_TRUE(result.has_value());
  return result ? std::move(result).value() : Morph{};
}

std::vector<float> sum(const Morph& morph, std::vector<float> weights,
                       const float* base = nullptr) {
  std::vector<float> out(morph.vertex_count * 3, 99.0f);
  evaluate_morph(morph, weights.data(), base, out.data());
  return out;
}

const std::vector<dna::BlendShapeTarget> kTargets{make_target(2, {2, 0}, {1, 4, 2, 5, 3, 6}),
                                                  make_target(0, {2}, {10, 20, 30})};

TEST(Morph, SumsWeightedDeltasOnTheBase) {
  const Morph morph = must_compile_morph(face_with_mesh(kTargets));
  EXPECT_EQ(morph.channels, (std::vector<std::uint16_t>{0, 2}));
  EXPECT_EQ(sum(morph, {1, 7, 2}), (std::vector<float>{8, 10, 12, 0, 0, 0, 12, 24, 36}));
  const std::vector<float> base{1, 1, 1, 2, 2, 2, 3, 3, 3};
  EXPECT_EQ(sum(morph, {0, 0, -1}, base.data()),
            (std::vector<float>{-3, -4, -5, 2, 2, 2, 2, 1, 0}));
}

TEST(Morph, TargetsOfOneChannelAddUp) {
  std::vector<dna::BlendShapeTarget> targets = kTargets;
  targets.push_back(make_target(2, {2}, {1, 1, 1}));
  const Morph morph = must_compile_morph(face_with_mesh(targets));
  EXPECT_EQ(morph.channels.size(), 2u);
  EXPECT_EQ(sum(morph, {0, 0, 1}), (std::vector<float>{4, 5, 6, 0, 0, 0, 2, 3, 4}));
}

TEST(Morph, DeltasAreTurnedByTheMatrix) {
  const Morph morph = must_compile_morph(face_with_mesh(kTargets), {0, 0, 2, 1, 0, 0, 0, -1, 0});
  EXPECT_EQ(sum(morph, {1, 0, 0}), (std::vector<float>{0, 0, 0, 0, 0, 0, 60, 10, -20}));
}

TEST(Morph, MeshWithoutTargetsIsItsBase) {
  const Morph morph = must_compile_morph(face_with_mesh({}));
  EXPECT_EQ(sum(morph, {1, 1, 1}), std::vector<float>(9, 0.0f));
}

TEST(Morph, WrongIndicesAreErrors) {
  const std::array<float, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};
  const dna::Dna vertex = face_with_mesh({make_target(0, {3}, {1, 1, 1})});
  const dna::Dna channel = face_with_mesh({make_target(3, {0}, {1, 1, 1})});
  const dna::Dna length = face_with_mesh({make_target(0, {0, 1}, {1, 1, 1})});
  for (const dna::Dna* dna : {&vertex, &channel, &length}) {
    const auto result = compile::compile_morph(*dna, 0, m);
    ASSERT_FALSE(result.has_value());
    EXPECT_NE(result.error().where.find("geometry.meshes[0]"), std::string::npos);
  }
  EXPECT_FALSE(compile::compile_morph(vertex, 1, m).has_value());
}

}  // namespace
}  // namespace risorius::rig
