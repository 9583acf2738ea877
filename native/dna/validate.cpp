// SPDX-License-Identifier: MIT
// Checks the layers of a Dna: errors refuse the file, oddities are warnings.
#include "dna/validate.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/finite.h"
#include "dna/controls.h"
#include "dna/where.h"

namespace risorius::dna {

namespace {

using core::Array;
using core::ErrorCode;
using core::List;
using core::ok;
using core::Status;
using detail::Where;

constexpr std::size_t kMostFindings = 1000;  // a broken file repeats its errors

template <class T>
T largest(const Array<T>& values) {
  T top = 0;
  for (const T v : values) top = std::max(top, v);
  return top;
}

// Collects errors and oddities of a Dna. Each check of a list gives at most one finding.
class Checker {
 public:
  explicit Checker(detail::Known known) : known_(known) {}
  std::vector<Finding> take() { return std::move(findings_); }
  const detail::Known& known() const { return known_; }

  void error(ErrorCode code, const Where& where, std::string message) {
    ++errors_;
    add(true, code, where, std::move(message));
  }
  void warn(const Where& where, std::string message) {
    add(false, ErrorCode::kInvalidValue, where, std::move(message));
  }
  bool same_length(const Where& where, const char* a, std::size_t na, const char* b,
                   std::size_t nb) {
    if (na == nb) return true;
    error(ErrorCode::kInvalidLength, where,
          std::to_string(na) + " " + a + ", but " + std::to_string(nb) + " " + b);
    return false;
  }
  template <class T>
  void below(const Where& where, const Array<T>& indices, std::size_t limit, const char* space) {
    if (indices.empty() || largest(indices) < limit) return;
    const Odd odd = find_odd(indices.size(), [&](std::size_t i) { return indices[i] >= limit; });
    error(ErrorCode::kInvalidIndex, where[odd.first],
          "index " + std::to_string(indices[odd.first]) + ", but there are " +
              std::to_string(limit) + " " + space + and_more(odd.count - 1));
  }
  void index(const Where& where, std::size_t value, std::size_t limit, const char* space) {
    if (value < limit) return;
    error(ErrorCode::kInvalidIndex, where,
          "index " + std::to_string(value) + ", but there are " + std::to_string(limit) + " " +
              space);
  }
  void finite(const Where& where, const Array<float>& values) {
    if (known_.finite || core::all_finite(values)) return;
    const Odd odd =
        find_odd(values.size(), [&](std::size_t i) { return !core::is_finite(values[i]); });
    warn(where[odd.first], "not a finite number" + and_more(odd.count - 1));
  }
  void row_counts(const Where& where, const Array<std::uint16_t>& lods, std::size_t rows,
                  std::size_t lod_count) {
    const auto is_beyond = [&](std::size_t l) { return lods[l] > rows; };
    const Odd beyond = find_odd(lods.size(), is_beyond);
    if (beyond.count > 0) {
      error(ErrorCode::kInvalidValue, (where + ".lods")[beyond.first],
            std::to_string(lods[beyond.first]) + " rows, but the table has " +
                std::to_string(rows) + and_more(beyond.count - 1));
    }
    const Odd rising = find_odd(lods.size(), [&](std::size_t l) {
      return l > 0 && lods[l] > lods[l - 1] && !is_beyond(l);
    });
    if (rising.count > 0) {
      warn((where + ".lods")[rising.first],
           "more rows than the LOD before it" + and_more(rising.count - 1));
    }
    if (rows > 0 && lods.size() != lod_count) {
      warn(where + ".lods", std::to_string(lods.size()) + " entries, but there are " +
                                std::to_string(lod_count) + " LODs");
    }
  }
  void lod_mapping(const Where& where, const LodMapping& m, std::size_t limit, const char* space,
                   std::size_t lod_count) {
    below(where + ".lods", m.lods, m.rows.size(), "index lists");
    for (std::size_t i = 0; i < m.rows.size(); ++i) {
      below((where + ".indices")[i], m.rows[i], limit, space);
    }
    if (!m.lods.empty() && m.lods.size() != lod_count) {
      warn(where + ".lods", std::to_string(m.lods.size()) + " entries, but there are " +
                                std::to_string(lod_count) + " LODs");
    }
  }
  void choice(const Where& where, std::uint32_t value, std::uint32_t limit) {
    if (value >= limit) warn(where, "the value " + std::to_string(value) + " is not known");
  }

