// SPDX-License-Identifier: MIT
// The arrays of a Python Pose that an evaluation writes into.
#pragma once

#include "bindings/numpy_arrays.h"
#include "rig/pose.h"

namespace risorius::bindings {

struct PoseArrays {
  FloatArray joints, blend_shapes, animated_maps, controls;
};

/// Uninitialised arrays for the pose of one frame.
inline PoseArrays new_pose(const rig::Rig& rig) {
  const auto n = [](std::uint32_t count) { return static_cast<py::ssize_t>(count); };
  return {FloatArray({n(rig.joint_count), n(rig.joint_stride)}),
          FloatArray(n(rig.blend_shape_count)), FloatArray(n(rig.animated_map_count)),
          FloatArray(n(rig.control_count))};
}

inline rig::PoseView view_of(PoseArrays& out) {
  return {out.joints.mutable_data(), out.blend_shapes.mutable_data(),
          out.animated_maps.mutable_data(), out.controls.mutable_data()};
}

}  // namespace risorius::bindings
