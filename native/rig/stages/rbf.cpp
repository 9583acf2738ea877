// SPDX-License-Identifier: MIT
// Radial solvers, which weight their poses by the distances of the input controls from the targets
// of the poses. Computed in double: an arc cosine near 1 loses half of its digits.
// From: dna-format 12.4
#include "rig/stages/rbf.h"

#include <algorithm>
#include <cmath>

#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

double square(double v) { return v * v; }

// Reduces a quaternion to its twist, the rotation about an axis. For the quaternion 0 0 0 0 the
// result is NaN, so that the input is near no pose.
void twist_only(double* q, std::uint32_t axis) noexcept {
  const double length = std::sqrt(square(q[axis]) + square(q[3]));
  for (std::uint32_t i = 0; i < 3; ++i) q[i] = i == axis ? q[i] / length : 0.0;
  q[3] /= length;
}

// Replaces a quaternion q by its swing q * twist^-1, where twist is its rotation about the axis. A
// rotation of 180 degrees about a perpendicular axis needs no change.
void swing_only(double* q, std::uint32_t axis) noexcept {
  const double t = q[axis], w = q[3];
  const std::uint32_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  const double a = q[u], b = q[v], length = -std::sqrt(square(t) + square(w));
  q[axis] = 0;
  q[3] = length;
  if (length == 0 && (a != 0 || b != 0)) return;
  q[u] = (w * a - t * b) / length;
  q[v] = (w * b + t * a) / length;
}

double arc_squared(const double* a, const double* b) noexcept {
  const double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  return dot * dot > 1.0 ? 0.0 : square(std::acos(2.0 * dot * dot - 1.0));
}

double kernel(std::uint32_t function, double d, double r) noexcept {
  if (r == 0) return d == 0 ? 1.0 : (d != d ? d : 0.0);
  const double x = d / r;
  switch (function) {
    case 0:
      return std::exp(-d / (r * r));
    case 1:
      return std::exp(-2.0 * x);
    case 2:
      return 1.0 - x < 0 ? 0.0 : 1.0 - x;
    case 3:
      return 1.0 - x * x * x < 0 ? 0.0 : 1.0 - x * x * x;
    default:
      return 1.0 - x * x * x * x * x < 0 ? 0.0 : 1.0 - x * x * x * x * x;
  }
}

double clamp01(double v) { return v < 0.0 ? 0.0 : (v > 1.0 ? 1.0 : v); }

// Computes the weights of the poses before normalization, scale and threshold.
// Out: near    for each pose, the kernel's value at the distance from its target
//      values  weights; the sum of the weights is returned
double pose_values(const Rig& rig, const RbfSolver& s, const double* inputs, double* near,
                   double* values) noexcept {
  double sum = 0;
  for (std::uint32_t p = 0; p < s.pose_count; ++p) {
    const double* target =
        rig.rbf_targets.data() + s.targets_begin + std::size_t{p} * s.input_count;
    near[p] = kernel(s.function, rbf_distance(s.distance, inputs, target, s.input_count), s.radius);
  }
  for (std::uint32_t p = 0; p < s.pose_count; ++p) {
    values[p] = near[p];
    if (s.interpolative != 0) {
      const double* row = rig.rbf_inverses.data() + s.inverse_begin + std::size_t{p} * s.pose_count;
      double product = 0;
      for (std::uint32_t i = 0; i < s.pose_count; ++i) product += row[i] * near[i];
      values[p] = clamp01(product);
    }
    sum += values[p];
  }
  return sum;
}

void gather_inputs(const Rig& rig, const RbfSolver& s, const float* controls,
                   double* inputs) noexcept {
  for (std::uint32_t i = 0; i < s.input_count; ++i) {
    inputs[i] = static_cast<double>(controls[rig.rbf_inputs[s.inputs_begin + i]]);
  }
  convert_rbf_inputs(s.distance, s.axis, inputs, s.input_count);
}

