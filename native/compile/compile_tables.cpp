// SPDX-License-Identifier: MIT
// Compiles names, the neutral pose, initial values of controls, correctives (psds), blend shape
// channels, and the conditional tables of GUI controls and animated maps. A row of a table adds
// slope * input + cut to its output while the input is between its bounds; neighbouring rows with
// the same input and output form a run.
#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <string>
#include <string_view>
#include <tuple>

#include "compile/parts.h"
#include "dna/controls.h"

namespace risorius::compile::detail {

namespace {

using core::ErrorCode;
using core::fail;
using core::ok;

void add_text(std::string_view text, RigData& out) {
  out.text.insert(out.text.end(), text.begin(), text.end());
  out.text_ends.push_back(static_cast<std::uint32_t>(out.text.size()));
}

void count_controls(const dna::Dna& dna, RigData& out) {
  const dna::ControlCounts counts = dna::control_counts(dna);
  out.raw_count = counts.raw;
  out.psd_count = counts.psd;
  out.control_count = counts.total();
  for (const dna::UnknownLayer& layer : dna.unknown_layers) {
    add_text({layer.id.data(), layer.id.size()}, out);
  }
}

std::vector<rig::ConditionalRow> compile_table(const dna::Conditionals& source) {
  const std::size_t n = source.input_indices.size();
  std::vector<rig::ConditionalRow> rows(n);
  for (std::size_t i = n; i-- > 0;) {
    rig::ConditionalRow& row = rows[i];
    row.input = source.input_indices[i];
    row.output = source.output_indices[i];
    row.from = std::min(source.from_values[i], source.to_values[i]);
    row.to = std::max(source.from_values[i], source.to_values[i]);
    row.slope = source.slope_values[i];
    row.cut = source.cut_values[i];
    const bool same_run =
        i + 1 < n && rows[i + 1].input == row.input && rows[i + 1].output == row.output;
    row.run_end = same_run ? rows[i + 1].run_end : static_cast<std::uint32_t>(i + 1);
  }
  return rows;
}

// Whether a run of rows adds a value other than 0 to its output while its input is 0.
// In: begin  index of the first row of the run
bool adds_at_rest(const std::vector<rig::ConditionalRow>& rows, std::size_t begin) {
  for (std::size_t i = begin; i < rows[begin].run_end; ++i) {
    const rig::ConditionalRow& row = rows[i];
    if (row.from <= 0.0f && 0.0f <= row.to) return row.slope * 0.0f + row.cut != 0.0f;
  }
  return false;
}

std::vector<rig::RowRun> runs_of(const std::vector<rig::ConditionalRow>& rows) {
  std::vector<rig::RowRun> runs;
  for (std::size_t i = 0; i < rows.size(); i = rows[i].run_end) {
    runs.push_back({rows[i].input, static_cast<std::uint16_t>(adds_at_rest(rows, i) ? 1 : 0),
                    static_cast<std::uint32_t>(i)});
  }
  return runs;
}

// Lists the channels of each control. The lists stay empty if two entries of shape_outputs are the
// same channel.
void list_shapes_of_controls(RigData& out) {
  std::vector<bool> taken(std::size_t{UINT16_MAX} + 1);
  for (const std::uint16_t output : out.shape_outputs) {
    if (taken[output]) return;
    taken[output] = true;
  }
  out.shape_begins.assign(out.control_count + std::size_t{1}, 0);
  for (const std::uint16_t input : out.shape_inputs) ++out.shape_begins[input + std::size_t{1}];
  std::partial_sum(out.shape_begins.begin(), out.shape_begins.end(), out.shape_begins.begin());
  std::vector<std::uint32_t> next = out.shape_begins;
  out.shapes_of_controls.resize(out.shape_inputs.size());
  for (std::size_t i = 0; i < out.shape_inputs.size(); ++i) {
    out.shapes_of_controls[next[out.shape_inputs[i]]++] = static_cast<std::uint16_t>(i);
  }
}

// The bounds of a row as a sortable number; -0 equals 0.
std::uint64_t bounds_key(const rig::ConditionalRow& row) {
  const auto bits = [](float v) { return std::uint64_t{std::bit_cast<std::uint32_t>(v + 0.0f)}; };
  return bits(row.from) << 32 | bits(row.to);
}

bool has_number_bounds(const rig::ConditionalRow& row) {
  return row.from == row.from && row.to == row.to;
}

// [rows] the first row of the range to which a row belongs: rows of one GUI control with equal
// bounds form a range. A row with a bound that is NaN is a range of its own.
// Out: steps  raised by the number of comparisons
std::vector<std::uint32_t> first_rows_of_ranges(const std::vector<rig::ConditionalRow>& rows,
                                                std::uint64_t& steps) {
  std::vector<std::uint32_t> order(rows.size()), first(rows.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    ++steps;
    const auto key = [&](std::uint32_t i) {
      return std::tuple(rows[i].input, bounds_key(rows[i]), i);
    };
    return key(a) < key(b);
  };
  std::ranges::sort(order, before);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const rig::ConditionalRow& row = rows[order[i]];
    const rig::ConditionalRow& last = rows[order[i > 0 ? i - 1 : 0]];
    const bool same = i > 0 && has_number_bounds(row) && row.input == last.input &&
                      bounds_key(row) == bounds_key(last);
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  return first;
}

// Lists the rows of each GUI control, grouped into ranges of equal bounds. Ranges are in the order
// of their first rows.
Status list_gui_ranges(core::Budget& budget, RigData& out) {
  std::uint64_t steps = 0;
  const std::vector<std::uint32_t> first = first_rows_of_ranges(out.gui_rows, steps);
  std::vector<std::uint32_t>& list = out.gui_range_rows;
  list.resize(out.gui_rows.size());
  std::iota(list.begin(), list.end(), 0u);
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    ++steps;
    return std::tuple(out.gui_rows[a].input, first[a], a) <
           std::tuple(out.gui_rows[b].input, first[b], b);
  };
  std::ranges::sort(list, before);
  for (std::uint32_t i = 0; i < list.size(); ++i) {
    if (first[list[i]] == list[i]) out.gui_ranges.push_back({out.gui_rows[list[i]].input, i, i});
    out.gui_ranges.back().rows_end = i + 1;
  }
  return budget.take_steps(steps, "behavior.gui_to_raw");
}

bool is_quaternion_w(std::string_view name) {
  return name.ends_with(".w") || name.ends_with(".qw");
}

// The initial values of controls: 1 for raw controls named *.w or *.qw that solvers or twist and
// swing setups read, and for controls of networks with such names; 0 for all others.
void compile_initial_controls(const dna::Dna& dna, RigData& out) {
  out.initial_controls.assign(out.control_count, 0.0f);
  const auto& names = dna.definition.raw_control_names;
  const auto mark = [&](const Array<std::uint16_t>& inputs) {
    for (const std::uint16_t i : inputs) {
      if (i < names.size() && is_quaternion_w(names[i])) out.initial_controls[i] = 1.0f;
    }
  };
  for (const auto& s : dna.rbf_behavior.solvers) mark(s.raw_control_indices);
  for (const auto& s : dna.twist_swing_behavior.twists) mark(s.input_control_indices);
  for (const auto& s : dna.twist_swing_behavior.swings) mark(s.input_control_indices);
  const auto& ml = dna.machine_learned_behavior.ml_control_names;
  for (std::size_t i = 0; i < ml.size(); ++i) {
    if (is_quaternion_w(ml[i])) out.initial_controls[out.raw_count + out.psd_count + i] = 1.0f;
  }
}

std::vector<std::uint32_t> row_counts(const Array<std::uint16_t>& lods, std::uint32_t lod_count) {
  std::vector<std::uint32_t> counts;
  for (std::uint32_t l = 0; l < lod_count && l < lods.size(); ++l) counts.push_back(lods[l]);
  return counts;
}

void compile_neutral(const dna::Dna& dna, RigData& out) {
  const dna::Definition& d = dna.definition;
  out.joint_count = static_cast<std::uint32_t>(d.joint_names.size());
  out.neutral_joints.resize(std::size_t{out.joint_count} * out.joint_stride, 1.0f);
  for (std::size_t j = 0; j < out.joint_count; ++j) {
    float* to = out.neutral_joints.data() + j * out.joint_stride;
    std::array<float, 3> angles{};
    for (std::size_t k = 0; k < 3; ++k) {
      to[k] = d.neutral_joint_translations.at(j, k);
      to[3 + k] = angles[k] = d.neutral_joint_rotations.at(j, k);
    }
    if (out.joint_stride == 9) continue;
    const rig::Quaternion q = rig::from_euler(out.euler, angles);
    to[3] = q.x, to[4] = q.y, to[5] = q.z, to[6] = q.w;
  }
}

}  // namespace

