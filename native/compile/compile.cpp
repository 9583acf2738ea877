// SPDX-License-Identifier: MIT
#include "compile/compile.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <map>
#include <queue>
#include <set>

#include "dna/io.h"

namespace risorius::compile {

namespace {

using core::Array;
using core::ErrorCode;
using core::fail;
using core::ok;
using core::Result;
using core::Status;
using rig::Rig;

std::vector<bool> quaternion_joint_flags(const dna::Dna& dna) {
  std::vector<bool> flags(dna.definition.joint_names.size(), false);
  const auto& entries = dna.joint_behavior_metadata.joint_representations;
  for (std::size_t j = 0; j < entries.size() && j < flags.size(); ++j) {
    flags[j] = entries[j].rotation == 1;
  }
  return flags;
}

void count_controls(const dna::Dna& dna, Rig& out) {
  const dna::ControlCounts counts = dna::control_counts(dna);
  out.raw_count = counts.raw;
  out.control_count = counts.total();
  const auto ignore = [&](const char* id, bool has_content) {
    if (has_content) out.ignored_layers.emplace_back(id);
  };
  ignore("mlbh", dna.machine_learned_behavior != dna::MachineLearnedBehavior{});
  ignore("mlbe", dna.machine_learned_behavior_ext != dna::MachineLearnedBehaviorExt{});
  ignore("rbfb", dna.rbf_behavior != dna::RbfBehavior{});
  ignore("rbfe", dna.rbf_behavior_ext != dna::RbfBehaviorExt{});
  ignore("twsw", dna.twist_swing_behavior != dna::TwistSwingBehavior{});
}

Status check_controls(const Array<std::uint16_t>& indices, std::uint32_t limit,
                      const std::string& where) {
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] < limit) continue;
    return fail(
        ErrorCode::kInvalidIndex, where + "[" + std::to_string(i) + "]",
        "control " + std::to_string(indices[i]) + ", but there are " + std::to_string(limit));
  }
  return ok();
}

Status check_lods(const Array<std::uint16_t>& lods, std::uint32_t lod_count,
                  const std::string& where) {
  if (lods.size() >= lod_count) return ok();
  return fail(ErrorCode::kInvalidLength, where + ".lods",
              std::to_string(lods.size()) + " entries, but there are " + std::to_string(lod_count) +
                  " LODs");
}

rig::ConditionalTable compile_table(const dna::Conditionals& source) {
  rig::ConditionalTable table;
  const std::size_t n = source.input_indices.size();
  table.rows.resize(n);
  for (std::size_t i = n; i-- > 0;) {
    rig::ConditionalRow& row = table.rows[i];
    row.input = source.input_indices[i];
    row.output = source.output_indices[i];
    row.from = std::min(source.from_values[i], source.to_values[i]);
    row.to = std::max(source.from_values[i], source.to_values[i]);
    row.slope = source.slope_values[i];
    row.cut = source.cut_values[i];
    const bool same_run =
        i + 1 < n && table.rows[i + 1].input == row.input && table.rows[i + 1].output == row.output;
    row.run_end = same_run ? table.rows[i + 1].run_end : static_cast<std::uint32_t>(i + 1);
  }
  return table;
}

std::vector<std::uint32_t> row_counts(const Array<std::uint16_t>& lods, std::uint32_t lod_count) {
  std::vector<std::uint32_t> counts;
  for (std::uint32_t l = 0; l < lod_count && l < lods.size(); ++l) counts.push_back(lods[l]);
  return counts;
}

void compile_neutral(const dna::Dna& dna, Rig& out) {
  const dna::Definition& d = dna.definition;
  out.joint_count = static_cast<std::uint32_t>(d.joint_names.size());
  out.neutral_joints.resize(std::size_t{out.joint_count} * 9, 1.0f);
  for (std::size_t j = 0; j < out.joint_count; ++j) {
    for (std::size_t k = 0; k < 3; ++k) {
      out.neutral_joints[j * 9 + k] = d.neutral_joint_translations.at(j, k);
      out.neutral_joints[j * 9 + 3 + k] = d.neutral_joint_rotations.at(j, k);
    }
  }
}

