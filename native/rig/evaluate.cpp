// SPDX-License-Identifier: MIT
#include <algorithm>

#include "rig/rig.h"
#include "rig/stages.h"

namespace risorius::rig {

namespace {

float clamp01(float v) { return v < 0.0f ? 0.0f : (v > 1.0f ? 1.0f : v); }

void evaluate_table(const ConditionalTable& table, std::uint32_t lod, const float* in, float* out,
                    std::size_t outputs) noexcept {
  std::fill(out, out + outputs, 0.0f);
  const std::size_t n =
      table.lod_row_counts.empty() ? table.rows.size() : table.lod_row_counts[lod];
  for (std::size_t i = 0; i < n;) {
    const ConditionalRow& row = table.rows[i];
    const float v = in[row.input];
    const bool holds = row.from <= v && v <= row.to;
    if (holds || v != v) out[row.output] += row.slope * v + row.cut;
    i = holds ? row.run_end : i + 1;
  }
  for (std::size_t o = 0; o < outputs; ++o) out[o] = clamp01(out[o]);
}

// One corrective from factors that are already clamped or from controls.
float corrective(const Rig& rig, const Psd& psd, const float* values) noexcept {
  float product = psd.weight;
  for (std::uint32_t f = psd.factors_begin; f < psd.factors_end; ++f) {
    product *= clamp01(values[rig.psd_factors[f]]);
  }
  return product > 1.0f ? 1.0f : product;
}

// Factors come before what uses them, so one pass settles. Members of a cycle multiply each other
// from rest and stay there, whatever their order.
void settled_correctives(const Rig& rig, std::uint32_t lod, float* controls) noexcept {
  for (const std::uint32_t p : rig.settled_psds_by_lod[lod]) {
    controls[rig.psds[p].output] = corrective(rig, rig.psds[p], controls);
  }
}

void joints(const Rig& rig, std::uint32_t lod, Workspace& work, Pose& pose) noexcept {
  std::fill(pose.joints.begin(), pose.joints.end(), 0.0f);
  const float* controls = pose.controls.data();
  for (const JointGroup& g : rig.joint_groups) {
    const std::uint32_t rows = rig.joint_group_lods[g.lods_begin + lod];
    if (rows == 0) continue;
    std::size_t active = 0;
    for (std::uint32_t c = 0; c < g.column_count; ++c) {
      const float v = controls[rig.joint_inputs[g.inputs_begin + c]];
      // Faces are sparse in time: most columns are zero and cost nothing.
      work.columns[active] = c;
      work.weights[active] = v;
      active += v != 0.0f ? 1 : 0;
    }
    const std::size_t padded =
        (rows + simd::kRowAlignment - 1) / simd::kRowAlignment * simd::kRowAlignment;
    rig.kernels->weighted_columns(rig.joint_values.data() + g.values_begin, g.stride,
                                  work.columns.data(), work.weights.data(), active,
                                  work.rows.data(), padded);
    const std::uint16_t* outputs = rig.joint_outputs.data() + g.outputs_begin;
    for (std::uint32_t r = 0; r < rows; ++r) pose.joints[outputs[r]] = work.rows[r];
  }
}

// Columns in order, each applied after the ones before (dna-format 12.5, quaternion groups).
void quaternion_joints(const Rig& rig, std::uint32_t lod, Pose& pose) noexcept {
  for (const QuaternionJoint& q : rig.quaternion_joints) {
    const JointGroup& g = rig.joint_groups[q.group];
    if (q.first_row >= rig.joint_group_lods[g.lods_begin + lod]) continue;
    Quaternion product;
    for (std::uint32_t c = 0; c < g.column_count; ++c) {
      const float v = pose.controls[rig.joint_inputs[g.inputs_begin + c]];
      if (v == 0.0f) continue;
      const Quaternion& full = rig.quaternions[q.quaternions_begin + c];
      const float identity = full.w >= 0.0f ? 1.0f - v : v - 1.0f;
      const Quaternion blend{full.x * v, full.y * v, full.z * v, full.w * v + identity};
      const float length =
          std::sqrt(blend.x * blend.x + blend.y * blend.y + blend.z * blend.z + blend.w * blend.w);
      product = multiply({blend.x / length, blend.y / length, blend.z / length, blend.w / length},
                         product);
    }
    const std::array<float, 3> angles = to_euler(rig.euler, product);
    std::copy(angles.begin(), angles.end(), pose.joints.data() + std::size_t{q.joint} * 9 + 3);
  }
}

void blend_shapes(const Rig& rig, std::uint32_t lod, Pose& pose) noexcept {
  std::fill(pose.blend_shapes.begin(), pose.blend_shapes.end(), 0.0f);
  const std::uint32_t rows = rig.shape_lod_row_counts.empty() ? 0 : rig.shape_lod_row_counts[lod];
  for (std::uint32_t i = 0; i < rows; ++i) {
    pose.blend_shapes[rig.shape_outputs[i]] = pose.controls[rig.shape_inputs[i]];
  }
}

}  // namespace

namespace detail {

std::uint32_t clamp_lod(const Rig& rig, std::uint32_t lod) noexcept {
  return rig.lod_count == 0 ? 0 : std::min(lod, rig.lod_count - 1);
}

void correctives_of_last_values(const Rig& rig, std::uint32_t lod, Workspace& work,
                                float* controls) noexcept {
  std::copy(controls, controls + rig.control_count, work.factors.begin());
  for (const std::uint32_t p : rig.psds_by_lod[lod]) {
    controls[rig.psds[p].output] = corrective(rig, rig.psds[p], work.factors.data());
  }
}

void outputs(const Rig& rig, std::uint32_t lod, Workspace& work, Pose& pose) noexcept {
  joints(rig, lod, work, pose);
  quaternion_joints(rig, lod, pose);
  blend_shapes(rig, lod, pose);
  evaluate_table(rig.animated_maps, lod, pose.controls.data(), pose.animated_maps.data(),
                 pose.animated_maps.size());
}

}  // namespace detail

Pose make_pose(const Rig& rig) {
  Pose pose;
  pose.joints.resize(std::size_t{rig.joint_count} * 9);
  pose.blend_shapes.resize(rig.blend_shape_count);
  pose.animated_maps.resize(rig.animated_map_count);
  pose.controls.resize(rig.control_count);
  return pose;
}

Workspace make_workspace(const Rig& rig) {
  Workspace work;
  work.columns.resize(rig.widest_group + 1);  // the loop above writes one past the active ones
  work.weights.resize(rig.widest_group + 1);
  work.rows.resize(rig.tallest_group);
  work.factors.resize(rig.control_count);
  return work;
}

std::size_t Rig::memory_bytes() const {
  std::size_t bytes = sizeof(Rig);
  bytes += joint_values.size() * sizeof(float) + joint_inputs.size() * 2 + joint_outputs.size() * 2;
  bytes += joint_groups.size() * sizeof(JointGroup) + joint_group_lods.size() * 4;
  bytes += (gui_to_raw.rows.size() + animated_maps.rows.size()) * sizeof(ConditionalRow);
  bytes += psds.size() * sizeof(Psd) + psd_factors.size() * 2;
  for (const auto& list : psds_by_lod) bytes += list.size() * 8;
  bytes += shape_inputs.size() * 4 + neutral_joints.size() * 4;
  return bytes;
}

void gui_to_raw(const Rig& rig, const float* gui, float* raw) noexcept {
  evaluate_table(rig.gui_to_raw, 0, gui, raw, rig.raw_count);
}

void evaluate(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
              Pose& pose) noexcept {
  const std::uint32_t level = detail::clamp_lod(rig, lod);
  std::copy(raw, raw + rig.raw_count, pose.controls.begin());
  std::fill(pose.controls.begin() + rig.raw_count, pose.controls.end(), 0.0f);
  if (rig.lod_count == 0) {
    std::fill(pose.joints.begin(), pose.joints.end(), 0.0f);
    std::fill(pose.blend_shapes.begin(), pose.blend_shapes.end(), 0.0f);
    std::fill(pose.animated_maps.begin(), pose.animated_maps.end(), 0.0f);
    return;
  }
  if (settle) {
    settled_correctives(rig, level, pose.controls.data());
  } else {
    detail::correctives_of_last_values(rig, level, work, pose.controls.data());
  }
  detail::outputs(rig, level, work, pose);
}

}  // namespace risorius::rig