// The factor for the weights of all poses. It makes them sum to 1 if their sum is above 1, or if
// the solver always normalizes and the sum is not 0; otherwise it is 1.
double ratio_of(const RbfSolver& s, double sum) noexcept {
  const bool normalize = sum > 1.0 || (s.always_normalize != 0 && sum != 0.0);
  return normalize ? 1.0 / sum : 1.0;
}

float weight_of(const RbfPose& pose, double value, double ratio) noexcept {
  return static_cast<float>(value * ratio * static_cast<double>(pose.scale));
}

void write_pose(const Rig& rig, const RbfPose& pose, float value, float* controls) noexcept {
  for (std::uint32_t i = 0; i < pose.input_count; ++i) {
    value *= controls[rig.rbf_pose_inputs[pose.inputs_begin + i]];
  }
  for (std::uint32_t i = 0; i < pose.output_count; ++i) {
    const RbfOutput& out = rig.rbf_outputs[pose.outputs_begin + i];
    controls[out.control] += out.weight * value;
  }
}

}  // namespace

void convert_rbf_inputs(std::uint32_t distance, std::uint32_t axis, double* values,
                        std::size_t count) noexcept {
  for (std::size_t q = 0; q + 4 <= count; q += 4) {
    if (distance == kSwingAngle) swing_only(values + q, axis);
    if (distance == kTwistAngle) twist_only(values + q, axis);
  }
}

double rbf_distance(std::uint32_t distance, const double* a, const double* b,
                    std::size_t count) noexcept {
  double sum = 0;
  if (distance == kEuclidean) {
    for (std::size_t i = 0; i < count; ++i) sum += square(a[i] - b[i]);
  } else {
    for (std::size_t q = 0; q + 4 <= count; q += 4) sum += arc_squared(a + q, b + q);
  }
  return std::sqrt(sum);
}

double rbf_kernel(std::uint32_t function, double distance, double radius) noexcept {
  return kernel(function, distance, radius);
}

void detail::run_solver(const Rig& rig, std::uint32_t index, Workspace& work,
                        float* controls) noexcept {
  const RbfSolver& s = rig.rbf_solvers[index];
  const std::span<const RbfPose> poses = rig.rbf_poses.subspan(s.poses_begin, s.pose_count);
  double* inputs = work.solver.data();
  double *near = inputs + rig.solver_inputs, *values = near + rig.solver_poses;
  gather_inputs(rig, s, controls, inputs);
  for (const RbfPose& pose : poses) {
    for (std::uint32_t i = 0; i < pose.output_count; ++i) {
      controls[rig.rbf_outputs[pose.outputs_begin + i].control] = 0.0f;
    }
  }
  const double ratio = ratio_of(s, pose_values(rig, s, inputs, near, values));
  for (std::size_t p = 0; p < poses.size(); ++p) {
    const float value = weight_of(poses[p], values[p], ratio);
    if (!(value > s.threshold)) continue;  // NaN is left out as well, as in the reference
    write_pose(rig, poses[p], value, controls);
  }
}

void solver_poses(const Rig& rig, std::uint32_t index, const float* controls, Workspace& work,
                  double* distances, float* weights) noexcept {
  const RbfSolver& s = rig.rbf_solvers[index];
  double* inputs = work.solver.data();
  double *near = inputs + rig.solver_inputs, *values = near + rig.solver_poses;
  gather_inputs(rig, s, controls, inputs);
  const double ratio = ratio_of(s, pose_values(rig, s, inputs, near, values));
  for (std::uint32_t p = 0; p < s.pose_count; ++p) {
    const double* target =
        rig.rbf_targets.data() + s.targets_begin + std::size_t{p} * s.input_count;
    distances[p] = rbf_distance(s.distance, inputs, target, s.input_count);
    const float value = weight_of(rig.rbf_poses[s.poses_begin + p], values[p], ratio);
    weights[p] = value > s.threshold ? value : 0.0f;
  }
}

}  // namespace risorius::rig
