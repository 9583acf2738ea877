// SPDX-License-Identifier: MIT
// Compiles radial solvers, which weight their poses by the distances of the input controls from the
// targets of the poses: converted targets, radii and inverse matrices. From: dna-format 12.4
#include <algorithm>
#include <cmath>
#include <utility>

#include "compile/parts.h"
#include "dna/controls.h"
#include "rig/stages/rbf.h"

namespace risorius::compile {

namespace {

using core::ErrorCode;
using core::fail;
using core::ok;
using core::Status;
using detail::count_of;
using detail::is_corrective;
using rig::RigData;

// The distance between the targets of two poses of a solver.
double distance(const RigData& r, const rig::RbfSolver& s, std::uint32_t a, std::uint32_t b) {
  const double* targets = r.rbf_targets.data() + s.targets_begin;
  return rig::rbf_distance(s.distance, targets + std::size_t{a} * s.input_count,
                           targets + std::size_t{b} * s.input_count, s.input_count);
}

double mean_distance(const RigData& r, const rig::RbfSolver& s) {
  double sum = 0;
  std::uint32_t pairs = 0;
  for (std::uint32_t a = 0; a < s.pose_count; ++a) {
    for (std::uint32_t b = a + 1; b < s.pose_count; ++b, ++pairs) sum += distance(r, s, a, b);
  }
  return pairs == 0 ? 0.0 : sum / pairs;
}

// Inverts a matrix m [n, n] by Gauss-Jordan elimination with the largest pivot of each column.
// Out: out      [n, n] the inverse, undefined if the matrix is singular
//      returns  the smallest absolute pivot, at most 1; 0 if the matrix is singular
double invert(std::vector<double> m, std::vector<double>& out, std::size_t n) {
  double smallest = 1.0;
  out.assign(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) out[i * n + i] = 1.0;
  for (std::size_t c = 0; c < n; ++c) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < n; ++r) {
      if (std::fabs(m[r * n + c]) > std::fabs(m[pivot * n + c])) pivot = r;
    }
    smallest = std::min(smallest, std::fabs(m[pivot * n + c]));
    if (!(smallest > 0)) return 0.0;
    for (std::size_t k = 0; k < n; ++k) {
      std::swap(m[c * n + k], m[pivot * n + k]);
      std::swap(out[c * n + k], out[pivot * n + k]);
    }
    const double scale = 1.0 / m[c * n + c];
    for (std::size_t k = 0; k < n; ++k) m[c * n + k] *= scale, out[c * n + k] *= scale;
    for (std::size_t r = 0; r < n; ++r) {
      const double factor = m[r * n + c];
      if (r == c || factor == 0) continue;
      for (std::size_t k = 0; k < n; ++k) {
        m[r * n + k] -= factor * m[c * n + k];
        out[r * n + k] -= factor * out[c * n + k];
      }
    }
  }
  return smallest;
}

// Inverts the matrix of kernel values between all targets of a solver. Targets that differ only by
// rounding make the matrix singular; then 1e-8 is added to its diagonal, so that the poses of these
// targets share their weight (the reference evaluator gives it to any one of them). If the matrix
// is still singular, it is stored instead of the inverse.
void add_inverse(rig::RbfSolver& s, RigData& out) {
  constexpr double kSingular = 1e-10, kRidge = 1e-8;
  const std::size_t n = s.pose_count;
  std::vector<double> kernels(n * n), inverse;
  for (std::uint32_t a = 0; a < n; ++a) {
    for (std::uint32_t b = 0; b < n; ++b) {
      kernels[a * n + b] = rig::rbf_kernel(s.function, distance(out, s, a, b), s.radius);
    }
  }
  if (!(invert(kernels, inverse, n) > kSingular)) {
    for (std::size_t i = 0; i < n; ++i) kernels[i * n + i] += kRidge;
    if (!(invert(kernels, inverse, n) > 0)) inverse = std::move(kernels);
  }
  s.interpolative = 1;
  s.inverse_begin = count_of(out.rbf_inverses);
  out.rbf_inverses.insert(out.rbf_inverses.end(), inverse.begin(), inverse.end());
}

void add_targets(const dna::RbfSolver& source, rig::RbfSolver& s, RigData& out) {
  s.targets_begin = count_of(out.rbf_targets);
  for (const float v : source.raw_control_values) {
    out.rbf_targets.push_back(static_cast<double>(v));
  }
  for (std::uint32_t p = 0; p < s.pose_count; ++p) {
    rig::convert_rbf_inputs(
        s.distance, s.axis,
        out.rbf_targets.data() + s.targets_begin + std::size_t{p} * s.input_count, s.input_count);
  }
}

// The poses of a file, each of which is compiled only once, although several solvers may list it.
class PoseLists {
 public:
  PoseLists(const dna::Dna& dna, RigData& out) : dna_(dna), out_(out) {
    poses_.resize(dna.rbf_behavior.poses.size());
    known_.resize(poses_.size(), false);
  }

  const rig::RbfPose& of(std::uint16_t index) {
    if (!known_[index]) poses_[index] = compile(index);
    known_[index] = true;
    return poses_[index];
  }

