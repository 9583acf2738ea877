// SPDX-License-Identifier: MIT
// Removes the LODs, joints, channels, maps, meshes and networks that a plan drops from a Dna, and
// renumbers the indices of the others.
#include "dna/convert/lods.h"

#include <algorithm>
#include <cmath>

#include "dna/controls.h"
#include "dna/validate.h"
#include "dna/where.h"

namespace risorius::dna {

namespace detail {

namespace {

using core::Array;
using core::Buffer;
using core::ErrorCode;
using core::List;
using core::PlanarArray;
using core::Status;
using Indices = std::vector<std::uint16_t>;

// Tells whether an IndexMap keeps an index, and remembers the first index that is out of range.
class Lookup {
 public:
  bool keeps(const IndexMap& map, std::size_t index, const Where& where, const char* space) {
    if (index >= map.size() && !error_) {
      error_ = core::Error{ErrorCode::kInvalidIndex, std::nullopt, where.text(),
                           "index " + std::to_string(index) + ", but there are " +
                               std::to_string(map.size()) + " " + space};
    }
    return map.keeps(index);
  }
  Status status() && { return error_ ? Status(core::Unexpected{*error_}) : core::ok(); }

 private:
  std::optional<core::Error> error_;
};

template <class T>
Array<T> select(const Array<T>& values, const std::vector<bool>& keep) {
  Buffer<T> out(values.size());
  std::size_t n = 0;
  for (std::size_t i = 0; i < values.size() && i < keep.size(); ++i) {
    if (keep[i]) out[n++] = values[i];
  }
  out.resize(n);
  return out;
}

template <class T>
void select(List<T>& list, const std::vector<bool>& keep) {
  std::vector<T> out;
  for (std::size_t i = 0; i < list.size() && i < keep.size(); ++i) {
    if (keep[i]) out.push_back(std::move(list[i]));
  }
  list = std::move(out);
}

template <class T>
void select(std::vector<T>& list, const std::vector<bool>& keep) {
  std::vector<T> out;
  for (std::size_t i = 0; i < list.size() && i < keep.size(); ++i) {
    if (keep[i]) out.push_back(std::move(list[i]));
  }
  list = std::move(out);
}

template <std::size_t kPlanes>
PlanarArray<kPlanes> select(const PlanarArray<kPlanes>& array, const std::vector<bool>& keep) {
  Buffer<float> out(array.values.size());
  std::size_t n = 0;
  for (std::size_t p = 0; p < kPlanes; ++p) {
    for (std::size_t i = 0; i < array.count(); ++i) {
      if (keep[i]) out[n++] = array.at(i, p);
    }
  }
  out.resize(n);
  return {std::move(out)};
}

Array<float> select_rows(const Array<float>& values, std::size_t columns,
                         const std::vector<bool>& keep) {
  Buffer<float> out(values.size());
  std::size_t n = 0;
  for (std::size_t r = 0; r < keep.size(); ++r) {
    if (!keep[r]) continue;
    const float* row = values.data() + r * columns;
    std::copy(row, row + columns, out.data() + n);
    n += columns;
  }
  out.resize(n);
  return out;
}

std::vector<bool> kept_of(const IndexMap& map) {
  std::vector<bool> keep(map.size());
  for (std::size_t i = 0; i < keep.size(); ++i) keep[i] = map.keeps(i);
  return keep;
}

// Reduces a list with one entry per LOD to the kept LODs.
Array<std::uint16_t> cut_lods(const LodPlan& plan, const Array<std::uint16_t>& lods) {
  Indices out;
  for (const std::uint16_t lod : plan.lods) {
    if (lod < lods.size()) out.push_back(lods[lod]);
  }
  return out;
}

LodMapping cut_mapping(const LodPlan& plan, const LodMapping& mapping, const IndexMap& map) {
  std::vector<std::uint32_t> row_to(mapping.rows.size(), IndexMap::kDropped);
  LodMapping out;
  Indices lods;
  std::vector<bool> used(mapping.rows.size(), false);
  const auto has_row = [&](std::uint16_t lod) {
    return lod < mapping.lods.size() && mapping.lods[lod] < mapping.rows.size();
  };
  for (const std::uint16_t lod : plan.lods) {
    if (has_row(lod)) used[mapping.lods[lod]] = true;
  }
  for (std::size_t r = 0; r < used.size(); ++r) {
    if (!used[r]) continue;
    row_to[r] = static_cast<std::uint32_t>(out.rows.size());
    Indices row;
    for (const std::uint16_t i : mapping.rows[r]) {
      if (map.keeps(i)) row.push_back(map[i]);
    }
    out.rows.emplace_back(std::move(row));
  }
  for (const std::uint16_t lod : plan.lods) {
    if (lod >= mapping.lods.size()) continue;
    // A LOD whose row does not exist gets row 65535, which does not exist either, so that validate
    // reports it.
    lods.push_back(static_cast<std::uint16_t>(has_row(lod) ? row_to[mapping.lods[lod]] : 65535));
  }
  out.lods = std::move(lods);
  return out;
}

void apply_to_definition(const LodPlan& plan, Definition& d) {
  const std::vector<bool> joints = kept_of(plan.joints);
  const std::vector<bool> channels = kept_of(plan.blend_shape_channels);
  d.lod_joint_mapping = cut_mapping(plan, d.lod_joint_mapping, plan.joints);
  d.lod_blend_shape_mapping =
      cut_mapping(plan, d.lod_blend_shape_mapping, plan.blend_shape_channels);
  d.lod_animated_map_mapping = cut_mapping(plan, d.lod_animated_map_mapping, plan.animated_maps);
  d.lod_mesh_mapping = cut_mapping(plan, d.lod_mesh_mapping, plan.meshes);
  select(d.joint_names, joints);
  select(d.blend_shape_channel_names, channels);
  select(d.animated_map_names, kept_of(plan.animated_maps));
  select(d.mesh_names, kept_of(plan.meshes));
  Indices from, to, parents;
  for (std::size_t i = 0; i < d.mesh_blend_shape_channel_mapping_from.size(); ++i) {
    const std::uint16_t mesh = d.mesh_blend_shape_channel_mapping_from[i];
    const std::uint16_t channel = d.mesh_blend_shape_channel_mapping_to[i];
    if (!plan.meshes.keeps(mesh) || !plan.blend_shape_channels.keeps(channel)) continue;
    from.push_back(plan.meshes[mesh]);
    to.push_back(plan.blend_shape_channels[channel]);
  }
  d.mesh_blend_shape_channel_mapping_from = std::move(from);
  d.mesh_blend_shape_channel_mapping_to = std::move(to);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (joints[j]) parents.push_back(plan.joints[d.joint_parents[j]]);
  }
  d.joint_parents = std::move(parents);
  d.neutral_joint_translations = select(d.neutral_joint_translations, joints);
  d.neutral_joint_rotations = select(d.neutral_joint_rotations, joints);
}

void apply_to_joint_group(const LodPlan& plan, const Where& where, Lookup& lookup, JointGroup& g) {
  const std::size_t columns = g.input_indices.size();
  const std::size_t rows = g.output_indices.size();
  if (rows == 0) {
    g.input_indices = {};
    g.values = {};
  }
  std::vector<bool> keep(rows);
  Indices outputs, joints;
  outputs.reserve(rows);
  joints.reserve(g.joint_indices.size());
  for (std::size_t r = 0; r < rows; ++r) {
    const std::uint16_t joint = g.output_indices[r] / 9, attribute = g.output_indices[r] % 9;
    keep[r] = lookup.keeps(plan.joints, joint, (where + ".output_indices")[r], "joints");
    if (!keep[r]) continue;
    outputs.push_back(static_cast<std::uint16_t>(plan.joints[joint] * 9 + attribute));
  }
  for (std::size_t i = 0; i < g.joint_indices.size(); ++i) {
    const std::uint16_t joint = g.joint_indices[i];
    if (lookup.keeps(plan.joints, joint, (where + ".joint_indices")[i], "joints")) {
      joints.push_back(plan.joints[joint]);
    }
  }
  if (outputs.size() < rows) drop_rows(keep, g.lods);
  if (outputs.size() * columns < g.values.size()) {
    g.values = select_rows(g.values, columns, keep);
  }
  g.output_indices = std::move(outputs);
  g.joint_indices = std::move(joints);
}

// Which entries of channels or maps remain: the entries that the finest kept LOD uses, which are
// the first lods[0] entries once lods is reduced, except entries whose output is dropped.
// In/out: lods  number of entries that each LOD uses, reduced to the kept LODs
std::vector<bool> kept_entries(const LodPlan& plan, const IndexMap& map,
                               const Array<std::uint16_t>& outputs, const Where& where,
                               const char* space, Lookup& lookup, Array<std::uint16_t>& lods) {
  lods = cut_lods(plan, lods);
  std::vector<bool> keep(outputs.size(), false);
  const std::size_t n = lods.empty() ? 0 : std::min<std::size_t>(lods[0], outputs.size());
  for (std::size_t i = 0; i < n; ++i) {
    keep[i] = lookup.keeps(map, outputs[i], where[i], space);
  }
  drop_rows(keep, lods);
  return keep;
}

Array<std::uint16_t> renumber(const IndexMap& map, const Array<std::uint16_t>& indices) {
  Buffer<std::uint16_t> out(indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i) out[i] = map[indices[i]];
  return out;
}

void apply_to_conditionals(const std::vector<bool>& keep, const IndexMap& outputs,
                           Conditionals& t) {
  t.input_indices = select(t.input_indices, keep);
  t.output_indices = renumber(outputs, select(t.output_indices, keep));
  t.from_values = select(t.from_values, keep);
  t.to_values = select(t.to_values, keep);
  t.slope_values = select(t.slope_values, keep);
  t.cut_values = select(t.cut_values, keep);
}

void apply_to_behavior(const LodPlan& plan, bool cut_while_reading, Lookup& lookup, Behavior& b) {
  for (std::size_t i = 0; i < b.joint_groups.size(); ++i) {
    if (!cut_while_reading) cut_rows(plan, b.joint_groups[i]);
    apply_to_joint_group(plan, Where("behavior.joint_groups")[i], lookup, b.joint_groups[i]);
  }
  if (b.joint_row_count > 0) {
    b.joint_row_count = static_cast<std::uint16_t>(9 * plan.joints.kept());
  }
  BlendShapeChannels& s = b.blend_shape_channels;
  std::vector<bool> keep =
      kept_entries(plan, plan.blend_shape_channels, s.output_indices,
                   "behavior.blend_shape_channels.output_indices", "channels", lookup, s.lods);
  s.input_indices = select(s.input_indices, keep);
  s.output_indices = renumber(plan.blend_shape_channels, select(s.output_indices, keep));
  Conditionals& maps = b.animated_maps.conditionals;
  keep = kept_entries(plan, plan.animated_maps, maps.output_indices,
                      "behavior.animated_maps.output_indices", "animated maps", lookup,
                      b.animated_maps.lods);
  apply_to_conditionals(keep, plan.animated_maps, maps);
}

void apply_to_skin(const LodPlan& plan, Mesh& m) {
  Buffer<std::uint32_t> offsets(m.skin_offsets.size());
  Buffer<float> weights(m.skin_weights.size());
  Buffer<std::uint16_t> joints(m.skin_joint_indices.size());
  std::size_t size = 0;
  bool unused = true;
  for (std::size_t v = 0; v + 1 < m.skin_offsets.size(); ++v) {
    const std::size_t begin = m.skin_offsets[v], end = m.skin_offsets[v + 1];
    offsets[v] = static_cast<std::uint32_t>(size);
    std::copy(m.skin_weights.data() + begin, m.skin_weights.data() + end, weights.data() + size);
    std::copy(m.skin_joint_indices.data() + begin, m.skin_joint_indices.data() + end,
              joints.data() + size);
    size += cut_influences(plan, weights.data() + size, joints.data() + size, end - begin, &unused);
  }
  if (offsets.size() > 0) offsets[offsets.size() - 1] = static_cast<std::uint32_t>(size);
  weights.resize(size);
  joints.resize(size);
  m.skin_offsets = std::move(offsets);
  m.skin_weights = std::move(weights);
  m.skin_joint_indices = std::move(joints);
}

void apply_to_targets(const LodPlan& plan, const Where& where, Lookup& lookup, Mesh& m) {
  std::vector<bool> keep(m.blend_shape_targets.size());
  for (std::size_t t = 0; t < keep.size(); ++t) {
    std::uint16_t& channel = m.blend_shape_targets[t].blend_shape_channel_index;
    keep[t] = lookup.keeps(plan.blend_shape_channels, channel,
                           (where + ".blend_shape_targets")[t] + ".blend_shape_channel_index",
                           "channels");
    if (keep[t]) channel = plan.blend_shape_channels[channel];
  }
  if (std::ranges::find(keep, false) != keep.end()) select(m.blend_shape_targets, keep);
}

// Removes networks and renumbers the others. A network is kept if a kept LOD lists it or if an
// operation of layer mlbe runs it at a kept LOD.
void apply_to_networks(const LodPlan& plan, Lookup& lookup, Dna& dna) {
  MachineLearnedBehavior& ml = dna.machine_learned_behavior;
  std::vector<bool> keep = needed(plan, ml.lod_neural_network_mapping, ml.neural_networks.size());
  add_networks_of_operations(plan, dna.machine_learned_behavior_ext, keep);
  const IndexMap map(keep);
  ml.lod_neural_network_mapping = cut_mapping(plan, ml.lod_neural_network_mapping, map);
  select(ml.neural_networks, keep);
  const std::vector<bool> meshes = kept_of(plan.meshes);
  select(ml.region_names, meshes);
  select(ml.region_network_indices, meshes);
  for (auto& mesh : ml.region_network_indices) {
    for (auto& region : mesh) {
      Indices networks;
      for (const std::uint16_t n : region) {
        const char* where = "machine_learned_behavior.region_network_indices";
        if (lookup.keeps(map, n, where, "networks")) networks.push_back(map[n]);
      }
      region = std::move(networks);
    }
  }
  constexpr std::uint16_t kMlp = 3;
  for (MlType& type : dna.machine_learned_behavior_ext.types) {
    for (auto& set : type.operations) {
      for (MlOperation& op : set) {
        if (op.operation_type != kMlp || op.parameters.empty()) continue;
        core::Buffer<std::uint32_t> p(op.parameters.size());
        std::ranges::copy(op.parameters, p.data());
        if (map.keeps(p[0])) p[0] = map[p[0]];
        op.parameters = std::move(p);
      }
    }
  }
}

// Reduces the row table of a network operation to the kept LODs. The table has the number of rows
// for each LOD of the first layer, then for each LOD of the second layer, and so on.
void cut_row_table(const LodPlan& plan, std::size_t lod_count, MlOperation& op) {
  constexpr std::uint16_t kMlp = 3;
  const std::size_t table = op.parameters.empty() ? 0 : op.parameters.size() - 1;
  if (op.operation_type != kMlp || lod_count == 0 || table < lod_count || table % lod_count != 0) {
    return;
  }
  std::vector<std::uint32_t> out{op.parameters[0]};
  for (std::size_t layer = 0; layer < table / lod_count; ++layer) {
    for (const std::uint16_t lod : plan.lods) {
      out.push_back(op.parameters[1 + layer * lod_count + lod]);
    }
  }
  op.parameters = std::move(out);
}

void apply_to_operations(const LodPlan& plan, std::size_t lod_count, Lookup& lookup,
                         MachineLearnedBehaviorExt& ext) {
  for (std::size_t t = 0; t < ext.types.size(); ++t) {
    MlType& type = ext.types[t];
    std::vector<IndexMap> maps;  // per operation set
    for (std::size_t s = 0; s < type.operations.size(); ++s) {
      auto& set = type.operations[s];
      const LodMapping none;
      const LodMapping& mapping =
          s < type.lod_operation_mappings.size() ? type.lod_operation_mappings[s] : none;
      const std::vector<bool> keep = needed(plan, mapping, set.size());
      maps.emplace_back(keep);
      select(set, keep);
      if (s < type.lod_operation_mappings.size()) {
        type.lod_operation_mappings[s] = cut_mapping(plan, mapping, maps.back());
      }
    }
    const Where where = Where("machine_learned_behavior_ext.types")[t] + ".operations";
    for (std::size_t s = 0; s < type.operations.size(); ++s) {
      for (MlOperation& op : type.operations[s]) {
        cut_row_table(plan, lod_count, op);
        Indices sets, operations;
        const std::size_t n = std::min(op.operation_set_dependency_indices.size(),
                                       op.operation_dependency_indices.size());
        for (std::size_t i = 0; i < n; ++i) {
          const std::uint16_t from = op.operation_set_dependency_indices[i];
          const std::uint16_t index = op.operation_dependency_indices[i];
          if (from >= maps.size()) continue;  // validate names it
          if (!lookup.keeps(maps[from], index, where, "operations of that set")) continue;
          sets.push_back(from);
          operations.push_back(maps[from][index]);
        }
        op.operation_set_dependency_indices = std::move(sets);
        op.operation_dependency_indices = std::move(operations);
      }
    }
  }
}

void apply_to_ml_joints(const LodPlan& plan, Lookup& lookup, MlJoints& joints) {
  const std::uint16_t stride = ml_joint_stride(joints);
  Indices inputs, outputs;
  const std::size_t n = std::min(joints.input_indices.size(), joints.output_indices.size());
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint16_t joint = joints.output_indices[i] / stride;
    const Where where = Where("machine_learned_behavior_ext.joints.output_indices")[i];
    if (!lookup.keeps(plan.joints, joint, where, "joints")) continue;
    inputs.push_back(joints.input_indices[i]);
    outputs.push_back(static_cast<std::uint16_t>(plan.joints[joint] * stride +
                                                 joints.output_indices[i] % stride));
  }
  joints.input_indices = std::move(inputs);
  joints.output_indices = std::move(outputs);
}

void apply_to_setups(const LodPlan& plan, const Where& where, Lookup& lookup,
                     List<TwistSwingSetup>& setups) {
  std::vector<bool> keep(setups.size());
  for (std::size_t s = 0; s < setups.size(); ++s) {
    TwistSwingSetup& setup = setups[s];
    std::vector<bool> outputs(setup.output_joint_indices.size());
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      outputs[i] = lookup.keeps(plan.joints, setup.output_joint_indices[i],
                                (where[s] + ".output_joint_indices")[i], "joints");
    }
    setup.blend_weights = select(setup.blend_weights, outputs);
    setup.output_joint_indices = renumber(plan.joints, select(setup.output_joint_indices, outputs));
    keep[s] = !setup.output_joint_indices.empty();
  }
  select(setups, keep);
}

