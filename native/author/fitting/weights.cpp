// SPDX-License-Identifier: MIT
// Weights of each vertex for given motions: least squares with weights that are not negative and
// sum to 1, at most K of them not 0 (active sets, after Lawson and Hanson 1974).
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "author/fitting/problem.h"
#include "core/parallel_for.h"

namespace risorius::author::detail {

namespace {

constexpr int kCandidates = 22;  // joints that a vertex tries at most
constexpr double kLeast = 1e-4;  // smaller weights are dropped
// For smoothness, each weight is drawn to a goal: kOwn * its present value + (1 - kOwn) * the mean
// of its neighbours' weights. With kOwn = 0, momentum would make the weights of neighbours
// oscillate. Tried from 0 to 0.7.
constexpr double kOwn = 0.4;
constexpr double kLeastOnward = 0.1;  // share of a weight that momentum leaves at least

// Matrices with at most kCandidates rows and columns. Eigen knows this limit, so that it allocates
// no memory.
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kCandidates, kCandidates>;
using Column = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kCandidates, 1>;
// For two joints with the motions (Affine) Y and Z: the ten coefficients of the quadratic form of
// the symmetric part of Y^T Z, summed over expressions.
using Products = std::array<double, 10>;

Products products(const Joint& a, const Joint& b) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (std::size_t e = 0; e < a.motions.size(); ++e) {
    sum.noalias() += a.motions[e].transpose() * b.motions[e];
  }
  const auto both = [&](int r, int c) { return sum(r, c) + sum(c, r); };
  return {sum(0, 0),  sum(1, 1),  sum(2, 2),  sum(3, 3),  both(0, 1),
          both(0, 2), both(1, 2), both(0, 3), both(1, 3), both(2, 3)};
}

double at(const Products& m, const Vec3& p) {
  return m[0] * p.x() * p.x() + m[1] * p.y() * p.y() + m[2] * p.z() * p.z() + m[3] +
         m[4] * p.x() * p.y() + m[5] * p.x() * p.z() + m[6] * p.y() * p.z() + m[7] * p.x() +
         m[8] * p.y() + m[9] * p.z();
}

/// The Products of each pair of joints that are candidates of the same vertex.
class Pairs {
 public:
  Pairs(const State& state, const std::vector<std::vector<Influence>>& candidates,
        std::size_t threads)
      : joints_(state.joints.size()), place_(joints_ * joints_, -1) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (const auto& row : candidates) {
      for (const Influence& a : row) {
        for (const Influence& b : row) {
          if (a.joint > b.joint || place_[a.joint * joints_ + b.joint] >= 0) continue;
          place_[a.joint * joints_ + b.joint] = static_cast<std::int32_t>(pairs.size());
          place_[b.joint * joints_ + a.joint] = static_cast<std::int32_t>(pairs.size());
          pairs.emplace_back(a.joint, b.joint);
        }
      }
    }
    values_.resize(pairs.size());
    core::parallel_for(pairs.size(), threads, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        values_[i] = products(state.joints[pairs[i].first], state.joints[pairs[i].second]);
      }
    });
  }

  double of(std::uint32_t a, std::uint32_t b, const Vec3& p) const {
    return at(values_[static_cast<std::size_t>(place_[a * joints_ + b])], p);
  }

 private:
  std::size_t joints_;
  std::vector<std::int32_t> place_;
  std::vector<Products> values_;
};

