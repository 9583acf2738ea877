// SPDX-License-Identifier: MIT
// BoneSpace: converts poses of a file's joints to transforms of another program's bones.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rig/quaternion.h"

namespace risorius::rig {

/// Converts vectors of a file to another space: v' = scale * axes * v.
struct SpaceConvention {
  EulerConvention euler;                                 // of the file
  std::array<float, 9> axes{1, 0, 0, 0, 1, 0, 0, 0, 1};  // rows; orthonormal, may mirror
  float scale = 1;
};

/// Converts poses to the bones of another program. The rest pose of a bone is the neutral pose of
/// its joint, with the rotation angles n. A pose with the deltas dt, dr and ds gives the bone the
/// transform R(n)^-1 T(dt) R(n + dr) S(1 + ds) relative to its rest pose, in the axes of the other
/// program.
struct BoneSpace {
  struct Bone {
    std::uint32_t joint;
    std::array<float, 3> neutral_angles;  // in the file's unit
    Quaternion neutral_inverse;           // inverse of the neutral rotation, in the other space
    std::array<float, 9> place;           // matrix from a translation in the file to the bone's
  };
  SpaceConvention convention;
  std::uint32_t joint_count = 0;
  std::vector<Bone> bones;
};

/// Prepares the conversion of some joints' poses to bones.
/// In:  neutral_rotations  float32[joint_count, 3], Euler angles in the file's unit and order
///      bones              the joint of each bone, below joint_count
BoneSpace make_bone_space(const SpaceConvention& convention, const float* neutral_rotations,
                          std::uint32_t joint_count, const std::vector<std::uint32_t>& bones);

/// Converts the joints of a pose to transforms of bones.
/// In:  joints   float32[joint_count, 9]: tx ty tz rx ry rz sx sy sz deltas of a Pose, file units
/// Out: location float32[bones, 3]; rotation float32[bones, 4], unit quaternions w x y z, w >= 0;
///      scale float32[bones, 3]
void evaluate_bones(const BoneSpace& space, const float* joints, float* location, float* rotation,
                    float* scale) noexcept;

}  // namespace risorius::rig
