// SPDX-License-Identifier: MIT
// Checks every index of a block against the size of the array that it points into.
#include "rig/check.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

namespace risorius::rig {

namespace {

using core::ErrorCode;
using core::fail;
using core::Status;

// Checks indices of the arrays, and remembers the first array with a wrong one.
class IndexCheck {
 public:
  template <class T, class Get>
  void below(const char* where, const T& values, std::uint64_t limit, Get get) {
    std::uint64_t most = 0;
    for (const auto& v : values) most = std::max<std::uint64_t>(most, get(v));
    if (!values.empty() && most >= limit && where_ == nullptr) where_ = where;
  }
  void below(const char* where, View<std::uint16_t> values, std::uint64_t limit) {
    below(where, values, limit, [](std::uint16_t v) { return v; });
  }
  /// Demands that the values ascend and that the last one equals the size of the array into which
  /// they point.
  void begins(const char* where, View<std::uint32_t> values, std::size_t size) {
    demand(where, std::ranges::is_sorted(values) && (values.empty() || values.back() == size));
  }
  void demand(const char* where, bool holds) {
    if (!holds && where_ == nullptr) where_ = where;
  }
  Status status() const {
    if (where_ == nullptr) return core::ok();
    return fail(ErrorCode::kInvalidIndex, std::string("rig.") + where_,
                "an index in it points outside its range");
  }

