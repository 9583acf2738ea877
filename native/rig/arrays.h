// SPDX-License-Identifier: MIT
// The arrays of a compiled face: as vectors while it is compiled, as views into one block after.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "rig/quaternion.h"
#include "simd/kernels.h"

namespace risorius::rig {

/// One row of a conditional table: from <= in <= to gives out += slope * in + cut.
struct ConditionalRow {
  std::uint16_t input = 0, output = 0;
  float from = 0, to = 0, slope = 0, cut = 0;  // from <= to
  std::uint32_t run_end = 0;                   // first row after the run of equal (input, output)
};

/// A corrective: min(1, weight * product of its factors, each clamped to [0, 1]).
struct Psd {
  std::uint16_t output = 0;  // control index
  std::uint16_t factor_count = 0;
  std::uint32_t factors_begin = 0;
  float weight = 1;
};

/// A dense matrix from controls to joint attributes, stored by columns of row_count values without
/// padding; what a control drives in all groups lies together.
struct JointGroup {
  std::uint32_t row_count = 0, column_count = 0;  // columns without any value do not count
  std::uint32_t rows_begin = 0;                   // its rows among those of all groups
};

/// A corrective, found by a factor that watches it.
struct Watch {
  std::uint16_t psd = 0;
  std::uint16_t other = 0;  // another of its factors, or the same again
};

/// A column of a group, found by its control.
struct JointColumn {
  std::uint32_t offset = 0;  // of its first value
  std::uint32_t group = 0;
};

/// One joint of one group whose rotation is a product of quaternions, one per column that turns it:
/// a blend of identity and the column's quaternion.
struct QuaternionJoint {
  std::uint32_t joint = 0, group = 0;
  std::uint32_t first_row = 0;  // its first rotation row: a LOD with fewer rows leaves it out
};

/// A column that turns such joints, by group and then in the order of the file, which is the order
/// of the product.
struct QuaternionColumn {
  std::uint32_t control = 0;
  std::uint32_t terms_begin = 0, terms_end = 0;
};

struct QuaternionTerm {
  Quaternion rotation;
  std::uint32_t slot = 0;  // of quaternion_joints
};

/// A radial solver: which of its poses' targets its inputs are near.
struct RbfSolver {
  double radius = 0;
  float threshold = 0;
  std::uint32_t inputs_begin = 0, input_count = 0;
  std::uint32_t poses_begin = 0, pose_count = 0;
  std::uint32_t targets_begin = 0;  // [poses, inputs], converted as the inputs are
  std::uint32_t inverse_begin = 0, interpolative = 0;  // [poses, poses] when it interpolates
  std::uint32_t distance = 0, function = 0, axis = 0;  // numbers as in the file
  std::uint32_t always_normalize = 0;
};

/// A pose of one solver: output += weight * value * product of the inputs.
struct RbfPose {
  std::uint32_t inputs_begin = 0, input_count = 0;
  std::uint32_t outputs_begin = 0, output_count = 0;
  float scale = 0;
};
struct RbfOutput {
  std::uint32_t control = 0;
  float weight = 0;
};

inline constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// A node of the graph of networks. Its values lie in scratch memory.
struct MlOperation {
  enum Kind : std::uint32_t { kGather = 1, kScatter = 2, kMlp = 3, kWeightedSum = 4 };
  std::uint32_t kind = kGather;
  std::uint32_t mask = kNone;  // of its network, or of the one that a scatter writes
  std::uint32_t values_begin = 0, value_count = 0;
  std::uint32_t segments_begin = 0, segment_count = 0;  // values of others that it reads
  std::uint32_t items_begin = 0, item_count = 0;        // ml_controls, or ml_layers of a network
};
struct MlSegment {
  std::uint32_t begin = 0, count = 0;
  float weight = 1;
};
struct MlControl {
  std::uint32_t control = 0;
  float rest = 0;  // its value while its network is masked
};
/// y = activation(W x + b), stored by columns of `rows` values: b, then those of W.
struct MlLayer {
  std::uint32_t weights_begin = 0, rows = 0, columns = 0, activation = 0;
  float alpha = 0;  // of the leaky ReLU
};

/// A joint that networks move: a control or kNone for tx ty tz, x y z w (Euler angles: no w), sx sy
/// sz.
struct MlJoint {
  std::uint32_t joint = 0, is_quaternion = 0;
  std::uint32_t controls[10] = {kNone, kNone, kNone, kNone, kNone,
                                kNone, kNone, kNone, kNone, kNone};
};

/// Spreads the rotation of four controls over joints.
struct TwistSwing {
  enum Kind : std::uint32_t { kTwist, kUntwist, kSwing };
  std::uint32_t inputs[4] = {0, 0, 0, 0};  // x y z w
  std::uint32_t axis = 0, kind = kTwist;
  std::uint32_t outputs_begin = 0, outputs_end = 0;
};
struct TwistSwingOutput {
  std::uint32_t joint = 0;
  float weight = 0;
};

/// Rows of the raw to GUI table that belong to one GUI control, and in it to one (from, to).
struct GuiRange {
  std::uint32_t gui = 0, rows_begin = 0, rows_end = 0;
};

/// One thing to do: a kind and an index in one number.
enum class StepKind : std::uint32_t { kOperation, kSolver, kPsd };
inline constexpr std::uint32_t make_step(StepKind kind, std::uint32_t index) {
  return (static_cast<std::uint32_t>(kind) << 30) | index;
}
inline constexpr StepKind step_kind(std::uint32_t step) { return StepKind{step >> 30}; }
inline constexpr std::uint32_t step_index(std::uint32_t step) { return step & 0x3FFFFFFFu; }

/// The lists of steps of a LOD.
enum StepList : std::uint32_t {
  kEarly,      // settled: networks and solvers that need no corrective
  kChained,    // settled: the rest but the watched, what others read first
  kCyclic,     // what needs itself, directly or not; at rest when settled
  kReference,  // not settled: networks and then solvers, in the order of the file
  kStepLists
};

/// Sizes and settings: plain numbers.
struct RigHeader {
  std::uint32_t lod_count = 0, joint_count = 0, blend_shape_count = 0, animated_map_count = 0;
  /// The control vector: raw | corrective | network | RBF pose.
  std::uint32_t raw_count = 0, gui_count = 0, psd_count = 0, control_count = 0;
  std::uint32_t operation_values = 0, widest_layer = 0, solver_inputs = 0, solver_poses = 0;
  std::uint32_t mask_count = 0;    // regions of networks
  std::uint32_t joint_stride = 9;  // 9 with Euler angles, 10 with quaternions
  EulerConvention euler;
  /// The system of joints that networks move, where it is another: v * ml_basis is a vector in
  /// ours.
  std::uint32_t ml_converted = 0;
  EulerConvention ml_euler;
  float ml_basis[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
};

/// A is a container of elements: std::vector or a view.
template <template <class> class A>
struct RigArrays {
  // Texts back to back: raw controls, GUI controls, ignored layers; text t ends at text_ends[t].
  A<char> text;
  A<std::uint32_t> text_ends;

