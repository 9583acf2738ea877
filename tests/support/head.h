// SPDX-License-Identifier: MIT
// A head with content in every layer, and files of it, large enough to distinguish read from
// skipped bytes.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "dna/file/parse.h"
#include "dna/file/write.h"
#include "support/face.h"

namespace risorius::testing_support {

using Bytes = std::vector<std::uint8_t>;

/// Sizes of a generated head. LOD l has its own mesh with vertices >> l vertices and channels >> l
/// blend shape channels; each of its blend shape targets has deltas >> l deltas. One more mesh
/// belongs to every LOD: it has `vertices` vertices, and targets of `deltas` deltas for all
/// channels.
struct HeadSizes {
  std::uint16_t lods = 4, joints = 60, raw = 100, channels = 32;
  std::uint32_t vertices = 6000, deltas = 1500, joint_groups = 8;
  std::uint32_t network_inputs = 100, network_outputs = 60, solver_poses = 100;
  std::size_t unknown_bytes = 5000;
};

/// The smallest head with content in every list.
inline HeadSizes tiny_head() {
  return {.lods = 2,
          .joints = 3,
          .raw = 4,
          .channels = 2,
          .vertices = 4,
          .deltas = 2,
          .joint_groups = 1,
          .network_inputs = 2,
          .network_outputs = 1,
          .solver_poses = 2,
          .unknown_bytes = 5};
}

inline std::vector<std::uint16_t> numbers(std::size_t n, std::size_t limit = 65536) {
  std::vector<std::uint16_t> out(n);
  for (std::size_t i = 0; i < n; ++i) out[i] = static_cast<std::uint16_t>(i % limit);
  return out;
}

inline std::vector<float> floats(std::size_t n) {
  std::vector<float> out(n);
  for (std::size_t i = 0; i < n; ++i) out[i] = static_cast<float>(i % 97) / 97.0f;
  return out;
}

/// A mapping in which LOD l lists the first n >> l indices.
inline dna::LodMapping halving(std::uint16_t lods, std::size_t n) {
  dna::LodMapping mapping;
  mapping.lods = numbers(lods);
  for (std::uint16_t l = 0; l < lods; ++l) mapping.rows.emplace_back(numbers(n >> l));
  return mapping;
}

/// A mapping in which LOD l lists index l, and index `always` unless `always` is -1.
inline dna::LodMapping one_each(std::uint16_t lods, int always = -1) {
  dna::LodMapping mapping;
  mapping.lods = numbers(lods);
  for (std::uint16_t l = 0; l < lods; ++l) {
    std::vector<std::uint16_t> row{l};
    if (always >= 0) row.push_back(static_cast<std::uint16_t>(always));
    mapping.rows.emplace_back(std::move(row));
  }
  return mapping;
}

inline dna::BlendShapeTarget make_target(std::uint16_t channel, std::uint32_t deltas) {
  dna::BlendShapeTarget t;
  t.deltas.values = floats(std::size_t{3} * deltas);
  std::vector<std::uint32_t> vertices(deltas);
  for (std::uint32_t i = 0; i < deltas; ++i) vertices[i] = i;
  t.vertex_indices = std::move(vertices);
  t.blend_shape_channel_index = channel;
  return t;
}

/// A mesh of quads. Vertex v has weights on three to six consecutive joints from joint v % joints
/// on; joint 0 follows the last one.
inline dna::Mesh make_head_mesh(std::uint32_t vertices, std::uint16_t joints,
                                std::uint16_t channels, std::uint32_t deltas) {
  dna::Mesh m;
  m.positions.values = floats(std::size_t{3} * vertices);
  m.normals.values = floats(std::size_t{3} * vertices);
  m.texture_coordinates.values = floats(std::size_t{2} * vertices);
  std::vector<std::uint32_t> layouts(vertices), face_offsets{0}, skin_offsets{0};
  for (std::uint32_t i = 0; i < vertices; ++i) layouts[i] = i;
  m.layout_positions = m.layout_texture_coordinates = m.layout_normals = layouts;
  for (std::uint32_t i = 4; i <= vertices; i += 4) face_offsets.push_back(i);
  layouts.resize(face_offsets.back());
  m.face_offsets = std::move(face_offsets);
  m.face_layouts = std::move(layouts);
  std::vector<float> weights;
  std::vector<std::uint16_t> skin_joints;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const std::uint32_t influences = 3 + v % 4;
    for (std::uint32_t i = 0; i < influences; ++i) {
      weights.push_back(1.0f / static_cast<float>(influences));
      skin_joints.push_back(static_cast<std::uint16_t>((v + i) % joints));
    }
    skin_offsets.push_back(static_cast<std::uint32_t>(weights.size()));
  }
  m.maximum_influence_per_vertex = 6;
  m.skin_offsets = std::move(skin_offsets);
  m.skin_weights = std::move(weights);
  m.skin_joint_indices = std::move(skin_joints);
  std::vector<dna::BlendShapeTarget> targets;
  for (std::uint16_t c = 0; c < channels; ++c) targets.push_back(make_target(c, deltas));
  m.blend_shape_targets = std::move(targets);
  return m;
}

