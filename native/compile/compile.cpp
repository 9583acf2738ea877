// SPDX-License-Identifier: MIT
#include "compile/compile.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <numeric>
#include <queue>
#include <span>
#include <string_view>

#include "dna/io.h"
#include "simd/half.h"

namespace risorius::compile {

namespace {

using core::Array;
using core::ErrorCode;
using core::fail;
using core::ok;
using core::Result;
using core::Status;
using rig::RigData;

constexpr std::uint32_t kNobody = UINT32_MAX;

std::vector<bool> quaternion_joint_flags(const dna::Dna& dna) {
  std::vector<bool> flags(dna.definition.joint_names.size(), false);
  const auto& entries = dna.joint_behavior_metadata.joint_representations;
  for (std::size_t j = 0; j < entries.size() && j < flags.size(); ++j) {
    flags[j] = entries[j].rotation == 1;
  }
  return flags;
}

void add_text(std::string_view text, RigData& out) {
  out.text.insert(out.text.end(), text.begin(), text.end());
  out.text_ends.push_back(static_cast<std::uint32_t>(out.text.size()));
}

void count_controls(const dna::Dna& dna, RigData& out) {
  const dna::ControlCounts counts = dna::control_counts(dna);
  out.raw_count = counts.raw;
  out.psd_count = counts.psd;
  out.control_count = counts.total();
  const auto ignore = [&](const char* id, bool has_content) {
    if (has_content) add_text(id, out);
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

std::vector<std::uint32_t> row_counts(const Array<std::uint16_t>& lods, std::uint32_t lod_count) {
  std::vector<std::uint32_t> counts;
  for (std::uint32_t l = 0; l < lod_count && l < lods.size(); ++l) counts.push_back(lods[l]);
  return counts;
}

void compile_neutral(const dna::Dna& dna, RigData& out) {
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

// In tiles: both sides are read and written by whole cache lines. Column c goes to
// to[offsets[c] ...], where it is kept.
void transpose(const float* from, std::size_t rows, std::span<const std::uint32_t> offsets,
               float* to) {
  constexpr std::size_t kTile = 16;
  const std::size_t columns = offsets.size();
  for (std::size_t r0 = 0; r0 < rows; r0 += kTile) {
    for (std::size_t c0 = 0; c0 < columns; c0 += kTile) {
      const std::size_t r1 = std::min(rows, r0 + kTile), c1 = std::min(columns, c0 + kTile);
      for (std::size_t c = c0; c < c1; ++c) {
        if (offsets[c] == kNobody) continue;
        for (std::size_t r = r0; r < r1; ++r) to[offsets[c] + r] = from[r * columns + c];
      }
    }
  }
}

// Rows of a group at each LOD. Those beyond what any LOD has are never evaluated and not stored.
core::Result<std::uint32_t> add_lods(const dna::JointGroup& g, const std::string& where,
                                     RigData& out) {
  if (!g.output_indices.empty()) {
    if (Status s = check_lods(g.lods, out.lod_count, where); !s) return std::move(s).propagate();
  }
  std::uint32_t rows = 0;
  for (std::uint32_t l = 0; l < out.lod_count; ++l) {
    const std::uint32_t count = l < g.lods.size() ? g.lods[l] : 0;
    out.joint_group_lods.push_back(count);
    rows = std::max(rows, count);
  }
  return rows;
}

Status compile_joint_group(const dna::JointGroup& g, const std::string& where, RigData& out) {
  if (Status s = check_controls(g.input_indices, out.control_count, where + ".input_indices"); !s) {
    return s;
  }
  const auto rows = add_lods(g, where, out);
  if (!rows) return core::Unexpected{rows.error()};
  rig::JointGroup group;
  group.row_count = *rows;
  group.rows_begin = static_cast<std::uint32_t>(out.joint_outputs.size());
  out.joint_outputs.insert(out.joint_outputs.end(), g.output_indices.begin(),
                           g.output_indices.begin() + *rows);
  out.joint_groups.push_back(group);
  return ok();
}

// The lowest row in which each column has a value: at LODs with fewer rows it does nothing.
std::vector<std::uint32_t> first_rows_with_values(const dna::JointGroup& g, std::uint32_t rows) {
  const std::size_t columns = g.input_indices.size();
  std::vector<std::uint32_t> first(columns, rows);
  std::size_t missing = columns;
  for (std::uint32_t r = 0; r < rows && missing > 0; ++r) {
    const float* row = g.values.data() + r * columns;
    for (std::size_t c = 0; c < columns; ++c) {
      if (first[c] < rows || row[c] == 0.0f) continue;
      first[c] = r;
      --missing;
    }
  }
  return first;
}

// [LOD][control]: something reads it there.
using Used = std::vector<std::vector<bool>>;

struct ColumnEntry {
  std::uint16_t control;
  std::uint32_t group, column;
};

// The columns that have any value, by control and group: what a control drives lies together.
std::vector<ColumnEntry> list_columns(const dna::Dna& dna, RigData& out, Used& used) {
  std::vector<ColumnEntry> entries;
  for (std::uint32_t i = 0; i < out.joint_groups.size(); ++i) {
    rig::JointGroup& g = out.joint_groups[i];
    const dna::JointGroup& source = dna.behavior.joint_groups[i];
    const std::vector<std::uint32_t> first = first_rows_with_values(source, g.row_count);
    g.columns_begin = out.list_count;
    for (std::uint32_t c = 0; c < first.size(); ++c) {
      if (first[c] == g.row_count) continue;
      ++g.column_count;
      const std::uint16_t control = source.input_indices[c];
      entries.push_back({control, i, c});
      for (std::uint32_t l = 0; l < out.lod_count; ++l) {
        if (out.joint_group_lods[i * out.lod_count + l] > first[c]) used[l][control] = true;
      }
    }
    out.list_count += g.column_count;
  }
  std::ranges::stable_sort(entries, {}, &ColumnEntry::control);
  return entries;
}

Status compile_columns(const dna::Dna& dna, RigData& out, Used& used) {
  const std::vector<ColumnEntry> entries = list_columns(dna, out, used);
  std::vector<std::vector<std::uint32_t>> offsets;
  for (const dna::JointGroup& g : dna.behavior.joint_groups) {
    offsets.emplace_back(g.input_indices.size(), kNobody);
  }
  std::uint64_t end = 0;
  out.joint_column_begins.assign(out.control_count + std::size_t{1}, 0);
  for (const ColumnEntry& e : entries) {
    const auto offset = static_cast<std::uint32_t>(end);
    offsets[e.group][e.column] = offset;
    out.joint_columns.push_back({offset, e.group});
    ++out.joint_column_begins[e.control + std::size_t{1}];
    end += out.joint_groups[e.group].row_count;
    if (end > UINT32_MAX - simd::kWidest) {
      return fail(ErrorCode::kLimitExceeded, "behavior.joint_groups",
                  "the matrices of all groups hold more values than an index of 32 bits reaches");
    }
  }
  std::partial_sum(out.joint_column_begins.begin(), out.joint_column_begins.end(),
                   out.joint_column_begins.begin());
  out.joint_values.resize(static_cast<std::size_t>(end) + simd::kWidest);  // kernels read on
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    transpose(dna.behavior.joint_groups[i].values.data(), out.joint_groups[i].row_count, offsets[i],
              out.joint_values.data());
  }
  return ok();
}

// Which row each joint attribute takes at a LOD; the last group that writes it wins.
std::vector<std::uint32_t> rows_by_attribute(const RigData& r, std::uint32_t lod) {
  std::vector<std::uint32_t> rows(std::size_t{r.joint_count} * 9, kNobody);
  for (std::size_t i = 0; i < r.joint_groups.size(); ++i) {
    const rig::JointGroup& g = r.joint_groups[i];
    for (std::uint32_t row = 0; row < r.joint_group_lods[i * r.lod_count + lod]; ++row) {
      rows[r.joint_outputs[g.rows_begin + row]] = g.rows_begin + row;
    }
  }
  return rows;
}

// The rows that one block of attributes takes, as pieces of rows that follow each other.
std::vector<simd::Piece> pieces_of(std::span<const std::uint32_t> rows, std::size_t block) {
  std::vector<simd::Piece> pieces;
  std::uint32_t next = kNobody;
  for (std::size_t p = 0; p < rows.size(); ++p) {
    if (rows[p] == kNobody) continue;
    if (rows[p] != next) pieces.push_back({rows[p], 0, static_cast<std::uint16_t>(block)});
    pieces.back().mask = static_cast<std::uint16_t>(pieces.back().mask | (1u << p));
    next = rows[p] + 1;
  }
  if (pieces.empty()) pieces.push_back({0, 0, static_cast<std::uint16_t>(block)});
  return pieces;
}

void compile_pieces(RigData& out) {
  out.extra_begins.push_back(0);
  for (std::uint32_t lod = 0; lod < out.lod_count; ++lod) {
    const std::vector<std::uint32_t> rows = rows_by_attribute(out, lod);
    for (std::size_t at = 0; at < rows.size(); at += simd::kPlaces) {
      const std::size_t count = std::min(simd::kPlaces, rows.size() - at);
      const auto pieces = pieces_of(std::span(rows).subspan(at, count), at / simd::kPlaces);
      out.joint_pieces.push_back(pieces[0]);
      out.extra_pieces.insert(out.extra_pieces.end(), pieces.begin() + 1, pieces.end());
    }
    out.extra_begins.push_back(static_cast<std::uint32_t>(out.extra_pieces.size()));
  }
}

void list_joints_written(RigData& out) {
  std::vector<bool> written(out.joint_count, false);
  for (const std::uint16_t o : out.joint_outputs) written[o / 9u] = true;
  for (std::uint32_t j = 0; j < out.joint_count; ++j) {
    if (written[j]) out.joints_written.push_back(static_cast<std::uint16_t>(j));
  }
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

// The columns that turn a joint at all.
void add_quaternion_terms(const dna::JointGroup& g, const std::array<std::int32_t, 3>& row_of_axis,
                          RigData& out) {
  const std::size_t columns = g.input_indices.size();
  for (std::size_t c = 0; c < columns; ++c) {
    std::array<float, 3> angles{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int32_t r = row_of_axis[axis];
      if (r >= 0) angles[axis] = g.values[static_cast<std::size_t>(r) * columns + c];
    }
    if (angles == std::array<float, 3>{}) continue;
    out.quaternion_terms.push_back({rig::from_euler(out.euler, angles), g.input_indices[c]});
  }
}

// The Euler entries of a column become one quaternion per joint; a missing row is 0.
void compile_quaternion_joints(const dna::JointGroup& g, std::uint32_t group_index,
                               const std::vector<bool>& flags, RigData& out) {
  std::map<std::uint32_t, std::array<std::int32_t, 3>> rows;  // joint -> its rotation rows
  for (std::uint32_t r = 0; r < out.joint_groups[group_index].row_count; ++r) {
    const std::uint32_t joint = g.output_indices[r] / 9u, attribute = g.output_indices[r] % 9u;
    if (attribute < 3 || attribute > 5 || !flags[joint]) continue;
    auto [at, added] = rows.try_emplace(joint, std::array<std::int32_t, 3>{-1, -1, -1});
    at->second[attribute - 3] = static_cast<std::int32_t>(r);
  }
  for (const auto& [joint, row_of_axis] : rows) {
    rig::QuaternionJoint q;
    q.joint = joint;
    q.group = group_index;
    q.first_row = UINT32_MAX;
    for (const std::int32_t r : row_of_axis) {
      if (r >= 0) q.first_row = std::min(q.first_row, static_cast<std::uint32_t>(r));
    }
    q.terms_begin = static_cast<std::uint32_t>(out.quaternion_terms.size());
    add_quaternion_terms(g, row_of_axis, out);
    q.terms_end = static_cast<std::uint32_t>(out.quaternion_terms.size());
    out.quaternion_joints.push_back(q);
  }
}

Status compile_joint_groups(const dna::Dna& dna, RigData& out) {
  const auto& groups = dna.behavior.joint_groups;
  const std::vector<bool> flags = quaternion_joint_flags(dna);
  out.euler = euler_convention(dna);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const std::string where = "behavior.joint_groups[" + std::to_string(i) + "]";
    if (Status s = compile_joint_group(groups[i], where, out); !s) return s;
    compile_quaternion_joints(groups[i], static_cast<std::uint32_t>(i), flags, out);
  }
  compile_pieces(out);
  list_joints_written(out);
  return ok();
}

Status compile_psds(const dna::Dna& dna, RigData& out) {
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
    if (list.size() > UINT16_MAX) {
      return fail(ErrorCode::kLimitExceeded, "behavior.psds",
                  "a corrective with more than 65535 factors");
    }
    for (const std::size_t i : list) {
      psd.weight *= source.values[i];
      out.psd_factors.push_back(source.columns[i]);
    }
    psd.factor_count = static_cast<std::uint16_t>(list.size());
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

std::span<const std::uint16_t> factors(const RigData& r, const rig::Psd& p) {
  return {r.psd_factors.data() + p.factors_begin, p.factor_count};
}

// Factors before what uses them, ties by ascending output; members of a cycle and what hangs on
// them come last.
std::vector<std::uint32_t> dependency_order(const RigData& r,
                                            const std::vector<std::uint32_t>& psds) {
  constexpr std::uint32_t kNone = UINT32_MAX;
  std::vector<std::uint32_t> psd_of_control(r.control_count, kNone);
  for (const std::uint32_t p : psds) psd_of_control[r.psds[p].output] = p;
  std::vector<std::vector<std::uint32_t>> users(r.psds.size());
  std::vector<std::uint32_t> waiting_for(r.psds.size(), 0);
  std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> ready;
  for (const std::uint32_t p : psds) {
    for (const std::uint16_t factor : factors(r, r.psds[p])) {
      const std::uint32_t source = psd_of_control[factor];
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

// Which factor watches each corrective; kNobody where a corrective is among the factors.
std::vector<std::uint32_t> choose_watchers(const RigData& r) {
  std::vector<std::uint32_t> load(r.control_count, 0), watchers;
  for (const rig::Psd& p : r.psds) {
    std::uint32_t watcher = kNobody;
    for (const std::uint16_t f : factors(r, p)) {
      if (f >= r.raw_count && f < r.raw_count + r.psd_count) {
        watcher = kNobody;
        break;
      }
      if (watcher == kNobody || load[f] < load[watcher]) watcher = f;
    }
    if (watcher != kNobody) ++load[watcher];
    watchers.push_back(watcher);
  }
  return watchers;
}

std::uint16_t another_factor(const RigData& r, const rig::Psd& p, std::uint32_t watcher) {
  for (const std::uint16_t f : factors(r, p)) {
    if (f != watcher) return f;
  }
  return static_cast<std::uint16_t>(watcher);
}

void schedule_psds(const Used& used, RigData& r) {
  const std::vector<std::uint32_t> watchers = choose_watchers(r);
  r.chained_begins.push_back(0);
  for (std::uint32_t lod = 0; lod < r.lod_count; ++lod) {
    std::vector<std::uint32_t> chained;
    std::vector<std::vector<rig::Watch>> watched(r.control_count);
    for (std::uint32_t p = 0; p < r.psds.size(); ++p) {
      if (!used[lod][r.psds[p].output]) continue;
      if (watchers[p] == kNobody) {
        chained.push_back(p);
      } else {
        watched[watchers[p]].push_back(
            {static_cast<std::uint16_t>(p), another_factor(r, r.psds[p], watchers[p])});
      }
    }
    for (const auto& list : watched) {
      r.watch_begins.push_back(static_cast<std::uint32_t>(r.watched.size()));
      r.watched.insert(r.watched.end(), list.begin(), list.end());
    }
    r.watch_begins.push_back(static_cast<std::uint32_t>(r.watched.size()));
    for (const std::uint32_t p : dependency_order(r, chained)) {
      r.chained.push_back(static_cast<std::uint16_t>(p));
    }
    r.chained_begins.push_back(static_cast<std::uint32_t>(r.chained.size()));
  }
}

Status compile_channels_and_maps(const dna::Dna& dna, RigData& out) {
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
    out.shape_lods = row_counts(s.lods, out.lod_count);
  }
  out.map_rows = compile_table(m.conditionals);
  if (!map_inputs.empty()) {
    if (Status c = check_lods(m.lods, out.lod_count, maps); !c) return c;
    out.map_lods = row_counts(m.lods, out.lod_count);
  }
  out.shape_inputs.assign(s.input_indices.begin(), s.input_indices.end());
  out.shape_outputs.assign(s.output_indices.begin(), s.output_indices.end());
  return ok();
}

Status narrow(RigData& out) {
  out.joint_halves.reserve(out.joint_values.size());
  for (const float v : out.joint_values) {
    if (!(std::fabs(v) <= simd::kLargestHalf)) {
      return fail(ErrorCode::kInvalidValue, "behavior.joint_groups",
                  "the joint value " + std::to_string(v) + " does not fit a float16 (65504)");
    }
    out.joint_halves.push_back(simd::to_half(v));
  }
  out.joint_values = {};
  return ok();
}

}  // namespace

Result<rig::Rig> compile(const dna::Dna& dna, const CompileOptions& options) {
  std::vector<dna::Warning> warnings;
  if (Status s = dna::validate(dna, warnings); !s) return std::move(s).propagate();
  const simd::Kernels* kernels =
      options.kernels != nullptr ? options.kernels : simd::find_kernels(nullptr);
  if (kernels == nullptr) {
    return fail(ErrorCode::kInvalidArgument, "RISORIUS_SIMD",
                std::string("this instruction set is not available; there are: ") +
                    simd::available_kernels());
  }
  RigData out;
  out.lod_count = dna.descriptor.lod_count;
  for (const std::string& name : dna.definition.raw_control_names) add_text(name, out);
  for (const std::string& name : dna.definition.gui_control_names) add_text(name, out);
  out.gui_count = static_cast<std::uint32_t>(dna.definition.gui_control_names.size());
  count_controls(dna, out);
  compile_neutral(dna, out);
  out.gui_rows = compile_table(dna.behavior.gui_to_raw);
  if (Status s = compile_joint_groups(dna, out); !s) return std::move(s).propagate();
  if (Status s = compile_channels_and_maps(dna, out); !s) return std::move(s).propagate();
  if (Status s = compile_psds(dna, out); !s) return std::move(s).propagate();
  Used used(out.lod_count, std::vector<bool>(out.control_count, false));
  if (Status s = compile_columns(dna, out, used); !s) return std::move(s).propagate();
  mark_channels_and_maps(out, used);
  schedule_psds(used, out);
  if (options.precision == Precision::kFloat16) {
    if (Status s = narrow(out); !s) return std::move(s).propagate();
  }
  return rig::make_rig(out, *kernels);
}

}  // namespace risorius::compile