Status compile_psds(const dna::Dna& dna, RigData& out) {
  const dna::Psds& source = dna.behavior.psds;
  RISORIUS_TRY(check_controls(source.columns, out.control_count, "behavior.psds.columns"));
  RISORIUS_TRY(check_controls(source.rows, out.control_count, "behavior.psds.rows"));
  std::vector<std::uint32_t> entries(source.rows.size());
  std::iota(entries.begin(), entries.end(), 0u);
  const auto row = [&](std::uint32_t i) { return source.rows[i]; };
  if (!std::ranges::is_sorted(source.rows)) std::ranges::stable_sort(entries, {}, row);
  out.psd_factors.reserve(entries.size());
  for (std::size_t i = 0; i < entries.size();) {
    rig::Psd psd;
    psd.output = row(entries[i]);
    psd.factors_begin = static_cast<std::uint32_t>(i);
    for (; i < entries.size() && row(entries[i]) == psd.output; ++i) {
      psd.weight *= source.values[entries[i]];
      out.psd_factors.push_back(source.columns[entries[i]]);
    }
    if (i - psd.factors_begin > UINT16_MAX) {
      return fail(ErrorCode::kLimitExceeded, "behavior.psds",
                  "a corrective with more than 65535 factors");
    }
    psd.factor_count = static_cast<std::uint16_t>(i - psd.factors_begin);
    out.psds.push_back(psd);
  }
  return ok();
}

