// SPDX-License-Identifier: MIT
// Fits joints, weights and joint motions to the expressions of a mesh, in rounds: motions for
// given weights, then weights for given motions.
#include "author/fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "author/fitting/prepare.h"
#include "author/fitting/problem.h"

namespace risorius::author {

namespace {

using core::ErrorCode;
using detail::Influence;
using detail::Joint;
using detail::Problem;
using detail::State;
using detail::Vec3;

constexpr int kRoundsOfWeights = 12;
constexpr std::size_t kRoundsOfMotions = 8;  // Gauss-Newton steps
// Factors of FitOptions::least_effect in two steps of thin_out. In each step, a joint leaves an
// expression in which it moves every vertex by less than the factor times least_effect. There are
// two steps, so that other joints take over before more joints leave.
constexpr double kThinning[] = {0.5, 1.0};
/// In this number of last rounds, joints are placed at their pivots, and momentum is 0 so that the
/// overshoot of earlier rounds is corrected. In earlier rounds a joint is in the middle of its
/// vertices (with FitOptions::bound only in the first half of the rounds), because a rotation about
/// a far pivot is solved less exactly.
constexpr std::size_t kLastRounds = 4;
constexpr double kMomentum = 0.6;
/// Number of the nearest joints that a vertex tries in fit_weights, in which joints do not move. A
/// vertex may need joints that are further away than the joints of its neighbours.
constexpr std::size_t kNearOfGiven = 12;
/// [V] the square of each vertex's largest error in any expression, times the importance that the
/// caller gives to the vertex.
/// In: left  the residual of find_residual
std::vector<double> worst_squares(const Problem& problem, const std::vector<float>& left) {
  std::vector<double> out(problem.vertices);
  for (std::size_t v = 0; v < problem.vertices; ++v) {
    const std::size_t count = problem.expressions;
    const float *x = left.data() + v * count * 3, *y = x + count, *z = y + count;
    float most = 0.0f;
    for (std::size_t e = 0; e < count; ++e) {
      most = std::max(most, x[e] * x[e] + y[e] * y[e] + z[e] * z[e]);
    }
    out[v] = double{most} * problem.asked[v];
  }
  return out;
}

/// Raises the importance of vertices whose largest error is above the mean, and lowers the
/// importance of the other vertices.
/// In: power  FitOptions::emphasis; 0: importance stays as it is
void emphasise(Problem& problem, const std::vector<float>& left, double power) {
  if (power <= 0.0) return;
  std::vector<double> worst = worst_squares(problem, left);
  double mean = 0.0;
  for (double& w : worst) {
    w = std::sqrt(w);
    mean += w / static_cast<double>(problem.vertices);
  }
  double sum = 0.0;
  for (std::size_t v = 0; v < problem.vertices; ++v) {
    const double target = problem.asked[v] * std::pow((worst[v] + 0.2 * mean) / mean, power);
    problem.importance[v] = std::sqrt(problem.importance[v] * target);
    sum += problem.importance[v];
  }
  const double mean_is_one = static_cast<double>(problem.vertices) / sum;
  for (std::size_t v = 0; v < problem.vertices; ++v) {
    const double asked = problem.asked[v];
    problem.importance[v] =
        std::clamp(problem.importance[v] * mean_is_one, 0.1 * asked, 100.0 * asked);
  }
}

Fit pack(const Problem& problem, const State& state, std::size_t expressions) {
  Fit out;
  out.influences = problem.influences;
  out.weight_joints.assign(problem.vertices * out.influences, 0);
  out.weights.assign(problem.vertices * out.influences, 0.0f);
  for (std::size_t v = 0; v < problem.vertices; ++v) {
    std::size_t at = v * out.influences;
    for (const Influence& i : state.weights[v]) {
      out.weight_joints[at] = static_cast<std::uint16_t>(i.joint);
      out.weights[at++] = static_cast<float>(i.weight);
    }
  }
  for (const Joint& joint : state.joints) {
    const Vec3 p = joint.position / problem.scale + problem.middle;
    out.joints.push_back({p.x(), p.y(), p.z()});
    out.mirrored.push_back(joint.mirrored);
    for (std::size_t e = 0; e < expressions; ++e) {
      const Eigen::AngleAxisd turn(joint.rotations[e]);
      const Vec3 r = turn.angle() * turn.axis(), t = joint.translations[e] / problem.scale;
      out.motions.push_back({{r.x(), r.y(), r.z()}, {t.x(), t.y(), t.z()}});
    }
  }
  return out;
}

/// Joints are added in several steps: the total number of joints after each step. The last number
/// is `joints`.
std::vector<std::size_t> stages(std::size_t joints) {
  std::vector<std::size_t> out{joints};
  while (out.back() > 30) out.push_back(out.back() * 2 / 3);
  std::reverse(out.begin(), out.end());
  return out;
}

class Steps {  // reports the share of work that is done
 public:
  Steps(const Progress& progress, std::size_t count) : progress_(progress), count_(count) {}
  bool go_on() {
    ++done_;
    return !progress_ || progress_(static_cast<double>(done_) / static_cast<double>(count_));
  }