inline void add_definition(const HeadSizes& s, dna::Dna& dna) {
  dna::Definition& d = dna.definition;
  d.gui_control_names = names("gui", s.raw);
  d.blend_shape_channel_names = names("shape", s.channels);
  d.animated_map_names = names("map", s.lods);
  d.mesh_names = names("mesh", s.lods + std::size_t{1});
  d.lod_joint_mapping = halving(s.lods, s.joints);
  d.lod_blend_shape_mapping = halving(s.lods, s.channels);
  d.lod_animated_map_mapping = one_each(s.lods);
  d.lod_mesh_mapping = one_each(s.lods, s.lods);
}

inline void add_behavior(const HeadSizes& s, dna::Dna& dna) {
  dna::Behavior& b = dna.behavior;
  b.gui_to_raw = {numbers(s.raw), numbers(s.raw), floats(s.raw),
                  floats(s.raw),  floats(s.raw),  floats(s.raw)};
  b.psds.rows = std::vector<std::uint16_t>(2, s.raw);
  b.psds.columns = {0, 1};
  b.psds.values = {1.0f, 1.0f};
  const std::size_t rows = std::size_t{9} * s.joints;
  b.joint_row_count = static_cast<std::uint16_t>(rows);
  b.joint_column_count = s.raw;
  std::vector<std::uint16_t> lods(s.lods);
  for (std::uint16_t l = 0; l < s.lods; ++l) lods[l] = static_cast<std::uint16_t>(rows >> l);
  std::vector<dna::JointGroup> groups;
  for (std::uint32_t g = 0; g < s.joint_groups; ++g) {
    groups.push_back(make_group(lods, numbers(s.raw), numbers(rows), floats(rows * s.raw)));
    groups.back().joint_indices = numbers(s.joints);
  }
  b.joint_groups = std::move(groups);
  std::vector<std::uint16_t> channels(s.lods), maps(s.lods, s.lods);
  for (std::uint16_t l = 0; l < s.lods; ++l)
    channels[l] = static_cast<std::uint16_t>(s.channels >> l);
  b.blend_shape_channels = {channels, numbers(s.channels, s.raw), numbers(s.channels)};
  b.animated_maps.lods = maps;
  b.animated_maps.conditionals = {numbers(s.lods), numbers(s.lods), floats(s.lods),
                                  floats(s.lods),  floats(s.lods),  floats(s.lods)};
}

inline void add_geometry(const HeadSizes& s, dna::Dna& dna) {
  std::vector<dna::Mesh> meshes;
  for (std::uint16_t l = 0; l < s.lods; ++l) {
    meshes.push_back(make_head_mesh(s.vertices >> l, static_cast<std::uint16_t>(s.joints >> l),
                                    static_cast<std::uint16_t>(s.channels >> l), s.deltas >> l));
  }
  meshes.push_back(make_head_mesh(s.vertices, s.joints, s.channels, s.deltas));
  std::vector<std::uint16_t> from, to;
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    for (const dna::BlendShapeTarget& t : meshes[m].blend_shape_targets) {
      from.push_back(static_cast<std::uint16_t>(m));
      to.push_back(t.blend_shape_channel_index);
    }
  }
  dna.definition.mesh_blend_shape_channel_mapping_from = std::move(from);
  dna.definition.mesh_blend_shape_channel_mapping_to = std::move(to);
  dna.geometry.meshes = std::move(meshes);
}

