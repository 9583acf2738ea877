// SPDX-License-Identifier: MIT
// The contents of a compiled face: one header of plain numbers and about sixty arrays.
//
// compile() fills the arrays as std::vectors (RigData). make_rig() then copies them into one block
// of bytes, and a Rig sees each array as a view into that block. Arrays refer to each other by
// index and never by pointer, so the block can be written to a file and read again at another
// address.
//
// Words: a *control* is one number of the control vector. Evaluation computes the vector from the
// *raw controls* that a caller sets; for most controls 0 is rest and 1 is full, such as a full
// smile. A *GUI control* is a slider of the rig's control panel: a table turns GUI controls into
// raw controls. The vector moves *joint attributes*, the 9 (or, with quaternions, 10) numbers of
// translation, rotation and scale of a joint; *blend shape channels*, the weights of the shapes
// that meshes add to their neutral one; and *animated maps*, the weights of wrinkle and colour
// textures. A *row* is a joint attribute in the numbering of a joint group. A *LOD* is a level of
// detail; 0 is the finest. A name that ends in "_begin" or "begins" is an index into the array that
// follows, or into the array that a comment names.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "rig/quaternion.h"
#include "simd/kernels.h"

namespace risorius::rig {

/// One row of a conditional table. If from <= in <= to holds for the input, the row adds slope * in
/// + cut to the output.
struct ConditionalRow {
  std::uint16_t input = 0, output = 0;
  float from = 0, to = 0, slope = 0, cut = 0;  // from <= to
  // Neighbouring rows with the same input and output form a run. Only the first row of the run that
  // applies counts. run_end is the first row behind the run.
  std::uint32_t run_end = 0;
};

/// A run of rows of a conditional table.
struct RowRun {
  std::uint16_t input = 0;
  std::uint16_t wakes = 0;  // 1: it adds something even if its input is 0, so it is never skipped
  std::uint32_t begin = 0;  // its first row
};

/// A corrective ("pose space deformation", hence Psd): a control that corrects the combined effect
/// of several controls, such as lips that are both pulled and pressed. Its value is min(1,
/// weight * the product of its factors); each factor is another control clamped to [0, 1].
struct Psd {
  std::uint16_t output = 0;         // the control that the corrective writes
  std::uint16_t factor_count = 0;   // number of factors
  std::uint32_t factors_begin = 0;  // the first factor in psd_factors
  float weight = 1;
};

/// A watched corrective (see psds), as an entry in the list of one of its factors.
struct Watch {
  std::uint16_t psd = 0;    // the corrective, an index into psds
  std::uint16_t other = 0;  // the control of a second factor; with one factor, that factor again
};

/// A joint group: a dense matrix that turns some controls into some joint attributes.
///
/// The matrix is stored column by column, a column for each control, in joint_values or
/// joint_halves. The columns of one control in all groups are stored one after the other, so that
/// they are one run of memory. Columns of at least kWidest (16) rows begin at a multiple of
/// kWidest values; shorter columns have no padding.
struct JointGroup {
  std::uint32_t row_count = 0;
  std::uint32_t column_count = 0;  // columns that hold at least one value other than 0
  // The first row of this group among the rows of all groups. A group of at least kWidest (16) rows
  // begins and ends at a multiple of kWidest rows, so that rows after its last row are unused.
  // Smaller groups have no padding.
  std::uint32_t rows_begin = 0;
  std::uint32_t columns_begin = 0;  // its first column in group_columns
  // The range of blocks (16 consecutive joint attributes, see joint_pieces) that the rows of this
  // group write at any LOD: from blocks_begin up to, not including, blocks_end.
  std::uint32_t blocks_begin = 0, blocks_end = 0;
};

/// Numbers of coefficients and columns of the joint groups that an evaluation of a LOD reads for
/// one control, or for all controls together.
struct ControlReads {
  std::uint32_t values = 0;   // coefficients that an evaluation reads
  std::uint32_t columns = 0;  // the columns that hold these coefficients
};

/// One column of a joint group, in the list of its control: the offset of its first value in
/// joint_values or joint_halves, and the number of the group.
using JointColumn = simd::Addend;

/// A joint whose rotation in one joint group is a product of quaternions. Each column that rotates
/// the joint gives one factor: an interpolation from no rotation to the column's quaternion, by the
/// control's value.
struct QuaternionJoint {
  std::uint32_t joint = 0;
  std::uint32_t group = 0;  // an index into joint_groups
  // The joint's first rotation row in the group. A LOD that has at most first_row rows of the group
  // leaves the rotation out.
  std::uint32_t first_row = 0;
};

/// A column that rotates joints by quaternions. The columns are ordered by group as in the file,
/// and within a group as the reference evaluator stores them, see quaternion_column_order() of the
/// compiler. The rotations are multiplied in this order, each from the left, because quaternions do
/// not commute.
struct QuaternionColumn {
  std::uint32_t control = 0;
  std::uint32_t terms_begin = 0, terms_end = 0;  // its terms in quaternion_terms
};

/// The rotation that one column gives to one joint while the column's control is 1.
struct QuaternionTerm {
  Quaternion rotation;
  std::uint32_t slot = 0;  // the joint, an index into quaternion_joints
};

/// A radial basis function solver. It compares its input controls with the target of each of its
/// poses; the nearer the target, the larger the weight of the pose.
struct RbfSolver {
  double radius = 0;
  float threshold = 0;  // a pose is left out unless its weight is above the threshold
  std::uint32_t inputs_begin = 0, input_count = 0;  // its input controls in rbf_inputs
  std::uint32_t poses_begin = 0, pose_count = 0;    // its poses in rbf_poses
  // The matrix [poses, inputs] of targets in rbf_targets. If the distance compares only the swing
  // or the twist of rotations, the targets hold only that part.
  std::uint32_t targets_begin = 0;
  std::uint32_t inverse_begin = 0;  // the matrix [poses, poses] in rbf_inverses, if interpolative
  std::uint32_t interpolative = 0;  // 1: at the target of a pose the solver gives that pose alone
  // The distance, the function that turns a distance into a weight, and the axis of the twist, as
  // numbers of the file format; stages/rbf.h lists them.
  std::uint32_t distance = 0, function = 0, axis = 0;
  // 1: the weights are divided by their sum, unless it is 0; 0: only if their sum is above 1.
  std::uint32_t always_normalize = 0;
};

/// A pose of a solver. To each output control it adds weight * value * the product of the pose's
/// input controls; weight is a constant of the output, and value is the weight that the solver
/// gives the pose.
struct RbfPose {
  std::uint32_t inputs_begin = 0, input_count = 0;    // controls in rbf_pose_inputs
  std::uint32_t outputs_begin = 0, output_count = 0;  // in rbf_outputs
  float scale = 0;                                    // value is multiplied by it
};
struct RbfOutput {
  std::uint32_t control = 0;
  float weight = 0;
};

/// An index that refers to nothing.
inline constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// An operation: one node of the graph of neural networks. Its results are floats in the scratch
/// memory of a Workspace (operation_values), where later operations read them.
struct MlOperation {
  // kGather copies controls to values; kMlp runs a network (a multilayer perceptron); kWeightedSum
  // adds values of other operations; kScatter copies values to controls.
  enum Kind : std::uint32_t { kGather = 1, kScatter = 2, kMlp = 3, kWeightedSum = 4 };
  std::uint32_t kind = kGather;
  // The region whose mask switches the operation off while the mask is 0, an index into the masks
  // of a Workspace. For kMlp it is the region of its network, for kScatter the region of the
  // network whose values it writes. kNone: no mask.
  std::uint32_t mask = kNone;
  std::uint32_t values_begin = 0, value_count = 0;      // its results, in operation_values
  std::uint32_t segments_begin = 0, segment_count = 0;  // its inputs, in ml_segments
  std::uint32_t items_begin = 0, item_count = 0;        // in ml_controls, or ml_layers for kMlp
};
/// A run of values that an earlier operation computed.
struct MlSegment {
  std::uint32_t begin = 0, count = 0;  // in operation_values
  float weight = 1;                    // factor of the values in a kWeightedSum
};
/// A control that an operation reads or writes.
struct MlControl {
  std::uint32_t control = 0;  // kNone: kScatter writes no control
  float rest = 0;             // the value that kScatter writes while the mask of the network is 0
};
/// A layer of a network: y = activation(W x + b). ml_weights has its b, `rows` values, and then the
/// columns of W, `rows` values each.
struct MlLayer {
  std::uint32_t weights_begin = 0, rows = 0, columns = 0;
  std::uint32_t activation = 0;  // 1 ReLU, 2 leaky ReLU, 3 tanh, 4 sigmoid; others: none
  float alpha = 0;               // the slope of the leaky ReLU below 0
};

/// A joint that networks move in addition to the joint groups.
struct MlJoint {
  std::uint32_t joint = 0;
  std::uint32_t is_quaternion = 0;  // 1: the rotation is a quaternion, 0: Euler angles
  // The controls with the values of tx ty tz, x y z w (Euler angles have no w) and sx sy sz; kNone:
  // the attribute has no control.
  std::uint32_t controls[10] = {kNone, kNone, kNone, kNone, kNone,
                                kNone, kNone, kNone, kNone, kNone};
};

/// A twist or swing setup. Four controls are a rotation, which consists of a *twist* about an axis
/// and a *swing* of that axis. Joints get shares of one of them, for example along a neck.
struct TwistSwing {
  // The rotation that is distributed over the joints. kTwist: the twist; kUntwist: the inverse of
  // the twist; kSwing: the inverse of the swing, and each joint also gets the whole inverse of the
  // twist.
  enum Kind : std::uint32_t { kTwist, kUntwist, kSwing };
  std::uint32_t inputs[4] = {0, 0, 0, 0};  // the controls of x y z w
  std::uint32_t axis = 0;                  // of the twist: 0 x, 1 y, 2 z
  std::uint32_t kind = kTwist;
  std::uint32_t outputs_begin = 0, outputs_end = 0;  // in twist_swing_outputs
};
struct TwistSwingOutput {
  std::uint32_t joint = 0;
  float weight = 0;  // 0: the whole rotation, 1: no rotation
};

/// The rows of the GUI table that belong to one GUI control and have the same from and to.
struct GuiRange {
  std::uint32_t gui = 0;                       // the GUI control
  std::uint32_t rows_begin = 0, rows_end = 0;  // in gui_range_rows
};

/// A step of an evaluation: the kind of work and the index of its element, packed into one number.
enum class StepKind : std::uint32_t { kOperation, kSolver, kPsd };
constexpr std::uint32_t make_step(StepKind kind, std::uint32_t index) {
  return (static_cast<std::uint32_t>(kind) << 30) | index;
}
constexpr StepKind step_kind(std::uint32_t step) { return StepKind{step >> 30}; }
/// The element of a step: an index into ml_operations, rbf_solvers or psds, depending on its kind.
constexpr std::uint32_t step_index(std::uint32_t step) { return step & 0x3FFFFFFFu; }

/// Each LOD has these lists of steps. A *settled* evaluation (settle = true) sorts all steps by
/// their dependencies. A *latent* one runs them in the fixed order of the reference evaluator's
/// stages.
enum StepList : std::uint32_t {
  // Networks and solvers that need no corrective, directly or indirectly. A settled evaluation runs
  // them before all correctives.
  kEarly,
  // The other networks and solvers, and the correctives that are not watched (see psds), each after
  // the steps that it reads. A settled evaluation runs all of these steps, a latent one only the
  // correctives.
  kChained,
  // Steps that depend on themselves, directly or through others, and steps that depend on them. A
  // settled evaluation does not run them, so that their outputs keep their initial values. A latent
  // one runs their correctives.
  kCyclic,
  // All networks, then all solvers, in the order of the file. Only a latent evaluation runs them.
  kReference,
  kStepLists  // the number of lists
};

/// The sizes and settings of a compiled face.
struct RigHeader {
  std::uint32_t lod_count = 0, joint_count = 0, blend_shape_count = 0, animated_map_count = 0;
  // The control vector has four parts: raw, corrective, network and RBF pose controls. raw_count
  // and psd_count are the lengths of the first two parts, control_count is the length of the
  // vector. GUI controls do not belong to it.
  std::uint32_t raw_count = 0, gui_count = 0, psd_count = 0, control_count = 0;
  std::uint32_t operation_values = 0;  // floats of scratch memory that operations compute
  std::uint32_t widest_layer = 0;      // largest number of rows or columns of a network layer
  std::uint32_t solver_inputs = 0, solver_poses = 0;  // of the largest solver
  std::uint32_t mask_count = 0;                       // regions of networks
  // The number of entries at the beginning of shape_outputs and shape_inputs whose channels and
  // controls both are consecutive, so that one copy sets all of these channels.
  std::uint32_t shape_run = 0;
  std::uint32_t joint_stride = 9;  // attributes of a joint; with quaternions 10
  EulerConvention euler;
  // 1 if networks move joints in other axes, or with another order or sign of Euler angles, than
  // the face's. Then v * ml_basis converts a vector from the networks' axes to the face's, and
  // ml_euler is the networks' convention of Euler angles.
  std::uint32_t ml_converted = 0;
  EulerConvention ml_euler;
  float ml_basis[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
};

/// The arrays of a compiled face. A is the container of the elements: std::vector or a view.
template <template <class> class A>
struct RigArrays {
  // Names, back to back: raw controls, GUI controls, ignored layers. Name t ends at text_ends[t].
  A<char> text;
  A<std::uint32_t> text_ends;

