// SPDX-License-Identifier: MIT
// Quaternion joints, which are turned by the product of the rotations of their columns, one for
// each control; and joints whose Euler angles are converted to quaternions. From: dna-format 12.5
#include <algorithm>
#include <bit>
#include <cmath>

#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

bool is_identity(const Quaternion& q) {
  return q.x == 0.0f && q.y == 0.0f && q.z == 0.0f && q.w == 1.0f;
}

// Multiplies the product, from the left, by the rotation of a term at the control value v.
void apply(const QuaternionTerm& term, float v, Quaternion& product) noexcept {
  const Quaternion& full = term.rotation;
  const float identity = full.w >= 0.0f ? 1.0f - v : v - 1.0f;
  const Quaternion blend{full.x * v, full.y * v, full.z * v, full.w * v + identity};
  const float length =
      std::sqrt(blend.x * blend.x + blend.y * blend.y + blend.z * blend.z + blend.w * blend.w);
  product =
      multiply({blend.x / length, blend.y / length, blend.z / length, blend.w / length}, product);
}

void find_columns(const Rig& rig, Workspace& work, const float* controls) noexcept {
  const std::uint32_t* begins = rig.quaternion_column_begins.data();
  for (std::uint32_t c = 0; c < rig.control_count; ++c) {
    if (controls[c] == 0.0f) continue;
    for (std::uint32_t i = begins[c]; i < begins[c + 1]; ++i) {
      const std::uint32_t column = rig.quaternion_column_list[i];
      work.quaternion_bits[column / 64] |= std::uint64_t{1} << (column % 64);
    }
  }
}

}  // namespace

namespace detail {

void euler_joints(const Rig& rig, std::uint32_t lod, const Workspace& work,
                  float* joints) noexcept {
  const std::uint32_t turning = rig.lod_count == 0 ? 0 : rig.euler_joint_lods[lod];
  for (const std::uint16_t joint : rig.euler_joints.subspan(turning)) {
    rotation_of(rig, joints, joint)[3] = 1.0f;
  }
  for (const std::uint16_t joint : work.straight_joints) {
    rotation_of(rig, joints, joint)[3] = 1.0f;
  }
  // A rig may have no joint, so that a pose has no memory for one.
  if (rig.euler_joints.empty()) return;
  const EulerConvention& c = rig.euler;
  simd::EulerTurns turns;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::uint8_t axis = turns.order[a] = c.order[a];
    turns.half_units[a] = 0.5f * c.signs[axis] * c.radians_per_unit;
  }
  turns.parity = c.order[1] == (c.order[0] + 1) % 3 ? 1.0f : -1.0f;
  rig.kernels->quaternions(turns, rig.euler_joints.data(), turning, rotation_of(rig, joints, 0),
                           rig.joint_stride);
}

// Rotates the quaternion joints: multiplies the rotations of the active columns in the order of
// quaternion_columns, each from the left.
void quaternion_joints(const Rig& rig, std::uint32_t lod, Workspace& work,
                       const PoseView& pose) noexcept {
  if (rig.quaternion_joints.empty()) return;
  std::fill(work.products.begin(), work.products.end(), Quaternion{});
  find_columns(rig, work, pose.controls);
  for (std::size_t word = 0; word < work.quaternion_bits.size(); ++word) {
    for (std::uint64_t bits = work.quaternion_bits[word]; bits != 0; bits &= bits - 1) {
      const QuaternionColumn& column =
          rig.quaternion_columns[word * 64 + static_cast<std::size_t>(std::countr_zero(bits))];
      for (std::uint32_t t = column.terms_begin; t < column.terms_end; ++t) {
        const QuaternionTerm& term = rig.quaternion_terms[t];
        apply(term, pose.controls[column.control], work.products[term.slot]);
      }
    }
    work.quaternion_bits[word] = 0;
  }
  for (std::size_t i = 0; i < work.products.size(); ++i) {
    const QuaternionJoint& q = rig.quaternion_joints[i];
    if (q.first_row >= rig.joint_group_lods[q.group * rig.lod_count + lod]) continue;
    float* to = rotation_of(rig, pose.joints, q.joint);
    if (is_identity(work.products[i]) && rig.joint_stride == 9) {
      std::fill(to, to + 3, 0.0f);
    } else {
      store_rotation(rig, work.products[i], to);
    }
  }
}

void rotations(const Rig& rig, std::uint32_t lod, Workspace& work, const PoseView& pose) noexcept {
  if (rig.joint_stride == 10) euler_joints(rig, lod, work, pose.joints);
  quaternion_joints(rig, lod, work, pose);
  twist_and_swing(rig, pose);
  ml_joints(rig, lod, pose);
}

}  // namespace detail

}  // namespace risorius::rig
