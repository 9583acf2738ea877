// SPDX-License-Identifier: MIT
// Converts poses of a file's joints to transforms of another program's bones, in the axes and units
// of that program. A transform is relative to the rest pose of the bone, the neutral pose of its
// joint.
#include "rig/outputs/bone_space.h"

#include <cmath>

namespace risorius::rig {
namespace {

using Matrix = std::array<float, 9>;  // rows

std::array<float, 3> transform(const Matrix& m, float x, float y, float z) {
  return {m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z,
          m[6] * x + m[7] * y + m[8] * z};
}

/// The quaternion of axes * M(q) * axes^T, where M(q) is the rotation matrix of q. If the axes
/// mirror, the sense of rotation is reversed.
Quaternion convert(const Matrix& axes, float handedness, const Quaternion& q) {
  const std::array<float, 3> v = transform(axes, q.x, q.y, q.z);
  return {handedness * v[0], handedness * v[1], handedness * v[2], q.w};
}

Matrix to_matrix(const Quaternion& q) {
  return {1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y - q.w * q.z),
          2 * (q.x * q.z + q.w * q.y),     2 * (q.x * q.y + q.w * q.z),
          1 - 2 * (q.x * q.x + q.z * q.z), 2 * (q.y * q.z - q.w * q.x),
          2 * (q.x * q.z - q.w * q.y),     2 * (q.y * q.z + q.w * q.x),
          1 - 2 * (q.x * q.x + q.y * q.y)};
}

Matrix product(const Matrix& a, const Matrix& b, float scale) {
  Matrix result{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) {
        result[i * 3 + j] += scale * a[i * 3 + k] * b[k * 3 + j];
      }
    }
  }
  return result;
}

void write_rotation(const Quaternion& q, float* out) {
  const float length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  const float factor = q.w < 0 ? -1.0f / length : 1.0f / length;
  out[0] = q.w * factor;
  out[1] = q.x * factor;
  out[2] = q.y * factor;
  out[3] = q.z * factor;
}

}  // namespace

BoneSpace make_bone_space(const SpaceConvention& convention, const float* neutral_rotations,
                          std::uint32_t joint_count, const std::vector<std::uint32_t>& bones) {
  BoneSpace space{convention, joint_count, {}};
  const float handedness = determinant(convention.axes) < 0 ? -1.0f : 1.0f;
  space.bones.reserve(bones.size());
  for (const std::uint32_t joint : bones) {
    const float* angles = neutral_rotations + std::size_t{joint} * 3;
    BoneSpace::Bone bone{joint, {angles[0], angles[1], angles[2]}, {}, {}};
    const Quaternion q =
        convert(convention.axes, handedness, from_euler(convention.euler, bone.neutral_angles));
    bone.neutral_inverse = {-q.x, -q.y, -q.z, q.w};
    bone.place = product(to_matrix(bone.neutral_inverse), convention.axes, convention.scale);
    space.bones.push_back(bone);
  }
  return space;
}

void evaluate_bones(const BoneSpace& space, const float* joints, float* location, float* rotation,
                    float* scale) noexcept {
  const Matrix& axes = space.convention.axes;
  const float handedness = determinant(axes) < 0 ? -1.0f : 1.0f;
  for (const BoneSpace::Bone& bone : space.bones) {
    const float* d = joints + std::size_t{bone.joint} * 9;
    const std::array<float, 3> place = transform(bone.place, d[0], d[1], d[2]);
    const Quaternion turned = from_euler(
        space.convention.euler, {bone.neutral_angles[0] + d[3], bone.neutral_angles[1] + d[4],
                                 bone.neutral_angles[2] + d[5]});
    write_rotation(multiply(bone.neutral_inverse, convert(axes, handedness, turned)), rotation);
    for (std::size_t i = 0; i < 3; ++i) {
      location[i] = place[i];
      scale[i] = 1 + std::fabs(axes[i * 3]) * d[6] + std::fabs(axes[i * 3 + 1]) * d[7] +
                 std::fabs(axes[i * 3 + 2]) * d[8];
    }
    location += 3;
    rotation += 4;
    scale += 3;
  }
}

}  // namespace risorius::rig
