// SPDX-License-Identifier: MIT
// The format in one place: the fields of each layer, in the order of their bytes. Reading, writing,
// JSON and the sizes of empty layers are visitors of these functions. Private to native/dna.
//
// A visitor has
//   field(name, value)              numbers, texts, Arrays, lists of them, structs with a describe
//   group(name, body)               a struct of the format that Dna lacks; only JSON nests it
//   sized(name, list, mapping)      a list whose elements are preceded by their size in bytes
//                                   (meshes of a 2.1 file: by the offset of their end); mapping
//                                   lists the elements that each LOD needs, or is null
//   faces(mesh), skin(mesh), targets(mesh)   lists that Dna keeps flat, or that a LOD may drop
//   setups(name, list, twist)       lists of describe_setup
//   matrix(name, joint group)       the values of a joint group; a reader may leave out rows
#pragma once

#include <type_traits>

#include "dna/dna.h"

namespace risorius::dna::detail {

/// The name of a field in Dna, for error messages, and its name in the format's JSON. Without a
/// JSON name, JSON uses the field's name in camelCase.
struct Name {
  const char* dna;
  const char* json = nullptr;
  Name(const char* in_dna) : dna(in_dna) {}
  Name(const char* in_dna, const char* in_json) : dna(in_dna), json(in_json) {}
};

/// D is T or const T, so that one function serves both reading and writing.
template <class D, class T>
concept Of = std::is_same_v<std::remove_const_t<D>, T>;

template <class V, Of<LodMapping> D>
void describe(V& v, D& d) {
  v.field("lods", d.lods);
  v.field("indices", d.rows);
}

template <class V, Of<CoordinateSystem> D>
void describe(V& v, D& d) {
  v.field("x_axis", d.x_axis);
  v.field("y_axis", d.y_axis);
  v.field("z_axis", d.z_axis);
}

template <class V, Of<Descriptor> D>
void describe(V& v, D& d) {
  v.field("name", d.name);
  v.field("archetype", d.archetype);
  v.field("gender", d.gender);
  v.field("age", d.age);
  v.field("metadata", d.metadata);
  v.field("translation_unit", d.translation_unit);
  v.field("rotation_unit", d.rotation_unit);
  v.field("coordinate_system", d.coordinate_system);
  v.field("lod_count", d.lod_count);
  v.field({"max_lod", "maxLOD"}, d.max_lod);
  v.field("complexity", d.complexity);
  v.field("db_name", d.db_name);
}

/// The winding order is not described here: the readers and writers of files and of JSON treat it
/// separately, because only files from 2.8 on have it.
template <class V, Of<DescriptorExt> D>
void describe(V& v, D& d) {
  v.field("rotation_sequence", d.rotation_sequence);
  v.group("rotation_sign", [&] {
    v.field("x", d.rotation_sign[0]);
    v.field("y", d.rotation_sign[1]);
    v.field("z", d.rotation_sign[2]);
  });
}

template <class V, Of<Definition> D>
void describe(V& v, D& d) {
  v.field("lod_joint_mapping", d.lod_joint_mapping);
  v.field("lod_blend_shape_mapping", d.lod_blend_shape_mapping);
  v.field("lod_animated_map_mapping", d.lod_animated_map_mapping);
  v.field("lod_mesh_mapping", d.lod_mesh_mapping);
  v.field("gui_control_names", d.gui_control_names);
  v.field("raw_control_names", d.raw_control_names);
  v.field("joint_names", d.joint_names);
  v.field("blend_shape_channel_names", d.blend_shape_channel_names);
  v.field("animated_map_names", d.animated_map_names);
  v.field("mesh_names", d.mesh_names);
  v.group("mesh_blend_shape_channel_mapping", [&] {
    v.field("from", d.mesh_blend_shape_channel_mapping_from);
    v.field("to", d.mesh_blend_shape_channel_mapping_to);
  });
  v.field({"joint_parents", "jointHierarchy"}, d.joint_parents);
  v.field("neutral_joint_translations", d.neutral_joint_translations);
  v.field("neutral_joint_rotations", d.neutral_joint_rotations);
}

template <class V, Of<Conditionals> D>
void describe(V& v, D& d) {
  v.field("input_indices", d.input_indices);
  v.field("output_indices", d.output_indices);
  v.field("from_values", d.from_values);
  v.field("to_values", d.to_values);
  v.field("slope_values", d.slope_values);
  v.field("cut_values", d.cut_values);
}

template <class V, Of<Psds> D>
void describe(V& v, D& d) {
  v.field("rows", d.rows);
  v.field("columns", d.columns);
  v.field("values", d.values);
}

template <class V, Of<JointGroup> D>
void describe(V& v, D& d) {
  v.field("lods", d.lods);
  v.field("input_indices", d.input_indices);
  v.field("output_indices", d.output_indices);
  v.matrix("values", d);
  v.field("joint_indices", d.joint_indices);
}

template <class V, Of<BlendShapeChannels> D>
void describe(V& v, D& d) {
  v.field("lods", d.lods);
  v.field("input_indices", d.input_indices);
  v.field("output_indices", d.output_indices);
}

template <class V, Of<AnimatedMaps> D>
void describe(V& v, D& d) {
  v.field("lods", d.lods);
  v.field("conditionals", d.conditionals);
}

// The following functions describe the four parts of the behavior layer. A 2.1 file stores each
// part at its own offset.
template <class V, Of<Behavior> D>
void describe_controls(V& v, D& d) {
  v.group({"", "controls"}, [&] {
    v.field("psd_count", d.psd_count);
    v.field({"gui_to_raw", "conditionals"}, d.gui_to_raw);
    v.field("psds", d.psds);
  });
}

template <class V, Of<Behavior> D>
void describe_joints(V& v, D& d) {
  v.group({"", "joints"}, [&] {
    v.field({"joint_row_count", "rowCount"}, d.joint_row_count);
    v.field({"joint_column_count", "colCount"}, d.joint_column_count);
    v.field("joint_groups", d.joint_groups);
  });
}

template <class V, Of<Behavior> D>
void describe(V& v, D& d) {
  describe_controls(v, d);
  describe_joints(v, d);
  v.field("blend_shape_channels", d.blend_shape_channels);
  v.field("animated_maps", d.animated_maps);
}

template <class V, Of<BlendShapeTarget> D>
void describe(V& v, D& d) {
  v.field("deltas", d.deltas);
  v.field("vertex_indices", d.vertex_indices);
  v.field("blend_shape_channel_index", d.blend_shape_channel_index);
}

template <class V, Of<Mesh> D>
void describe(V& v, D& d) {
  v.field("positions", d.positions);
  v.field("texture_coordinates", d.texture_coordinates);
  v.field("normals", d.normals);
  v.group({"", "layouts"}, [&] {
    v.field({"layout_positions", "positions"}, d.layout_positions);
    v.field({"layout_texture_coordinates", "textureCoordinates"}, d.layout_texture_coordinates);
    v.field({"layout_normals", "normals"}, d.layout_normals);
  });
  v.faces(d);
  v.field("maximum_influence_per_vertex", d.maximum_influence_per_vertex);
  v.skin(d);
  v.targets(d);
}

template <class V, Of<Geometry> D>
void describe(V& v, D& d) {
  v.sized("meshes", d.meshes, static_cast<const LodMapping*>(nullptr));
}

template <class V, Of<NeuralNetworkLayer> D>
void describe(V& v, D& d) {
  v.field("biases", d.biases);
  v.field("weights", d.weights);
  v.group({"", "activationFunction"}, [&] {
    v.field({"activation_function", "functionId"}, d.activation_function);
    v.field({"activation_parameters", "parameters"}, d.activation_parameters);
  });
}

template <class V, Of<NeuralNetwork> D>
void describe(V& v, D& d) {
  v.field("output_indices", d.output_indices);
  v.field("input_indices", d.input_indices);
  v.field("layers", d.layers);
}

template <class V, Of<MachineLearnedBehavior> D>
void describe(V& v, D& d) {
  v.field("ml_control_names", d.ml_control_names);
  v.field("lod_neural_network_mapping", d.lod_neural_network_mapping);
  v.group({"", "neuralNetworkToMeshRegion"}, [&] {
    v.field("region_names", d.region_names);
    v.field({"region_network_indices", "indices"}, d.region_network_indices);
  });
  v.sized("neural_networks", d.neural_networks, &d.lod_neural_network_mapping);
}

template <class V, Of<MlOperation> D>
void describe(V& v, D& d) {
  v.field("parameters", d.parameters);
  v.field({"operation_set_dependency_indices", "mlOperationSetDependencyIndices"},
          d.operation_set_dependency_indices);
  v.field({"operation_dependency_indices", "mlOperationDependencyIndices"},
          d.operation_dependency_indices);
  v.field("operation_type", d.operation_type);
}

template <class V, Of<MlType> D>
void describe(V& v, D& d) {
  v.field({"lod_operation_mappings", "lodMLOperationMappings"}, d.lod_operation_mappings);
  v.field("operations", d.operations);
}

template <class V, Of<MlJoints> D>
void describe(V& v, D& d) {
  v.field("parameter_keys", d.parameter_keys);
  v.field("parameter_values", d.parameter_values);
  v.field("input_indices", d.input_indices);
  v.field("output_indices", d.output_indices);
}

template <class V, Of<MachineLearnedBehaviorExt> D>
void describe(V& v, D& d) {
  v.field({"types", "mlbTypeData"}, d.types);
  v.field({"joints", "mlbJoints"}, d.joints);
}

template <class V, Of<RbfSolver> D>
void describe(V& v, D& d) {
  v.field("name", d.name);
  v.field("raw_control_indices", d.raw_control_indices);
  v.field("pose_indices", d.pose_indices);
  v.field("raw_control_values", d.raw_control_values);
  v.field("radius", d.radius);
  v.field("weight_threshold", d.weight_threshold);
  v.field("solver_type", d.solver_type);
  v.field("automatic_radius", d.automatic_radius);
  v.field("distance_method", d.distance_method);
  v.field("normalize_method", d.normalize_method);
  v.field("function_type", d.function_type);
  v.field("twist_axis", d.twist_axis);
}

template <class V, Of<RbfPose> D>
void describe(V& v, D& d) {
  v.field("name", d.name);
  v.field("scale", d.scale);
}

template <class V, Of<RbfBehavior> D>
void describe(V& v, D& d) {
  v.field("lod_solver_mapping", d.lod_solver_mapping);
  v.sized("solvers", d.solvers, &d.lod_solver_mapping);
  v.field("poses", d.poses);
}

template <class V, Of<RbfPoseControls> D>
void describe(V& v, D& d) {
  v.field("input_control_indices", d.input_control_indices);
  v.field("output_control_indices", d.output_control_indices);
  v.field("output_control_weights", d.output_control_weights);
}

template <class V, Of<RbfBehaviorExt> D>
void describe(V& v, D& d) {
  v.field("pose_control_names", d.pose_control_names);
  v.field("poses", d.poses);
}

template <class V, Of<JointRepresentation> D>
void describe(V& v, D& d) {
  v.field("translation", d.translation);
  v.field("rotation", d.rotation);
  v.field("scale", d.scale);
}

template <class V, Of<JointBehaviorMetadata> D>
void describe(V& v, D& d) {
  v.field("joint_representations", d.joint_representations);
}

template <class V, Of<TwistSwingBehavior> D>
void describe(V& v, D& d) {
  v.setups("twists", d.twists, true);
  v.setups("swings", d.swings, false);
}

/// Describes a twist or swing setup. The bytes are the same for both; the JSON names differ.
template <class V, Of<TwistSwingSetup> D>
void describe_setup(V& v, D& d, bool twist) {
  v.field({"blend_weights", twist ? "twistBlendWeights" : "swingBlendWeights"}, d.blend_weights);
  v.field({"output_joint_indices", twist ? "twistOutputJointIndices" : "swingOutputJointIndices"},
          d.output_joint_indices);
  v.field(
      {"input_control_indices", twist ? "twistInputControlIndices" : "swingInputControlIndices"},
      d.input_control_indices);
  v.field("twist_axis", d.twist_axis);
}

}  // namespace risorius::dna::detail
