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
  std::uint32_t columns_begin = 0;  // where its list of active columns begins: a sum of counts
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
  std::uint32_t terms_begin = 0, terms_end = 0;
};

struct QuaternionTerm {
  Quaternion rotation;
  std::uint32_t control = 0;
};

/// Sizes and settings: plain numbers.
struct RigHeader {
  std::uint32_t lod_count = 0, joint_count = 0, blend_shape_count = 0, animated_map_count = 0;
  /// The control vector: raw | corrective | network | RBF pose.
  std::uint32_t raw_count = 0, gui_count = 0, psd_count = 0, control_count = 0;
  std::uint32_t list_count = 0;  // columns of all groups
  EulerConvention euler;
};

/// A is a container of elements: std::vector or a view.
template <template <class> class A>
struct RigArrays {
  // Texts back to back: raw controls, GUI controls, ignored layers; text t ends at text_ends[t].
  A<char> text;
  A<std::uint32_t> text_ends;

  A<float> neutral_joints;  // [joints, 9], scale 1
  A<ConditionalRow> gui_rows;

  // A corrective without correctives among its factors is watched by the factor that watches the
  // fewest: while that rests at 0 so does the corrective, and nobody looks. Per LOD a row of
  // control_count + 1 begins into watched.
  A<Psd> psds;  // ascending output
  A<std::uint16_t> psd_factors;
  A<std::uint32_t> watch_begins;
  A<Watch> watched;
  // The others per LOD, factors before what uses them: chained[chained_begins[lod] ...].
  A<std::uint32_t> chained_begins;
  A<std::uint16_t> chained;

  A<JointGroup> joint_groups;
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
  A<QuaternionTerm> quaternion_terms;

  A<std::uint16_t> shape_inputs, shape_outputs;
  A<std::uint32_t> shape_lods;  // [LODs]: entries
  A<ConditionalRow> map_rows;
  A<std::uint32_t> map_lods;  // [LODs]: rows
};

/// Calls f(array) for each, in the order of the block.
template <class R, class F>
void for_each_array(R& r, F f) {
  f(r.text), f(r.text_ends), f(r.neutral_joints), f(r.gui_rows);
  f(r.psds), f(r.psd_factors), f(r.watch_begins), f(r.watched);
  f(r.chained_begins), f(r.chained);
  f(r.joint_groups), f(r.joint_group_lods), f(r.joint_values), f(r.joint_halves);
  f(r.joint_outputs), f(r.joint_pieces), f(r.extra_begins), f(r.extra_pieces);
  f(r.joint_column_begins), f(r.joint_columns), f(r.joints_written);
  f(r.quaternion_joints), f(r.quaternion_terms);
  f(r.shape_inputs), f(r.shape_outputs), f(r.shape_lods), f(r.map_rows), f(r.map_lods);
}

template <class T>
using Owned = std::vector<T>;
template <class T>
using View = std::span<const T>;

/// A face while it is compiled.
struct RigData : RigHeader, RigArrays<Owned> {};

}  // namespace risorius::rig