  A<float> neutral_joints;    // [joints, joint_stride]; the scale is 1
  A<float> initial_controls;  // [controls]: values before any step runs
  // The table from GUI controls to raw controls. For the conversion from raw to GUI controls,
  // gui_ranges lists ranges of rows with equal bounds, sorted by GUI control and then by first row.
  A<ConditionalRow> gui_rows;
  A<GuiRange> gui_ranges;
  A<std::uint32_t> gui_range_rows;  // indices into gui_rows

  // Correctives. Most of them are 0, and evaluation should not visit these. A corrective is
  // *watched* if it has a factor, all of its factors have their values before the first corrective
  // is computed, and its output is no raw control. It is then in the list of one of its factors,
  // the factor with the shortest list. While that factor is 0 the corrective is 0, and evaluation
  // does not visit it.
  A<Psd> psds;                    // in the order of `watched`, the others last; each output once
  A<std::uint16_t> psd_factors;   // controls
  A<std::uint32_t> watch_begins;  // [LODs, controls + 1]: where each control's list begins
  A<Watch> watched;               // the lists
  // Steps: correctives that are not watched, networks and solvers. List l of a LOD begins at
  // steps[step_begins[lod * kStepLists + l]] and ends where the next list begins.
  A<std::uint32_t> step_begins;
  A<std::uint32_t> steps;

