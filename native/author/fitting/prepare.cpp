// SPDX-License-Identifier: MIT
// Converts the shapes, the given joints and the pivots of a fit to the fit's own units.
#include "author/fitting/prepare.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "core/parallel_for.h"

namespace risorius::author::detail {

namespace {

using core::ErrorCode;

/// The smoothness with which weights are as smooth as the weights of the program Dem Bones with its
/// default options. It is a share of the vertices' mean squared motion.
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

/// Converts displacements to the fit's unit. An expression without a partner on the other side gets
/// a mirrored copy, so that the fit treats both sides of the face alike.
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

}  // namespace

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

namespace {

void set_motion(const Problem& problem, const JointMotion& from, std::size_t e, Joint& joint) {
  const Vec3 turn(from.rotation[0], from.rotation[1], from.rotation[2]);
  const double angle = turn.norm();
  if (angle > 0.0) joint.rotations[e] = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  joint.translations[e] =
      Vec3(from.translation[0], from.translation[1], from.translation[2]) * problem.scale;
  update_motion(joint, e);
}

/// Converts a given joint. Its motions in the added mirrored expressions are set later, by
/// pair_given.
Joint take_joint(const Problem& problem, const GivenJoint& given, std::uint32_t number) {
  Joint out;
  const Vector3& p = given.position;
  out.position = (Vec3(p[0], p[1], p[2]) - problem.middle) * problem.scale;
  out.place = out.position;
  out.rests = given.motions.empty();
  out.given = true;
  out.mirrored = number;
  rest(out, problem.expressions);
  for (std::size_t e = 0; e < given.motions.size(); ++e)
    set_motion(problem, given.motions[e], e, out);
  return out;
}

/// Pairs each given joint with the joint on the other side (itself if there is none), and fills the
/// motions of the given joints in the added mirrored expressions.
/// In: own  number of expressions without the added ones
void pair_given(const Problem& problem, const std::vector<GivenJoint>& given,
                std::vector<Joint>& joints, std::size_t own) {
  if (problem.mirror.empty()) return;
  const Mat3 flip = Vec3(-1, 1, 1).asDiagonal();
  // Several joints may have the same position: for example, all joints of an eye's lids are at the
  // middle of the eye. So pairs are found by comparing motions, too. A joint is the mirror of at
  // most one other joint.
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
      update_motion(joint, e);
    }
  }
}

/// For each vertex, finds the given joint that alone reproduces the vertex's motion best, if its
/// squared error is below half of the squared motion.
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
          const Affine& m = joints[j].motions[e];
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

}  // namespace

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
    // A pivot without a pivot on the other side that is near the plane x = 0 is moved into this
    // plane, so that it is its own mirror.
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
        return core::fail(ErrorCode::kInvalidValue, place, "weights from 0 to 1e6 were expected");
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

}  // namespace risorius::author::detail
