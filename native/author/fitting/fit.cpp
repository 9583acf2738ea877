// SPDX-License-Identifier: MIT
#include "author/fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "author/fitting/problem.h"
#include "core/finite.h"
#include "core/parallel_for.h"

namespace risorius::author {

namespace {

using core::ErrorCode;
using detail::Influence;
using detail::Joint;
using detail::Mat3;
using detail::Problem;
using detail::State;
using detail::Vec3;

constexpr int kRoundsOfWeights = 12;
constexpr std::size_t kRoundsOfMotions = 8;  // of Gauss and Newton
// Joints leave an expression step by step: the others have taken over before the next ones go.
constexpr double kThinning[] = {0.5, 1.0};
/// Joints lie amid what they move until the last rounds: from a far pivot they turn on their own
/// worse.
constexpr std::size_t kRoundsAtPivots = 4;
/// Joints that stay where they are: those that a vertex needs may lie further off than its
/// neighbours'.
constexpr std::size_t kNearOfGiven = 12;
/// Of the mean square of motion: as smooth as Dem Bones leaves weights with its own default.
constexpr double kSmoothness = 0.18;

void find_neighbours(const std::vector<Edge>& edges, Problem& problem) {
  std::vector<std::uint32_t>& first = problem.first_neighbour;
  first.assign(problem.vertices + 1, 0);
  for (const Edge& e : edges) {
    ++first[e[0] + 1];
    ++first[e[1] + 1];
  }
  for (std::size_t v = 0; v < problem.vertices; ++v) first[v + 1] += first[v];
  problem.neighbours.resize(2 * edges.size());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (const Edge& e : edges) {
    problem.neighbours[next[e[0]]++] = e[1];
    problem.neighbours[next[e[1]]++] = e[0];
  }
}

/// Displacements in the fit's unit. An expression without a partner on the other side gets one, so
/// that what the middle and both sides ask for is the same.
void take_displacements(const Shapes& shapes, Problem& problem) {
  std::vector<std::uint32_t> alone;
  if (!problem.mirror.empty()) {
    problem.other_side.assign(problem.mirror.expressions.begin(), problem.mirror.expressions.end());
    for (std::uint32_t e = 0; e < shapes.expressions; ++e) {
      if (problem.mirror.expressions[e] != Mirror::kNone) continue;
      problem.other_side[e] = problem.other_side.size();
      problem.other_side.push_back(e);
      alone.push_back(e);
    }
  }
  problem.expressions = shapes.expressions + alone.size();
  problem.displacements.resize(problem.vertices * problem.expressions * 3);
  problem.motion.resize(problem.vertices);
  const auto scale = static_cast<float>(problem.scale);
  for (std::size_t v = 0; v < problem.vertices; ++v) {
    float* out = problem.displacements.data() + v * problem.expressions * 3;
    const float* own = shapes.of_vertex(v);
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t e = 0; e < shapes.expressions; ++e) *out++ = own[3 * e + k] * scale;
      for (const std::uint32_t e : alone) {
        const float* other = shapes.of_vertex(problem.mirror.vertices[v]) + 3 * e;
        *out++ = (k == 0 ? -other[k] : other[k]) * scale;
      }
    }
    double sum = 0.0;
    const float* d = problem.of_vertex(v);
    for (std::size_t x = 0; x < 3 * problem.expressions; ++x) sum += double{d[x]} * double{d[x]};
    problem.motion[v] = std::sqrt(sum);
  }
}

Problem make_problem(const Shapes& shapes, const FitOptions& options) {
  Problem out;
  out.vertices = shapes.vertex_count();
  out.influences = options.influences;
  out.threads = options.threads;
  if (options.symmetric) out.mirror = find_mirror(shapes);
  Vec3 low = Vec3::Constant(1e300), high = -low;
  for (const Vector3& p : shapes.neutral) {
    low = low.cwiseMin(Vec3(p[0], p[1], p[2]));
    high = high.cwiseMax(Vec3(p[0], p[1], p[2]));
  }
  out.middle = (low + high) / 2;
  if (!out.mirror.empty()) out.middle.x() = 0.0;
  out.scale = 1.0 / (high - low).maxCoeff();
  for (const Vector3& p : shapes.neutral) {
    out.positions.push_back((Vec3(p[0], p[1], p[2]) - out.middle) * out.scale);
  }
  find_neighbours(shapes.edges, out);
  take_displacements(shapes, out);
  out.asked = shapes.importance;
  if (out.asked.empty()) out.asked.assign(out.vertices, 1.0);
  double all = 0.0;
  for (const double a : out.asked) all += a / static_cast<double>(out.vertices);
  for (double& a : out.asked) a /= all;
  out.importance = out.asked;
  double mean = 0.0;
  for (std::size_t v = 0; v < out.vertices; ++v)
    mean += out.asked[v] * out.motion[v] * out.motion[v];
  out.smoothness =
      (options.smoothness * kSmoothness + 1e-9) * mean / static_cast<double>(out.vertices);
  return out;
}

