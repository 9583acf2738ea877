// SPDX-License-Identifier: MIT
// Compares the contents of a face in the C API with the Dna that C++ reads from the same file.
#include <algorithm>
#include <cstddef>
#include <string>

#include "api/opened.h"
#include "bytes/source.h"
#include "dna/file/parse.h"

namespace risorius {
namespace {

using namespace testing_support;

dna::Dna read_golden(const std::string& name, std::vector<std::uint16_t> lods = {}) {
  dna::ParseOptions options;
  options.lods.lods = std::move(lods);
  auto source = bytes::open_file(golden_path(name));
  auto dna = dna::parse(*source.value(), options);
  EXPECT_TRUE(dna.has_value());
  return std::move(dna).value();
}

void expect_names(const FacePtr& face, risorius_list list, const std::vector<std::string>& names) {
  ASSERT_EQ(risorius_count(face.get(), list), names.size());
  for (std::uint32_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(names[i], risorius_name(face.get(), list, i));
  }
}

void expect_all_names(const FacePtr& face, const dna::Definition& d) {
  expect_names(face, RISORIUS_RAW_CONTROLS, d.raw_control_names);
  expect_names(face, RISORIUS_GUI_CONTROLS, d.gui_control_names);
  expect_names(face, RISORIUS_JOINTS, d.joint_names);
  expect_names(face, RISORIUS_SHAPES, d.blend_shape_channel_names);
  expect_names(face, RISORIUS_MAPS, d.animated_map_names);
  expect_names(face, RISORIUS_MESHES, d.mesh_names);
}

void expect_lod_items(const FacePtr& face, risorius_list list, const dna::LodMapping& mapping) {
  for (std::uint32_t lod = 0; lod < risorius_count(face.get(), RISORIUS_LODS); ++lod) {
    const std::uint16_t* items = nullptr;
    std::uint32_t count = 0;
    ASSERT_EQ(risorius_lod_items(face.get(), list, lod, &items, &count), RISORIUS_OK);
    const auto& row = mapping.rows[mapping.lods[lod]];
    EXPECT_TRUE(std::equal(items, items + count, row.begin(), row.end())) << lod;
  }
}

TEST(ApiFace, HasTheNamesAndTheLodsOfTheFile) {
  const dna::Dna dna = read_golden("medium");
  const FacePtr face = open_golden("medium");
  expect_all_names(face, dna.definition);
  EXPECT_EQ(risorius_count(face.get(), RISORIUS_LODS), dna.descriptor.lod_count);
  expect_lod_items(face, RISORIUS_JOINTS, dna.definition.lod_joint_mapping);
  expect_lod_items(face, RISORIUS_SHAPES, dna.definition.lod_blend_shape_mapping);
  expect_lod_items(face, RISORIUS_MAPS, dna.definition.lod_animated_map_mapping);
  expect_lod_items(face, RISORIUS_MESHES, dna.definition.lod_mesh_mapping);
}

TEST(ApiFace, OfSomeLodsIsTheFileFiltered) {
  constexpr std::uint16_t kLods[] = {1, 3};
  risorius_options options{};
  options.lods = kLods;
  options.lod_count = 2;
  const dna::Dna dna = read_golden("medium", {1, 3});
  const FacePtr face = open_golden("medium", options);
  EXPECT_EQ(risorius_count(face.get(), RISORIUS_LODS), 2u);
  expect_all_names(face, dna.definition);
  expect_lod_items(face, RISORIUS_JOINTS, dna.definition.lod_joint_mapping);
}

TEST(ApiFace, HasTheSkeletonOfTheFile) {
  const dna::Dna dna = read_golden("units");
  const FacePtr face = open_golden("units");
  risorius_skeleton skeleton{};
  ASSERT_EQ(risorius_get_skeleton(face.get(), &skeleton), RISORIUS_OK);
  const dna::Definition& d = dna.definition;
  ASSERT_EQ(skeleton.joint_count, d.joint_names.size());
  ASSERT_EQ(skeleton.stride, 9u);
  for (std::uint32_t j = 0; j < skeleton.joint_count; ++j) {
    EXPECT_EQ(skeleton.parents[j], d.joint_parents[j]);
    for (std::uint32_t k = 0; k < 3; ++k) {
      EXPECT_EQ(skeleton.neutral[j * 9 + k], d.neutral_joint_translations.at(j, k));
      EXPECT_EQ(skeleton.neutral[j * 9 + 3 + k], d.neutral_joint_rotations.at(j, k));
      EXPECT_EQ(skeleton.neutral[j * 9 + 6 + k], 1.0f);
    }
  }
  EXPECT_EQ(skeleton.translation_unit, dna.descriptor.translation_unit);
  EXPECT_EQ(skeleton.rotation_unit, dna.descriptor.rotation_unit);
  EXPECT_EQ(skeleton.axes[0], dna.descriptor.coordinate_system.x_axis);
  EXPECT_EQ(skeleton.axes[1], dna.descriptor.coordinate_system.y_axis);
  EXPECT_EQ(skeleton.axes[2], dna.descriptor.coordinate_system.z_axis);
  EXPECT_EQ(skeleton.rotation_order, dna.descriptor_ext.rotation_sequence);
  EXPECT_TRUE(std::ranges::equal(skeleton.rotation_signs, dna.descriptor_ext.rotation_sign));
}

template <class T>
void expect_same(const T* found, std::size_t count, const core::Array<T>& wanted) {
  EXPECT_TRUE(std::equal(found, found + count, wanted.begin(), wanted.end()));
}

void expect_mesh(const FacePtr& face, std::uint32_t index, const dna::Mesh& wanted) {
  risorius_mesh m{};
  ASSERT_EQ(risorius_get_mesh(face.get(), index, &m), RISORIUS_OK);
  expect_same(m.positions, std::size_t{3} * m.vertex_count, wanted.positions.values);
  expect_same(m.uvs, std::size_t{2} * m.uv_count, wanted.texture_coordinates.values);
  expect_same(m.normals, std::size_t{3} * m.normal_count, wanted.normals.values);
  expect_same(m.corner_positions, m.corner_count, wanted.layout_positions);
  expect_same(m.corner_uvs, m.corner_count, wanted.layout_texture_coordinates);
  expect_same(m.corner_normals, m.corner_count, wanted.layout_normals);
  ASSERT_EQ(m.polygon_count + 1, wanted.face_offsets.size());
  expect_same(m.polygon_begins, m.polygon_count + 1, wanted.face_offsets);
  expect_same(m.polygon_corners, m.polygon_begins[m.polygon_count], wanted.face_layouts);
  ASSERT_EQ(m.vertex_count + 1, wanted.skin_offsets.size());
  expect_same(m.skin_begins, m.vertex_count + 1, wanted.skin_offsets);
  expect_same(m.skin_weights, m.skin_begins[m.vertex_count], wanted.skin_weights);
  expect_same(m.skin_joints, m.skin_begins[m.vertex_count], wanted.skin_joint_indices);
  ASSERT_EQ(m.target_count, wanted.blend_shape_targets.size());
  for (std::uint32_t t = 0; t < m.target_count; ++t) {
    const dna::BlendShapeTarget& target = wanted.blend_shape_targets[t];
    risorius_target out{};
    ASSERT_EQ(risorius_get_target(face.get(), index, t, &out), RISORIUS_OK);
    EXPECT_EQ(out.shape, target.blend_shape_channel_index);
    expect_same(out.vertices, out.count, target.vertex_indices);
    expect_same(out.deltas, std::size_t{3} * out.count, target.deltas.values);
  }
}

TEST(ApiFace, HasTheMeshesOfTheFile) {
  const dna::Dna dna = read_golden("medium");
  risorius_options options{};
  options.flags = RISORIUS_GEOMETRY | RISORIUS_TARGETS;
  const FacePtr face = open_golden("medium", options);
  const auto& meshes = dna.geometry.meshes;
  ASSERT_GT(meshes.size(), 0u);
  ASSERT_GT(meshes[0].blend_shape_targets.size(), 0u);
  for (std::uint32_t i = 0; i < meshes.size(); ++i) expect_mesh(face, i, meshes[i]);
}

TEST(ApiFace, HasNoMeshThatWasNotAskedFor) {
  const FacePtr bare = open_golden("medium");
  risorius_mesh m{};
  ASSERT_EQ(risorius_get_mesh(bare.get(), 0, &m), RISORIUS_OK);
  EXPECT_EQ(m.vertex_count, 0u);
  const char* name = risorius_name(bare.get(), RISORIUS_MESHES, 1);
  risorius_options options{};
  options.flags = RISORIUS_GEOMETRY;
  options.meshes = &name;
  options.mesh_count = 1;
  const FacePtr face = open_golden("medium", options);
  ASSERT_EQ(risorius_get_mesh(face.get(), 0, &m), RISORIUS_OK);
  EXPECT_EQ(m.vertex_count, 0u);
  ASSERT_EQ(risorius_get_mesh(face.get(), 1, &m), RISORIUS_OK);
  EXPECT_GT(m.vertex_count, 0u);
  EXPECT_EQ(m.target_count, 0u);
}

// A compiled program depends on the sizes and offsets of the structs in risorius.h. A change of a
// size or an offset needs a new number RISORIUS_ABI.
TEST(ApiFace, TheLibraryIsTheHeaders) {
  EXPECT_EQ(risorius_abi(), std::uint32_t{RISORIUS_ABI});
  EXPECT_STREQ(risorius_version(), RISORIUS_TEST_VERSION);
  if (sizeof(void*) == 8) {
    EXPECT_EQ(sizeof(risorius_error), 48u);
    EXPECT_EQ(sizeof(risorius_options), 32u);
    EXPECT_EQ(sizeof(risorius_skeleton), 64u);
    EXPECT_EQ(sizeof(risorius_mesh), 112u);
    EXPECT_EQ(sizeof(risorius_target), 24u);
    EXPECT_EQ(offsetof(risorius_error, message), 40u);
    EXPECT_EQ(offsetof(risorius_options, meshes), 24u);
    EXPECT_EQ(offsetof(risorius_skeleton, rotation_signs), 48u);
    EXPECT_EQ(offsetof(risorius_mesh, skin_joints), 104u);
  }
}

}  // namespace
}  // namespace risorius
