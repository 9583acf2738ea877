// SPDX-License-Identifier: MIT
// Twist and swing setups: four controls are a rotation, which consists of a twist about an axis and
// a swing of that axis. Joints of a setup get shares of the twist or the swing.
// From: dna-format 12.5
#include <cmath>

#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

Quaternion conjugate(const Quaternion& q) { return {-q.x, -q.y, -q.z, q.w}; }

Quaternion inverse(const Quaternion& q) {
  const float square = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  const Quaternion c = conjugate(q);
  return square == 0.0f ? Quaternion{}
                        : Quaternion{c.x / square, c.y / square, c.z / square, c.w / square};
}

// The twist of a rotation: its part that rotates about the given axis.
Quaternion twist(const Quaternion& q, std::uint32_t axis) {
  const float t = axis == 0 ? q.x : (axis == 1 ? q.y : q.z);
  const float length = std::sqrt(t * t + q.w * q.w);
  if (length == 0.0f) return {};
  const float s = t / length;
  return {axis == 0 ? s : 0.0f, axis == 1 ? s : 0.0f, axis == 2 ? s : 0.0f, q.w / length};
}

// Interpolates from q (weight 0) to no rotation (weight 1) along the shorter arc.
Quaternion to_identity(const Quaternion& q, float weight) {
  const float sign = q.w < 0.0f ? -1.0f : 1.0f, cosine = q.w * sign;
  float a = 1.0f - weight, b = weight;
  if (!(cosine > 1.0f - 1.2e-7f)) {
    const float angle = std::acos(cosine), sine = std::sin(angle);
    a = std::sin(a * angle) / sine;
    b = std::sin(b * angle) / sine;
  }
  b *= sign;
  return {q.x * a, q.y * a, q.z * a, q.w * a + b};
}

}  // namespace

void detail::twist_and_swing(const Rig& rig, const PoseView& pose) noexcept {
  for (const TwistSwing& setup : rig.twist_swings) {
    const float* c = pose.controls;
    const Quaternion q{c[setup.inputs[0]], c[setup.inputs[1]], c[setup.inputs[2]],
                       c[setup.inputs[3]]};
    const Quaternion t = twist(q, setup.axis), untwist = conjugate(t);
    Quaternion from = setup.kind == TwistSwing::kTwist ? t : untwist;
    if (setup.kind == TwistSwing::kSwing) from = inverse(multiply(q, untwist));
    for (std::uint32_t i = setup.outputs_begin; i < setup.outputs_end; ++i) {
      const TwistSwingOutput& out = rig.twist_swing_outputs[i];
      Quaternion part = to_identity(from, out.weight);
      if (setup.kind == TwistSwing::kSwing) part = multiply(untwist, part);
      store_rotation(rig, part, rotation_of(rig, pose.joints, out.joint));
    }
  }
}

}  // namespace risorius::rig