  // Joint groups. The groups that coarse LODs use come first, so that a LOD needs only the first
  // live_groups[lod] groups, and only the first joint_group_lods[group, lod] rows of each group.
  A<JointGroup> joint_groups;
  A<std::uint32_t> live_groups;       // [LODs]
  A<std::uint32_t> joint_group_lods;  // [groups, LODs]
  A<float> joint_values;              // the columns as float32 ...
  A<std::uint16_t> joint_halves;      // ... or as float16; one of the two arrays is empty
  A<std::uint16_t> joint_outputs;     // [rows of all groups]: the joint attribute of each row
  // How rows are copied to joint attributes. The attributes are divided into blocks of 16. For each
  // LOD and block one piece tells which attributes take values and at which row these values begin.
  // Attributes of the block whose values are not in these consecutive rows have extra pieces.
  A<simd::Piece> joint_pieces;    // [LODs, blocks]
  A<std::uint32_t> extra_begins;  // [LODs + 1]
  A<simd::Piece> extra_pieces;
  A<std::uint32_t> joint_column_begins;  // [controls + 1]: where each control's columns begin
  A<JointColumn> joint_columns;          // by control, then by group
  // The columns of joint_columns, sorted by group and then by control, for frames in which most
  // columns are active. The weight of a column is the value of its control.
  A<simd::Column> group_columns;
  // [LODs, controls + 1]: one entry for each control; the last entry is for all controls together.
  // Empty if a coefficient is not finite, because columns of controls at 0 must not be read then.
  A<ControlReads> control_reads;
  A<std::uint16_t> joints_written;  // joints that anything moves at any LOD, ascending

