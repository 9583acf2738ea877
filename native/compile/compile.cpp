// SPDX-License-Identifier: MIT
#include "compile/compile.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <iterator>
#include <numeric>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>

#include "compile/parts.h"
#include "core/finite.h"
#include "dna/controls.h"
#include "dna/size.h"
#include "dna/validate.h"
#include "rig/block.h"
#include "simd/four.h"
#include "simd/half.h"

namespace risorius::compile {

namespace {

using core::Array;
using core::ErrorCode;
using core::fail;
using core::ok;
using core::Result;
using core::Status;
using detail::check_controls;
using detail::Groups;
using detail::Used;
using rig::RigData;

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

Status check_lods(const Array<std::uint16_t>& lods, std::uint32_t lod_count,
                  const std::string& where) {
  if (lods.size() >= lod_count) return ok();
  return fail(ErrorCode::kInvalidLength, where + ".lods",
              std::to_string(lods.size()) + " entries, but there are " + std::to_string(lod_count) +
                  " LODs");
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

// Whether a run adds something where its input is 0.
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

// The channels of each control. Left empty where two of them have one output.
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

// Bounds of a row as a number that sorts: -0 is 0, and what is no number equals nothing.
std::uint64_t bounds_key(const rig::ConditionalRow& row) {
  const auto bits = [](float v) { return std::uint64_t{std::bit_cast<std::uint32_t>(v + 0.0f)}; };
  return bits(row.from) << 32 | bits(row.to);
}

bool has_number_bounds(const rig::ConditionalRow& row) {
  return row.from == row.from && row.to == row.to;
}

// The first row of each row's range: rows of one GUI control with equal bounds.
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

// Of each GUI control its rows, in ranges of equal bounds, in the order of their first rows.
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

// 0, but 1 for the last part of each quaternion that solvers, setups and networks read or write.
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

// A column of a group, and where it is kept.
struct KeptColumn {
  std::uint32_t column, offset;
};

// Whether four columns are: a file may list a group's controls in any order.
bool side_by_side(const KeptColumn* four) {
  bool all = true;
  for (std::uint32_t i = 1; i < 4; ++i) all = all && four[i].column == four[0].column + i;
  return all;
}

// In tiles: both sides are read and written by whole cache lines, four columns at a time.
// In: from  [rows, stride]
void transpose(const float* from, std::size_t rows, std::size_t stride,
               std::span<const KeptColumn> columns, float* to) {
  constexpr std::size_t kTile = 16, kTogether = 4;
  for (std::size_t r0 = 0; r0 < rows; r0 += kTile) {
    const std::size_t r1 = std::min(rows, r0 + kTile);
    std::size_t c = 0;
    for (; c + kTogether <= columns.size(); c += kTogether) {
      const KeptColumn* k = columns.data() + c;
      float *const a = to + k[0].offset, *const b = to + k[1].offset, *const d = to + k[2].offset,
                   *const e = to + k[3].offset;
      std::size_t r = r0;
      if (side_by_side(k)) {
        for (; r + kTogether <= r1; r += kTogether) {
          simd::turn_four(from + r * stride + k[0].column, stride, a + r, b + r, d + r, e + r);
        }
      }
      for (; r < r1; ++r) {
        const float* row = from + r * stride;
        a[r] = row[k[0].column], b[r] = row[k[1].column];
        d[r] = row[k[2].column], e[r] = row[k[3].column];
      }
    }
    for (; c < columns.size(); ++c) {
      for (std::size_t r = r0; r < r1; ++r) {
        to[columns[c].offset + r] = from[r * stride + columns[c].column];
      }
    }
  }
}

// The columns of all groups, which stay in the matrices of the file until the block is there.
struct KeptMatrices {
  struct Matrix {
    const dna::JointGroup* group;
    std::uint32_t rows;
    std::vector<KeptColumn> columns;
  };
  std::vector<Matrix> matrices;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> gaps;  // between columns: first, end
  std::size_t size = 0;                                       // of all, in floats

  // Out: to  [size], overwritten
  void write(std::span<float> to) const {
    for (const auto& [first, end] : gaps) {
      std::fill(to.begin() + first, to.begin() + end, 0.0f);
    }
    for (const Matrix& m : matrices) {
      transpose(m.group->values.data(), m.rows, m.group->input_indices.size(), m.columns,
                to.data());
    }
  }
};

// Rows of a group at each LOD. Those beyond what any LOD has are never evaluated and not stored.
core::Result<std::uint32_t> add_lods(const dna::JointGroup& g, const std::string& where,
                                     RigData& out) {
  if (!g.output_indices.empty()) {
    RISORIUS_TRY(check_lods(g.lods, out.lod_count, where));
  }
  std::uint32_t rows = 0;
  for (std::uint32_t l = 0; l < out.lod_count; ++l) {
    const std::uint32_t count = l < g.lods.size() ? g.lods[l] : 0;
    out.joint_group_lods.push_back(count);
    rows = std::max(rows, count);
  }
  return rows;
}

// Groups that coarser LODs have come first.
Groups list_groups(const dna::Dna& dna) {
  const auto levels = [](const dna::JointGroup* g) {
    std::size_t n = g->lods.size();
    while (n > 0 && g->lods[n - 1] == 0) --n;
    return n;
  };
  Groups groups;
  for (const dna::JointGroup& g : dna.behavior.joint_groups) groups.push_back(&g);
  std::ranges::stable_sort(groups, std::greater{}, levels);
  return groups;
}

Status compile_joint_group(const dna::JointGroup& g, const std::string& where, RigData& out) {
  RISORIUS_TRY(check_controls(g.input_indices, out.control_count, where + ".input_indices"));
  const auto rows = add_lods(g, where, out);
  if (!rows) return core::Unexpected{rows.error()};
  rig::JointGroup group;
  group.row_count = *rows;
  std::vector<std::uint16_t>& outputs = out.joint_outputs;
  // A long group has whole vectors of rows to itself; nothing places what is behind its last row.
  const auto fill = [&] {
    if (*rows < simd::kWidest) return;
    outputs.resize(simd::rounded_up(outputs.size()), g.output_indices[0]);
  };
  fill();
  group.rows_begin = static_cast<std::uint32_t>(outputs.size());
  outputs.insert(outputs.end(), g.output_indices.begin(), g.output_indices.begin() + *rows);
  fill();
  out.joint_groups.push_back(group);
  return ok();
}

// The lowest row in which each column has a value: at LODs with fewer rows it does nothing.
std::vector<std::uint32_t> first_rows_with_values(const dna::JointGroup& g, std::uint32_t rows) {
  const std::size_t columns = g.input_indices.size();
  std::vector<std::uint32_t> first(columns, rows), missing(columns);
  std::iota(missing.begin(), missing.end(), 0u);
  for (std::uint32_t r = 0; r < rows && !missing.empty(); ++r) {
    const float* row = g.values.data() + r * columns;
    std::size_t left = 0;
    for (const std::uint32_t c : missing) {
      if (row[c] == 0.0f) {
        missing[left++] = c;
      } else {
        first[c] = r;
      }
    }
    missing.resize(left);
  }
  return first;
}

struct ColumnEntry {
  std::uint16_t control;
  std::uint32_t group, column;
};

// In the same order where the control is the same.
std::vector<ColumnEntry> by_control(const std::vector<ColumnEntry>& entries,
                                    std::uint32_t control_count) {
  std::vector<std::size_t> next(control_count + std::size_t{1});
  for (const ColumnEntry& e : entries) ++next[e.control + std::size_t{1}];
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<ColumnEntry> out(entries.size());
  for (const ColumnEntry& e : entries) out[next[e.control]++] = e;
  return out;
}

// The columns that have any value, by control and group: what a control drives lies together.
std::vector<ColumnEntry> list_columns(const Groups& groups, RigData& out, Used& used) {
  std::vector<ColumnEntry> entries;
  for (std::uint32_t i = 0; i < out.joint_groups.size(); ++i) {
    rig::JointGroup& g = out.joint_groups[i];
    const dna::JointGroup& source = *groups[i];
    const std::vector<std::uint32_t> first = first_rows_with_values(source, g.row_count);
    for (std::uint32_t c = 0; c < first.size(); ++c) {
      if (first[c] == g.row_count) continue;
      ++g.column_count;
      const std::uint16_t control = source.input_indices[c];
      entries.push_back({control, i, c});
      for (std::uint32_t l = 0; l < out.lod_count; ++l) {
        if (out.joint_group_lods[i * out.lod_count + l] > first[c]) used[l][control] = true;
      }
    }
  }
  return by_control(entries, out.control_count);
}

// The columns once more, by group and then by control.
void list_by_group(const std::vector<ColumnEntry>& entries, RigData& out) {
  std::vector<std::uint32_t> next;
  std::uint32_t begin = 0;
  for (rig::JointGroup& g : out.joint_groups) {
    next.push_back(g.columns_begin = begin);
    begin += g.column_count;
  }
  out.group_columns.resize(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    out.group_columns[next[entries[i].group]++] = {out.joint_columns[i].offset, entries[i].control};
  }
}

// What each control costs at each LOD, and all of them.
void count_reads(const std::vector<ColumnEntry>& entries, RigData& out) {
  const std::size_t stride = out.control_count + std::size_t{1};
  out.control_reads.resize(out.lod_count * stride);
  for (std::uint32_t l = 0; l < out.lod_count; ++l) {
    rig::ControlReads* reads = out.control_reads.data() + l * stride;
    rig::ControlReads all;
    for (const ColumnEntry& e : entries) {
      if (e.group >= out.live_groups[l]) continue;
      const std::uint32_t rows = out.joint_group_lods[e.group * out.lod_count + l];
      reads[e.control].values += rows, ++reads[e.control].columns;
      all.values += rows, ++all.columns;
    }
    reads[out.control_count] = all;
  }
}

// Where each column will lie, by control and group.
Status place_columns(const Groups& groups, const std::vector<ColumnEntry>& entries, RigData& out,
                     KeptMatrices& kept) {
  for (std::size_t i = 0; i < groups.size(); ++i) {
    kept.matrices.push_back({groups[i], out.joint_groups[i].row_count, {}});
    kept.matrices.back().columns.reserve(out.joint_groups[i].column_count);
  }
  std::uint64_t end = 0;
  out.joint_column_begins.assign(out.control_count + std::size_t{1}, 0);
  out.joint_columns.reserve(entries.size());
  const auto leave = [&](std::uint64_t to) {
    kept.gaps.emplace_back(static_cast<std::uint32_t>(end), static_cast<std::uint32_t>(to));
    end = to;
  };
  for (const ColumnEntry& e : entries) {
    // A column begins on whole vectors, unless it is shorter than one: those lie side by side.
    const std::uint32_t rows = out.joint_groups[e.group].row_count;
    if (rows >= simd::kWidest && end % simd::kWidest != 0) leave(simd::rounded_up(end));
    const auto offset = static_cast<std::uint32_t>(end);
    kept.matrices[e.group].columns.push_back({e.column, offset});
    out.joint_columns.push_back({offset, e.group});
    ++out.joint_column_begins[e.control + std::size_t{1}];
    end += rows;
    if (end > UINT32_MAX - simd::kWidest) {
      return fail(ErrorCode::kLimitExceeded, "behavior.joint_groups",
                  "the matrices of all groups hold more values than an index of 32 bits reaches");
    }
  }
  std::partial_sum(out.joint_column_begins.begin(), out.joint_column_begins.end(),
                   out.joint_column_begins.begin());
  leave(end + simd::kWidest);  // kernels read on
  kept.size = static_cast<std::size_t>(end);
  return ok();
}

// Columns without a value are not kept, and those hold nothing that is not finite.
bool all_finite(const KeptMatrices& kept) {
  return std::ranges::all_of(kept.matrices, [](const KeptMatrices::Matrix& m) {
    const std::size_t count = m.rows * m.group->input_indices.size();
    return core::all_finite(std::span<const float>(m.group->values.data(), count));
  });
}

// In: finite  all numbers of the file are known to be finite
Status compile_columns(const Groups& groups, bool finite, RigData& out, KeptMatrices& kept,
                       Used& used) {
  const std::vector<ColumnEntry> entries = list_columns(groups, out, used);
  RISORIUS_TRY(place_columns(groups, entries, out, kept));
  list_by_group(entries, out);
  // A column at rest may be read where that costs less, but 0 times infinity is no 0.
  if (finite || all_finite(kept)) count_reads(entries, out);
  return ok();
}

// Which row each joint attribute takes at a LOD; the last group that writes it wins.
std::vector<std::uint32_t> rows_by_attribute(const RigData& r,
                                             std::span<const std::uint32_t> file_order,
                                             std::uint32_t lod) {
  std::vector<std::uint32_t> rows(std::size_t{r.joint_count} * r.joint_stride, rig::kNone);
  for (const std::size_t i : file_order) {
    const rig::JointGroup& g = r.joint_groups[i];
    for (std::uint32_t row = 0; row < r.joint_group_lods[i * r.lod_count + lod]; ++row) {
      rows[r.joint_outputs[g.rows_begin + row]] = g.rows_begin + row;
    }
  }
  return rows;
}

// The rows that one block of attributes takes, as pieces of rows that follow each other.
void add_pieces(std::span<const std::uint32_t> rows, std::size_t block, RigData& out) {
  out.joint_pieces.push_back({0, 0, static_cast<std::uint16_t>(block)});
  simd::Piece* piece = &out.joint_pieces.back();
  std::uint32_t next = rig::kNone;
  for (std::size_t p = 0; p < rows.size(); ++p) {
    if (rows[p] == rig::kNone) continue;
    if (rows[p] != next && piece->mask != 0) {
      out.extra_pieces.push_back({0, 0, static_cast<std::uint16_t>(block)});
      piece = &out.extra_pieces.back();
    }
    if (piece->mask == 0) piece->from = rows[p];
    piece->mask = static_cast<std::uint16_t>(piece->mask | (1u << p));
    next = rows[p] + 1;
  }
}

// The blocks that each group's rows reach.
void find_blocks(RigData& out) {
  for (rig::JointGroup& g : out.joint_groups) {
    const auto rows = std::span(out.joint_outputs).subspan(g.rows_begin, g.row_count);
    if (rows.empty()) continue;
    const auto [least, most] = std::ranges::minmax(rows);
    g.blocks_begin = static_cast<std::uint32_t>(least / simd::kPlaces);
    g.blocks_end = static_cast<std::uint32_t>(most / simd::kPlaces + 1);
  }
}

void compile_pieces(const Groups& groups, RigData& out) {
  find_blocks(out);
  std::vector<std::uint32_t> file_order(groups.size());
  std::iota(file_order.begin(), file_order.end(), 0u);
  std::ranges::sort(file_order, {}, [&](std::uint32_t i) { return groups[i]; });
  out.extra_begins.push_back(0);
  for (std::uint32_t lod = 0; lod < out.lod_count; ++lod) {
    const std::vector<std::uint32_t> rows = rows_by_attribute(out, file_order, lod);
    for (std::size_t at = 0; at < rows.size(); at += simd::kPlaces) {
      const std::size_t count = std::min(simd::kPlaces, rows.size() - at);
      add_pieces(std::span(rows).subspan(at, count), at / simd::kPlaces, out);
    }
    out.extra_begins.push_back(static_cast<std::uint32_t>(out.extra_pieces.size()));
  }
}

// Joints that any group, setup or network moves at any LOD.
void list_joints_written(RigData& out) {
  std::vector<bool> written(out.joint_count, false);
  for (const std::uint16_t row : out.joint_outputs) written[row / 9u] = true;
  for (const rig::TwistSwingOutput& t : out.twist_swing_outputs) written[t.joint] = true;
  for (const rig::MlJoint& m : out.ml_joints) written[m.joint] = true;
  for (std::uint32_t j = 0; j < out.joint_count; ++j) {
    if (written[j]) out.joints_written.push_back(static_cast<std::uint16_t>(j));
  }
}

// With quaternions as output a joint has ten rows: the scale moves by one.
Status widen_joint_rows(RigData& out) {
  if (std::size_t{out.joint_count} * 10 > 65536) {
    return fail(ErrorCode::kLimitExceeded, "definition.joint_names",
                "more than 6553 joints with quaternions as output");
  }
  for (std::uint16_t& row : out.joint_outputs) {
    const std::uint32_t joint = row / 9u, attribute = row % 9u;
    row = static_cast<std::uint16_t>(joint * 10 + attribute + (attribute > 5 ? 1 : 0));
  }
  return ok();
}

Status compile_joint_groups(const dna::Dna& dna, const Groups& groups, RigData& out) {
  for (const dna::JointGroup* g : groups) {
    const auto i = g - &dna.behavior.joint_groups[0];
    const std::string where = "behavior.joint_groups[" + std::to_string(i) + "]";
    RISORIUS_TRY(compile_joint_group(*g, where, out));
  }
  for (std::uint32_t l = 0; l < out.lod_count; ++l) {
    std::size_t live = groups.size();
    while (live > 0 && out.joint_group_lods[(live - 1) * out.lod_count + l] == 0) --live;
    out.live_groups.push_back(static_cast<std::uint32_t>(live));
  }
  return ok();
}

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

// The inputs of channels and maps within their row counts.
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

Status narrow(const KeptMatrices& kept, RigData& out) {
  std::vector<float> values(kept.size);
  kept.write(values);
  out.joint_halves.reserve(values.size());
  for (const float v : values) {
    if (!(std::fabs(v) <= simd::kLargestHalf)) {
      return fail(ErrorCode::kInvalidValue, "behavior.joint_groups",
                  "the joint value " + std::to_string(v) + " does not fit a float16 (65504)");
    }
    out.joint_halves.push_back(simd::to_half(v));
  }
  return ok();
}

// Names, sizes and tables.
Status compile_frame(const dna::Dna& dna, core::Budget& budget, RigData& out) {
  out.lod_count = dna.descriptor.lod_count;
  out.euler = detail::euler_convention(dna);
  for (const std::string& name : dna.definition.raw_control_names) add_text(name, out);
  for (const std::string& name : dna.definition.gui_control_names) add_text(name, out);
  out.gui_count = static_cast<std::uint32_t>(dna.definition.gui_control_names.size());
  count_controls(dna, out);
  compile_neutral(dna, out);
  compile_initial_controls(dna, out);
  out.gui_rows = compile_table(dna.behavior.gui_to_raw);
  return list_gui_ranges(budget, out);
}

// In:  finite  all numbers of the file are known to be finite
// Out: kept  the joint matrices, which out.joint_halves has or neither of its arrays
Result<RigData> compile_parts(const dna::Dna& dna, bool finite, const CompileOptions& options,
                              core::Budget& budget, KeptMatrices& kept) {
  RigData out;
  out.joint_stride = options.rotation == Rotation::kQuaternion ? 10 : 9;
  if (const std::uint32_t controls = dna::control_counts(dna).total(); controls > 65536) {
    return fail(ErrorCode::kLimitExceeded, "behavior.psd_count",
                std::to_string(controls) + " controls, the format's indices reach 65536");
  }
  RISORIUS_TRY(compile_frame(dna, budget, out));
  detail::StepLods lods;
  Used used(out.lod_count, std::vector<bool>(out.control_count, false));
  const Groups groups = list_groups(dna);
  RISORIUS_TRY(compile_joint_groups(dna, groups, out));
  detail::compile_quaternion_joints(dna, groups, out);
  RISORIUS_TRY(detail::compile_solvers(dna, budget, out, lods));
  RISORIUS_TRY(detail::compile_networks(dna, budget, out, lods));
  RISORIUS_TRY(detail::compile_ml_joints(dna, out));
  detail::compile_twist_and_swing(dna, out);
  RISORIUS_TRY(compile_channels_and_maps(dna, out));
  RISORIUS_TRY(compile_psds(dna, out));
  list_joints_written(out);
  RISORIUS_TRY(compile_columns(groups, finite, out, kept, used));
  mark_channels_and_maps(out, used);
  detail::mark_ml_joints(out, used);
  RISORIUS_TRY(detail::schedule(used, lods, budget, out));
  if (out.joint_stride == 10) {
    RISORIUS_TRY(widen_joint_rows(out));
  }
  compile_pieces(groups, out);
  if (options.precision == Precision::kFloat16) {
    RISORIUS_TRY(narrow(kept, out));
  }
  return out;
}

}  // namespace

Status detail::check_controls(const Array<std::uint16_t>& indices, std::uint32_t limit,
                              const std::string& where) {
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] < limit) continue;
    return fail(
        ErrorCode::kInvalidIndex, where + "[" + std::to_string(i) + "]",
        "control " + std::to_string(indices[i]) + ", but there are " + std::to_string(limit));
  }
  return ok();
}