 private:
  const char* where_ = nullptr;
};

void check_convention(const EulerConvention& e, IndexCheck& c) {
  const unsigned axes =
      (1u << (e.order[0] & 31)) | (1u << (e.order[1] & 31)) | (1u << (e.order[2] & 31));
  c.demand("header", axes == 7 && e.order[0] < 3 && e.order[1] < 3 && e.order[2] < 3);
}

void check_sizes(const Rig& r, IndexCheck& c) {
  const std::uint64_t lods = r.lod_count;
  c.demand("header", std::uint64_t{r.raw_count} + r.psd_count <= r.control_count &&
                         r.control_count <= 65536 && r.joint_count <= 65536 &&
                         r.blend_shape_count <= 65536 && r.animated_map_count <= 65536);
  c.demand("text_ends", r.text_ends.size() >= std::uint64_t{r.raw_count} + r.gui_count);
  c.begins("text_ends", r.text_ends, r.text.size());
  c.demand("neutral_joints",
           r.neutral_joints.size() == std::uint64_t{r.joint_count} * r.joint_stride);
  c.demand("psds", r.psds.size() <= 65536);
  c.demand("header", r.joint_stride == 9 || r.joint_stride == 10);
  c.demand("initial_controls", r.initial_controls.size() == r.control_count);
  c.demand("watch_begins", r.watch_begins.size() == lods * (r.control_count + 1));
  c.demand("step_begins", r.step_begins.size() == lods * kStepLists + 1);
  c.demand("joint_group_lods", r.joint_group_lods.size() == lods * r.joint_groups.size());
  c.demand("live_groups", r.live_groups.size() == lods);
  c.demand("euler_joint_lods", r.euler_joint_lods.size() == lods);
  c.demand("joint_values", r.joint_values.empty() || r.joint_halves.empty());
  c.demand("group_columns", r.group_columns.size() == r.joint_columns.size());
  c.demand("control_reads",
           r.control_reads.empty() || r.control_reads.size() == lods * (r.control_count + 1));
  c.demand("joint_column_begins", r.joint_column_begins.size() == r.control_count + std::size_t{1});
  c.demand("shape_outputs", r.shape_outputs.size() == r.shape_inputs.size());
  c.demand("shape_lods", r.shape_lods.empty() || r.shape_lods.size() == lods);
  c.demand("map_lods", r.map_lods.empty() || r.map_lods.size() == lods);
  check_convention(r.euler, c);
  check_convention(r.ml_euler, c);
}

void check_correctives(const Rig& r, IndexCheck& c) {
  c.below("psd_factors", r.psd_factors, r.control_count);
  c.begins("watch_begins", r.watch_begins, r.watched.size());
  c.below("watched", r.watched, r.psds.size(), [](const Watch& w) { return w.psd; });
  c.below("watched", r.watched, r.control_count, [](const Watch& w) { return w.other; });
  if (!c.status()) return;
  for (const Watch& w : r.watched) c.demand("watched", r.psds[w.psd].output >= r.raw_count);
  // A corrective must be in at most one list of a LOD, because Workspace::firing has one place for
  // each corrective.
  std::vector<std::uint32_t> seen(r.psds.size(), kNone);
  for (std::uint32_t l = 0; l < r.lod_count; ++l) {
    const std::uint32_t* begins = r.watch_begins.data() + std::size_t{l} * (r.control_count + 1);
    for (std::uint32_t i = begins[0]; i < begins[r.control_count]; ++i) {
      c.demand("watched", std::exchange(seen[r.watched[i].psd], l) != l);
    }
  }
  for (const Psd& p : r.psds) {
    c.demand("psds", p.output < r.raw_count + r.psd_count &&
                         std::uint64_t{p.factors_begin} + p.factor_count <= r.psd_factors.size());
  }
}

// Checks group_columns. A kernel computes whole SIMD registers, so from each column it may read as
// many values as the group has rows, rounded up to a multiple of simd::kWidest. These values must
// be inside the matrices, and the control of the column must exist.
void check_group_columns(const Rig& r, std::uint64_t values, IndexCheck& c) {
  std::size_t i = 0;
  for (const JointGroup& g : r.joint_groups) {
    for (std::uint32_t n = 0; n < g.column_count && i < r.group_columns.size(); ++n, ++i) {
      const simd::Column& column = r.group_columns[i];
      const std::uint64_t end = column.offset + std::uint64_t{simd::rounded_up(g.row_count)};
      c.demand("group_columns", end <= values && column.weight < r.control_count);
    }
  }
}

void check_groups(const Rig& r, IndexCheck& c) {
  const std::uint64_t values = r.is_half() ? r.joint_halves.size() : r.joint_values.size();
  c.below("joint_outputs", r.joint_outputs, std::uint64_t{r.joint_count} * r.joint_stride);
  c.below("joints_written", r.joints_written, r.joint_count);
  c.begins("joint_column_begins", r.joint_column_begins, r.joint_columns.size());
  std::vector<std::uint32_t> columns(r.joint_groups.size());
  for (const JointColumn& column : r.joint_columns) {
    if (column.group >= columns.size()) return c.demand("joint_columns", false);
    ++columns[column.group];
    const std::uint64_t end =
        column.offset + simd::rounded_up(r.joint_groups[column.group].row_count);
    // Evaluation reads the first value of a column even if the column has no rows.
    c.demand("joint_columns", end <= values && column.offset < values);
  }
  check_group_columns(r, values, c);
  std::uint64_t rows = 0, begin = 0;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const JointGroup& g = r.joint_groups[i];
    // Small groups follow each other without gaps, although a kernel writes whole registers and so
    // also overwrites the first rows of the next group, which is computed later. Groups of at least
    // kWidest rows begin at a multiple of kWidest rows.
    const bool wide = g.row_count >= simd::kWidest;
    if (wide) rows = simd::rounded_up(rows);
    c.demand("joint_groups",
             columns[i] == g.column_count && g.rows_begin == rows && g.columns_begin == begin);
    rows += wide ? simd::rounded_up(std::uint64_t{g.row_count}) : g.row_count;
    begin += g.column_count;
    for (std::uint32_t l = 0; l < r.lod_count; ++l) {
      c.demand("joint_group_lods", r.joint_group_lods[i * r.lod_count + l] <= g.row_count);
    }
  }
  c.demand("joint_groups", rows == r.joint_outputs.size());
  const auto most = [](std::uint32_t v) { return v; };
  c.below("live_groups", r.live_groups, r.joint_groups.size() + 1, most);
}

// The pieces of a LOD may only copy rows that it computes: other rows still have the values of
// earlier frames.
void check_live_pieces(const Rig& r, std::uint32_t lod, IndexCheck& c) {
  // [rows + 1]: how many of the rows before each row the LOD computes.
  std::vector<std::uint32_t> live_before(r.joint_outputs.size() + 1);
  for (std::uint32_t i = 0; i < r.live_groups[lod]; ++i) {
    const std::uint32_t rows = r.joint_group_lods[std::size_t{i} * r.lod_count + lod];
    for (std::uint32_t row = 0; row < rows; ++row) {
      live_before[r.joint_groups[i].rows_begin + row + 1] = 1;
    }
  }
  std::partial_sum(live_before.begin(), live_before.end(), live_before.begin());
  const auto demand = [&](const char* where, View<simd::Piece> pieces) {
    for (const simd::Piece& p : pieces) {
      const auto taken = static_cast<std::uint32_t>(std::popcount(p.mask));
      c.demand(where, live_before[p.from + taken] - live_before[p.from] == taken);
    }
  };
  const std::size_t blocks = r.joint_pieces.size() / r.lod_count;
  demand("joint_pieces", r.joint_pieces.subspan(lod * blocks, blocks));
  const std::uint32_t* extra = r.extra_begins.data() + lod;
  demand("extra_pieces", r.extra_pieces.subspan(extra[0], extra[1] - extra[0]));
}

// Whether the extra pieces of each LOD are sorted by block, because evaluation looks them up by
// block.
bool in_order(const Rig& r) {
  for (std::size_t l = 0; l + 1 < r.extra_begins.size(); ++l) {
    const std::uint32_t* begin = r.extra_begins.data() + l;
    if (begin[0] > begin[1] || begin[1] > r.extra_pieces.size() ||
        !std::ranges::is_sorted(r.extra_pieces.subspan(begin[0], begin[1] - begin[0]), {},
                                &simd::Piece::block)) {
      return false;
    }
  }
  return true;
}

void check_pieces(const Rig& r, IndexCheck& c) {
  const std::uint64_t places = std::uint64_t{r.joint_count} * r.joint_stride;
  const std::uint64_t blocks = (places + simd::kPlaces - 1) / simd::kPlaces;
  const std::uint32_t last = places % simd::kPlaces == 0 ? 0xFFFFu : (1u << (places % 16)) - 1u;
  c.demand("joint_pieces", r.joint_pieces.size() == blocks * r.lod_count);
  c.demand("extra_begins", r.extra_begins.size() == r.lod_count + std::size_t{1});
  c.begins("extra_begins", r.extra_begins, r.extra_pieces.size());
  for (const auto& [where, pieces] :
       {std::pair{"joint_pieces", r.joint_pieces}, std::pair{"extra_pieces", r.extra_pieces}}) {
    for (const simd::Piece& p : pieces) {
      const auto taken = static_cast<std::uint64_t>(std::popcount(p.mask));
      c.demand(where, p.from + taken <= r.joint_outputs.size());
    }
  }
  for (const simd::Piece& p : r.extra_pieces) {
    c.demand("extra_pieces", p.block < blocks && (p.block + 1u < blocks || (p.mask & ~last) == 0));
  }
  // Each block of attributes that a group writes must be in the group's range of blocks, because
  // evaluation skips the blocks outside of it.
  for (const JointGroup& g : r.joint_groups) {
    c.demand("joint_groups", g.blocks_begin <= g.blocks_end && g.blocks_end <= blocks);
    for (std::uint32_t row = 0; row < g.row_count && c.status(); ++row) {
      const std::size_t block = r.joint_outputs[g.rows_begin + row] / simd::kPlaces;
      c.demand("joint_groups", g.blocks_begin <= block && block < g.blocks_end);
    }
  }
  c.demand("extra_pieces", in_order(r));
  for (std::uint32_t lod = 0; lod < r.lod_count && c.status(); ++lod) check_live_pieces(r, lod, c);
}

bool inside(std::uint64_t begin, std::uint64_t count, std::size_t size) {
  return begin + count <= size;
}

void check_steps(const Rig& r, IndexCheck& c) {
  c.begins("step_begins", r.step_begins, r.steps.size());
  if (!r.step_begins.empty()) c.demand("step_begins", r.step_begins.front() == 0);
  for (const std::uint32_t step : r.steps) {
    const std::uint32_t i = step_index(step);
    switch (step_kind(step)) {
      case StepKind::kOperation:
        c.demand("steps", i < r.ml_operations.size());
        break;
      case StepKind::kSolver:
        c.demand("steps", i < r.rbf_solvers.size());
        break;
      case StepKind::kPsd:
        c.demand("steps", i < r.psds.size());
        break;
      default:
        c.demand("steps", false);
    }
  }
  // Correctives may only be in the lists kChained and kCyclic.
  for (std::size_t i = 0; i + 1 < r.step_begins.size() && c.status(); ++i) {
    if (i % kStepLists != kEarly && i % kStepLists != kReference) continue;
    for (std::uint32_t s = r.step_begins[i]; s < r.step_begins[i + 1]; ++s) {
      c.demand("steps", step_kind(r.steps[s]) != StepKind::kPsd);
    }
  }
}

void check_quaternions(const Rig& r, IndexCheck& c) {
  const auto same = [](std::uint32_t v) { return v; };
  for (const QuaternionJoint& q : r.quaternion_joints) {
    c.demand("quaternion_joints", q.joint < r.joint_count && q.group < r.joint_groups.size());
  }
  for (const QuaternionColumn& q : r.quaternion_columns) {
    c.demand("quaternion_columns", q.control < r.control_count && q.terms_begin <= q.terms_end &&
                                       q.terms_end <= r.quaternion_terms.size());
  }
  c.below("quaternion_terms", r.quaternion_terms, r.quaternion_joints.size(),
          [](const QuaternionTerm& t) { return t.slot; });
  c.demand("quaternion_column_begins",
           r.quaternion_joints.empty() ||
               r.quaternion_column_begins.size() == r.control_count + std::size_t{1});
  c.begins("quaternion_column_begins", r.quaternion_column_begins, r.quaternion_column_list.size());
  c.below("quaternion_column_list", r.quaternion_column_list, r.quaternion_columns.size(), same);
  c.below("euler_joints", r.euler_joints, r.joint_count);
  c.below("euler_joint_lods", r.euler_joint_lods, r.euler_joints.size() + 1, same);
}

void check_solvers(const Rig& r, IndexCheck& c) {
  c.below("rbf_inputs", r.rbf_inputs, r.control_count);
  c.below("rbf_pose_inputs", r.rbf_pose_inputs, r.control_count);
  c.below("rbf_outputs", r.rbf_outputs, r.control_count,
          [](const RbfOutput& o) { return o.control; });
  std::uint32_t inputs = 0, poses = 0;
  for (const RbfSolver& s : r.rbf_solvers) {
    inputs = std::max(inputs, s.input_count);
    poses = std::max(poses, s.pose_count);
    const std::uint64_t square = std::uint64_t{s.pose_count} * s.pose_count;
    c.demand("rbf_solvers",
             s.axis < 3 && inside(s.inputs_begin, s.input_count, r.rbf_inputs.size()) &&
                 inside(s.poses_begin, s.pose_count, r.rbf_poses.size()) &&
                 inside(s.targets_begin, std::uint64_t{s.pose_count} * s.input_count,
                        r.rbf_targets.size()) &&
                 (s.interpolative == 0 || inside(s.inverse_begin, square, r.rbf_inverses.size())));
  }
  c.demand("header", inputs == r.solver_inputs && poses == r.solver_poses);
  for (const RbfPose& p : r.rbf_poses) {
    c.demand("rbf_poses", inside(p.inputs_begin, p.input_count, r.rbf_pose_inputs.size()) &&
                              inside(p.outputs_begin, p.output_count, r.rbf_outputs.size()));
  }
}

void check_operation(const Rig& r, const MlOperation& op, IndexCheck& c) {
  const bool layers = op.kind == MlOperation::kMlp;
  c.demand("ml_operations", (op.mask == kNone || op.mask < r.mask_count) &&
                                inside(op.values_begin, op.value_count, r.operation_values) &&
                                inside(op.segments_begin, op.segment_count, r.ml_segments.size()) &&
                                inside(op.items_begin, op.item_count,
                                       layers ? r.ml_layers.size() : r.ml_controls.size()));
  if (op.kind != MlOperation::kGather || !c.status()) return;
  c.demand("ml_operations", op.value_count <= op.item_count);
  for (std::uint32_t i = 0; i < op.item_count; ++i) {
    c.demand("ml_controls", r.ml_controls[op.items_begin + i].control != kNone);
  }
}

void check_networks(const Rig& r, IndexCheck& c) {
  for (const MlOperation& op : r.ml_operations) check_operation(r, op, c);
  c.demand("header", detail::scratch_fits(r));
  for (const MlSegment& s : r.ml_segments) {
    c.demand("ml_segments", inside(s.begin, s.count, r.operation_values));
  }
  for (const MlControl& m : r.ml_controls) {
    c.demand("ml_controls", m.control < r.control_count || m.control == kNone);
  }
  c.demand("ml_layer_rows", r.ml_layer_rows.size() == r.ml_layers.size() * r.lod_count);
  std::uint32_t widest = 0;
  for (std::size_t i = 0; i < r.ml_layers.size() && c.status(); ++i) {
    const MlLayer& l = r.ml_layers[i];
    const std::uint64_t weights = (std::uint64_t{l.columns} + 1) * l.rows + simd::kWidest;
    c.demand("ml_layers", inside(l.weights_begin, weights, r.ml_weights.size()) &&
                              (l.rows > 0 || l.columns == 0));
    widest = std::max({widest, l.rows, l.columns});
    for (std::uint32_t lod = 0; lod < r.lod_count; ++lod) {
      c.demand("ml_layer_rows", r.ml_layer_rows[i * r.lod_count + lod] <= l.rows);
    }
  }
  c.demand("header", widest == r.widest_layer && widest < 0x1000000);
}

void check_moved_joints(const Rig& r, IndexCheck& c) {
  c.demand("ml_joint_lods", r.ml_joint_lods.size() == r.ml_joints.size() * r.lod_count);
  for (const MlJoint& j : r.ml_joints) {
    c.demand("ml_joints", j.joint < r.joint_count);
    for (const std::uint32_t control : j.controls) {
      c.demand("ml_joints", control < r.control_count || control == kNone);
    }
  }
  for (const TwistSwing& t : r.twist_swings) {
    for (const std::uint32_t input : t.inputs) c.demand("twist_swings", input < r.control_count);
    c.demand("twist_swings", t.axis < 3 && t.outputs_begin <= t.outputs_end &&
                                 t.outputs_end <= r.twist_swing_outputs.size());
  }
  c.below("twist_swing_outputs", r.twist_swing_outputs, r.joint_count,
          [](const TwistSwingOutput& o) { return o.joint; });
}

void check_gui_ranges(const Rig& r, IndexCheck& c) {
  for (const GuiRange& g : r.gui_ranges) {
    c.demand("gui_ranges", g.gui < r.gui_count && g.rows_begin <= g.rows_end &&
                               g.rows_end <= r.gui_range_rows.size());
  }
  c.below("gui_range_rows", r.gui_range_rows, r.gui_rows.size(), [](std::uint32_t v) { return v; });
}

// Whether the first `count` values are consecutive integers, each one more than the value before.
bool is_run(View<std::uint16_t> list, std::size_t count) {
  if (count > list.size()) return false;
  for (std::size_t i = 1; i < count; ++i) {
    if (list[i] != list[i - 1] + 1) return false;
  }
  return true;
}

void check_table(const char* where, View<ConditionalRow> rows, std::uint64_t inputs,
                 std::uint64_t outputs, IndexCheck& c) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    c.demand(where, rows[i].input < inputs && rows[i].output < outputs && rows[i].run_end > i &&
                        rows[i].run_end <= rows.size());
  }
}

}  // namespace