// Rows beyond the first LOD's count are never evaluated and not stored.
Status compile_joint_group(const dna::JointGroup& g, const std::string& where, Rig& out) {
  if (Status s = check_controls(g.input_indices, out.control_count, where + ".input_indices"); !s) {
    return s;
  }
  rig::JointGroup group;
  group.lods_begin = static_cast<std::uint32_t>(out.joint_group_lods.size());
  std::uint32_t rows = 0;
  if (!g.output_indices.empty()) {
    if (Status s = check_lods(g.lods, out.lod_count, where); !s) return s;
  }
  for (std::uint32_t l = 0; l < out.lod_count; ++l) {
    const std::uint32_t count = l < g.lods.size() ? g.lods[l] : 0;
    out.joint_group_lods.push_back(count);
    rows = std::max(rows, count);
  }
  const std::size_t columns = g.input_indices.size();
  group.row_count = rows;
  group.column_count = static_cast<std::uint32_t>(columns);
  group.stride = static_cast<std::uint32_t>((rows + simd::kRowAlignment - 1) / simd::kRowAlignment *
                                            simd::kRowAlignment);
  if (out.joint_values.size() + std::size_t{group.stride} * columns > UINT32_MAX) {
    return fail(ErrorCode::kLimitExceeded, where + ".values",
                "the matrices of all groups hold more values than an index of 32 bits reaches");
  }
  group.values_begin = static_cast<std::uint32_t>(out.joint_values.size());
  group.inputs_begin = static_cast<std::uint32_t>(out.joint_inputs.size());
  group.outputs_begin = static_cast<std::uint32_t>(out.joint_outputs.size());
  out.joint_values.resize(out.joint_values.size() + group.stride * columns, 0.0f);
  float* values = out.joint_values.data() + group.values_begin;
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      values[c * group.stride + r] = g.values[r * columns + c];
    }
  }
  out.joint_inputs.insert(out.joint_inputs.end(), g.input_indices.begin(), g.input_indices.end());
  out.joint_outputs.insert(out.joint_outputs.end(), g.output_indices.begin(),
                           g.output_indices.begin() + rows);
  out.widest_group = std::max(out.widest_group, group.column_count);
  out.tallest_group = std::max(out.tallest_group, group.stride);
  out.joint_groups.push_back(group);
  return ok();
}

rig::EulerConvention euler_convention(const dna::Dna& dna) {
  static constexpr std::uint8_t kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                                 {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  const dna::DescriptorExt& ext = dna.descriptor_ext;
  rig::EulerConvention c;
  const auto* order = kOrders[ext.rotation_sequence < 6 ? ext.rotation_sequence : 0];
  for (std::size_t i = 0; i < 3; ++i) {
    c.order[i] = order[i];
    c.signs[i] = ext.rotation_sign[i] < 0 ? -1.0f : 1.0f;
  }
  c.radians_per_unit = dna.descriptor.rotation_unit == 1 ? 1.0f : 0.0174532925199432958f;
  return c;
}

// The Euler entries of a column become one quaternion per joint; a missing row is 0.
void compile_quaternion_joints(const dna::JointGroup& g, std::uint32_t group_index,
                               const std::vector<bool>& flags, Rig& out) {
  std::map<std::uint32_t, std::array<std::int32_t, 3>> rows;  // joint -> its rotation rows
  for (std::uint32_t r = 0; r < out.joint_groups[group_index].row_count; ++r) {
    const std::uint32_t joint = g.output_indices[r] / 9u, attribute = g.output_indices[r] % 9u;
    if (attribute < 3 || attribute > 5 || !flags[joint]) continue;
    auto [at, added] = rows.try_emplace(joint, std::array<std::int32_t, 3>{-1, -1, -1});
    at->second[attribute - 3] = static_cast<std::int32_t>(r);
  }
  const std::size_t columns = g.input_indices.size();
  for (const auto& [joint, row_of_axis] : rows) {
    rig::QuaternionJoint q;
    q.joint = joint;
    q.group = group_index;
    q.quaternions_begin = static_cast<std::uint32_t>(out.quaternions.size());
    q.first_row = UINT32_MAX;
    for (const std::int32_t r : row_of_axis) {
      if (r >= 0) q.first_row = std::min(q.first_row, static_cast<std::uint32_t>(r));
    }
    for (std::size_t c = 0; c < columns; ++c) {
      std::array<float, 3> angles{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int32_t r = row_of_axis[axis];
        if (r >= 0) angles[axis] = g.values[static_cast<std::size_t>(r) * columns + c];
      }
      out.quaternions.push_back(rig::from_euler(out.euler, angles));
    }
    out.quaternion_joints.push_back(q);
  }
}

Status compile_joint_groups(const dna::Dna& dna, Rig& out) {
  const auto& groups = dna.behavior.joint_groups;
  const std::vector<bool> flags = quaternion_joint_flags(dna);
  out.euler = euler_convention(dna);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const std::string where = "behavior.joint_groups[" + std::to_string(i) + "]";
    if (Status s = compile_joint_group(groups[i], where, out); !s) return s;
    compile_quaternion_joints(groups[i], static_cast<std::uint32_t>(i), flags, out);
  }
  std::set<std::uint16_t> written;
  for (const std::uint16_t o : out.joint_outputs) written.insert(static_cast<std::uint16_t>(o / 9));
  out.joints_written.assign(written.begin(), written.end());
  return ok();
}