 private:
  const Progress& progress_;
  std::size_t count_, done_ = 0;
};

void improve(const Problem& problem, State& state, std::vector<float>& left) {
  detail::solve_motions(problem, state, left);
  detail::solve_weights(problem, state);
  detail::move_joints(problem, state);
  detail::find_residual(problem, state, left);
}

/// The sum of squared residuals, in which all vertices have the same weight.
double squares(const std::vector<float>& left) {
  double sum = 0.0;
  for (const float x : left) sum += double{x} * double{x};
  return sum;
}

/// The state of the round whose largest error is the smallest so far.
struct Best {
  std::optional<State> state;
  double largest = std::numeric_limits<double>::infinity();  // squared

  void take(const Problem& problem, const State& now, std::vector<float> left) {
    State tried = now;
    detail::solve_motions(problem, tried, left);
    const double worst = std::ranges::max(worst_squares(problem, left));
    if (worst >= largest) return;
    largest = worst;
    state = std::move(tried);
  }
};

/// Removes joints from the expressions in which they move every vertex by less than least_effect
/// (in the shapes' unit); the other joints take over.
void thin_out(const Problem& problem, double least_effect, State& state, std::vector<float>& left) {
  for (const double share : kThinning) {
    detail::leave_expressions(problem, state, share * least_effect * problem.scale);
    detail::find_residual(problem, state, left);
    detail::solve_motions(problem, state, left);
    detail::solve_weights(problem, state);
    detail::find_residual(problem, state, left);
    detail::solve_motions(problem, state, left);
  }
}

/// Adds new joints without motions, each in the middle of its vertices or at its pivot, and sets
/// the weights of all joints.
/// In:    at  [new joints] index of the joint's pivot, or kInTheMiddle
/// Fails: kInvalidIndex, kInvalidLength, kInvalidValue (at, weights)
core::Status take_new_joints(const Problem& problem, const StartWeights& weights,
                             const std::vector<std::uint32_t>& at, State& state) {
  const std::size_t given = state.joints.size();
  for (std::size_t j = 0; j < at.size(); ++j) {
    if (at[j] == kInTheMiddle || at[j] < problem.pivots.size()) continue;
    return core::fail(
        ErrorCode::kInvalidIndex, "at[" + std::to_string(j) + "]",
        "pivot " + std::to_string(at[j]) + " of " + std::to_string(problem.pivots.size()));
  }
  state.joints.resize(given + at.size());
  for (std::size_t j = given; j < state.joints.size(); ++j) {
    state.joints[j].mirrored = static_cast<std::uint32_t>(j);
    detail::rest(state.joints[j], problem.expressions);
  }
  RISORIUS_TRY(detail::take_start(weights, state));
  detail::move_joints(problem, state);
  for (std::size_t j = 0; j < at.size(); ++j) {
    if (at[j] != kInTheMiddle) state.joints[given + j].position = problem.pivots[at[j]].position;
  }
  return core::ok();
}

}  // namespace

core::Result<Fit> fit_joints(const Shapes& shapes, const FitOptions& options,
                             const Progress& progress) {
  RISORIUS_TRY(detail::check(shapes, options));
  Problem problem = detail::make_problem(shapes, options);
  detail::take_pivots(options.pivots, problem);
  State state = detail::start(problem, options.given, shapes.expressions);
  std::vector<float> left;
  // Before other joints are added, the given joints get the vertices that they move.
  if (!options.given.empty()) {
    for (int round = 0; round < kRoundsOfWeights; ++round) detail::solve_weights(problem, state);
  }
  detail::find_residual(problem, state, left);
  const std::vector<std::size_t> counts = stages(options.joints);
  Steps steps(progress, 2 * counts.size() + options.rounds + 1);
  const auto stopped = [] { return core::fail(ErrorCode::kInvalidArgument, "", "stopped"); };
  for (const std::size_t count : counts) {
    detail::add_joints(problem, state, left, std::max(count, state.joints.size()));
    for (int repeat = 0; repeat < 2; ++repeat) {
      detail::find_residual(problem, state, left);
      improve(problem, state, left);
      if (!steps.go_on()) return stopped();
    }
  }
  Best best;
  double before = squares(left);
  for (std::size_t r = 0; r < options.rounds; ++r) {
    const bool last = r + kLastRounds >= options.rounds;
    problem.to_pivots = last || (options.bound && 2 * r >= options.rounds);
    problem.momentum = last ? 0.0 : kMomentum;
    improve(problem, state, left);
    if (problem.to_pivots) best.take(problem, state, left);
    // The last two rounds only adapt to the last change of importance.
    if (r + 2 < options.rounds) emphasise(problem, left, options.emphasis);
    const double now = squares(left);
    if (now > before) state.solved.clear();  // momentum overshot: start it again
    before = now;
    if (!steps.go_on()) return stopped();
  }
  problem.momentum = 0.0;
  if (best.state) {
    state = std::move(*best.state);
  } else {
    detail::solve_motions(problem, state, left);
  }
  if (!steps.go_on()) return stopped();
  if (options.least_effect > 0.0) thin_out(problem, options.least_effect, state, left);
  return pack(problem, state, shapes.expressions);
}

core::Result<Fit> fit_motions(const Shapes& shapes, const FitOptions& options,
                              const StartWeights& weights, const std::vector<std::uint32_t>& at) {
  FitOptions own = options;
  own.symmetric = false;  // the result is as symmetric as the shapes and the weights
  RISORIUS_TRY(detail::check(shapes, own));
  Problem problem = detail::make_problem(shapes, own);
  detail::take_pivots(own.pivots, problem);
  State state = detail::start(problem, own.given, shapes.expressions);
  if (state.joints.size() + at.size() != own.joints || own.given.size() != state.joints.size()) {
    return core::fail(ErrorCode::kInvalidArgument, "given",
                      "a joint that rests and " + std::to_string(own.joints) +
                          " joints in all were expected, found " +
                          std::to_string(own.given.size() + at.size()));
  }
  RISORIUS_TRY(take_new_joints(problem, weights, at, state));
  problem.influences = std::max(weights.influences, std::size_t{1});
  std::vector<float> left;
  detail::find_residual(problem, state, left);
  for (std::size_t round = 0; round < kRoundsOfMotions; ++round) {
    if (round > 1 && round + 2 < kRoundsOfMotions) emphasise(problem, left, own.emphasis);
    detail::solve_motions(problem, state, left);
  }
  for (const double share : kThinning) {
    if (own.least_effect <= 0.0) break;
    detail::leave_expressions(problem, state, share * own.least_effect * problem.scale);
    detail::find_residual(problem, state, left);
    for (int round = 0; round < 2; ++round) detail::solve_motions(problem, state, left);
  }
  return pack(problem, state, shapes.expressions);
}

core::Result<Fit> fit_weights(const Shapes& shapes, const std::vector<GivenJoint>& joints,
                              const FitOptions& options, const StartWeights& start_weights) {
  FitOptions own = options;
  own.given = joints;
  own.joints = joints.size() + 2;
  RISORIUS_TRY(detail::check(shapes, own));
  Problem problem = detail::make_problem(shapes, own);
  problem.near = kNearOfGiven;
  State state = detail::start(problem, joints, shapes.expressions);
  RISORIUS_TRY(detail::take_start(start_weights, state));
  // In each round a vertex tries the joints of its neighbours, so that a joint spreads by one ring
  // of vertices.
  for (int round = 0; round < kRoundsOfWeights; ++round) detail::solve_weights(problem, state);
  return pack(problem, state, shapes.expressions);
}

}  // namespace risorius::author