void set_motion(const Problem& problem, const JointMotion& from, std::size_t e, Joint& joint) {
  const Vec3 turn(from.rotation[0], from.rotation[1], from.rotation[2]);
  const double angle = turn.norm();
  if (angle > 0.0) joint.rotations[e] = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  joint.translations[e] =
      Vec3(from.translation[0], from.translation[1], from.translation[2]) * problem.scale;
  detail::update_motion(joint, e);
}

/// A given joint. Expressions that were added as mirrors take the mirrored motion of their origin,
/// which is the motion of the joint on the other side: see pair_given.
Joint take_joint(const Problem& problem, const GivenJoint& given, std::uint32_t number) {
  Joint out;
  const Vector3& p = given.position;
  out.position = (Vec3(p[0], p[1], p[2]) - problem.middle) * problem.scale;
  out.place = out.position;
  out.rests = given.motions.empty();
  out.given = true;
  out.mirrored = number;
  detail::rest(out, problem.expressions);
  for (std::size_t e = 0; e < given.motions.size(); ++e)
    set_motion(problem, given.motions[e], e, out);
  return out;
}

/// Finds given joints' mirrors, and fills their motions in the expressions that were added.
void pair_given(const Problem& problem, const std::vector<GivenJoint>& given,
                std::vector<Joint>& joints, std::size_t own) {
  if (problem.mirror.empty()) return;
  const Mat3 flip = Vec3(-1, 1, 1).asDiagonal();
  // Several may lie at one place, such as the joints of a lid in the eye's middle: then what they
  // do tells which belong together. Each is one other's, never two's.
  std::vector<bool> taken(joints.size(), false);
  for (std::uint32_t j = 0; j < joints.size(); ++j) {
    taken[j] = j < given.size() && given[j].mirrored != GivenJoint::kUnknown;
    if (taken[j]) joints[j].mirrored = given[j].mirrored;
  }
  for (std::uint32_t j = 0; j < joints.size(); ++j) {
    if (taken[j]) continue;
    std::uint32_t best = j;
    double least = 1e300;
    for (std::uint32_t k = j; k < joints.size(); ++k) {
      if (taken[k] || (flip * joints[k].position - joints[j].position).norm() > 1e-3) continue;
      double apart = 0.0;
      for (std::size_t e = 0; e < own; ++e) {
        const std::uint32_t f = problem.mirror.expressions[e];
        if (f == Mirror::kNone || f >= own) continue;
        apart += (flip * joints[k].rotations[f] * flip - joints[j].rotations[e]).squaredNorm();
        apart += (flip * joints[k].translations[f] - joints[j].translations[e]).squaredNorm();
      }
      if (apart < least) {
        least = apart;
        best = k;
      }
    }
    joints[j].mirrored = best;
    joints[best].mirrored = j;
    taken[j] = taken[best] = true;
  }
  for (std::size_t e = own; e < problem.expressions; ++e) {
    const std::size_t from = problem.other_side[e];
    for (Joint& joint : joints) {
      const Joint& other = joints[joint.mirrored];
      joint.rotations[e] = flip * other.rotations[from] * flip;
      joint.translations[e] = flip * other.translations[from];
      detail::update_motion(joint, e);
    }
  }
}