Status compile_psds(const dna::Dna& dna, Rig& out) {
  const dna::Psds& source = dna.behavior.psds;
  if (Status s = check_controls(source.columns, out.control_count, "behavior.psds.columns"); !s) {
    return s;
  }
  if (Status s = check_controls(source.rows, out.control_count, "behavior.psds.rows"); !s) {
    return s;
  }
  std::map<std::uint16_t, std::vector<std::size_t>> entries;  // rows may be interleaved
  for (std::size_t i = 0; i < source.rows.size(); ++i) entries[source.rows[i]].push_back(i);
  for (const auto& [output, list] : entries) {
    rig::Psd psd;
    psd.output = output;
    psd.factors_begin = static_cast<std::uint32_t>(out.psd_factors.size());
    for (const std::size_t i : list) {
      psd.weight *= source.values[i];
      out.psd_factors.push_back(source.columns[i]);
    }
    psd.factors_end = static_cast<std::uint32_t>(out.psd_factors.size());
    out.psds.push_back(psd);
  }
  return ok();
}

// Marks the controls that something reads at this LOD: columns of joint groups with a value in a
// row of the LOD, and the inputs of channels and maps within their row counts.
std::vector<bool> used_controls(const Rig& r, std::uint32_t lod) {
  std::vector<bool> used(r.control_count, false);
  for (const rig::JointGroup& g : r.joint_groups) {
    const std::uint32_t rows = r.joint_group_lods[g.lods_begin + lod];
    for (std::uint32_t c = 0; c < g.column_count; ++c) {
      const float* column = r.joint_values.data() + g.values_begin + std::size_t{c} * g.stride;
      if (std::any_of(column, column + rows, [](float v) { return v != 0.0f; })) {
        used[r.joint_inputs[g.inputs_begin + c]] = true;
      }
    }
  }
  for (std::uint32_t i = 0; i < (r.shape_lod_row_counts.empty() ? 0 : r.shape_lod_row_counts[lod]);
       ++i) {
    used[r.shape_inputs[i]] = true;
  }
  const rig::ConditionalTable& maps = r.animated_maps;
  for (std::uint32_t i = 0; i < (maps.lod_row_counts.empty() ? 0 : maps.lod_row_counts[lod]); ++i) {
    used[maps.rows[i].input] = true;
  }
  return used;
}