/// The joints that a vertex tries, sorted by index. The weight of each is the mean of the weights
/// that the vertex's neighbours have of this joint.
std::vector<Influence> candidates_of(const Problem& problem, const State& state, std::size_t v) {
  std::vector<double> mean(state.joints.size(), 0.0), score(state.joints.size(), -1.0);
  std::vector<std::uint32_t> found;
  const auto note = [&](std::uint32_t j, double add) {
    if (score[j] < 0) {
      score[j] = 0;
      found.push_back(j);
    }
    score[j] += add;
  };
  // Only the first of the joints without motion is always a candidate. If all of them were, no
  // place would be left among the kCandidates for joints that move.
  for (std::uint32_t j = 0; j < state.joints.size(); ++j) {
    if (!state.joints[j].rests) continue;
    note(j, 100.0);
    break;
  }
  if (problem.nearest_given[v] != Mirror::kNone) note(problem.nearest_given[v], 50.0);
  for (const Influence& i : state.weights[v]) note(i.joint, 1.0 + i.weight);
  const std::size_t begin = problem.first_neighbour[v], end = problem.first_neighbour[v + 1];
  for (std::size_t n = begin; n < end; ++n) {
    const double share = 1.0 / static_cast<double>(end - begin);
    for (const Influence& i : state.weights[problem.neighbours[n]]) {
      note(i.joint, share * i.weight);
      mean[i.joint] += share * i.weight;
    }
  }
  std::vector<std::pair<double, std::uint32_t>> near;
  for (std::uint32_t j = 0; j < state.joints.size(); ++j) {
    near.emplace_back((state.joints[j].place - problem.positions[v]).squaredNorm(), j);
  }
  const std::size_t count = std::min(problem.near, near.size());
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end());
  for (std::size_t i = 0; i < count; ++i)
    note(near[i].second, 0.02 / (1.0 + static_cast<double>(i)));
  std::sort(found.begin(), found.end(), [&](std::uint32_t a, std::uint32_t b) {
    return score[a] > score[b] || (score[a] == score[b] && a < b);
  });
  if (found.size() > std::size_t{kCandidates}) found.resize(kCandidates);
  std::sort(found.begin(), found.end());
  std::vector<Influence> out;
  for (const std::uint32_t j : found) out.push_back({j, mean[j]});
  return out;
}

/// Minimises w' G w - 2 b' w with w >= 0 and sum w = 1.
class Simplex {
 public:
  Simplex(Matrix gram, Column right) : gram_(std::move(gram)), right_(std::move(right)) {
    // The small number on the diagonal gives two joints that move alike equal weights, and keeps
    // rounding errors from making a weight negative. The goal that the weights sum to 1 is a
    // further row of the least squares, weighted so heavily that the sum is 1 up to rounding.
    gram_.diagonal().array() += 1e-7 * gram_.diagonal().maxCoeff();
    const double heavy = 1e4 * (gram_.diagonal().maxCoeff() + 1e-30);
    gram_.array() += heavy;
    right_.array() += heavy;
    weights_ = Column::Zero(right_.size());
  }

  /// Solves by the active set method of NNLS.
  /// In: start  candidates of the first passive set, whose weights may be above 0
  void solve(const std::vector<int>& start) {
    passive_ = start;
    for (const int c : start) weights_[c] = 1.0 / static_cast<double>(start.size());
    inner();
    for (int step = 0; step < 3 * right_.size(); ++step) {
      const Column slope = right_ - gram_ * weights_;
      int best = -1;
      double most = 1e-12 * right_.cwiseAbs().maxCoeff();
      for (int c = 0; c < right_.size(); ++c) {
        if (slope[c] > most && std::find(passive_.begin(), passive_.end(), c) == passive_.end()) {
          most = slope[c];
          best = c;
        }
      }
      if (best < 0) return;
      passive_.push_back(best);
      inner();
    }
  }

  /// Removes candidates one by one, always the candidate whose removal adds the least error, until
  /// at most `count` are left.
  void limit(std::size_t count) {
    while (passive_.size() > count) {
      const auto n = static_cast<Eigen::Index>(passive_.size());
      const Matrix inverse = Eigen::LLT<Matrix>(system()).solve(Matrix::Identity(n, n));
      std::size_t worst = 0;
      double least = 0.0;
      for (std::size_t i = 0; i < passive_.size(); ++i) {
        const double w = weights_[passive_[i]];
        const auto at = static_cast<Eigen::Index>(i);
        const double cost = w * w / inverse(at, at);
        if (i == 0 || cost < least) {
          least = cost;
          worst = i;
        }
      }
      weights_[passive_[worst]] = 0.0;
      passive_.erase(passive_.begin() + static_cast<std::ptrdiff_t>(worst));
      inner();
    }
  }

  const Column& weights() const { return weights_; }

 private:
  Matrix system() const {
    const auto n = static_cast<Eigen::Index>(passive_.size());
    Matrix out(n, n);
    for (Eigen::Index r = 0; r < n; ++r) {
      for (Eigen::Index c = 0; c < n; ++c) {
        out(r, c) =
            gram_(passive_[static_cast<std::size_t>(r)], passive_[static_cast<std::size_t>(c)]);
      }
    }
    return out;
  }