/// Which of the given joints alone comes nearest to what a vertex does, where that is near at all.
void find_nearest_given(Problem& problem, const std::vector<Joint>& joints) {
  problem.nearest_given.assign(problem.vertices, Mirror::kNone);
  core::parallel_for(problem.vertices, problem.threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t v = from; v < to; ++v) {
      const Vec3& p = problem.positions[v];
      double least = 0.5 * problem.motion[v] * problem.motion[v];
      for (std::uint32_t j = 0; j < joints.size(); ++j) {
        if (joints[j].rests) continue;
        const float* d = problem.of_vertex(v);
        double error = 0.0;
        const std::size_t count = problem.expressions;
        for (std::size_t e = 0; e < count && error < least; ++e) {
          const detail::Affine& m = joints[j].motions[e];
          const Vec3 wanted(double{d[e]}, double{d[count + e]}, double{d[2 * count + e]});
          error += (m.leftCols<3>() * p + m.col(3) - wanted).squaredNorm();
        }
        if (error < least) {
          least = error;
          problem.nearest_given[v] = j;
        }
      }
    }
  });
}

/// The pivots in the fit's unit, each with that of the other side.
void take_pivots(const std::vector<Pivot>& pivots, Problem& problem) {
  for (std::size_t i = 0; i < pivots.size(); ++i) {
    const Vector3& p = pivots[i].position;
    Problem::Pivot pivot;
    pivot.position = (Vec3(p[0], p[1], p[2]) - problem.middle) * problem.scale;
    pivot.expressions.assign(problem.expressions, false);
    for (const std::uint32_t e : pivots[i].expressions) pivot.expressions[e] = true;
    pivot.mirrored = i;
    problem.pivots.push_back(std::move(pivot));
  }
  if (problem.mirror.empty()) return;
  for (std::size_t i = 0; i < pivots.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      Vec3& a = problem.pivots[i].position;
      Vec3& b = problem.pivots[k].position;
      const Vec3 other(-b.x(), b.y(), b.z());
      if ((a - other).norm() > 0.02) continue;
      a = (a + other) / 2;
      b = Vec3(-a.x(), a.y(), a.z());
      problem.pivots[i].mirrored = k;
      problem.pivots[k].mirrored = i;
    }
    // What has no other side lies in the middle.
    if (problem.pivots[i].mirrored == i && std::abs(problem.pivots[i].position.x()) < 0.02) {
      problem.pivots[i].position.x() = 0.0;
    }
  }
}

State start(Problem& problem, const std::vector<GivenJoint>& given, std::size_t own) {
  State out;
  for (const GivenJoint& g : given) {
    out.joints.push_back(take_joint(problem, g, static_cast<std::uint32_t>(out.joints.size())));
  }
  const auto rests = [](const Joint& j) { return j.rests; };
  if (std::none_of(out.joints.begin(), out.joints.end(), rests)) {
    GivenJoint head;
    head.position = {problem.middle.x(), problem.middle.y(), problem.middle.z()};
    out.joints.push_back(take_joint(problem, head, static_cast<std::uint32_t>(out.joints.size())));
  }
  pair_given(problem, given, out.joints, own);
  find_nearest_given(problem, out.joints);
  const auto head = std::find_if(out.joints.begin(), out.joints.end(), rests);
  out.weights.assign(problem.vertices,
                     {Influence{static_cast<std::uint32_t>(head - out.joints.begin()), 1.0}});
  return out;
}

/// [V] the square of the largest error of each vertex in any expression, as far as it counts.
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

/// Vertices whose largest error stands out count more from here on.
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

core::Status check_mesh(const Shapes& shapes) {
  const std::size_t n = shapes.vertex_count();
  for (const Edge& e : shapes.edges) {
    if (e[0] < n && e[1] < n) continue;
    return core::fail(
        ErrorCode::kInvalidIndex, "edges",
        "an edge has vertex " + std::to_string(std::max(e[0], e[1])) + " of " + std::to_string(n));
  }
  for (std::size_t v = 0; v < n; ++v) {
    for (const double x : shapes.neutral[v]) {
      if (!std::isfinite(x)) {
        return core::fail(ErrorCode::kInvalidValue, "neutral[" + std::to_string(v) + "]",
                          "a finite number was expected");
      }
    }
  }
  if (!shapes.importance.empty() && shapes.importance.size() != n) {
    return core::fail(ErrorCode::kInvalidLength, "importance",
                      std::to_string(n) + " numbers or none were expected, found " +
                          std::to_string(shapes.importance.size()));
  }
  for (std::size_t v = 0; v < shapes.importance.size(); ++v) {
    if (shapes.importance[v] > 0.0 && std::isfinite(shapes.importance[v])) continue;
    return core::fail(ErrorCode::kInvalidValue, "importance[" + std::to_string(v) + "]",
                      "a finite number above 0 was expected");
  }
  return core::ok();
}

