// SPDX-License-Identifier: MIT
// Solves a fine step: a motion of each vertex that brings it near its match on the target and is
// similar to its neighbours' motions.
#include "register/steps/fine.h"

#include <Eigen/SparseCholesky>
#include <algorithm>

#include "register/steps/conjugate.h"

namespace risorius::registering::steps {

namespace {

using Sparse = Eigen::SparseMatrix<double>;

constexpr double kStretch = 0.02;  // of the stiffness: weight of differences between neighbours
constexpr int kSlides = 12;        // largest number of rounds of conjugate gradients
constexpr double kHold = 1e-6;     // weight of motion 0, for vertices without matches

/// [V, V] matrix; its product with values of vertices is each value minus the mean of its
/// neighbours' values. In the mean, neighbours have the weight 1 / distance in `base`.
Sparse differences(const Graph& graph, const Points& base) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::uint32_t v = 0; v < graph.size(); ++v) {
    const auto around = graph.of(v);
    if (around.empty()) continue;
    double sum = 0;
    std::vector<double> weights;
    for (const std::uint32_t next : around) {
      weights.push_back(1 / std::max((base[v] - base[next]).norm(), 1e-3));
      sum += weights.back();
    }
    const auto row = static_cast<int>(v);
    entries.emplace_back(row, row, 1.0);
    for (std::size_t k = 0; k < around.size(); ++k) {
      entries.emplace_back(row, static_cast<int>(around[k]), -weights[k] / sum);
    }
  }
  Sparse out(static_cast<Eigen::Index>(graph.size()), static_cast<Eigen::Index>(graph.size()));
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

/// [V, V] matrix; its product with values of vertices is, for each vertex, the sum of its value
/// minus the value of each neighbour.
Sparse stretches(const Graph& graph) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::uint32_t v = 0; v < graph.size(); ++v) {
    const auto row = static_cast<int>(v);
    for (const std::uint32_t next : graph.of(v)) {
      entries.emplace_back(row, row, 1.0);
      entries.emplace_back(row, static_cast<int>(next), -1.0);
    }
  }
  Sparse out(static_cast<Eigen::Index>(graph.size()), static_cast<Eigen::Index>(graph.size()));
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

}  // namespace

struct Fine::Impl {
  explicit Impl(const Points& from)
      : base(from),
        points(from),
        moved(Eigen::MatrixX3d::Zero(static_cast<Eigen::Index>(from.size()), 3)) {}

  const Points& base;
  Points points;
  Eigen::MatrixX3d moved;  // displacements from the base
  Sparse smooth;           // matrix of stiffness 1, lower triangle
  Eigen::SimplicialLLT<Sparse, Eigen::Lower, Eigen::AMDOrdering<int>> solver;
  bool analyzed = false;
};

Fine::Fine(const Graph& graph, const Points& base) : impl_(std::make_unique<Impl>(base)) {
  const Sparse rows = differences(graph, base);
  Sparse identity(rows.rows(), rows.cols());
  identity.setIdentity();
  const Sparse all =
      Sparse(rows.transpose() * rows) + kStretch * stretches(graph) + kHold * identity;
  impl_->smooth = all.triangularView<Eigen::Lower>();
}

Fine::~Fine() = default;

bool Fine::solve(const std::vector<Match>& matches, double stiffness) {
  Impl& my = *impl_;
  Sparse matrix = stiffness * my.smooth;
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(matrix.rows(), 3);
  for (std::size_t v = 0; v < matches.size(); ++v) {
    if (matches[v].weight <= 0) continue;
    const auto row = static_cast<Eigen::Index>(v);
    matrix.coeffRef(row, row) += matches[v].weight;
    right.row(row) = matches[v].pulled(matches[v].point - my.base[v]).transpose();
  }
  if (!my.analyzed) my.solver.analyzePattern(matrix);
  my.analyzed = true;
  my.solver.factorize(matrix);
  if (my.solver.info() != Eigen::Success) return false;
  const auto apply = [&](const Eigen::MatrixX3d& x) -> Eigen::MatrixX3d {
    Eigen::MatrixX3d out = matrix.selfadjointView<Eigen::Lower>() * x;
    for (std::size_t v = 0; v < matches.size(); ++v) {
      const Match& match = matches[v];
      if (match.weight <= 0 || match.along >= 1) continue;
      const Vec3 way = x.row(static_cast<Eigen::Index>(v)).transpose();
      out.row(static_cast<Eigen::Index>(v)) -= (match.weight * way - match.pulled(way)).transpose();
    }
    return out;
  };
  const auto nearly = [&](const Eigen::MatrixX3d& x) -> Eigen::MatrixX3d {
    return my.solver.solve(x);
  };
  conjugate(apply, nearly, right, my.moved, kSlides);
  if (!my.moved.allFinite()) return false;
  for (std::size_t v = 0; v < my.points.size(); ++v) {
    my.points[v] = my.base[v] + my.moved.row(static_cast<Eigen::Index>(v)).transpose();
  }
  return true;
}

const Points& Fine::points() const { return impl_->points; }

}  // namespace risorius::registering::steps