// Adds one network per LOD, and operations that run the networks.
inline void add_networks(const HeadSizes& s, dna::Dna& dna) {
  dna::MachineLearnedBehavior& ml = dna.machine_learned_behavior;
  ml.ml_control_names = names("ml", s.network_outputs);
  ml.lod_neural_network_mapping = one_each(s.lods);
  std::vector<dna::NeuralNetwork> networks(s.lods);
  for (dna::NeuralNetwork& n : networks) {
    n.input_indices = numbers(s.network_inputs, s.raw);
    n.output_indices = numbers(s.network_outputs, s.raw);
    dna::NeuralNetworkLayer layer;
    layer.biases = floats(s.network_outputs);
    layer.weights = floats(std::size_t{s.network_outputs} * s.network_inputs);
    layer.activation_parameters = {0.5f};
    n.layers = std::vector{layer};
  }
  ml.neural_networks = std::move(networks);
  for (std::size_t m = 0; m < dna.definition.mesh_names.size(); ++m) {
    ml.region_names.push_back(names("region", 1));
    ml.region_network_indices.push_back({{0}});
  }
  dna::MlType type;
  type.lod_operation_mappings = {one_each(s.lods)};
  std::vector<dna::MlOperation> operations(s.lods);
  for (std::uint16_t l = 0; l < s.lods; ++l) {
    operations[l].operation_type = 3;  // a network
    operations[l].parameters = {std::uint32_t{l}};
    operations[l].operation_set_dependency_indices = {0};
    operations[l].operation_dependency_indices = {l};
  }
  std::vector<dna::List<dna::MlOperation>> sets;
  sets.emplace_back(std::move(operations));
  type.operations = std::move(sets);
  dna.machine_learned_behavior_ext.types = std::vector{type};
  dna.machine_learned_behavior_ext.joints = {{0}, {0}, {0}, {0}};
}

inline void add_poses(const HeadSizes& s, dna::Dna& dna) {
  dna::RbfBehavior& rbf = dna.rbf_behavior;
  rbf.lod_solver_mapping = one_each(s.lods);
  std::vector<dna::RbfSolver> solvers(s.lods);
  for (dna::RbfSolver& solver : solvers) {
    solver.name = "solver";
    solver.raw_control_indices = numbers(4);
    solver.pose_indices = numbers(s.solver_poses);
    solver.raw_control_values = floats(std::size_t{4} * s.solver_poses);
  }
  rbf.solvers = std::move(solvers);
  std::vector<dna::RbfPose> poses(s.solver_poses, {"pose", 1.0f});
  rbf.poses = std::move(poses);
  dna.rbf_behavior_ext.pose_control_names = names("pose control", s.solver_poses);
  std::vector<dna::RbfPoseControls> controls(s.solver_poses);
  for (dna::RbfPoseControls& c : controls) c = {{0}, {1}, {1.0f}};
  dna.rbf_behavior_ext.poses = std::move(controls);
}

/// A complete head of the given sizes.
inline dna::Dna make_head(const HeadSizes& s = {}) {
  dna::Dna dna = make_face(s.raw, 1, s.joints, s.lods);
  dna.descriptor.name = "head";
  dna.descriptor.metadata = {{"made", "for a test"}};
  add_definition(s, dna);
  add_behavior(s, dna);
  add_geometry(s, dna);
  add_networks(s, dna);
  add_poses(s, dna);
  dna.joint_behavior_metadata.joint_representations =
      std::vector<dna::JointRepresentation>(s.joints);
  dna::TwistSwingSetup setup{floats(s.joints), numbers(s.joints), {0, 1, 2, 3}, 1};
  dna.twist_swing_behavior.twists = dna.twist_swing_behavior.swings = std::vector{setup};
  dna.unknown_layers.push_back({{'x', 't', 'r', 'a'}, 1, Bytes(s.unknown_bytes, 7)});
  return dna;
}

inline Bytes write_head(const dna::Dna& dna, std::uint16_t minor) {
  std::vector<dna::Warning> lost;
  auto bytes = dna::write(dna, {minor, true}, lost);
  if (!bytes) {
    ADD_FAILURE() << bytes.error().describe();
    std::abort();
  }
  return std::move(bytes).value();
}

}  // namespace risorius::testing_support