core::Status check_displacements(const Shapes& shapes) {
  double most = 0.0;
  for (std::size_t i = 0; i < shapes.displacements.size(); ++i) {
    const float d = shapes.displacements[i];
    if (!core::is_finite(d)) {
      return core::fail(ErrorCode::kInvalidValue,
                        "displacements[" + std::to_string(i / 3 / shapes.expressions) + "][" +
                            std::to_string(i / 3 % shapes.expressions) + "]",
                        "a finite number was expected");
    }
    most = std::max(most, std::abs(double{d}));
  }
  if (most <= 0.0)
    return core::fail(ErrorCode::kInvalidValue, "displacements", "no expression moves a vertex");
  return core::ok();
}

core::Status check_given(const std::vector<GivenJoint>& given, std::size_t expressions) {
  for (std::size_t j = 0; j < given.size(); ++j) {
    const std::uint32_t other = given[j].mirrored;
    if (other == GivenJoint::kUnknown) continue;
    if (other < given.size() && given[other].mirrored == j) continue;
    return core::fail(ErrorCode::kInvalidIndex, "given[" + std::to_string(j) + "]",
                      "a joint of the other side was expected whose other side it is");
  }
  for (const GivenJoint& g : given) {
    if (g.motions.empty() || g.motions.size() == expressions) continue;
    return core::fail(ErrorCode::kInvalidLength, "given",
                      "motions of " + std::to_string(expressions) +
                          " expressions or none were expected, found " +
                          std::to_string(g.motions.size()));
  }
  return core::ok();
}

core::Status check_pivots(const std::vector<Pivot>& pivots, std::size_t expressions) {
  for (std::size_t i = 0; i < pivots.size(); ++i) {
    const Pivot& pivot = pivots[i];
    const std::string place = "pivots[" + std::to_string(i) + "]";
    for (const double x : pivot.position) {
      if (!std::isfinite(x))
        return core::fail(ErrorCode::kInvalidValue, place, "a finite number was expected");
    }
    for (const std::uint32_t e : pivot.expressions) {
      if (e < expressions) continue;
      return core::fail(ErrorCode::kInvalidIndex, place,
                        "expression " + std::to_string(e) + " of " + std::to_string(expressions));
    }
  }
  return core::ok();
}

core::Status check_numbers(const FitOptions& options) {
  const std::size_t needed = options.given.size() + 2;
  if (options.joints < needed || options.joints > 4096) {
    return core::fail(
        ErrorCode::kInvalidArgument, "joints",
        std::to_string(needed) + " to 4096 were expected, found " + std::to_string(options.joints));
  }
  if (options.influences < 1 || options.influences > 16) {
    return core::fail(ErrorCode::kInvalidArgument, "influences",
                      "1 to 16 were expected, found " + std::to_string(options.influences));
  }
  if (!(options.least_effect >= 0.0 && std::isfinite(options.least_effect))) {
    return core::fail(ErrorCode::kInvalidArgument, "least_effect",
                      "a finite number from 0 on was expected");
  }
  for (const double x : {options.smoothness, options.emphasis}) {
    if (!(x >= 0.0 && x <= 100.0)) {
      return core::fail(ErrorCode::kInvalidArgument, "smoothness, emphasis",
                        "0 to 100 were expected");
    }
  }
  return core::ok();
}

core::Status check(const Shapes& shapes, const FitOptions& options) {
  const std::size_t n = shapes.vertex_count(), values = n * shapes.expressions * 3;
  if (n == 0 || shapes.expressions == 0) {
    return core::fail(ErrorCode::kInvalidArgument, "shapes",
                      "a mesh and at least one expression were expected");
  }
  if (shapes.displacements.size() != values) {
    return core::fail(ErrorCode::kInvalidArgument, "displacements",
                      std::to_string(values) + " numbers were expected, found " +
                          std::to_string(shapes.displacements.size()));
  }
  RISORIUS_TRY(check_mesh(shapes));
  RISORIUS_TRY(check_displacements(shapes));
  RISORIUS_TRY(check_given(options.given, shapes.expressions));
  RISORIUS_TRY(check_pivots(options.pivots, shapes.expressions));
  RISORIUS_TRY(check_numbers(options));
  return core::ok();
}