 private:
  struct Odd {
    std::size_t first = 0, count = 0;
  };
  /// The first index below `size` for which is_odd is true (0 if there is none), and the number of
  /// such indices.
  template <class IsOdd>
  static Odd find_odd(std::size_t size, const IsOdd& is_odd) {
    Odd out;
    for (std::size_t i = size; i-- > 0;) {
      if (!is_odd(i)) continue;
      out.first = i;
      ++out.count;
    }
    return out;
  }
  static std::string and_more(std::size_t n) {
    return n == 0 ? "" : " (and " + std::to_string(n) + " more in this list)";
  }
  void add(bool is_error, ErrorCode code, const Where& where, std::string message) {
    if (findings_.size() >= kMostFindings && !(is_error && errors_ == 1)) return;
    findings_.push_back({is_error, {code, std::nullopt, where.text(), std::move(message)}});
  }

  detail::Known known_;
  std::vector<Finding> findings_;
  std::size_t errors_ = 0;
};

// ---- descriptor and definition

void check_descriptor(Checker& c, const Dna& dna) {
  const Descriptor& d = dna.descriptor;
  c.choice("descriptor.archetype", d.archetype, 6);
  c.choice("descriptor.gender", d.gender, 3);
  c.choice("descriptor.translation_unit", d.translation_unit, 2);
  c.choice("descriptor.rotation_unit", d.rotation_unit, 2);
  if (d.lod_count > 33) {
    c.error(ErrorCode::kInvalidValue, "descriptor.lod_count",
            "lod_count is " + std::to_string(d.lod_count) + ", the format allows 33");
  }
  const DescriptorExt& ext = dna.descriptor_ext;
  c.choice("descriptor_ext.rotation_sequence", ext.rotation_sequence, 6);
  c.choice("descriptor_ext.face_winding_order", ext.face_winding_order, 2);
  for (std::size_t i = 0; i < 3; ++i) {
    if (ext.rotation_sign[i] == 1 || ext.rotation_sign[i] == -1) continue;
    constexpr const char* kAxes[] = {".x", ".y", ".z"};
    c.warn(Where("descriptor_ext.rotation_sign") + kAxes[i],
           "the sign is " + std::to_string(ext.rotation_sign[i]) + ", 1 or -1 was expected");
  }
  const CoordinateSystem& a = d.coordinate_system;
  const bool axes = a.x_axis < 6 && a.y_axis < 6 && a.z_axis < 6 && a.x_axis / 2 != a.y_axis / 2 &&
                    a.y_axis / 2 != a.z_axis / 2 && a.x_axis / 2 != a.z_axis / 2;
  if (!axes) c.warn("descriptor.coordinate_system", "the axes do not span space");
}

void check_hierarchy(Checker& c, const Array<std::uint16_t>& parents) {
  // From each joint, go up to a joint that is known to reach a root.
  std::vector<std::uint8_t> good(parents.size(), 0);
  std::vector<std::size_t> path;
  for (std::size_t j = 0; j < parents.size(); ++j) {
    path.clear();
    std::size_t at = j;
    while (!good[at] && parents[at] != at) {
      path.push_back(at);
      at = parents[at];
      if (path.size() <= parents.size()) continue;
      c.error(ErrorCode::kInvalidValue, Where("definition.joint_parents")[j],
              "the joint hierarchy has a cycle");
      return;
    }
    good[at] = 1;
    for (const std::size_t p : path) good[p] = 1;
  }
}

void check_definition(Checker& c, const Dna& dna) {
  const Definition& d = dna.definition;
  const std::size_t joints = d.joint_names.size(), lods = dna.descriptor.lod_count;
  const std::size_t channels = d.blend_shape_channel_names.size(), meshes = d.mesh_names.size();
  c.lod_mapping("definition.lod_joint_mapping", d.lod_joint_mapping, joints, "joints", lods);
  c.lod_mapping("definition.lod_blend_shape_mapping", d.lod_blend_shape_mapping, channels,
                "blend shape channels", lods);
  c.lod_mapping("definition.lod_animated_map_mapping", d.lod_animated_map_mapping,
                d.animated_map_names.size(), "animated maps", lods);
  c.lod_mapping("definition.lod_mesh_mapping", d.lod_mesh_mapping, meshes, "meshes", lods);
  const Where pairs = "definition.mesh_blend_shape_channel_mapping";
  c.same_length(pairs, "meshes", d.mesh_blend_shape_channel_mapping_from.size(), "channels",
                d.mesh_blend_shape_channel_mapping_to.size());
  c.below(pairs + ".from", d.mesh_blend_shape_channel_mapping_from, meshes, "meshes");
  c.below(pairs + ".to", d.mesh_blend_shape_channel_mapping_to, channels, "blend shape channels");
  const Where parents = "definition.joint_parents";
  const bool whole =
      c.same_length(parents, "joint names", joints, "parents", d.joint_parents.size());
  c.same_length("definition.neutral_joint_translations", "joint names", joints, "translations",
                d.neutral_joint_translations.count());
  c.same_length("definition.neutral_joint_rotations", "joint names", joints, "rotations",
                d.neutral_joint_rotations.count());
  c.below(parents, d.joint_parents, joints, "joints");
  if (whole && (joints == 0 || largest(d.joint_parents) < joints)) {
    check_hierarchy(c, d.joint_parents);
  }
  c.finite("definition.neutral_joint_translations", d.neutral_joint_translations.values);
  c.finite("definition.neutral_joint_rotations", d.neutral_joint_rotations.values);
}

// ---- behavior

void check_conditionals(Checker& c, const Where& where, const Conditionals& t, std::size_t inputs,
                        const char* input_space, std::size_t outputs, const char* output_space) {
  const std::size_t rows = t.input_indices.size();
  c.same_length(where, "inputs", rows, "outputs", t.output_indices.size());
  c.same_length(where, "inputs", rows, "from values", t.from_values.size());
  c.same_length(where, "inputs", rows, "to values", t.to_values.size());
  c.same_length(where, "inputs", rows, "slope values", t.slope_values.size());
  c.same_length(where, "inputs", rows, "cut values", t.cut_values.size());
  c.below(where + ".input_indices", t.input_indices, inputs, input_space);
  c.below(where + ".output_indices", t.output_indices, outputs, output_space);
  c.finite(where + ".from_values", t.from_values);
  c.finite(where + ".to_values", t.to_values);
  c.finite(where + ".slope_values", t.slope_values);
  c.finite(where + ".cut_values", t.cut_values);
}

void check_joint_group(Checker& c, const Where& where, const JointGroup& g, const Dna& dna) {
  const std::size_t joints = dna.definition.joint_names.size();
  if (g.values.size() != g.output_indices.size() * g.input_indices.size()) {
    c.error(ErrorCode::kInvalidLength, where + ".values",
            std::to_string(g.values.size()) + " values, but " +
                std::to_string(g.output_indices.size()) + " rows of " +
                std::to_string(g.input_indices.size()));
  }
  c.below(where + ".input_indices", g.input_indices, control_counts(dna).total(), "controls");
  c.below(where + ".output_indices", g.output_indices, joints * 9, "joint attributes");
  c.below(where + ".joint_indices", g.joint_indices, joints, "joints");
  c.row_counts(where, g.lods, g.output_indices.size(), dna.descriptor.lod_count);
  c.finite(where + ".values", g.values);
}

void check_behavior(Checker& c, const Dna& dna) {
  const Behavior& b = dna.behavior;
  const Definition& d = dna.definition;
  const std::size_t raw = d.raw_control_names.size(), controls = control_counts(dna).total();
  const std::size_t lods = dna.descriptor.lod_count;
  check_conditionals(c, "behavior.gui_to_raw", b.gui_to_raw, d.gui_control_names.size(),
                     "GUI controls", raw, "raw controls");
  c.same_length("behavior.psds", "rows", b.psds.rows.size(), "columns", b.psds.columns.size());
  c.same_length("behavior.psds", "rows", b.psds.rows.size(), "values", b.psds.values.size());
  c.below("behavior.psds.rows", b.psds.rows, raw + b.psd_count, "raw and corrective controls");
  c.below("behavior.psds.columns", b.psds.columns, controls, "controls");
  c.finite("behavior.psds.values", b.psds.values);
  for (std::size_t i = 0; i < b.joint_groups.size(); ++i) {
    check_joint_group(c, Where("behavior.joint_groups")[i], b.joint_groups[i], dna);
  }
  const BlendShapeChannels& s = b.blend_shape_channels;
  const Where shapes = "behavior.blend_shape_channels", maps = "behavior.animated_maps";
  c.same_length(shapes, "inputs", s.input_indices.size(), "outputs", s.output_indices.size());
  c.below(shapes + ".input_indices", s.input_indices, controls, "controls");
  c.below(shapes + ".output_indices", s.output_indices, d.blend_shape_channel_names.size(),
          "blend shape channels");
  c.row_counts(shapes, s.lods, s.output_indices.size(), lods);
  const Conditionals& table = b.animated_maps.conditionals;
  check_conditionals(c, maps, table, controls, "controls", d.animated_map_names.size(),
                     "animated maps");
  c.row_counts(maps, b.animated_maps.lods, table.input_indices.size(), lods);
}

// ---- geometry

void check_offsets(Checker& c, const Where& where, const Array<std::uint32_t>& offsets,
                   std::size_t items) {
  if (offsets.empty()) {
    if (items > 0) c.error(ErrorCode::kInvalidLength, where, "values without offsets");
    return;
  }
  bool good = offsets[0] == 0 && offsets[offsets.size() - 1] == items;
  for (std::size_t i = 1; i < offsets.size(); ++i) good = good && offsets[i] >= offsets[i - 1];
  if (!good) {
    c.error(ErrorCode::kInvalidValue, where,
            "offsets must begin at 0, never fall and end at the number of values");
  }
}

void check_targets(Checker& c, const Where& where, const Dna& dna, const Mesh& m) {
  const std::size_t channels = dna.definition.blend_shape_channel_names.size();
  for (std::size_t t = 0; t < m.blend_shape_targets.size(); ++t) {
    const BlendShapeTarget& target = m.blend_shape_targets[t];
    const Where at = (where + ".blend_shape_targets")[t];
    c.same_length(at, "deltas", target.deltas.count(), "vertex indices",
                  target.vertex_indices.size());
    if (!c.known().vertex_indices) {
      c.below(at + ".vertex_indices", target.vertex_indices, m.positions.count(), "vertices");
    }
    c.index(at + ".blend_shape_channel_index", target.blend_shape_channel_index, channels,
            "blend shape channels");
    c.finite(at + ".deltas", target.deltas.values);
  }
}

void check_mesh(Checker& c, const Where& where, const Dna& dna, const Mesh& m) {
  const std::size_t vertices = m.positions.count();
  const std::size_t layouts = m.layout_positions.size();
  c.same_length(where, "layout positions", layouts, "layout texture coordinates",
                m.layout_texture_coordinates.size());
  c.same_length(where, "layout positions", layouts, "layout normals", m.layout_normals.size());
  c.below(where + ".layout_positions", m.layout_positions, vertices, "vertices");
  c.below(where + ".layout_texture_coordinates", m.layout_texture_coordinates,
          m.texture_coordinates.count(), "texture coordinates");
  c.below(where + ".layout_normals", m.layout_normals, m.normals.count(), "normals");
  check_offsets(c, where + ".faces", m.face_offsets, m.face_layouts.size());
  c.below(where + ".face_layouts", m.face_layouts, layouts, "layouts");
  const Where skin = where + ".skin_weights";
  check_offsets(c, skin, m.skin_offsets, m.skin_weights.size());
  c.same_length(skin, "weights", m.skin_weights.size(), "joint indices",
                m.skin_joint_indices.size());
  if (!m.skin_offsets.empty()) {
    c.same_length(skin, "entries", m.skin_offsets.size() - 1, "vertices", vertices);
  }
  c.below(where + ".skin_joint_indices", m.skin_joint_indices, dna.definition.joint_names.size(),
          "joints");
  c.finite(skin, m.skin_weights);
  c.finite(where + ".positions", m.positions.values);
  c.finite(where + ".texture_coordinates", m.texture_coordinates.values);
  c.finite(where + ".normals", m.normals.values);
  check_targets(c, where, dna, m);
}

void check_geometry(Checker& c, const Dna& dna) {
  const List<Mesh>& meshes = dna.geometry.meshes;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    check_mesh(c, Where("geometry.meshes")[i], dna, meshes[i]);
  }
  const std::size_t names = dna.definition.mesh_names.size();
  if (!meshes.empty() && meshes.size() != names) {
    c.warn("geometry.meshes",
           std::to_string(meshes.size()) + " meshes, but " + std::to_string(names) + " mesh names");
  }
}

// ---- networks

void check_network(Checker& c, const Where& where, const NeuralNetwork& n, std::size_t controls) {
  c.below(where + ".output_indices", n.output_indices, controls, "controls");
  c.below(where + ".input_indices", n.input_indices, controls, "controls");
  for (std::size_t l = 0; l < n.layers.size(); ++l) {
    const NeuralNetworkLayer& layer = n.layers[l];
    const Where at = (where + ".layers")[l];
    const std::size_t outputs = layer.biases.size(), weights = layer.weights.size();
    const bool rows = outputs == 0 ? weights == 0 : weights % outputs == 0;
    if (!rows || (l > 0 && weights != outputs * n.layers[l - 1].biases.size())) {
      c.error(
          ErrorCode::kInvalidLength, at + ".weights",
          std::to_string(weights) + " weights do not fit " + std::to_string(outputs) + " outputs" +
              (l > 0 ? " of " + std::to_string(n.layers[l - 1].biases.size()) + " inputs" : ""));
    }
    c.choice(at + ".activation_function", layer.activation_function, 5);
    if (layer.activation_function == 2 && layer.activation_parameters.empty()) {
      c.warn(at + ".activation_parameters", "leaky ReLU without its slope");
    }
    c.finite(at + ".biases", layer.biases);
    c.finite(at + ".weights", layer.weights);
  }
}

void check_networks(Checker& c, const Dna& dna) {
  const MachineLearnedBehavior& ml = dna.machine_learned_behavior;
  const Where where = "machine_learned_behavior";
  const std::size_t count = ml.neural_networks.size(), controls = control_counts(dna).total();
  c.lod_mapping(where + ".lod_neural_network_mapping", ml.lod_neural_network_mapping, count,
                "networks", dna.descriptor.lod_count);
  c.same_length(where + ".region_names", "meshes with region names", ml.region_names.size(),
                "with region networks", ml.region_network_indices.size());
  for (std::size_t m = 0; m < ml.region_network_indices.size(); ++m) {
    const auto& regions = ml.region_network_indices[m];
    const Where at = (where + ".region_network_indices")[m];
    if (m < ml.region_names.size()) {
      c.same_length(at, "region names", ml.region_names[m].size(), "regions", regions.size());
    }
    for (std::size_t r = 0; r < regions.size(); ++r) {
      c.below(at[r], regions[r], count, "networks");
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    check_network(c, (where + ".neural_networks")[i], ml.neural_networks[i], controls);
  }
}

void check_operation(Checker& c, const Where& where, const MlOperation& op, const MlType& type,
                     const Dna& dna) {
  const auto& sets = op.operation_set_dependency_indices;
  const auto& operations = op.operation_dependency_indices;
  const bool pairs = c.same_length(where, "set dependencies", sets.size(), "operation dependencies",
                                   operations.size());
  c.below(where + ".operation_set_dependency_indices", sets, type.operations.size(),
          "operation sets");
  for (std::size_t i = 0; pairs && i < sets.size(); ++i) {
    if (sets[i] >= type.operations.size()) continue;
    c.index((where + ".operation_dependency_indices")[i], operations[i],
            type.operations[sets[i]].size(), "operations in that set");
  }
  c.choice(where + ".operation_type", op.operation_type, 5);
  enum : std::uint16_t { kGather = 1, kScatter = 2, kMlp = 3 };
  if (op.operation_type == kGather || op.operation_type == kScatter) {
    c.below(where + ".parameters", op.parameters, control_counts(dna).total(), "controls");
  } else if (op.operation_type == kMlp && !op.parameters.empty()) {
    c.index(where + ".parameters[0]", op.parameters[0],
            dna.machine_learned_behavior.neural_networks.size(), "networks");
  }
}

void check_ml_joints(Checker& c, const Dna& dna) {
  const MlJoints& j = dna.machine_learned_behavior_ext.joints;
  const Where where = "machine_learned_behavior_ext.joints";
  c.same_length(where, "parameter keys", j.parameter_keys.size(), "parameter values",
                j.parameter_values.size());
  c.same_length(where, "inputs", j.input_indices.size(), "outputs", j.output_indices.size());
  c.below(where + ".input_indices", j.input_indices, control_counts(dna).total(), "controls");
  c.below(where + ".output_indices", j.output_indices,
          dna.definition.joint_names.size() * ml_joint_stride(j), "joint attributes");
}

void check_operations(Checker& c, const Dna& dna) {
  const auto& types = dna.machine_learned_behavior_ext.types;
  for (std::size_t t = 0; t < types.size(); ++t) {
    const MlType& type = types[t];
    const Where where = Where("machine_learned_behavior_ext.types")[t];
    c.same_length(where, "LOD mappings", type.lod_operation_mappings.size(), "operation sets",
                  type.operations.size());
    for (std::size_t s = 0; s < type.operations.size(); ++s) {
      if (s < type.lod_operation_mappings.size()) {
        c.lod_mapping((where + ".lod_operation_mappings")[s], type.lod_operation_mappings[s],
                      type.operations[s].size(), "operations", dna.descriptor.lod_count);
      }
      for (std::size_t i = 0; i < type.operations[s].size(); ++i) {
        check_operation(c, (where + ".operations")[s][i], type.operations[s][i], type, dna);
      }
    }
  }
  check_ml_joints(c, dna);
}

// ---- RBF poses, joint metadata, twist and swing

void check_solver(Checker& c, const Where& where, const RbfSolver& s, const Dna& dna) {
  c.below(where + ".raw_control_indices", s.raw_control_indices, control_counts(dna).total(),
          "controls");
  c.below(where + ".pose_indices", s.pose_indices, dna.rbf_behavior.poses.size(), "poses");
  if (s.raw_control_values.size() != s.pose_indices.size() * s.raw_control_indices.size()) {
    c.error(ErrorCode::kInvalidLength, where + ".raw_control_values",
            std::to_string(s.raw_control_values.size()) + " values, but " +
                std::to_string(s.pose_indices.size()) + " poses of " +
                std::to_string(s.raw_control_indices.size()) + " controls");
  }
  c.finite(where + ".raw_control_values", s.raw_control_values);
  if (!std::isfinite(s.radius)) c.warn(where + ".radius", "not a finite number");
  c.choice(where + ".solver_type", s.solver_type, 2);
  c.choice(where + ".automatic_radius", s.automatic_radius, 2);
  c.choice(where + ".distance_method", s.distance_method, 4);
  c.choice(where + ".normalize_method", s.normalize_method, 2);
  c.choice(where + ".function_type", s.function_type, 5);
  c.choice(where + ".twist_axis", s.twist_axis, 3);
}

void check_rbf(Checker& c, const Dna& dna) {
  const RbfBehavior& rbf = dna.rbf_behavior;
  const std::size_t controls = control_counts(dna).total();
  c.lod_mapping("rbf_behavior.lod_solver_mapping", rbf.lod_solver_mapping, rbf.solvers.size(),
                "solvers", dna.descriptor.lod_count);
  for (std::size_t i = 0; i < rbf.solvers.size(); ++i) {
    check_solver(c, Where("rbf_behavior.solvers")[i], rbf.solvers[i], dna);
  }
  for (std::size_t i = 0; i < rbf.poses.size(); ++i) {
    if (std::isfinite(rbf.poses[i].scale)) continue;
    c.warn(Where("rbf_behavior.poses")[i] + ".scale", "not a finite number");
  }
  const auto& poses = dna.rbf_behavior_ext.poses;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Where where = Where("rbf_behavior_ext.poses")[i];
    c.below(where + ".input_control_indices", poses[i].input_control_indices, controls, "controls");
    c.below(where + ".output_control_indices", poses[i].output_control_indices, controls,
            "controls");
    c.same_length(where, "outputs", poses[i].output_control_indices.size(), "weights",
                  poses[i].output_control_weights.size());
    c.finite(where + ".output_control_weights", poses[i].output_control_weights);
  }
  if (!poses.empty() && poses.size() != rbf.poses.size()) {
    c.warn("rbf_behavior_ext.poses", std::to_string(poses.size()) +
                                         " poses, but rbf_behavior has " +
                                         std::to_string(rbf.poses.size()));
  }
}

void check_joint_metadata(Checker& c, const Dna& dna) {
  const auto& entries = dna.joint_behavior_metadata.joint_representations;
  const Where where = "joint_behavior_metadata.joint_representations";
  const std::size_t joints = dna.definition.joint_names.size();
  if (!entries.empty() && entries.size() != joints) {
    c.warn(where, std::to_string(entries.size()) + " entries, but there are " +
                      std::to_string(joints) + " joints");
  }
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i].translation < 1 && entries[i].rotation < 2 && entries[i].scale < 1) continue;
    c.choice(where[i] + ".translation", entries[i].translation, 1);
    c.choice(where[i] + ".rotation", entries[i].rotation, 2);
    c.choice(where[i] + ".scale", entries[i].scale, 1);
  }
}