 private:
  // Compiles the scale, inputs and outputs of a pose. In files without layer rbfe a pose has no
  // inputs, and its only output is its own control.
  rig::RbfPose compile(std::uint16_t index) {
    const auto& ext = dna_.rbf_behavior_ext;
    rig::RbfPose pose;
    pose.scale = dna_.rbf_behavior.poses[index].scale;
    pose.inputs_begin = count_of(out_.rbf_pose_inputs);
    pose.outputs_begin = count_of(out_.rbf_outputs);
    if (ext.poses.empty() && ext.pose_control_names.empty()) {
      const dna::ControlCounts n = dna::control_counts(dna_);
      add_output(n.raw + n.psd + n.ml + index, 1.0f);
    } else if (index < ext.poses.size()) {
      const dna::RbfPoseControls& c = ext.poses[index];
      for (const std::uint16_t i : c.input_control_indices) out_.rbf_pose_inputs.push_back(i);
      for (std::size_t i = 0; i < c.output_control_indices.size(); ++i) {
        add_output(c.output_control_indices[i], c.output_control_weights[i]);
      }
    }
    pose.input_count = count_of(out_.rbf_pose_inputs) - pose.inputs_begin;
    pose.output_count = count_of(out_.rbf_outputs) - pose.outputs_begin;
    return pose;
  }
  void add_output(std::uint32_t control, float weight) {
    if (!is_corrective(out_, control)) out_.rbf_outputs.push_back({control, weight});
  }

  const dna::Dna& dna_;
  RigData& out_;
  std::vector<rig::RbfPose> poses_;
  std::vector<bool> known_;
};

Status check_solver(const dna::RbfSolver& s, const std::string& where) {
  if (s.distance_method == rig::kEuclidean || s.raw_control_indices.size() % 4 == 0) return ok();
  return fail(ErrorCode::kInvalidLength, where + ".raw_control_indices",
              std::to_string(s.raw_control_indices.size()) +
                  " controls, but a distance of rotations needs four for each");
}

// Charges the budget for the distances between all poses, and for the matrix of an interpolative
// solver.
Status take_matrices(const dna::RbfSolver& s, const std::string& where, detail::Budget& budget) {
  const std::uint64_t n = s.pose_indices.size();
  const std::uint64_t inputs = s.raw_control_indices.size() + 1;
  const bool interpolates = s.solver_type == 1;
  const std::uint64_t distances = s.automatic_radius == 0 || interpolates ? n * n : 0;
  RISORIUS_TRY(budget.take_steps(distances * inputs, where));
  if (!interpolates) return ok();
  RISORIUS_TRY(budget.take_bytes(n * n * sizeof(double), where));
  return budget.take_steps(n * n * n, where);
}

// Adds the poses of a solver and charges the budget for evaluating them. A pose that is listed
// several times is charged each time.
Status add_poses(const dna::RbfSolver& source, const std::string& where, PoseLists& poses,
                 detail::Budget& budget, RigData& out) {
  std::uint64_t steps = 0;
  for (const std::uint16_t p : source.pose_indices) {
    out.rbf_poses.push_back(poses.of(p));
    steps += out.rbf_poses.back().input_count + out.rbf_poses.back().output_count;
  }
  return budget.take_steps(steps, where);
}

Status add_solver(const dna::Dna& dna, const dna::RbfSolver& source, const std::string& where,
                  PoseLists& poses, detail::Budget& budget, RigData& out) {
  rig::RbfSolver s;
  s.threshold = source.weight_threshold;
  s.inputs_begin = count_of(out.rbf_inputs);
  s.input_count = count_of(source.raw_control_indices);
  s.poses_begin = count_of(out.rbf_poses);
  s.pose_count = count_of(source.pose_indices);
  s.distance = source.distance_method;
  s.function = source.function_type;
  s.axis = source.twist_axis < 3 ? source.twist_axis : 0;
  s.always_normalize = source.normalize_method == 1 ? 1 : 0;
  for (const std::uint16_t i : source.raw_control_indices) out.rbf_inputs.push_back(i);
  RISORIUS_TRY(add_poses(source, where, poses, budget, out));
  add_targets(source, s, out);
  s.radius = static_cast<double>(source.radius) *
             (dna.descriptor.rotation_unit == 1 ? 1.0 : 0.017453292519943295);
  if (source.automatic_radius == 0) s.radius = mean_distance(out, s);
  if (source.solver_type == 1) add_inverse(s, out);
  out.solver_inputs = std::max(out.solver_inputs, s.input_count);
  out.solver_poses = std::max(out.solver_poses, s.pose_count);
  out.rbf_solvers.push_back(s);
  return ok();
}

}  // namespace

std::vector<std::uint32_t> detail::listed(const dna::LodMapping& mapping, std::uint32_t lod) {
  if (lod >= mapping.lods.size() || mapping.lods[lod] >= mapping.rows.size()) return {};
  const auto& row = mapping.rows[mapping.lods[lod]];
  return {row.begin(), row.end()};
}

Status detail::compile_solvers(const dna::Dna& dna, Budget& budget, RigData& out, StepLods& lods) {
  const auto& solvers = dna.rbf_behavior.solvers;
  PoseLists poses(dna, out);
  for (std::size_t i = 0; i < solvers.size(); ++i) {
    const std::string where = "rbf_behavior.solvers[" + std::to_string(i) + "]";
    RISORIUS_TRY(check_solver(solvers[i], where));
    const std::string list = where + ".pose_indices";
    RISORIUS_TRY(take_matrices(solvers[i], list, budget));
    RISORIUS_TRY(add_solver(dna, solvers[i], list, poses, budget, out));
  }
  for (std::uint32_t lod = 0; lod < out.lod_count; ++lod) {
    lods.solvers.push_back(listed(dna.rbf_behavior.lod_solver_mapping, lod));
  }
  return ok();
}

}  // namespace risorius::compile