  // Joints that are rotated by quaternions, and the columns and terms of these rotations.
  A<QuaternionJoint> quaternion_joints;
  A<QuaternionColumn> quaternion_columns;
  A<QuaternionTerm> quaternion_terms;
  A<std::uint32_t> quaternion_column_begins;  // [controls + 1], or empty without such joints
  A<std::uint32_t> quaternion_column_list;    // indices into quaternion_columns, by control
  // If rotations in poses are quaternions: the joints whose Euler angles must be converted to
  // quaternions. Joints of coarse LODs come first, so that a LOD converts the first
  // euler_joint_lods[lod].
  A<std::uint16_t> euler_joints;
  A<std::uint32_t> euler_joint_lods;  // [LODs]

  // Solvers.
  A<RbfSolver> rbf_solvers;
  A<std::uint16_t> rbf_inputs;  // controls
  A<double> rbf_targets, rbf_inverses;
  A<RbfPose> rbf_poses;
  A<std::uint16_t> rbf_pose_inputs;  // controls
  A<RbfOutput> rbf_outputs;

  // Networks.
  A<MlOperation> ml_operations;
  A<MlSegment> ml_segments;
  A<MlControl> ml_controls;
  A<MlLayer> ml_layers;
  A<std::uint32_t> ml_layer_rows;  // [layers, LODs]: the rows of a layer that a LOD needs
  A<float> ml_weights;
  A<MlJoint> ml_joints;
  A<std::uint32_t> ml_joint_lods;  // [network joints, LODs]: 1 where the LOD has the joint

