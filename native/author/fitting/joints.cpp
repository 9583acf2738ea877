// SPDX-License-Identifier: MIT
// Places new joints at the vertices with the largest error, apart from each other.
#include <algorithm>
#include <cmath>

#include "author/fitting/problem.h"

namespace risorius::author::detail {

namespace {

/// [V] the length of each vertex's residuals in all expressions together, weighted by importance
/// and averaged with the neighbours as a root mean square.
std::vector<double> errors(const Problem& problem, const std::vector<float>& left) {
  std::vector<double> raw(problem.vertices), out(problem.vertices);
  const std::size_t row = 3 * problem.expressions;
  for (std::size_t v = 0; v < problem.vertices; ++v) {
    double sum = 0.0;
    for (std::size_t x = 0; x < row; ++x) {
      const double d = double{left[v * row + x]};
      sum += d * d;
    }
    raw[v] = problem.importance[v] * sum;
  }
  for (std::size_t v = 0; v < problem.vertices; ++v) {
    double sum = raw[v];
    const std::size_t begin = problem.first_neighbour[v], end = problem.first_neighbour[v + 1];
    for (std::size_t n = begin; n < end; ++n) sum += raw[problem.neighbours[n]];
    out[v] = std::sqrt(sum / static_cast<double>(end - begin + 1));
  }
  return out;
}

/// The distance between neighbouring joints, as a share of the mesh's size, if `joints` joints were
/// spread evenly over the part of the surface that moves.
double spacing(const Problem& problem, std::size_t joints) {
  double moving = 0.0;
  const double most = *std::max_element(problem.motion.begin(), problem.motion.end());
  for (const double m : problem.motion) moving += m > 0.02 * most ? 1.0 : 0.0;
  // The surface area of a head is about three times its squared size.
  const double area = 3.0 * moving / static_cast<double>(problem.vertices);
  return std::sqrt(area / static_cast<double>(std::max<std::size_t>(joints, 1)));
}

Joint make_joint(const Problem& problem, const Vec3& position, std::uint32_t mirrored) {
  Joint out;
  out.position = position;
  out.place = position;
  out.mirrored = mirrored;
  rest(out, problem.expressions);
  return out;
}

/// Gives the vertices around a new joint weights of this joint: 0.7 at the joint, falling to 0 at
/// the distance `reach`. The other weights of a vertex are scaled so that the sum stays 1.
void take_weights(const Problem& problem, State& state, std::uint32_t joint, double reach) {
  const Vec3& centre = state.joints[joint].position;
  for (std::size_t v = 0; v < problem.vertices; ++v) {
    const double d = (problem.positions[v] - centre).norm() / reach;
    if (d >= 1.0) continue;
    const double share = 0.7 * (1 - d * d) * (1 - d * d);
    for (Influence& i : state.weights[v]) i.weight *= 1 - share;
    state.weights[v].push_back({joint, share});
  }
}

}  // namespace

void add_joints(const Problem& problem, State& state, const std::vector<float>& left,
                std::size_t count) {
  std::vector<double> error = errors(problem, left);
  const double reach = spacing(problem, count);
  std::vector<double> room(problem.vertices, 1.0);  // 0 at a new joint, 1 far from all of them
  std::vector<std::uint32_t> fresh;
  const auto occupy = [&](const Vec3& centre) {
    for (std::size_t v = 0; v < problem.vertices; ++v) {
      const double d = (problem.positions[v] - centre).norm() / reach;
      room[v] = std::min(room[v], d * d);
    }
  };
  while (state.joints.size() < count) {
    std::size_t best = 0;
    double most = -1.0;
    for (std::size_t v = 0; v < problem.vertices; ++v) {
      if (!problem.is_representative(v)) continue;
      const double score = error[v] * std::min(room[v], 1.0);
      if (score > most) {
        most = score;
        best = v;
      }
    }
    if (most <= 0.0) return;
    Vec3 position = problem.positions[best];
    const auto number = static_cast<std::uint32_t>(state.joints.size());
    const bool middle = problem.mirror.empty() || std::abs(position.x()) < 0.25 * reach;
    if (!problem.mirror.empty() && middle) position.x() = 0.0;
    if (!middle && number + 2 > count) {  // no room for two
      room[best] = 0.0;
      bool left_over = false;
      for (std::size_t v = 0; v < problem.vertices && !left_over; ++v) {
        left_over =
            std::abs(problem.positions[v].x()) < 0.25 * reach && error[v] > 0 && room[v] > 0;
      }
      if (!left_over) return;
      continue;
    }
    state.joints.push_back(make_joint(problem, position, middle ? number : number + 1));
    fresh.push_back(number);
    occupy(position);
    if (!middle) {
      const Vec3 other(-position.x(), position.y(), position.z());
      state.joints.push_back(make_joint(problem, other, number));
      fresh.push_back(number + 1);
      occupy(other);
    }
  }
  for (const std::uint32_t j : fresh) take_weights(problem, state, j, 1.2 * reach);
}

}  // namespace risorius::author::detail