// Factors before what uses them, ties by ascending output; members of a cycle and what hangs on
// them come last.
std::vector<std::uint32_t> dependency_order(const Rig& r, const std::vector<std::uint32_t>& psds) {
  constexpr std::uint32_t kNone = UINT32_MAX;
  std::vector<std::uint32_t> psd_of_control(r.control_count, kNone);
  for (const std::uint32_t p : psds) psd_of_control[r.psds[p].output] = p;
  std::vector<std::vector<std::uint32_t>> users(r.psds.size());
  std::vector<std::uint32_t> waiting_for(r.psds.size(), 0);
  std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> ready;
  for (const std::uint32_t p : psds) {
    for (std::uint32_t f = r.psds[p].factors_begin; f < r.psds[p].factors_end; ++f) {
      const std::uint32_t source = psd_of_control[r.psd_factors[f]];
      if (source == kNone) continue;
      users[source].push_back(p);
      ++waiting_for[p];
    }
    if (waiting_for[p] == 0) ready.push(p);
  }
  std::vector<std::uint32_t> order;
  while (!ready.empty()) {
    const std::uint32_t p = ready.top();
    ready.pop();
    order.push_back(p);
    for (const std::uint32_t user : users[p]) {
      if (--waiting_for[user] == 0) ready.push(user);
    }
  }
  std::ranges::copy_if(psds, std::back_inserter(order),
                       [&](std::uint32_t p) { return waiting_for[p] > 0; });
  return order;
}

void schedule_psds(Rig& r) {
  for (std::uint32_t lod = 0; lod < r.lod_count; ++lod) {
    const std::vector<bool> used = used_controls(r, lod);
    std::vector<std::uint32_t> psds;
    for (std::uint32_t p = 0; p < r.psds.size(); ++p) {
      if (used[r.psds[p].output]) psds.push_back(p);
    }
    r.settled_psds_by_lod.push_back(dependency_order(r, psds));
    r.psds_by_lod.push_back(std::move(psds));
  }
}

Status compile_channels_and_maps(const dna::Dna& dna, Rig& out) {
  const dna::BlendShapeChannels& s = dna.behavior.blend_shape_channels;
  const dna::AnimatedMaps& m = dna.behavior.animated_maps;
  out.blend_shape_count =
      static_cast<std::uint32_t>(dna.definition.blend_shape_channel_names.size());
  out.animated_map_count = static_cast<std::uint32_t>(dna.definition.animated_map_names.size());
  const std::string shapes = "behavior.blend_shape_channels", maps = "behavior.animated_maps";
  if (Status c = check_controls(s.input_indices, out.control_count, shapes + ".input_indices");
      !c) {
    return c;
  }
  const auto& map_inputs = m.conditionals.input_indices;
  if (Status c = check_controls(map_inputs, out.control_count, maps + ".input_indices"); !c) {
    return c;
  }
  if (!s.input_indices.empty()) {
    if (Status c = check_lods(s.lods, out.lod_count, shapes); !c) return c;
    out.shape_lod_row_counts = row_counts(s.lods, out.lod_count);
  }
  out.animated_maps = compile_table(m.conditionals);
  if (!map_inputs.empty()) {
    if (Status c = check_lods(m.lods, out.lod_count, maps); !c) return c;
    out.animated_maps.lod_row_counts = row_counts(m.lods, out.lod_count);
  }
  out.shape_inputs.assign(s.input_indices.begin(), s.input_indices.end());
  out.shape_outputs.assign(s.output_indices.begin(), s.output_indices.end());
  return ok();
}

}  // namespace

Result<Rig> compile(const dna::Dna& dna, const CompileOptions& options) {
  std::vector<dna::Warning> warnings;
  if (Status s = dna::validate(dna, warnings); !s) return std::move(s).propagate();
  Rig out;
  out.kernels = options.kernels != nullptr ? options.kernels : simd::find_kernels(nullptr);
  if (out.kernels == nullptr) {
    return fail(ErrorCode::kInvalidArgument, "RISORIUS_SIMD",
                std::string("this instruction set is not available; there are: ") +
                    simd::available_kernels());
  }
  out.lod_count = dna.descriptor.lod_count;
  out.raw_control_names = dna.definition.raw_control_names;
  out.gui_control_names = dna.definition.gui_control_names;
  count_controls(dna, out);
  compile_neutral(dna, out);
  out.gui_to_raw = compile_table(dna.behavior.gui_to_raw);
  if (Status s = compile_joint_groups(dna, out); !s) return std::move(s).propagate();
  if (Status s = compile_channels_and_maps(dna, out); !s) return std::move(s).propagate();
  if (Status s = compile_psds(dna, out); !s) return std::move(s).propagate();
  schedule_psds(out);
  return out;
}

}  // namespace risorius::compile