  A<float> neutral_joints;    // [joints, stride], scale 1
  A<float> initial_controls;  // [controls]
  A<ConditionalRow> gui_rows;
  A<GuiRange> gui_ranges;           // by GUI control, ranges of one in the order of their rows
  A<std::uint32_t> gui_range_rows;  // in gui_rows

  // A corrective whose factors are there before any corrective is watched by the factor that
  // watches the fewest: while that rests at 0 so does the corrective, and nobody looks. Per LOD a
  // row of control_count + 1 begins into watched.
  A<Psd> psds;  // by watcher, so that what one look needs lies together; each output once
  A<std::uint16_t> psd_factors;
  A<std::uint32_t> watch_begins;
  A<Watch> watched;
  // What watches nothing, per LOD and list: steps[step_begins[lod * kStepLists + list] ...].
  A<std::uint32_t> step_begins;
  A<std::uint32_t> steps;

  // Groups that coarser LODs have come first: a LOD needs the first live_groups[lod] only.
  A<JointGroup> joint_groups;
  A<std::uint32_t> live_groups;       // [LODs]
  A<std::uint32_t> joint_group_lods;  // [groups, LODs]: rows
  A<float> joint_values;              // one of these two is empty
  A<std::uint16_t> joint_halves;
  A<std::uint16_t> joint_outputs;  // of the rows of all groups, one after the other
  // Where those rows go, per LOD: for each 16 joint attributes a piece, and extra pieces for what
  // does not follow each other in the rows (extra_begins[lod] ...).
  A<simd::Piece> joint_pieces;
  A<std::uint32_t> extra_begins;
  A<simd::Piece> extra_pieces;
  A<std::uint32_t> joint_column_begins;  // [controls + 1]
  A<JointColumn> joint_columns;          // by control, then by group
  A<std::uint16_t> joints_written;       // by any group at any LOD, ascending

