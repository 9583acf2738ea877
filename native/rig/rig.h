// SPDX-License-Identifier: MIT
// Rig: the compiled, immutable form of a face's behavior. Knows nothing of the file it came from;
// may be shared by any number of threads and faces.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/aligned.h"
#include "rig/quaternion.h"
#include "simd/kernels.h"

namespace risorius::rig {

/// One row of a conditional table: from <= in <= to gives out += slope * in + cut.
struct ConditionalRow {
  std::uint16_t input = 0, output = 0;
  float from = 0, to = 0, slope = 0, cut = 0;  // from <= to
  std::uint32_t run_end = 0;                   // first row after the run of equal (input, output)
};

struct ConditionalTable {
  std::vector<ConditionalRow> rows;
  std::vector<std::uint32_t> lod_row_counts;  // empty: all rows at every LOD
};

/// A corrective: min(1, weight * product of its factors, each clamped to [0, 1]).
struct Psd {
  std::uint16_t output = 0;  // control index
  float weight = 1;
  std::uint32_t factors_begin = 0, factors_end = 0;
};

/// A dense matrix from controls to joint attributes, stored by columns: the value of row r and
/// column c is values[values_begin + c * stride + r]; rows beyond row_count are zero.
struct JointGroup {
  std::uint32_t values_begin = 0, stride = 0;
  std::uint32_t inputs_begin = 0, column_count = 0;
  std::uint32_t outputs_begin = 0, row_count = 0;
  std::uint32_t lods_begin = 0;  // lod_count row counts in joint_group_lods
};

/// One joint of one group whose rotation is a product of quaternions, one per column: column c
/// turns it by a blend of identity and quaternions[quaternions_begin + c].
struct QuaternionJoint {
  std::uint32_t joint = 0, group = 0;
  std::uint32_t first_row = 0;  // its first rotation row: a LOD with fewer rows leaves it out
  std::uint32_t quaternions_begin = 0;
};

struct Rig {
  std::vector<std::string> raw_control_names, gui_control_names;
  std::uint32_t lod_count = 0, joint_count = 0, blend_shape_count = 0, animated_map_count = 0;
  std::uint32_t raw_count = 0, control_count = 0;  // controls: raw, corrective, network, RBF pose
  std::vector<float> neutral_joints;               // [joints, 9], scale 1

  ConditionalTable gui_to_raw;
  std::vector<Psd> psds;                                        // ascending output
  std::vector<std::uint16_t> psd_factors;                       // control indices
  std::vector<std::vector<std::uint32_t>> psds_by_lod;          // ascending
  std::vector<std::vector<std::uint32_t>> settled_psds_by_lod;  // factors before what uses them

  std::vector<JointGroup> joint_groups;
  core::AlignedVector<float> joint_values;
  std::vector<std::uint16_t> joint_inputs, joint_outputs;
  std::vector<std::uint32_t> joint_group_lods;
  std::uint32_t widest_group = 0, tallest_group = 0;  // scratch sizes
  std::vector<std::uint16_t> joints_written;          // by any group at any LOD, ascending

  std::vector<QuaternionJoint> quaternion_joints;
  std::vector<Quaternion> quaternions;
  EulerConvention euler;

  std::vector<std::uint16_t> shape_inputs, shape_outputs;
  std::vector<std::uint32_t> shape_lod_row_counts;
  ConditionalTable animated_maps;

  std::vector<std::string> ignored_layers;  // behavior in the file that is not evaluated
  const simd::Kernels* kernels = nullptr;

  std::size_t memory_bytes() const;
};

/// The output of one evaluation. Joint values are deltas from neutral in the file's units and axes:
/// tx ty tz rx ry rz sx sy sz; a scale of 0 is no scale.
struct Pose {
  std::vector<float> joints;         // [joints, 9]
  std::vector<float> blend_shapes;   // [channels]
  std::vector<float> animated_maps;  // [maps], in [0, 1]
  std::vector<float> controls;       // [controls]
};

/// Scratch memory of one thread.
struct Workspace {
  std::vector<std::uint32_t> columns;
  std::vector<float> weights;
  core::AlignedVector<float> rows;
  std::vector<float> factors;
};

Pose make_pose(const Rig& rig);
Workspace make_workspace(const Rig& rig);

/// Raw controls from GUI controls by the conditional table; results are clamped to [0, 1], inputs
/// outside every row's range give nothing.
/// In: gui float32[G]. Out: raw float32[R].
void gui_to_raw(const Rig& rig, const float* gui, float* raw) noexcept;

/// Turns raw controls into a pose. Allocates nothing.
/// In:   raw     float32[R], not clamped here; NaN or infinity spoils every row of the joint groups
///               that have it as a column, its shapes, maps and correctives, and nothing else
///       lod     clamped to the last LOD
///       settle  true: correctives of correctives are evaluated in the order of their dependency,
///       so
///               that the pose is a function of raw alone; false: they read 0, as on the
///               reference's first call
/// Out:  pose    every field overwritten
/// From: RigLogic; dna-format 12.1, 12.2, 12.5, 12.6
void evaluate(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
              Pose& pose) noexcept;

/// One face through time, with the reference's latency: a corrective reads the correctives of the
/// previous evaluation.
class Instance {
 public:
  explicit Instance(const Rig& rig);
  std::uint32_t lod() const { return lod_; }
  /// Another level clears all correctives, as in the reference. Clamped to the last LOD.
  void set_lod(std::uint32_t lod) noexcept;
  const Pose& evaluate(const float* raw) noexcept;

 private:
  const Rig* rig_;
  std::uint32_t lod_ = 0;
  Workspace work_;
  Pose pose_;
};

}  // namespace risorius::rig