void mark_channels_and_maps(const RigData& r, Used& used) {
  for (std::uint32_t l = 0; l < r.lod_count; ++l) {
    for (std::uint32_t i = 0; !r.shape_lods.empty() && i < r.shape_lods[l]; ++i) {
      used[l][r.shape_inputs[i]] = true;
    }
    for (std::uint32_t i = 0; !r.map_lods.empty() && i < r.map_lods[l]; ++i) {
      used[l][r.map_rows[i].input] = true;
    }
  }
}

Status compile_channels_and_maps(const dna::Dna& dna, RigData& out) {
  const dna::BlendShapeChannels& s = dna.behavior.blend_shape_channels;
  const dna::AnimatedMaps& m = dna.behavior.animated_maps;
  out.blend_shape_count =
      static_cast<std::uint32_t>(dna.definition.blend_shape_channel_names.size());
  out.animated_map_count = static_cast<std::uint32_t>(dna.definition.animated_map_names.size());
  const std::string shapes = "behavior.blend_shape_channels", maps = "behavior.animated_maps";
  RISORIUS_TRY(check_controls(s.input_indices, out.control_count, shapes + ".input_indices"));
  const auto& map_inputs = m.conditionals.input_indices;
  RISORIUS_TRY(check_controls(map_inputs, out.control_count, maps + ".input_indices"));
  if (!s.input_indices.empty()) {
    RISORIUS_TRY(check_lods(s.lods, out.lod_count, shapes));
    out.shape_lods = row_counts(s.lods, out.lod_count);
  }
  out.map_rows = compile_table(m.conditionals);
  if (!map_inputs.empty()) {
    RISORIUS_TRY(check_lods(m.lods, out.lod_count, maps));
    out.map_lods = row_counts(m.lods, out.lod_count);
  }
  out.shape_inputs.assign(s.input_indices.begin(), s.input_indices.end());
  out.shape_outputs.assign(s.output_indices.begin(), s.output_indices.end());
  const auto follows = [](const std::vector<std::uint16_t>& list, std::size_t i) {
    return i == 0 || list[i] == list[i - 1] + 1;
  };
  while (out.shape_run < out.shape_inputs.size() && follows(out.shape_inputs, out.shape_run) &&
         follows(out.shape_outputs, out.shape_run)) {
    ++out.shape_run;
  }
  out.map_runs = runs_of(out.map_rows);
  list_shapes_of_controls(out);
  return ok();
}

Status compile_frame(const dna::Dna& dna, core::Budget& budget, RigData& out) {
  out.lod_count = dna.descriptor.lod_count;
  out.euler = euler_convention(dna);
  for (const std::string& name : dna.definition.raw_control_names) add_text(name, out);
  for (const std::string& name : dna.definition.gui_control_names) add_text(name, out);
  out.gui_count = static_cast<std::uint32_t>(dna.definition.gui_control_names.size());
  count_controls(dna, out);
  compile_neutral(dna, out);
  compile_initial_controls(dna, out);
  out.gui_rows = compile_table(dna.behavior.gui_to_raw);
  return list_gui_ranges(budget, out);
}

}  // namespace risorius::compile::detail