void apply_to_extensions(const LodPlan& plan, std::size_t lod_count, Lookup& lookup, Dna& dna) {
  apply_to_networks(plan, lookup, dna);
  apply_to_operations(plan, lod_count, lookup, dna.machine_learned_behavior_ext);
  apply_to_ml_joints(plan, lookup, dna.machine_learned_behavior_ext.joints);
  RbfBehavior& rbf = dna.rbf_behavior;
  const std::vector<bool> solvers = needed(plan, rbf.lod_solver_mapping, rbf.solvers.size());
  rbf.lod_solver_mapping = cut_mapping(plan, rbf.lod_solver_mapping, IndexMap(solvers));
  select(rbf.solvers, solvers);
  auto& representations = dna.joint_behavior_metadata.joint_representations;
  select(representations, kept_of(plan.joints));
  apply_to_setups(plan, "twist_swing_behavior.twists", lookup, dna.twist_swing_behavior.twists);
  apply_to_setups(plan, "twist_swing_behavior.swings", lookup, dna.twist_swing_behavior.swings);
}

}  // namespace

Status drop_channels(const LodPlan& plan, std::vector<bool> entries, Dna& dna) {
  Lookup lookup;
  BlendShapeChannels& s = dna.behavior.blend_shape_channels;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    entries[i] = entries[i] && plan.blend_shape_channels.keeps(s.output_indices[i]);
  }
  drop_rows(entries, s.lods);
  s.input_indices = select(s.input_indices, entries);
  s.output_indices = renumber(plan.blend_shape_channels, select(s.output_indices, entries));
  for (std::size_t i = 0; i < dna.geometry.meshes.size(); ++i) {
    apply_to_targets(plan, Where("geometry.meshes")[i], lookup, dna.geometry.meshes[i]);
  }
  apply_to_definition(plan, dna.definition);
  return std::move(lookup).status();
}

