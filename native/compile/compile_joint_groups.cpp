// SPDX-License-Identifier: MIT
// Compiles the joint groups, the matrices from controls (columns) to joint attributes (rows). The
// file stores them by rows, the Rig stores the columns with a value other than 0, sorted by
// control. Joint attributes are divided into blocks of 16, which take their values from rows.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>
#include <string>

#include "compile/kept_matrices.h"
#include "compile/parts.h"
#include "core/finite.h"
#include "simd/four.h"
#include "simd/half.h"

namespace risorius::compile::detail {

namespace {

using core::ErrorCode;
using core::fail;
using core::ok;

// Whether four columns are adjacent in the group's matrix in the file. They need not be, because a
// group may list its controls in any order.
bool side_by_side(const KeptColumn* four) {
  bool all = true;
  for (std::uint32_t i = 1; i < 4; ++i) all = all && four[i].column == four[0].column + i;
  return all;
}

// Copies columns of a matrix that is stored by rows, each column to one run of memory. The values
// are copied in tiles, four columns at a time, so that whole cache lines are read and written.
// In: from     [rows, stride] the matrix
//     columns  the copied columns, with their offsets in `to`
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

}  // namespace

void KeptMatrices::write(std::span<float> to) const {
  for (const auto& [first, end] : gaps) {
    std::fill(to.begin() + first, to.begin() + end, 0.0f);
  }
  for (const Matrix& m : matrices) {
    transpose(m.group->values.data(), m.rows, m.group->input_indices.size(), m.columns, to.data());
  }
}

namespace {

// Appends the number of a group's rows at each LOD to out.joint_group_lods. Out: the largest of
// these numbers; further rows are not stored, because no LOD evaluates them
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

}  // namespace

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

namespace {

Status compile_joint_group(const dna::JointGroup& g, const std::string& where, RigData& out) {
  RISORIUS_TRY(check_controls(g.input_indices, out.control_count, where + ".input_indices"));
  const auto rows = add_lods(g, where, out);
  if (!rows) return core::Unexpected{rows.error()};
  rig::JointGroup group;
  group.row_count = *rows;
  std::vector<std::uint16_t>& outputs = out.joint_outputs;
  // The rows of a group with at least kWidest rows are padded to whole vectors. Padding rows are
  // not written to poses.
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

// The first row in which each column has a value other than 0, `rows` if there is none. At a LOD
// with no more rows than this the column has no effect.
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

// Sorts columns by control; columns of one control stay in order.
std::vector<ColumnEntry> by_control(const std::vector<ColumnEntry>& entries,
                                    std::uint32_t control_count) {
  std::vector<std::size_t> next(control_count + std::size_t{1});
  for (const ColumnEntry& e : entries) ++next[e.control + std::size_t{1}];
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<ColumnEntry> out(entries.size());
  for (const ColumnEntry& e : entries) out[next[e.control]++] = e;
  return out;
}

// The columns that have a value other than 0, sorted by control and then by group. Marks their
// controls in `used`.
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

// Lists the columns of `entries` sorted by group and then by control.
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

// Counts the columns and values that each control, and all controls together, read at each LOD.
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

// Assigns each column its offset in the rig's joint_values. The columns are sorted by control, and
// the columns of one control by group.
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
    // Columns of at least kWidest rows begin on whole vectors; shorter columns are stored without
    // gaps.
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
  leave(end + simd::kWidest);  // kernels read past the last column
  kept.size = static_cast<std::size_t>(end);
  return ok();
}

// Whether all values of the joint matrices are finite. Columns that are not stored need no
// exception, because all their values are 0.
bool all_finite(const KeptMatrices& kept) {
  return std::ranges::all_of(kept.matrices, [](const KeptMatrices::Matrix& m) {
    const std::size_t count = m.rows * m.group->input_indices.size();
    return core::all_finite(std::span<const float>(m.group->values.data(), count));
  });
}

}  // namespace

Status compile_columns(const Groups& groups, bool finite, RigData& out, KeptMatrices& kept,
                       Used& used) {
  const std::vector<ColumnEntry> entries = list_columns(groups, out, used);
  RISORIUS_TRY(place_columns(groups, entries, out, kept));
  list_by_group(entries, out);
  // With these counts the evaluator may read all columns if that costs less than selecting the
  // columns of controls other than 0. All values must be finite, because 0 times infinity is not 0.
  if (finite || all_finite(kept)) count_reads(entries, out);
  return ok();
}

namespace {

// [joint attributes] the row that gives the attribute its value at a LOD, or kNone. If several
// groups write an attribute, the last of them in the file counts.
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

// Lists the rows from which one block of attributes takes its values, as pieces of consecutive
// rows: the first piece in joint_pieces, the others in extra_pieces.
// In: rows  the row of each attribute of the block, or kNone
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

// Sets blocks_begin and blocks_end of each group: the blocks of attributes from the first to the
// last that rows of the group write.
void find_blocks(RigData& out) {
  for (rig::JointGroup& g : out.joint_groups) {
    const auto rows = std::span(out.joint_outputs).subspan(g.rows_begin, g.row_count);
    if (rows.empty()) continue;
    const auto [least, most] = std::ranges::minmax(rows);
    g.blocks_begin = static_cast<std::uint32_t>(least / simd::kPlaces);
    g.blocks_end = static_cast<std::uint32_t>(most / simd::kPlaces + 1);
  }
}

}  // namespace

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

void list_joints_written(RigData& out) {
  std::vector<bool> written(out.joint_count, false);
  for (const std::uint16_t row : out.joint_outputs) written[row / 9u] = true;
  for (const rig::TwistSwingOutput& t : out.twist_swing_outputs) written[t.joint] = true;
  for (const rig::MlJoint& m : out.ml_joints) written[m.joint] = true;
  for (std::uint32_t j = 0; j < out.joint_count; ++j) {
    if (written[j]) out.joints_written.push_back(static_cast<std::uint16_t>(j));
  }
}

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

}  // namespace risorius::compile::detail