  A<QuaternionJoint> quaternion_joints;
  A<QuaternionColumn> quaternion_columns;
  A<QuaternionTerm> quaternion_terms;
  A<std::uint32_t> quaternion_column_begins;  // [controls + 1], or empty
  A<std::uint32_t> quaternion_column_list;    // in quaternion_columns, by control
  // With quaternions as output: joints turned by Euler angles, those of coarser LODs first.
  A<std::uint16_t> euler_joints;
  A<std::uint32_t> euler_joint_lods;  // [LODs]: how many of them

  A<RbfSolver> rbf_solvers;
  A<std::uint16_t> rbf_inputs;  // controls
  A<double> rbf_targets, rbf_inverses;
  A<RbfPose> rbf_poses;
  A<std::uint16_t> rbf_pose_inputs;
  A<RbfOutput> rbf_outputs;

  A<MlOperation> ml_operations;
  A<MlSegment> ml_segments;
  A<MlControl> ml_controls;
  A<MlLayer> ml_layers;
  A<std::uint32_t> ml_layer_rows;  // [layers, LODs]
  A<float> ml_weights;
  A<MlJoint> ml_joints;
  A<std::uint32_t> ml_joint_lods;  // [ML joints, LODs]: 1 where the LOD has the joint

  A<TwistSwing> twist_swings;
  A<TwistSwingOutput> twist_swing_outputs;

  A<std::uint16_t> shape_inputs, shape_outputs;
  A<std::uint32_t> shape_lods;  // [LODs]: entries
  A<ConditionalRow> map_rows;
  A<std::uint32_t> map_lods;  // [LODs]: rows
};

/// Calls f(array) for each, in the order of the block.
template <class R, class F>
constexpr void for_each_array(R& r, F f) {
  f(r.text), f(r.text_ends), f(r.neutral_joints), f(r.initial_controls);
  f(r.gui_rows), f(r.gui_ranges), f(r.gui_range_rows);
  f(r.psds), f(r.psd_factors), f(r.watch_begins), f(r.watched);
  f(r.step_begins), f(r.steps);
  f(r.joint_groups), f(r.live_groups), f(r.joint_group_lods), f(r.joint_values), f(r.joint_halves);
  f(r.joint_outputs), f(r.joint_pieces), f(r.extra_begins), f(r.extra_pieces);
  f(r.joint_column_begins), f(r.joint_columns), f(r.joints_written);
  f(r.quaternion_joints), f(r.quaternion_columns), f(r.quaternion_terms);
  f(r.quaternion_column_begins), f(r.quaternion_column_list), f(r.euler_joints);
  f(r.euler_joint_lods);
  f(r.rbf_solvers), f(r.rbf_inputs), f(r.rbf_targets), f(r.rbf_inverses);
  f(r.rbf_poses), f(r.rbf_pose_inputs), f(r.rbf_outputs);
  f(r.ml_operations), f(r.ml_segments), f(r.ml_controls), f(r.ml_layers), f(r.ml_layer_rows);
  f(r.ml_weights), f(r.ml_joints), f(r.ml_joint_lods), f(r.twist_swings), f(r.twist_swing_outputs);
  f(r.shape_inputs), f(r.shape_outputs), f(r.shape_lods), f(r.map_rows), f(r.map_lods);
}

template <class T>
using Owned = std::vector<T>;
template <class T>
using View = std::span<const T>;

/// A face while it is compiled.
struct RigData : RigHeader, RigArrays<Owned> {};

}  // namespace risorius::rig
