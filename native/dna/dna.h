// SPDX-License-Identifier: MIT
// Dna: a plain value that mirrors the MetaHuman DNA format, one struct per layer.
// Field names are the format's in snake_case; LODs count from 0, the most detailed.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/array.h"

namespace risorius::dna {

using core::Array;
using core::List;
using core::Vec2Array;
using core::Vec3Array;

/// A list of indices for each LOD: LOD l has the list rows[lods[l]]. LODs may share a list.
struct LodMapping {
  Array<std::uint16_t> lods;
  std::vector<Array<std::uint16_t>> rows;
  bool operator==(const LodMapping&) const = default;
};

struct CoordinateSystem {  // axis directions: 0 left 1 right 2 up 3 down 4 front 5 back
  std::uint16_t x_axis = 1, y_axis = 2, z_axis = 4;
  bool operator==(const CoordinateSystem&) const = default;
};

struct Descriptor {
  std::string name;
  std::uint16_t archetype = 0;  // 0 asian 1 black 2 caucasian 3 hispanic 4 alien 5 other
  std::uint16_t gender = 0;     // 0 male 1 female 2 other
  std::uint16_t age = 0;
  std::vector<std::pair<std::string, std::string>> metadata;
  std::uint16_t translation_unit = 0;  // 0 cm 1 m
  std::uint16_t rotation_unit = 0;     // 0 degrees 1 radians
  CoordinateSystem coordinate_system;
  std::uint16_t lod_count = 0;
  std::uint16_t max_lod = 0;
  std::string complexity;
  std::string db_name;
  bool operator==(const Descriptor&) const = default;
};

struct DescriptorExt {
  std::uint32_t rotation_sequence = 0;                 // 0 xyz 1 xzy 2 yxz 3 yzx 4 zxy 5 zyx
  std::array<std::int32_t, 3> rotation_sign{1, 1, 1};  // 1 or -1
  std::uint8_t face_winding_order = 0;                 // 0 ccw 1 cw
  bool operator==(const DescriptorExt&) const = default;
};

struct Definition {
  LodMapping lod_joint_mapping, lod_blend_shape_mapping, lod_animated_map_mapping, lod_mesh_mapping;
  std::vector<std::string> gui_control_names, raw_control_names, joint_names,
      blend_shape_channel_names, animated_map_names, mesh_names;
  Array<std::uint16_t> mesh_blend_shape_channel_mapping_from;  // mesh
  Array<std::uint16_t> mesh_blend_shape_channel_mapping_to;    // channel
  Array<std::uint16_t> joint_parents;                          // a root is its own parent
  Vec3Array neutral_joint_translations;                        // relative to the parent, file units
  Vec3Array neutral_joint_rotations;                           // relative to the parent, file units
  bool operator==(const Definition&) const = default;
};

/// Rows of a table, as six parallel lists. A row adds slope * in + cut to its output if its
/// input `in` satisfies from <= in <= to.
struct Conditionals {
  Array<std::uint16_t> input_indices, output_indices;
  Array<float> from_values, to_values, slope_values, cut_values;
  bool operator==(const Conditionals&) const = default;
};

/// Correctives, as a sparse matrix in coordinate form. Each entry gives a corrective one factor:
/// row is the control index of the corrective, column that of the factor. The weight of a
/// corrective is the product of the values of its entries: the corrective is min(1, weight *
/// product of its factors).
struct Psds {
  Array<std::uint16_t> rows, columns;
  Array<float> values;
  bool operator==(const Psds&) const = default;
};

struct JointGroup {
  Array<std::uint16_t> lods;            // leading rows used at each LOD, non-increasing
  Array<std::uint16_t> input_indices;   // columns: control indices
  Array<std::uint16_t> output_indices;  // rows: joint * 9 + attribute (tx ty tz rx ry rz sx sy sz)
  Array<float> values;                  // [rows, columns], row-major
  Array<std::uint16_t> joint_indices;
  bool operator==(const JointGroup&) const = default;
};

struct BlendShapeChannels {
  Array<std::uint16_t> lods, input_indices, output_indices;
  bool operator==(const BlendShapeChannels&) const = default;
};

struct AnimatedMaps {
  Array<std::uint16_t> lods;
  Conditionals conditionals;
  bool operator==(const AnimatedMaps&) const = default;
};

struct Behavior {
  std::uint16_t psd_count = 0;
  Conditionals gui_to_raw;
  Psds psds;
  std::uint16_t joint_row_count = 0, joint_column_count = 0;
  List<JointGroup> joint_groups;
  BlendShapeChannels blend_shape_channels;
  AnimatedMaps animated_maps;
  bool operator==(const Behavior&) const = default;
};

struct BlendShapeTarget {
  Vec3Array deltas;
  Array<std::uint32_t> vertex_indices;
  std::uint16_t blend_shape_channel_index = 0;
  bool operator==(const BlendShapeTarget&) const = default;
};

struct Mesh {
  Vec3Array positions;            // [vertices], file units
  Vec2Array texture_coordinates;  // u, v
  Vec3Array normals;
  Array<std::uint32_t> layout_positions, layout_texture_coordinates, layout_normals;
  Array<std::uint32_t> face_offsets;  // [faces + 1] into face_layouts, or empty
  Array<std::uint32_t> face_layouts;  // layout indices of all faces, back to back
  std::uint16_t maximum_influence_per_vertex = 0;
  Array<std::uint32_t> skin_offsets;  // [vertices + 1] into the two below, or empty
  Array<float> skin_weights;
  Array<std::uint16_t> skin_joint_indices;
  List<BlendShapeTarget> blend_shape_targets;
  bool operator==(const Mesh&) const = default;
};

struct Geometry {
  List<Mesh> meshes;
  bool operator==(const Geometry&) const = default;
};

/// One layer of a network: y = activation(W x + b).
struct NeuralNetworkLayer {
  Array<float> biases;                    // [outputs]
  Array<float> weights;                   // [outputs, inputs], row-major
  std::uint16_t activation_function = 0;  // 0 linear 1 relu 2 leakyrelu 3 tanh 4 sigmoid
  Array<float> activation_parameters;     // leakyrelu: its slope below 0
  bool operator==(const NeuralNetworkLayer&) const = default;
};

struct NeuralNetwork {
  Array<std::uint16_t> output_indices, input_indices;  // control indices
  List<NeuralNetworkLayer> layers;
  bool operator==(const NeuralNetwork&) const = default;
};

/// Layer mlbh: neural networks and the controls that they write.
struct MachineLearnedBehavior {
  std::vector<std::string> ml_control_names;
  LodMapping lod_neural_network_mapping;
  std::vector<std::vector<std::string>> region_names;                     // [mesh][region]
  std::vector<std::vector<Array<std::uint16_t>>> region_network_indices;  // [mesh][region]
  List<NeuralNetwork> neural_networks;
  bool operator==(const MachineLearnedBehavior&) const = default;
};

/// A node of the graph of layer mlbe. Its parameters depend on its type. Gather and scatter:
/// control indices. MLP: the network's index, then optionally the number of rows of each network
/// layer at each LOD (layer-major). Weighted sum: the number of outputs, then one weight per
/// dependency, as the bits of a float.
struct MlOperation {
  Array<std::uint32_t> parameters;
  Array<std::uint16_t> operation_set_dependency_indices, operation_dependency_indices;
  std::uint16_t operation_type = 0;  // 0 unspecified 1 gather 2 scatter 3 MLP 4 weighted sum
  bool operator==(const MlOperation&) const = default;
};

struct MlType {
  std::vector<LodMapping> lod_operation_mappings;  // [operation set]
  List<List<MlOperation>> operations;              // [operation set][operation]
  bool operator==(const MlType&) const = default;
};

/// Joints that networks move. input_indices: control indices. output_indices, parallel to them:
/// joint * stride + attribute; the stride is 9, or 10 with quaternions. parameter_values has the
/// value of each key in parameter_keys: 0 type of translation, 1 type of rotation (0 Euler,
/// 1 quaternion), 2 type of scale, 3 to 5 axes, 6 to 8 rotation signs (1 for 1, 0 for -1),
/// 9 rotation sequence.
struct MlJoints {
  Array<std::uint16_t> parameter_keys, parameter_values, input_indices, output_indices;
  bool operator==(const MlJoints&) const = default;
};

/// Layer mlbe: operations that run the networks of layer mlbh, and joints that networks move.
struct MachineLearnedBehaviorExt {
  List<MlType> types;
  MlJoints joints;
  bool operator==(const MachineLearnedBehaviorExt&) const = default;
};

struct RbfSolver {
  std::string name;
  Array<std::uint16_t> raw_control_indices, pose_indices;
  Array<float> raw_control_values;  // [poses, raw controls]: each pose's target
  float radius = 0.0f;              // file's rotation unit
  float weight_threshold = 0.0f;
  std::uint16_t solver_type = 0;       // 0 additive 1 interpolative
  std::uint16_t automatic_radius = 0;  // 0 on 1 off
  std::uint16_t distance_method = 0;   // 0 euclidean 1 quaternion 2 swing angle 3 twist angle
  std::uint16_t normalize_method = 0;  // 0 if weights sum to over 1, 1 always
  std::uint16_t function_type = 0;     // 0 gaussian 1 exponential 2 linear 3 cubic 4 quintic
  std::uint16_t twist_axis = 0;        // 0 x 1 y 2 z
  bool operator==(const RbfSolver&) const = default;
};

struct RbfPose {
  std::string name;
  float scale = 0.0f;
  bool operator==(const RbfPose&) const = default;
};

/// Layer rbfb: radial basis function solvers and their poses.
struct RbfBehavior {
  LodMapping lod_solver_mapping;
  List<RbfSolver> solvers;
  List<RbfPose> poses;
  bool operator==(const RbfBehavior&) const = default;
};

/// The output controls of a pose of layer rbfb. The pose adds to each output control: the weight of
/// that output, times the pose's value, times the product of the input controls.
struct RbfPoseControls {
  Array<std::uint16_t> input_control_indices, output_control_indices;
  Array<float> output_control_weights;
  bool operator==(const RbfPoseControls&) const = default;
};

/// Layer rbfe: the output controls of each pose of layer rbfb.
struct RbfBehaviorExt {
  std::vector<std::string> pose_control_names;
  List<RbfPoseControls> poses;
  bool operator==(const RbfBehaviorExt&) const = default;
};

struct JointRepresentation {
  std::uint16_t translation = 0;  // 0 vector
  std::uint16_t rotation = 0;     // 0 Euler angles 1 quaternion
  std::uint16_t scale = 0;        // 0 vector
  bool operator==(const JointRepresentation&) const = default;
};

/// Layer jbmd: the representation of each joint's translation, rotation and scale.
struct JointBehaviorMetadata {
  List<JointRepresentation> joint_representations;
  bool operator==(const JointBehaviorMetadata&) const = default;
};

/// A twist or swing setup: distributes the rotation in four controls (x y z w) over joints.
struct TwistSwingSetup {
  Array<float> blend_weights;  // one per output joint
  Array<std::uint16_t> output_joint_indices, input_control_indices;
  std::uint16_t twist_axis = 0;  // 0 x 1 y 2 z
  bool operator==(const TwistSwingSetup&) const = default;
};

/// Layer twsw: setups that distribute the twist or the swing of a rotation over joints.
struct TwistSwingBehavior {
  List<TwistSwingSetup> twists, swings;
  bool operator==(const TwistSwingBehavior&) const = default;
};

/// A layer that this version does not know, kept as bytes at its place in the file's index.
struct UnknownLayer {
  std::array<char, 4> id{};
  std::uint32_t version = 0;  // major << 16 | minor
  std::vector<std::uint8_t> bytes;
  bool operator==(const UnknownLayer&) const = default;
};

/// An oddity of a file that does not prevent reading it.
struct Warning {
  std::string where;
  std::string message;
  std::optional<std::uint64_t> offset = std::nullopt;  // byte offset in the file, if known
  bool operator==(const Warning&) const = default;
};

/// The numbers of controls in layers that were not loaded. These controls keep their indices in the
/// control space raw | corrective | network | RBF pose.
struct UnreadControls {
  std::uint32_t psd = 0, ml = 0, rbf_pose = 0;
  bool operator==(const UnreadControls&) const = default;
};

struct Dna {
  std::uint16_t generation = 2, version = 8;  // of the source file
  Descriptor descriptor;
  DescriptorExt descriptor_ext;
  Definition definition;
  Behavior behavior;
  Geometry geometry;
  MachineLearnedBehavior machine_learned_behavior;
  MachineLearnedBehaviorExt machine_learned_behavior_ext;
  RbfBehavior rbf_behavior;
  RbfBehaviorExt rbf_behavior_ext;
  JointBehaviorMetadata joint_behavior_metadata;
  TwistSwingBehavior twist_swing_behavior;
  UnreadControls unread_controls;
  std::vector<UnknownLayer> unknown_layers;
  /// Layer ids in the order of the source file's index, so that a written file has the same order;
  /// "" stands for the next element of unknown_layers.
  std::vector<std::string> index_order;
  std::vector<Warning> warnings;
};

}  // namespace risorius::dna