std::size_t cut_influences(const LodPlan& plan, float* weights, std::uint16_t* joints,
                           std::size_t n, bool* finite) {
  std::size_t kept = 0;
  float removed = 0.0f;
  for (std::size_t i = 0; i < n; ++i) {
    if (!plan.joints.keeps(joints[i])) {
      removed += weights[i];
      continue;
    }
    weights[kept] = weights[i];
    joints[kept++] = plan.joints[joints[i]];
  }
  if (kept == 0 && n > 0) {
    weights[0] = 1.0f;
    joints[0] = plan.root;
    return 1;
  }
  if (removed > 0.0f && removed < 1.0f) {
    const float grow = 1.0f / (1.0f - removed);
    for (std::size_t i = 0; i < kept; ++i) {
      weights[i] *= grow;
      if (!std::isfinite(weights[i])) *finite = false;
    }
  }
  return kept;
}

std::size_t cut_rows(const LodPlan& plan, JointGroup& group) {
  group.lods = cut_lods(plan, group.lods);
  std::size_t rows = 0;
  for (const std::uint16_t n : group.lods) rows = std::max<std::size_t>(rows, n);
  rows = std::min(rows, group.output_indices.size());
  group.output_indices = Indices(group.output_indices.begin(),
                                 group.output_indices.begin() + static_cast<std::ptrdiff_t>(rows));
  return rows;
}

