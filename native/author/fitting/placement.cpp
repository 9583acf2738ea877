// SPDX-License-Identifier: MIT
// Chooses the expressions that each joint takes part in, and its position.
#include <algorithm>

#include "author/fitting/problem.h"
#include "author/fitting/weights_by_joint.h"
#include "core/parallel_for.h"

namespace risorius::author::detail {

namespace {

/// The squared length of the part of a vertex's displacement that comes from a joint.
/// In: p       the vertex's neutral position times the weight
///     weight  the vertex's weight of the joint
double moved_square(const Affine& motion, const Vec3& p, double weight) {
  return (motion.leftCols<3>() * p + weight * motion.col(3)).squaredNorm();
}

}  // namespace

void leave_expressions(const Problem& problem, State& state, double least) {
  const ByJoint weights = by_joint(state);
  const std::size_t count = problem.expressions;
  std::vector<std::vector<bool>> small(state.joints.size());
  core::parallel_for(state.joints.size(), problem.threads, [&](std::size_t from, std::size_t to) {
    std::vector<double> most(count);
    for (std::size_t j = from; j < to; ++j) {
      most.assign(count, 0.0);
      for (const auto& entry : weights.of[j]) {
        const Vec3 p = entry.weight * problem.positions[entry.vertex];
        for (std::size_t e = 0; e < count; ++e) {
          most[e] = std::max(most[e], moved_square(state.joints[j].motions[e], p, entry.weight));
        }
      }
      for (const double square : most) small[j].push_back(square < least * least);
    }
  });
  const auto& other = problem.other_side;
  for (std::size_t j = 0; j < state.joints.size(); ++j) {
    Joint& joint = state.joints[j];
    if (joint.given) continue;
    joint.idle.resize(count);
    for (std::size_t e = 0; e < count; ++e) {
      // A joint leaves an expression only if its mirrored joint leaves the mirrored expression.
      const bool also = other.empty() || small[joint.mirrored][other[e]];
      if (!small[j][e] || !also) continue;
      joint.idle[e] = true;
      joint.rotations[e] = Mat3::Identity();
      joint.translations[e] = Vec3::Zero();
      update_motion(joint, e);
    }
  }
}

namespace {

/// The pivot whose expressions have the largest share of a joint's squared motion, or -1 if no
/// pivot has a share above 0.3 or joints are not placed at pivots.
int pivot_of(const Problem& problem, const Joint& joint,
             const std::vector<ByJoint::Entry>& weights) {
  if (problem.pivots.empty() || !problem.to_pivots) return -1;
  std::vector<double> energy(problem.expressions, 0.0);
  double all = 0.0;
  for (const auto& entry : weights) {
    const Vec3 p = entry.weight * problem.positions[entry.vertex];
    for (std::size_t e = 0; e < problem.expressions; ++e) {
      const double moved = moved_square(joint.motions[e], p, entry.weight);
      energy[e] += moved;
      all += moved;
    }
  }
  int best = -1;
  double most = 0.3 * all;
  for (std::size_t i = 0; i < problem.pivots.size(); ++i) {
    double share = 0.0;
    for (std::size_t e = 0; e < problem.expressions; ++e) {
      if (problem.pivots[i].expressions[e]) share += energy[e];
    }
    if (share > most) {
      most = share;
      best = static_cast<int>(i);
    }
  }
  return best;
}

/// Changes a joint's neutral position to `to`, and changes its translations so that its vertices
/// move as before.
void place_at(const Problem& problem, const Vec3& to, Joint& joint) {
  const Vec3 arm = to - joint.position;
  for (std::size_t e = 0; e < problem.expressions; ++e) {
    joint.translations[e] += joint.rotations[e] * arm - arm;
  }
  joint.position = to;
}

}  // namespace

void move_joints(const Problem& problem, State& state) {
  const ByJoint weights = by_joint(state);
  std::vector<int> pivots(state.joints.size(), -1);
  core::parallel_for(state.joints.size(), problem.threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t j = from; j < to; ++j) {
      if (!state.joints[j].given) pivots[j] = pivot_of(problem, state.joints[j], weights.of[j]);
    }
  });
  for (std::size_t j = 0; j < state.joints.size(); ++j) {
    Joint& joint = state.joints[j];
    if (joint.given) continue;
    Vec3 sum = Vec3::Zero();
    double total = 0.0;
    for (const auto& entry : weights.of[j]) {
      const double s = entry.weight * entry.weight;
      sum += s * problem.positions[entry.vertex];
      total += s;
    }
    if (total <= 0.0) continue;
    joint.place = sum / total;
    const bool alone = joint.mirrored == j;
    if (!problem.mirror.empty() && alone) joint.place.x() = 0.0;
    int pivot = pivots[j];
    if (!problem.mirror.empty() && joint.mirrored < j) {  // same as on the other side
      const int other = pivots[joint.mirrored];
      pivot = other < 0
                  ? -1
                  : static_cast<int>(problem.pivots[static_cast<std::size_t>(other)].mirrored);
    }
    Vec3 to = joint.place;
    if (pivot >= 0) to = problem.pivots[static_cast<std::size_t>(pivot)].position;
    if (!problem.mirror.empty() && alone && to.x() != 0.0) to = joint.place;
    place_at(problem, to, joint);
  }
}

}  // namespace risorius::author::detail