  /// Solves for the candidates of the passive set; a candidate that would get a negative weight
  /// leaves the set.
  void inner() {
    while (!passive_.empty()) {
      const auto n = static_cast<Eigen::Index>(passive_.size());
      Column b(n);
      for (Eigen::Index r = 0; r < n; ++r) b[r] = right_[passive_[static_cast<std::size_t>(r)]];
      const Column x = Eigen::LLT<Matrix>(system()).solve(b);
      double reach = 1.0;
      for (Eigen::Index r = 0; r < n; ++r) {
        const double w = weights_[passive_[static_cast<std::size_t>(r)]];
        if (x[r] <= 0.0) reach = std::min(reach, w / (w - x[r] + 1e-300));
      }
      std::vector<int> kept;
      for (Eigen::Index r = 0; r < n; ++r) {
        const int c = passive_[static_cast<std::size_t>(r)];
        weights_[c] += reach * (x[r] - weights_[c]);
        if (reach < 1.0 && weights_[c] <= 1e-12) {
          weights_[c] = 0.0;
        } else {
          kept.push_back(c);
        }
      }
      if (kept.size() == passive_.size()) return;
      passive_ = std::move(kept);
    }
  }

  Matrix gram_;
  Column right_, weights_;
  std::vector<int> passive_;
};

std::vector<Influence> best_weights(const Problem& problem, const State& state, const Pairs& pairs,
                                    const std::vector<Influence>& candidates, std::size_t v) {
  const auto n = static_cast<Eigen::Index>(candidates.size());
  const Vec3& p = problem.positions[v];
  Matrix gram(n, n);
  Column right(n);
  for (Eigen::Index r = 0; r < n; ++r) {
    const std::uint32_t a = candidates[static_cast<std::size_t>(r)].joint;
    for (Eigen::Index c = 0; c <= r; ++c) {
      gram(r, c) = gram(c, r) = pairs.of(a, candidates[static_cast<std::size_t>(c)].joint, p);
    }
    const Joint& joint = state.joints[a];
    double sum = 0.0;
    if (!joint.rests) {
      const float* d = problem.of_vertex(v);
      const std::size_t count = problem.expressions;
      for (std::size_t e = 0; e < count; ++e) {
        const Affine& m = joint.motions[e];
        for (std::size_t k = 0; k < 3; ++k) {
          const auto row = m.row(static_cast<Eigen::Index>(k));
          sum += double{d[k * count + e]} *
                 (row[0] * p.x() + row[1] * p.y() + row[2] * p.z() + row[3]);
        }
      }
    }
    right[r] = sum;
  }
  const double own = problem.momentum > 0.0 ? kOwn : 0.0;
  const double smoothness = problem.smoothness / std::max(1.0, problem.importance[v]) / (1.0 - own);
  std::vector<int> start;
  for (Eigen::Index r = 0; r < n; ++r) {
    const Influence& c = candidates[static_cast<std::size_t>(r)];
    gram(r, r) += smoothness;
    right[r] += smoothness * (1.0 - own) * c.weight;
    for (const Influence& i : state.weights[v]) {
      if (i.joint != c.joint) continue;
      start.push_back(static_cast<int>(r));
      right[r] += smoothness * own * i.weight;
    }
  }
  Simplex simplex(std::move(gram), std::move(right));
  simplex.solve(start);
  simplex.limit(problem.influences);
  std::vector<Influence> out;
  double sum = 0.0;
  for (Eigen::Index r = 0; r < n; ++r) {
    const double w = simplex.weights()[r];
    if (w < kLeast) continue;
    out.push_back({candidates[static_cast<std::size_t>(r)].joint, w});
    sum += w;
  }
  for (Influence& i : out) i.weight /= sum;
  return out;
}

std::vector<Influence> mirrored(const State& state, std::vector<Influence> row) {
  for (Influence& i : row) i.joint = state.joints[i.joint].mirrored;
  std::sort(row.begin(), row.end(),
            [](const Influence& a, const Influence& b) { return a.joint < b.joint; });
  return row;
}