Status apply(const LodPlan& plan, bool cut_while_reading, Dna& dna) {
  Lookup lookup;
  const std::size_t lod_count = dna.descriptor.lod_count;
  dna.descriptor.max_lod = static_cast<std::uint16_t>(dna.descriptor.max_lod + plan.lods[0]);
  dna.descriptor.lod_count = static_cast<std::uint16_t>(plan.lods.size());
  apply_to_behavior(plan, cut_while_reading, lookup, dna.behavior);
  apply_to_extensions(plan, lod_count, lookup, dna);
  apply_to_definition(plan, dna.definition);
  for (std::size_t i = 0; i < dna.geometry.meshes.size(); ++i) {
    if (!plan.meshes.keeps(i)) continue;
    const Where where = Where("geometry.meshes")[i];
    if (!cut_while_reading) apply_to_skin(plan, dna.geometry.meshes[i]);
    apply_to_targets(plan, where, lookup, dna.geometry.meshes[i]);
  }
  select(dna.geometry.meshes, kept_of(plan.meshes));
  return std::move(lookup).status();
}

}  // namespace detail

// Makes a plan that keeps all LODs and drops only channels, and applies it.
core::Result<Dna> remove_unreferenced_blend_shapes(const Dna& dna) {
  std::vector<Warning> unused;
  RISORIUS_TRY(validate(dna, unused));
  Dna out = dna;
  const ControlCounts controls = control_counts(dna);
  const auto provided = [&](std::uint32_t control) {
    if (control < controls.raw) return true;
    control -= controls.raw;
    if (control < controls.psd) return true;
    control -= controls.psd;
    if (control < controls.ml) return dna.unread_controls.ml == 0;
    control -= controls.ml;
    return control < controls.rbf_pose && dna.unread_controls.rbf_pose == 0;
  };
  detail::LodPlan plan;
  const Definition& d = dna.definition;
  for (std::uint16_t lod = 0; lod < dna.descriptor.lod_count; ++lod) plan.lods.push_back(lod);
  std::vector<bool> keep =
      detail::needed(plan, d.lod_blend_shape_mapping, d.blend_shape_channel_names.size());
  BlendShapeChannels& s = out.behavior.blend_shape_channels;
  std::vector<bool> entries(s.input_indices.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    entries[i] = provided(s.input_indices[i]);
    if (!entries[i]) keep[s.output_indices[i]] = false;
  }
  const auto all = [](std::size_t n) { return detail::IndexMap(std::vector<bool>(n, true)); };
  plan.blend_shape_channels = detail::IndexMap(keep);
  plan.joints = all(d.joint_names.size());
  plan.meshes = all(d.mesh_names.size());
  plan.animated_maps = all(d.animated_map_names.size());
  RISORIUS_TRY(detail::drop_channels(plan, entries, out));
  return out;
}

