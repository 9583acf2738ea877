// SPDX-License-Identifier: MIT
// Compiles the graph of networks, and the joints that networks move. The nodes are operations: a
// gather reads controls, a network computes values, a weighted sum adds values, a scatter writes
// controls. From: dna-format 12.3, 12.5
#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <map>

#include "compile/parts.h"
#include "dna/controls.h"
#include "simd/kernels.h"

namespace risorius::compile {

namespace {

using core::ErrorCode;
using core::fail;
using core::ok;
using core::Status;
using detail::count_of;
using detail::is_corrective;
using detail::listed;
using detail::StepLods;
using rig::MlOperation;
using rig::RigData;

// The graph of operations for a file without layer mlbe: for each network a gather that reads its
// inputs, the network itself, and a scatter that writes its outputs.
dna::MlType synthesized(const dna::MachineLearnedBehavior& ml) {
  dna::MlType type;
  type.lod_operation_mappings.assign(3, ml.lod_neural_network_mapping);
  std::vector<dna::MlOperation> gathers, networks, scatters;
  const auto count = static_cast<std::uint16_t>(
      std::min<std::size_t>(ml.neural_networks.size(), std::numeric_limits<std::uint16_t>::max()));
  for (std::uint16_t i = 0; i < count; ++i) {
    const dna::NeuralNetwork& n = ml.neural_networks[i];
    dna::MlOperation gather, network, scatter;
    gather.operation_type = MlOperation::kGather;
    gather.parameters = std::vector<std::uint32_t>(n.input_indices.begin(), n.input_indices.end());
    network.operation_type = MlOperation::kMlp;
    network.parameters = {i};
    scatter.operation_type = MlOperation::kScatter;
    scatter.parameters =
        std::vector<std::uint32_t>(n.output_indices.begin(), n.output_indices.end());
    network.operation_set_dependency_indices = {0};
    scatter.operation_set_dependency_indices = {1};
    network.operation_dependency_indices = scatter.operation_dependency_indices = {i};
    gathers.push_back(gather), networks.push_back(network), scatters.push_back(scatter);
  }
  type.operations = std::vector<core::List<dna::MlOperation>>{gathers, networks, scatters};
  return type;
}

// Network -> its mask, the number of the first mesh region that lists the network. Regions are
// counted over all meshes. Also adds the number of regions to out.mask_count.
std::map<std::uint16_t, std::uint32_t> masks_of_networks(const dna::Dna& dna, RigData& out) {
  std::map<std::uint16_t, std::uint32_t> masks;
  for (const auto& mesh : dna.machine_learned_behavior.region_network_indices) {
    for (const auto& region : mesh) {
      for (const std::uint16_t network : region) masks.try_emplace(network, out.mask_count);
      ++out.mask_count;
    }
  }
  return masks;
}

// [controls]: whether a control is the w of a joint's quaternion.
std::vector<bool> joint_w_controls(const dna::Dna& dna, std::uint32_t controls) {
  std::vector<bool> w(controls, false);
  const dna::MlJoints& joints = dna.machine_learned_behavior_ext.joints;
  if (dna::ml_joint_stride(joints) != 10) return w;
  for (std::size_t i = 0; i < joints.input_indices.size(); ++i) {
    if (joints.output_indices[i] % 10 == 6) w[joints.input_indices[i]] = true;
  }
  return w;
}

class GraphCompiler {
 public:
  GraphCompiler(const dna::Dna& dna, detail::Budget& budget, RigData& out, StepLods& lods)
      : dna_(dna),
        budget_(budget),
        out_(out),
        lods_(lods),
        masks_(masks_of_networks(dna, out)),
        rests_at_one_(joint_w_controls(dna, out.control_count)) {}

  Status add_type(const dna::MlType& type, const std::string& where) {
    // Operation o of set s has the number numbers_[s][o]; later sets have higher numbers.
    numbers_.clear();
    first_ = count_of(out_.ml_operations);
    std::uint32_t next = first_;
    for (const auto& set : type.operations) {
      numbers_.emplace_back();
      for (std::size_t o = 0; o < set.size(); ++o) numbers_.back().push_back(next++);
    }
    for (std::size_t s = 0; s < type.operations.size(); ++s) {
      for (std::size_t o = 0; o < type.operations[s].size(); ++o) {
        const std::string at =
            where + ".operations[" + std::to_string(s) + "][" + std::to_string(o) + "]";
        RISORIUS_TRY(add_operation(type.operations[s][o], at));
      }
    }
    return list_lods(type, where);
  }

