// SPDX-License-Identifier: MIT
// Radial solvers, which weight their poses by the distances of the input controls from the targets
// of the poses. The compiler shares their arithmetic, because it inverts the matrices of the
// weights between targets; solver_poses() explains the weights of a result.
#pragma once

#include <cstddef>
#include <cstdint>

#include "rig/pose.h"

namespace risorius::rig {

enum RbfDistance : std::uint32_t { kEuclidean, kQuaternion, kSwingAngle, kTwistAngle };

/// For the distances of swing or twist angles: reduces each quaternion (x y z w) of values to its
/// swing or twist about the axis (0 x, 1 y, 2 z), in place. For other distances: does nothing.
/// In: values  [count], one quaternion after the other
void convert_rbf_inputs(std::uint32_t distance, std::uint32_t axis, double* values,
                        std::size_t count) noexcept;
/// The distance between two inputs that convert_rbf_inputs has converted: the length of their
/// difference, or for rotations the root of the sum of squared angles, in radians.
/// In: distance  an RbfDistance
///     a, b      [count]; rotations are x y z w, one after the other
double rbf_distance(std::uint32_t distance, const double* a, const double* b,
                    std::size_t count) noexcept;
/// The weight of a pose at a distance from its target.
/// In: function  as in the file: 0 Gaussian 1 exponential 2 linear 3 cubic 4 quintic
///     radius    0: the weight is 1 at distance 0, else 0
double rbf_kernel(std::uint32_t function, double distance, double radius) noexcept;

/// Distances and weights of a solver's poses, to explain a result of evaluate(), which computes the
/// same weights.
/// In:  index     below the number of solvers
///      controls  float32[controls] of an evaluated pose
///      work      of make_workspace
/// Out: distances, weights  [poses of the solver]: distances of rotations are in radians; weights
///                          without the factors of the input and output controls of a pose, 0 if
///                          not above the threshold
void solver_poses(const Rig& rig, std::uint32_t index, const float* controls, Workspace& work,
                  double* distances, float* weights) noexcept;

}  // namespace risorius::rig