namespace {

core::Status check_parts(const Dna& dna, const std::vector<bool>& joints,
                         const std::vector<bool>& correctives) {
  using core::ErrorCode;
  const Definition& d = dna.definition;
  if (dna.descriptor.lod_count == 0) {
    return core::fail(ErrorCode::kInvalidArgument, "descriptor.lod_count",
                      "a level of detail at least was expected");
  }
  if (joints.size() != d.joint_names.size() || correctives.size() != dna.behavior.psd_count) {
    return core::fail(ErrorCode::kInvalidLength,
                      joints.size() == d.joint_names.size() ? "correctives" : "joints",
                      "one value for each was expected");
  }
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (!joints[j] || joints[d.joint_parents[j]]) continue;
    return core::fail(ErrorCode::kInvalidArgument, "joints",
                      "joint " + std::to_string(j) + " cannot stay without its parent");
  }
  return core::ok();
}

// Which channels remain: a channel is dropped if all controls that drive it are dropped.
std::vector<bool> kept_channels(const Dna& dna, const std::vector<bool>& controls) {
  const BlendShapeChannels& s = dna.behavior.blend_shape_channels;
  std::vector<bool> keep(dna.definition.blend_shape_channel_names.size(), true);
  for (const std::uint16_t channel : s.output_indices) keep[channel] = false;
  for (std::size_t i = 0; i < s.output_indices.size(); ++i) {
    if (controls[s.input_indices[i]]) keep[s.output_indices[i]] = true;
  }
  return keep;
}

}  // namespace

