// SPDX-License-Identifier: MIT
// The smallest face with content in every layer of the format.
#pragma once

#include "dna/dna.h"

namespace risorius::testing_support {

namespace full_face {

inline dna::Vec3Array vectors(std::vector<float> x, std::vector<float> y, std::vector<float> z) {
  x.insert(x.end(), y.begin(), y.end());
  x.insert(x.end(), z.begin(), z.end());
  return {core::Array<float>(std::move(x))};
}

inline dna::Descriptor descriptor() {
  dna::Descriptor d;
  d.name = "full";
  d.archetype = 2;
  d.gender = 1;
  d.age = 30;
  d.metadata = {{"by", "hand"}};
  d.lod_count = 2;
  d.complexity = "A";
  d.db_name = "db";
  return d;
}

inline dna::Definition definition() {
  dna::Definition d;
  d.lod_joint_mapping = {{0, 1}, {{0, 1, 2}, {0, 1}}};
  d.lod_blend_shape_mapping = {{0, 1}, {{0, 1}, {1}}};
  d.lod_animated_map_mapping = {{0, 0}, {{0}}};
  d.lod_mesh_mapping = {{0, 1}, {{0}, {1}}};
  d.gui_control_names = {"gui"};
  d.raw_control_names = {"jaw", "q.x", "q.y", "q.z", "q.w"};
  d.joint_names = {"root", "jaw", "lip"};
  d.blend_shape_channel_names = {"open", "wide"};
  d.animated_map_names = {"blush"};
  d.mesh_names = {"head0", "head1"};
  d.mesh_blend_shape_channel_mapping_from = {0, 0, 1};
  d.mesh_blend_shape_channel_mapping_to = {0, 1, 1};
  d.joint_parents = {0, 0, 1};
  d.neutral_joint_translations = vectors({0, 1, 2}, {0, 3, 4}, {0, -1, -2});
  d.neutral_joint_rotations = vectors({0, 10, 0}, {0, 20, 0}, {0, 0, 90});
  return d;
}

// Controls 0 to 4 are raw controls, 5 is the corrective, 6 and 7 belong to networks, and 8 to the
// RBF pose.
inline dna::Behavior behavior() {
  dna::Behavior b;
  b.psd_count = 1;
  b.gui_to_raw = {{0, 0}, {0, 0}, {0, 0.5f}, {0.5f, 1}, {1, 0.5f}, {0, 0.25f}};
  b.psds = {{5, 5}, {0, 4}, {1, 0.5f}};
  b.joint_row_count = 27;
  b.joint_column_count = 9;
  dna::JointGroup linear, turning;
  linear.lods = {3, 2};
  linear.input_indices = {0, 5};
  linear.output_indices = {9, 17, 18};
  linear.values = {1, 0.5f, 0, 0.25f, -2, 0};
  linear.joint_indices = {1, 2};
  turning.lods = {2, 0};
  turning.input_indices = {0};
  turning.output_indices = {21, 22};
  turning.values = {30, -15};
  turning.joint_indices = {2};
  b.joint_groups = std::vector<dna::JointGroup>{linear, turning};
  b.blend_shape_channels = {{2, 1}, {5, 0}, {1, 0}};
  b.animated_maps = {{1, 1}, {{0}, {0}, {0}, {1}, {1}, {0}}};
  return b;
}

inline dna::Mesh mesh(bool finest) {
  dna::Mesh m;
  m.positions = vectors({0, 1, 0}, {0, 0, 1}, {0, 0, 0.5f});
  m.texture_coordinates = {{0, 1, 0, 0, 0, 1}};
  m.normals = vectors({0}, {0}, {1});
  m.layout_positions = {0, 1, 2};
  m.layout_texture_coordinates = {0, 1, 2};
  m.layout_normals = {0, 0, 0};
  m.face_offsets = {0, 3};
  m.face_layouts = {0, 1, 2};
  m.maximum_influence_per_vertex = 2;
  m.skin_offsets = {0, 2, 3, 4};
  m.skin_weights = {0.75f, 0.25f, 1, 1};
  m.skin_joint_indices = std::vector<std::uint16_t>{0, std::uint16_t(finest ? 2 : 1), 1, 0};
  dna::BlendShapeTarget open, wide;
  open.deltas = vectors({0}, {-1}, {0});
  open.vertex_indices = {1};
  wide.deltas = vectors({1, -1}, {0, 0}, {0, 0.5f});
  wide.vertex_indices = {0, 2};
  wide.blend_shape_channel_index = 1;
  m.blend_shape_targets = finest ? std::vector<dna::BlendShapeTarget>{open, wide}
                                 : std::vector<dna::BlendShapeTarget>{wide};
  return m;
}

inline dna::MachineLearnedBehavior networks() {
  dna::NeuralNetwork n;
  n.output_indices = {6, 7};
  n.input_indices = {0, 5};
  dna::NeuralNetworkLayer hidden, last;
  hidden.biases = {0.5f};
  hidden.weights = {1, -1};
  hidden.activation_function = 2;
  hidden.activation_parameters = {0.1f};
  last.biases = {0, 1};
  last.weights = {2, 3};
  last.activation_function = 4;
  n.layers = std::vector<dna::NeuralNetworkLayer>{hidden, last};
  dna::MachineLearnedBehavior ml;
  ml.ml_control_names = {"ml0", "ml1"};
  ml.lod_neural_network_mapping = {{0, 1}, {{0, 1}, {1}}};
  ml.region_names = {{"cheek"}, {"cheek"}};
  ml.region_network_indices = {{{0}}, {{1}}};
  ml.neural_networks = std::vector<dna::NeuralNetwork>{n, n};
  return ml;
}

inline dna::MlOperation operation(std::uint16_t type, std::vector<std::uint32_t> parameters,
                                  std::vector<std::uint16_t> sets = {},
                                  std::vector<std::uint16_t> operations = {}) {
  dna::MlOperation op;
  op.parameters = std::move(parameters);
  op.operation_set_dependency_indices = std::move(sets);
  op.operation_dependency_indices = std::move(operations);
  op.operation_type = type;
  return op;
}

inline dna::MachineLearnedBehaviorExt operations() {
  using Set = core::List<dna::MlOperation>;
  const Set gather(std::vector<dna::MlOperation>{operation(1, {0, 5})});
  const Set mlp(std::vector<dna::MlOperation>{operation(3, {0, 1, 1, 2, 2}, {0}, {0}),
                                              operation(3, {1}, {0}, {0})});
  const Set scatter(std::vector<dna::MlOperation>{operation(2, {6, 7}, {1, 1}, {0, 1})});
  dna::MlType type;
  type.lod_operation_mappings = {{{0, 0}, {{0}}}, {{0, 1}, {{0, 1}, {1}}}, {{0, 0}, {{0}}}};
  type.operations = std::vector<Set>{gather, mlp, scatter};
  dna::MachineLearnedBehaviorExt ext;
  ext.types = std::vector<dna::MlType>{type};
  ext.joints = {{1, 9}, {0, 0}, {6, 7}, {9, 18}};
  return ext;
}

inline dna::RbfBehavior rbf() {
  dna::RbfSolver s;
  s.name = "solver";
  s.raw_control_indices = {1, 2, 3, 4};
  s.pose_indices = {0};
  s.raw_control_values = {0, 0, 0, 1};
  s.radius = 45;
  s.distance_method = 2;
  s.automatic_radius = 1;
  dna::RbfBehavior r;
  r.lod_solver_mapping = {{0, 0}, {{0}}};
  r.solvers = std::vector<dna::RbfSolver>{s};
  r.poses = std::vector<dna::RbfPose>{{"pose", 1}};
  return r;
}

inline dna::TwistSwingSetup setup(std::uint16_t axis) {
  dna::TwistSwingSetup s;
  s.blend_weights = {0.25f, 0.5f};
  s.output_joint_indices = {1, 2};
  s.input_control_indices = {1, 2, 3, 4};
  s.twist_axis = axis;
  return s;
}

}  // namespace full_face

/// A face with two LODs, three joints, five raw controls, two meshes, and one or two of everything
/// else, in all layers up to version 2.8. Its behavior reads only raw and corrective controls, so
/// that it remains complete when it is written for older versions.
inline dna::Dna make_full_face() {
  dna::Dna dna;
  dna.descriptor = full_face::descriptor();
  dna.descriptor_ext = {3, {1, -1, 1}, 1};
  dna.definition = full_face::definition();
  dna.behavior = full_face::behavior();
  dna.geometry.meshes = std::vector<dna::Mesh>{full_face::mesh(true), full_face::mesh(false)};
  dna.machine_learned_behavior = full_face::networks();
  dna.machine_learned_behavior_ext = full_face::operations();
  dna.rbf_behavior = full_face::rbf();
  dna.rbf_behavior_ext.pose_control_names = {"pose0"};
  dna.rbf_behavior_ext.poses = std::vector<dna::RbfPoseControls>{{{0}, {8}, {1}}};
  dna.joint_behavior_metadata.joint_representations =
      std::vector<dna::JointRepresentation>{{0, 0, 0}, {0, 0, 0}, {0, 1, 0}};
  dna.twist_swing_behavior.twists = std::vector<dna::TwistSwingSetup>{full_face::setup(0)};
  dna.twist_swing_behavior.swings = std::vector<dna::TwistSwingSetup>{full_face::setup(1)};
  return dna;
}

}  // namespace risorius::testing_support