void check_setups(Checker& c, const Where& name, const List<TwistSwingSetup>& setups,
                  const Dna& dna) {
  for (std::size_t i = 0; i < setups.size(); ++i) {
    const TwistSwingSetup& s = setups[i];
    const Where where = name[i];
    c.same_length(where, "output joints", s.output_joint_indices.size(), "weights",
                  s.blend_weights.size());
    c.below(where + ".output_joint_indices", s.output_joint_indices,
            dna.definition.joint_names.size(), "joints");
    c.below(where + ".input_control_indices", s.input_control_indices, control_counts(dna).total(),
            "controls");
    if (s.input_control_indices.size() != 4) {
      c.warn(where + ".input_control_indices", std::to_string(s.input_control_indices.size()) +
                                                   " controls, a rotation has 4 (x y z w)");
    }
    c.finite(where + ".blend_weights", s.blend_weights);
    c.choice(where + ".twist_axis", s.twist_axis, 3);
  }
}

void check_layers(Checker& c, const Dna& dna, bool geometry) {
  check_descriptor(c, dna);
  check_definition(c, dna);
  // An empty behavior has nothing to check; it is empty if it was not loaded.
  if (dna.behavior != Behavior{}) check_behavior(c, dna);
  if (geometry) check_geometry(c, dna);
  check_networks(c, dna);
  check_operations(c, dna);
  check_rbf(c, dna);
  check_joint_metadata(c, dna);
  check_setups(c, "twist_swing_behavior.twists", dna.twist_swing_behavior.twists, dna);
  check_setups(c, "twist_swing_behavior.swings", dna.twist_swing_behavior.swings, dna);
}

// Fails with the first error among the findings. Without errors, adds the findings to `warnings`.
Status told(std::vector<Finding> findings, std::vector<Warning>& warnings) {
  for (Finding& f : findings) {
    if (f.is_error) return core::Unexpected{std::move(f.error)};
  }
  for (Finding& f : findings) {
    warnings.push_back({std::move(f.error.where), std::move(f.error.message), std::nullopt});
  }
  return ok();
}

}  // namespace

std::vector<Finding> detail::find_all(const Dna& dna, Known known) {
  Checker c(known);
  check_layers(c, dna, true);
  return c.take();
}

Status detail::validate(const Dna& dna, Known known, std::vector<Warning>& warnings) {
  return told(find_all(dna, known), warnings);
}

Status validate(const Dna& dna, std::vector<Warning>& warnings) {
  return detail::validate(dna, {}, warnings);
}

Status validate_behavior(const Dna& dna, std::vector<Warning>& warnings) {
  Checker c{detail::Known{}};
  check_layers(c, dna, false);
  return told(c.take(), warnings);
}

}  // namespace risorius::dna