core::Result<Dna> keep_parts(const Dna& dna, const std::vector<bool>& joints,
                             const std::vector<bool>& correctives) {
  std::vector<Warning> unused;
  RISORIUS_TRY(validate(dna, unused));
  RISORIUS_TRY(check_parts(dna, joints, correctives));
  Dna out = dna;
  const ControlCounts counts = control_counts(dna);
  std::vector<bool> controls(counts.total(), true);
  for (std::size_t i = 0; i < correctives.size(); ++i) controls[counts.raw + i] = correctives[i];
  const auto all = [](std::size_t n) { return detail::IndexMap(std::vector<bool>(n, true)); };
  detail::LodPlan plan;
  const Definition& d = dna.definition;
  for (std::uint16_t lod = 0; lod < dna.descriptor.lod_count; ++lod) plan.lods.push_back(lod);
  plan.blend_shape_channels = detail::IndexMap(kept_channels(dna, controls));
  plan.joints = detail::IndexMap(joints);
  plan.meshes = all(d.mesh_names.size());
  plan.animated_maps = all(d.animated_map_names.size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (!joints[j] || d.joint_parents[j] != j) continue;
    plan.root = plan.joints[j];
    break;
  }
  if (auto dropped = detail::forget_controls(controls, out); !dropped) {
    return std::move(dropped).propagate();
  }
  const auto gone = static_cast<std::uint16_t>(std::ranges::count(correctives, false));
  out.behavior.psd_count = static_cast<std::uint16_t>(out.behavior.psd_count - gone);
  out.behavior.joint_column_count = static_cast<std::uint16_t>(
      out.behavior.joint_column_count - std::min(gone, out.behavior.joint_column_count));
  RISORIUS_TRY(detail::apply(plan, false, out));
  return out;
}

core::Result<Dna> filter_lods(const Dna& dna, const LodSelection& selection) {
  std::vector<Warning> unused;
  RISORIUS_TRY(validate(dna, unused));
  auto plan = detail::plan_lods(dna.descriptor, dna.definition, selection);
  if (!plan) return std::move(plan).propagate();
  Dna out = dna;
  if (!plan->has_value()) return out;
  RISORIUS_TRY(detail::apply(**plan, false, out));
  return out;
}

}  // namespace risorius::dna