  A<TwistSwing> twist_swings;
  A<TwistSwingOutput> twist_swing_outputs;

  // Blend shape channels: channel shape_outputs[i] is control shape_inputs[i]. A LOD has the first
  // shape_lods[lod] of them.
  A<std::uint16_t> shape_inputs, shape_outputs;
  A<std::uint32_t> shape_lods;  // [LODs]
  // The channels of each control, as indices into shape_inputs, for frames in which most controls
  // are 0. shape_begins and shapes_of_controls are empty if two entries write one channel: then the
  // last entry counts, even if its control is 0.
  A<std::uint32_t> shape_begins;  // [controls + 1]
  A<std::uint16_t> shapes_of_controls;
  // The table from controls to animated maps. A LOD has the first map_lods[lod] rows.
  A<ConditionalRow> map_rows;
  A<RowRun> map_runs;         // its runs, ascending
  A<std::uint32_t> map_lods;  // [LODs]
};

/// Calls f(array) for each array, in the order in which the block holds them.
template <class R, class F>
constexpr void for_each_array(R& r, F f) {
  f(r.text), f(r.text_ends), f(r.neutral_joints), f(r.initial_controls);
  f(r.gui_rows), f(r.gui_ranges), f(r.gui_range_rows);
  f(r.psds), f(r.psd_factors), f(r.watch_begins), f(r.watched);
  f(r.step_begins), f(r.steps);
  f(r.joint_groups), f(r.live_groups), f(r.joint_group_lods), f(r.joint_values), f(r.joint_halves);
  f(r.joint_outputs), f(r.joint_pieces), f(r.extra_begins), f(r.extra_pieces);
  f(r.joint_column_begins), f(r.joint_columns), f(r.group_columns), f(r.control_reads);
  f(r.joints_written);
  f(r.quaternion_joints), f(r.quaternion_columns), f(r.quaternion_terms);
  f(r.quaternion_column_begins), f(r.quaternion_column_list), f(r.euler_joints);
  f(r.euler_joint_lods);
  f(r.rbf_solvers), f(r.rbf_inputs), f(r.rbf_targets), f(r.rbf_inverses);
  f(r.rbf_poses), f(r.rbf_pose_inputs), f(r.rbf_outputs);
  f(r.ml_operations), f(r.ml_segments), f(r.ml_controls), f(r.ml_layers), f(r.ml_layer_rows);
  f(r.ml_weights), f(r.ml_joints), f(r.ml_joint_lods), f(r.twist_swings), f(r.twist_swing_outputs);
  f(r.shape_inputs), f(r.shape_outputs), f(r.shape_lods), f(r.shape_begins);
  f(r.shapes_of_controls), f(r.map_rows), f(r.map_runs), f(r.map_lods);
}

template <class T>
using Owned = std::vector<T>;
template <class T>
using View = std::span<const T>;

/// The arrays of a face during compilation.
struct RigData : RigHeader, RigArrays<Owned> {};

}  // namespace risorius::rig