/// Makes the weights of a vertex in the plane x = 0 symmetric. The result is the mean of the
/// weights and the mirrored weights, with at most `count` joints.
std::vector<Influence> balanced(const State& state, const std::vector<Influence>& row,
                                std::size_t count) {
  std::vector<Influence> both = row;
  for (const Influence& i : mirrored(state, row)) {
    const auto same = std::find_if(both.begin(), both.end(),
                                   [&](const Influence& b) { return b.joint == i.joint; });
    if (same == both.end()) {
      both.push_back({i.joint, i.weight / 2});
      continue;
    }
    same->weight = (same->weight + i.weight) / 2;
  }
  for (Influence& b : both) {  // joints that only the row itself has
    const bool other = std::any_of(row.begin(), row.end(), [&](const Influence& i) {
      return state.joints[i.joint].mirrored == b.joint;
    });
    const bool own =
        std::any_of(row.begin(), row.end(), [&](const Influence& i) { return i.joint == b.joint; });
    if (own && !other) b.weight /= 2;
  }
  std::sort(both.begin(), both.end(), [&](const Influence& a, const Influence& b) {
    const auto pair = [&](const Influence& i) {
      return std::min(i.joint, state.joints[i.joint].mirrored);
    };
    if (std::abs(a.weight - b.weight) > 1e-12) return a.weight > b.weight;
    return pair(a) < pair(b) || (pair(a) == pair(b) && a.joint < b.joint);
  });
  while (both.size() > count) {  // a joint and its mirror leave together
    const std::uint32_t last = both.back().joint, other = state.joints[last].mirrored;
    both.pop_back();
    if (other != last) {
      both.erase(std::find_if(both.begin(), both.end(),
                              [&](const Influence& i) { return i.joint == other; }));
    }
  }
  double sum = 0.0;
  for (const Influence& i : both) sum += i.weight;
  for (Influence& i : both) i.weight /= sum;
  std::sort(both.begin(), both.end(),
            [](const Influence& a, const Influence& b) { return a.joint < b.joint; });
  return both;
}

double weight_of(const std::vector<Influence>& row, std::uint32_t joint) {
  const auto found =
      std::find_if(row.begin(), row.end(), [&](const Influence& i) { return i.joint == joint; });
  return found == row.end() ? 0.0 : found->weight;
}

/// Adds momentum to a vertex's weights: changes them further in the direction of their change since
/// the previous round, and divides them by their sum.
/// In: before    the weights of the previous round
///     momentum  the share of the change that is added
std::vector<Influence> onward(std::vector<Influence> row, const std::vector<Influence>& before,
                              double momentum) {
  double sum = 0.0;
  for (Influence& i : row) {
    const double on = i.weight + momentum * (i.weight - weight_of(before, i.joint));
    i.weight = std::max(kLeastOnward * i.weight, on);
    sum += i.weight;
  }
  for (Influence& i : row) i.weight /= sum;
  return row;
}

/// Adds momentum to the solved weights of all vertices (Nesterov 1983). On a symmetric mesh both
/// sides get equal weights.
void go_on(const Problem& problem, State& state, std::vector<std::vector<Influence>> solved) {
  state.weights = solved;
  if (!state.solved.empty()) {
    core::parallel_for(problem.vertices, problem.threads, [&](std::size_t from, std::size_t to) {
      for (std::size_t v = from; v < to; ++v) {
        if (!problem.is_representative(v)) continue;
        state.weights[v] = onward(solved[v], state.solved[v], problem.momentum);
      }
    });
    for (std::size_t v = 0; v < problem.mirror.vertices.size(); ++v) {
      const std::uint32_t other = problem.mirror.vertices[v];
      if (other > v) state.weights[other] = mirrored(state, state.weights[v]);
    }
  }
  state.solved = std::move(solved);
}

}  // namespace

void solve_weights(const Problem& problem, State& state) {
  std::vector<std::vector<Influence>> candidates(problem.vertices), out(problem.vertices);
  core::parallel_for(problem.vertices, problem.threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t v = from; v < to; ++v) {
      if (problem.is_representative(v)) candidates[v] = candidates_of(problem, state, v);
    }
  });
  const Pairs pairs(state, candidates, problem.threads);
  core::parallel_for(problem.vertices, problem.threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t v = from; v < to; ++v) {
      if (problem.is_representative(v)) {
        out[v] = best_weights(problem, state, pairs, candidates[v], v);
      }
    }
  });
  if (!problem.mirror.empty()) {
    for (std::size_t v = 0; v < problem.vertices; ++v) {
      const std::uint32_t other = problem.mirror.vertices[v];
      if (other == v) out[v] = balanced(state, out[v], problem.influences);
      if (other > v) out[other] = mirrored(state, out[v]);
    }
  }
  if (problem.momentum > 0.0) {
    go_on(problem, state, std::move(out));
  } else {
    state.weights = std::move(out);
    state.solved.clear();
  }
}

}  // namespace risorius::author::detail