 private:
  Status add_operation(const dna::MlOperation& source, const std::string& where) {
    MlOperation op;
    op.kind = source.operation_type;
    op.values_begin = out_.operation_values;
    op.segments_begin = count_of(out_.ml_segments);
    RISORIUS_TRY(add_segments(source, op, where));
    switch (source.operation_type) {
      case MlOperation::kGather:
      case MlOperation::kScatter:
        add_controls(source, op);
        break;
      case MlOperation::kMlp:
        RISORIUS_TRY(add_network(source, op, where));
        break;
      case MlOperation::kWeightedSum:
        op.value_count = source.parameters.empty() ? 0 : source.parameters[0];
        break;
      default:  // an unknown operation does nothing
        op.kind = MlOperation::kWeightedSum;
    }
    RISORIUS_TRY(budget_.take_bytes(sizeof(float) * std::uint64_t{op.value_count}, where));
    constexpr std::uint32_t kMost = 1u << 24;
    if (op.value_count > kMost || out_.operation_values > kMost) {
      return fail(ErrorCode::kLimitExceeded, where, "more than 16 million values of networks");
    }
    out_.operation_values += op.value_count;
    out_.ml_operations.push_back(op);
    return ok();
  }

  // Adds a segment for each operation from which an operation reads values. A network that depends
  // on a gather reads only from gathers, not from its other dependencies.
  Status add_segments(const dna::MlOperation& source, MlOperation& op, const std::string& where) {
    std::vector<const MlOperation*> others;
    bool gathers = false;
    for (std::size_t d = 0; d < source.operation_set_dependency_indices.size(); ++d) {
      const std::uint32_t number = numbers_[source.operation_set_dependency_indices[d]]
                                           [source.operation_dependency_indices[d]];
      if (number >= out_.ml_operations.size()) {
        return fail(ErrorCode::kInvalidIndex, where + ".operation_set_dependency_indices",
                    "an operation that depends on itself or on a later one");
      }
      others.push_back(&out_.ml_operations[number]);
      gathers = gathers || others.back()->kind == MlOperation::kGather;
    }
    for (std::size_t d = 0; d < others.size(); ++d) {
      const MlOperation& other = *others[d];
      if (op.kind == MlOperation::kMlp && gathers && other.kind != MlOperation::kGather) continue;
      if (op.kind == MlOperation::kScatter && op.mask == rig::kNone) op.mask = other.mask;
      float weight = 1.0f;
      if (op.kind == MlOperation::kWeightedSum) {
        const bool given = d + 1 < source.parameters.size();
        weight = given ? std::bit_cast<float>(source.parameters[d + 1]) : 0.0f;
      }
      out_.ml_segments.push_back({other.values_begin, other.value_count, weight});
    }
    op.segment_count = count_of(out_.ml_segments) - op.segments_begin;
    return ok();
  }

  void add_controls(const dna::MlOperation& source, MlOperation& op) {
    const bool reads = op.kind == MlOperation::kGather;
    op.items_begin = count_of(out_.ml_controls);
    op.item_count = count_of(source.parameters);
    op.value_count = reads ? op.item_count : 0;
    for (const std::uint32_t control : source.parameters) {
      const bool skipped = !reads && is_corrective(out_, control);
      out_.ml_controls.push_back(
          {skipped ? rig::kNone : control, rests_at_one_[control] ? 1.0f : 0.0f});
    }
  }

  Status add_network(const dna::MlOperation& source, MlOperation& op, const std::string& where) {
    op.items_begin = count_of(out_.ml_layers);
    if (source.parameters.empty()) return ok();
    const auto number = static_cast<std::uint16_t>(source.parameters[0]);
    const dna::NeuralNetwork& network = dna_.machine_learned_behavior.neural_networks[number];
    const auto mask = masks_.find(number);
    if (mask != masks_.end()) op.mask = mask->second;
    op.item_count = count_of(network.layers);
    const bool table = out_.lod_count > 0 &&
                       source.parameters.size() >= 1 + network.layers.size() * out_.lod_count;
    const auto [shared, is_first] = layers_.try_emplace(number, op.items_begin);
    if (!table && !is_first) {
      op.items_begin = shared->second;
    } else {
      if (table && is_first) layers_.erase(shared);  // these rows belong to this operation alone
      RISORIUS_TRY(add_layers(source, network, number, where));
    }
    if (op.item_count > 0) op.value_count = out_.ml_layers[op.items_begin + op.item_count - 1].rows;
    return ok();
  }

  Status add_layers(const dna::MlOperation& source, const dna::NeuralNetwork& network,
                    std::uint16_t number, const std::string& where) {
    for (std::size_t l = 0; l < network.layers.size(); ++l) {
      RISORIUS_TRY(add_layer(network.layers[l], number, l, where));
      add_row_counts(source, l, network.layers.size());
    }
    return ok();
  }

