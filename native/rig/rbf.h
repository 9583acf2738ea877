// SPDX-License-Identifier: MIT
// The arithmetic of radial solvers, shared with the compiler that turns over their targets.
#pragma once

#include <cstddef>
#include <cstdint>

namespace risorius::rig {

enum RbfDistance : std::uint32_t { kEuclidean, kQuaternion, kSwingAngle, kTwistAngle };

/// Reduces each quaternion (x y z w) of values to its swing or twist about the axis, in place;
/// other distances leave them as they are.
void convert_rbf_inputs(std::uint32_t distance, std::uint32_t axis, double* values,
                        std::size_t count) noexcept;
/// Between two converted inputs: length of the difference, or root of the sum of squared arcs.
double rbf_distance(std::uint32_t distance, const double* a, const double* b,
                    std::size_t count) noexcept;
/// In: function as in the file: 0 Gaussian 1 exponential 2 linear 3 cubic 4 quintic. A radius of 0
/// is the limit: 1 at distance 0, else 0.
double rbf_kernel(std::uint32_t function, double distance, double radius) noexcept;

}  // namespace risorius::rig