core::Budget budget_for(const dna::Dna& dna) {
  const std::uint64_t size = dna::size_in_bytes(dna);
  return {"compiling this face", (std::uint64_t{1} << 20) + 64 * size,
          (std::uint64_t{1} << 28) + 256 * size};
}

Result<rig::Rig> compile(const dna::Dna& dna, const CompileOptions& options) {
  std::vector<dna::Warning> warnings;
  RISORIUS_TRY(dna::validate_behavior(dna, warnings));
  const simd::Kernels* kernels =
      options.kernels != nullptr ? options.kernels : simd::find_kernels(nullptr);
  if (kernels == nullptr) {
    return fail(ErrorCode::kInvalidArgument, "RISORIUS_SIMD",
                std::string("this instruction set is not available; there are: ") +
                    simd::available_kernels());
  }
  core::Budget own = budget_for(dna);
  KeptMatrices kept;
  const bool finite = warnings.empty();  // there is one for each list with a number that is not
  core::Budget& budget = options.budget != nullptr ? *options.budget : own;
  auto out = compile_parts(dna, finite, options, budget, kept);
  if (!out) return core::Unexpected{out.error()};
  if (options.precision == Precision::kFloat16) return rig::make_rig(*out, *kernels);
  return rig::make_rig(*out, *kernels,
                       {kept.size, [&](std::span<float> values) { kept.write(values); }});
}

}  // namespace risorius::compile