  // Adds a layer of a network for one operation. If another operation uses the same network, its
  // weights are not stored again.
  Status add_layer(const dna::NeuralNetworkLayer& source, std::uint16_t network, std::size_t index,
                   const std::string& where) {
    rig::MlLayer layer;
    layer.rows = count_of(source.biases);
    layer.columns = layer.rows == 0 ? 0 : count_of(source.weights) / layer.rows;
    layer.activation = source.activation_function;
    layer.alpha = source.activation_parameters.empty() ? 0.0f : source.activation_parameters[0];
    const auto [at, added] = weights_.try_emplace({network, index}, count_of(out_.ml_weights));
    layer.weights_begin = at->second;
    if (added) {
      if (out_.ml_weights.size() + source.weights.size() + layer.rows > 0xFFFF0000u) {
        return fail(ErrorCode::kLimitExceeded, where, "networks of more than 4 billion weights");
      }
      out_.ml_weights.insert(out_.ml_weights.end(), source.biases.begin(), source.biases.end());
      for (std::uint32_t c = 0; c < layer.columns; ++c) {
        for (std::uint32_t r = 0; r < layer.rows; ++r) {
          out_.ml_weights.push_back(source.weights[std::size_t{r} * layer.columns + c]);
        }
      }
    }
    out_.widest_layer = std::max({out_.widest_layer, layer.rows, layer.columns});
    out_.ml_layers.push_back(layer);
    return ok();
  }

  // Adds the number of rows that the newest layer computes at each LOD: all rows, unless the
  // operation has a table of row counts.
  void add_row_counts(const dna::MlOperation& source, std::size_t layer, std::size_t layers) {
    const std::size_t lods = out_.lod_count;
    const bool table = source.parameters.size() >= 1 + layers * lods;
    for (std::size_t lod = 0; lod < lods; ++lod) {
      const std::uint32_t all = out_.ml_layers.back().rows;
      out_.ml_layer_rows.push_back(table ? std::min(all, source.parameters[1 + layer * lods + lod])
                                         : all);
    }
  }

  // Adds the operations of a type to the lists of each LOD. An operation that a LOD lists is left
  // out if an operation from which it reads does not run at this LOD.
  Status list_lods(const dna::MlType& type, const std::string& where) {
    for (std::uint32_t lod = 0; lod < out_.lod_count; ++lod) {
      std::vector<bool> runs_here(out_.ml_operations.size() - first_, false);  // of this type
      for (std::size_t s = 0; s < type.operations.size(); ++s) {
        if (s >= type.lod_operation_mappings.size()) break;
        for (const std::uint32_t o : listed(type.lod_operation_mappings[s], lod)) {
          const dna::MlOperation& op = type.operations[s][o];
          const std::uint64_t steps = 1 + op.operation_set_dependency_indices.size();
          RISORIUS_TRY(budget_.take_steps(steps, where));
          if (!has_all(runs_here, op)) continue;
          runs_here[numbers_[s][o] - first_] = true;
          lods_.operations[lod].push_back(numbers_[s][o]);
        }
      }
    }
    return ok();
  }
  bool has_all(const std::vector<bool>& runs, const dna::MlOperation& op) const {
    for (std::size_t d = 0; d < op.operation_set_dependency_indices.size(); ++d) {
      const std::uint32_t number =
          numbers_[op.operation_set_dependency_indices[d]][op.operation_dependency_indices[d]];
      if (!runs[number - first_]) return false;
    }
    return true;
  }