/// Takes the weights to begin with. Fails: see fit_weights
core::Status take_start(const StartWeights& start, State& state) {
  if (start.influences == 0) return core::ok();
  const std::size_t size = state.weights.size() * start.influences;
  if (start.joints.size() != size || start.weights.size() != size) {
    return core::fail(ErrorCode::kInvalidLength, "start",
                      std::to_string(size) + " numbers were expected");
  }
  for (std::size_t v = 0; v < state.weights.size(); ++v) {
    std::vector<Influence> row;
    double sum = 0.0;
    for (std::size_t at = v * start.influences; at < (v + 1) * start.influences; ++at) {
      const float weight = start.weights[at];
      const std::string place = "start[" + std::to_string(v) + "]";
      if (!(weight >= 0.0f && weight <= 1e6f)) {
        return core::fail(ErrorCode::kInvalidValue, place, "weights from 0 on were expected");
      }
      if (weight == 0.0f) continue;
      if (start.joints[at] >= state.joints.size()) {
        return core::fail(ErrorCode::kInvalidIndex, place,
                          "joint " + std::to_string(start.joints[at]) + " of " +
                              std::to_string(state.joints.size()));
      }
      row.push_back({start.joints[at], static_cast<double>(weight)});
      sum += static_cast<double>(weight);
    }
    if (row.empty()) continue;
    for (Influence& i : row) i.weight /= sum;
    state.weights[v] = std::move(row);
  }
  return core::ok();
}

/// How many joints there are after each step of growing.
std::vector<std::size_t> stages(std::size_t joints) {
  std::vector<std::size_t> out{joints};
  while (out.back() > 30) out.push_back(out.back() * 2 / 3);
  std::reverse(out.begin(), out.end());
  return out;
}

class Steps {  // tells how far the work is
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

/// What a round would end at, kept where its largest error is the smallest so far.
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

/// Joints leave the expressions in which they do little, and the others take over.
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

/// New joints that rest, each in the middle of what it moves or at its pivot.
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
  RISORIUS_TRY(take_start(weights, state));
  detail::move_joints(problem, state);
  for (std::size_t j = 0; j < at.size(); ++j) {
    if (at[j] != kInTheMiddle) state.joints[given + j].position = problem.pivots[at[j]].position;
  }
  return core::ok();
}

}  // namespace

core::Result<Fit> fit_joints(const Shapes& shapes, const FitOptions& options,
                             const Progress& progress) {
  RISORIUS_TRY(check(shapes, options));
  Problem problem = make_problem(shapes, options);
  take_pivots(options.pivots, problem);
  State state = start(problem, options.given, shapes.expressions);
  std::vector<float> left;
  if (!options.given.empty()) {  // what the given joints move is theirs before others come
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
  for (std::size_t r = 0; r < options.rounds; ++r) {
    problem.to_pivots =
        r + kRoundsAtPivots >= options.rounds || (options.bound && 2 * r >= options.rounds);
    improve(problem, state, left);
    if (options.bound && problem.to_pivots) best.take(problem, state, left);
    // The last two rounds even out what the new importance asked for.
    if (r + 2 < options.rounds) emphasise(problem, left, options.emphasis);
    if (!steps.go_on()) return stopped();
  }
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
  own.symmetric = false;  // as symmetric as the shapes and the weights are
  RISORIUS_TRY(check(shapes, own));
  Problem problem = make_problem(shapes, own);
  take_pivots(own.pivots, problem);
  State state = start(problem, own.given, shapes.expressions);
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
  RISORIUS_TRY(check(shapes, own));
  Problem problem = make_problem(shapes, own);
  problem.near = kNearOfGiven;
  State state = start(problem, joints, shapes.expressions);
  RISORIUS_TRY(take_start(start_weights, state));
  // Neighbours tell each other which joints are worth trying: once round a ring, twice for the
  // next.
  for (int round = 0; round < kRoundsOfWeights; ++round) detail::solve_weights(problem, state);
  return pack(problem, state, shapes.expressions);
}

}  // namespace risorius::author