bool detail::scratch_fits(const Rig& r) {
  std::uint64_t values = 0;
  for (const MlOperation& op : r.ml_operations) values += op.value_count;
  const std::uint64_t most = (std::uint64_t{1} << 20) + 64 * std::uint64_t{r.memory_bytes()};
  return r.operation_values <= values &&
         sizeof(float) * (std::uint64_t{r.operation_values} + r.mask_count) <= most;
}

Status detail::check_everything(const Rig& r) {
  IndexCheck c;
  check_sizes(r, c);
  RISORIUS_TRY(c.status());
  check_correctives(r, c);
  check_groups(r, c);
  check_pieces(r, c);
  check_steps(r, c);
  check_quaternions(r, c);
  check_solvers(r, c);
  check_networks(r, c);
  check_moved_joints(r, c);
  check_gui_ranges(r, c);
  c.below("shape_inputs", r.shape_inputs, r.control_count);
  c.below("shape_outputs", r.shape_outputs, r.blend_shape_count);
  c.demand("header", is_run(r.shape_inputs, r.shape_run) && is_run(r.shape_outputs, r.shape_run));
  const auto most = [](std::uint32_t v) { return v; };
  c.below("shape_lods", r.shape_lods, r.shape_inputs.size() + 1, most);
  c.demand("shape_begins",
           r.shape_begins.empty() || r.shape_begins.size() == r.control_count + std::size_t{1});
  c.begins("shape_begins", r.shape_begins, r.shapes_of_controls.size());
  c.below("shapes_of_controls", r.shapes_of_controls, r.shape_inputs.size());
  c.below("map_lods", r.map_lods, r.map_rows.size() + 1, most);
  c.below("map_runs", r.map_runs, r.control_count, [](const RowRun& run) { return run.input; });
  c.below("map_runs", r.map_runs, r.map_rows.size(), [](const RowRun& run) { return run.begin; });
  check_table("gui_rows", r.gui_rows, r.gui_count, r.raw_count, c);
  check_table("map_rows", r.map_rows, r.control_count, r.animated_map_count, c);
  return c.status();
}

}  // namespace risorius::rig