  const dna::Dna& dna_;
  detail::Budget& budget_;
  RigData& out_;
  StepLods& lods_;
  std::map<std::uint16_t, std::uint32_t> masks_;
  std::vector<bool> rests_at_one_;
  std::map<std::pair<std::uint16_t, std::size_t>, std::uint32_t> weights_;
  // Network -> index of its first layer in ml_layers; only for networks whose layers compute all
  // rows at every LOD.
  std::map<std::uint16_t, std::uint32_t> layers_;
  std::vector<std::vector<std::uint32_t>> numbers_;
  std::uint32_t first_ = 0;  // index of the first operation of the type that add_type compiles
};

// Three rows, for the axes x, y and z: the direction of the axis as a vector (right, up, front).
// In: axes  0 left, 1 right, 2 up, 3 down, 4 front, 5 back
std::array<std::array<float, 3>, 3> basis_of(const std::array<std::uint16_t, 3>& axes) {
  std::array<std::array<float, 3>, 3> rows{};
  for (std::size_t i = 0; i < 3; ++i) {
    const bool negative = axes[i] == 0 || axes[i] == 3 || axes[i] == 5;
    rows[i][axes[i] / 2 % 3] = negative ? -1.0f : 1.0f;
  }
  return rows;
}

// Sets the axes and the Euler convention to which the joint values of networks refer. They are the
// axes and the convention of the face, unless parameters 3 to 9 of MlJoints are all present.
void add_system(const dna::Dna& dna, RigData& out) {
  const dna::MlJoints& joints = dna.machine_learned_behavior_ext.joints;
  std::map<std::uint16_t, std::uint16_t> settings;
  for (std::size_t i = 0; i < joints.parameter_keys.size(); ++i) {
    settings[joints.parameter_keys[i]] = joints.parameter_values[i];
  }
  out.ml_euler = out.euler;
  for (std::uint16_t key = 3; key <= 9; ++key) {
    if (!settings.contains(key)) return;
  }
  dna::Dna system;
  system.descriptor.rotation_unit = dna.descriptor.rotation_unit;
  system.descriptor_ext.rotation_sequence = settings[9];
  for (std::uint16_t i = 0; i < 3; ++i) {
    system.descriptor_ext.rotation_sign[i] =
        settings[static_cast<std::uint16_t>(6 + i)] == 1 ? 1 : -1;
  }
  out.ml_euler = detail::euler_convention(system);
  const dna::CoordinateSystem& ours = dna.descriptor.coordinate_system;
  const auto from = basis_of({settings[3], settings[4], settings[5]});
  const auto to = basis_of({ours.x_axis, ours.y_axis, ours.z_axis});
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      float dot = 0;
      for (std::size_t k = 0; k < 3; ++k) dot += from[i][k] * to[j][k];
      out.ml_basis[i * 3 + j] = dot;
    }
  }
  const bool same = std::ranges::equal(out.ml_basis, std::array{1, 0, 0, 0, 1, 0, 0, 0, 1}) &&
                    out.ml_euler.order == out.euler.order && out.ml_euler.signs == out.euler.signs;
  out.ml_converted = same ? 0 : 1;
}

}  // namespace

Status detail::compile_networks(const dna::Dna& dna, Budget& budget, RigData& out, StepLods& lods) {
  lods.operations.resize(out.lod_count);
  GraphCompiler graph(dna, budget, out, lods);
  const auto& types = dna.machine_learned_behavior_ext.types;
  const bool synthesize = types.empty() && !dna.machine_learned_behavior.neural_networks.empty();
  if (synthesize) {
    const std::string where = "machine_learned_behavior";
    RISORIUS_TRY(graph.add_type(synthesized(dna.machine_learned_behavior), where));
  }
  for (std::size_t t = 0; t < types.size(); ++t) {
    const std::string where = "machine_learned_behavior_ext.types[" + std::to_string(t) + "]";
    RISORIUS_TRY(graph.add_type(types[t], where));
  }
  if (!out.ml_layers.empty()) {  // kernels read past the last layer
    out.ml_weights.resize(out.ml_weights.size() + simd::kWidest);
  }
  return ok();
}

Status detail::compile_ml_joints(const dna::Dna& dna, RigData& out) {
  const dna::MlJoints& source = dna.machine_learned_behavior_ext.joints;
  add_system(dna, out);
  const std::uint32_t stride = dna::ml_joint_stride(source);
  std::map<std::uint32_t, rig::MlJoint> joints;
  for (std::size_t i = 0; i < source.input_indices.size(); ++i) {
    const std::uint32_t joint = source.output_indices[i] / stride;
    const std::uint32_t attribute = source.output_indices[i] % stride;
    rig::MlJoint& entry = joints[joint];
    entry.joint = joint;
    entry.is_quaternion = stride == 10 ? 1 : 0;
    entry.controls[attribute + (stride == 9 && attribute > 5 ? 1 : 0)] = source.input_indices[i];
  }
  std::vector<std::vector<bool>> has(out.lod_count, std::vector<bool>(out.joint_count, false));
  for (std::uint32_t lod = 0; lod < out.lod_count && !joints.empty(); ++lod) {
    for (const std::uint32_t j : listed(dna.definition.lod_joint_mapping, lod)) has[lod][j] = true;
  }
  for (const auto& [joint, entry] : joints) {
    out.ml_joints.push_back(entry);
    for (const std::vector<bool>& joints_here : has) {
      out.ml_joint_lods.push_back(joints_here[joint] ? 1 : 0);
    }
  }
  return ok();
}

void detail::mark_ml_joints(const RigData& r, Used& used) {
  for (std::size_t j = 0; j < r.ml_joints.size(); ++j) {
    for (std::uint32_t lod = 0; lod < r.lod_count; ++lod) {
      if (r.ml_joint_lods[j * r.lod_count + lod] == 0) continue;
      for (const std::uint32_t control : r.ml_joints[j].controls) {
        if (control != rig::kNone) used[lod][control] = true;
      }
    }
  }
}

}  // namespace risorius::compile
