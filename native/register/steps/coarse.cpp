// SPDX-License-Identifier: MIT
// Solves a coarse step: affine motions of nodes, which carry the vertices around them, that bring
// vertices near their matches on the target.
#include "register/steps/coarse.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>

#include "register/steps/conjugate.h"

namespace risorius::registering::steps {

namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Row4 = Eigen::Vector4d;
using Block = Eigen::Matrix4d;

constexpr double kBound = 0.1;    // stiffness between the affine parts of neighbours
constexpr double kAtRest = 1e-4;  // weight of a node's current motion, for nodes without matches
constexpr int kConjugate = 25;    // largest number of rounds

/// A match of a vertex that is weaker along the surface than across it. It pulls only at the
/// vertex's node.
struct Drawn {
  std::uint32_t node;
  Row4 row;
  Vec3 normal;
  double free;  // weight across the surface minus weight along it
};

}  // namespace

struct Coarse::Impl {
  Impl(const Nodes& of, const Points& points) : nodes(of), rest(points) {}

  const Nodes& nodes;
  const Points& rest;
  Eigen::MatrixX3d motion;  // [4 N] for each node: position, then transposed affine part
  std::vector<std::size_t> in_cell;
  std::vector<double> stiff;  // [edges]
  Sparse matrix;              // lower triangle, with equal match weights in all directions
  Eigen::SimplicialLLT<Sparse, Eigen::Lower, Eigen::AMDOrdering<int>> solver;
  bool analyzed = false;

  Vec3 at(std::uint32_t node) const { return rest[nodes.vertices[node]]; }
  Row4 row(std::uint32_t node, const Vec3& p) const {
    const Vec3 away = p - at(node);
    return {1.0, away[0], away[1], away[2]};
  }
  /// Adds the stiffness between neighbouring nodes.
  /// Out: own      the diagonal block of each node
  ///      between  entries of the blocks of two nodes, below the diagonal
  void add_stiffness(double stiffness, std::vector<Block>& own,
                     std::vector<Eigen::Triplet<double>>& between) const;
  /// Adds a small weight that keeps each node at its current motion, so that the system also
  /// determines nodes without matches.
  void hold(std::vector<Block>& own, Eigen::MatrixX3d& right) const;
  bool factorize(const std::vector<Block>& own, std::vector<Eigen::Triplet<double>>& entries);
};

Coarse::Coarse(const Nodes& nodes, const Points& rest)
    : impl_(std::make_unique<Impl>(nodes, rest)) {
  const std::size_t count = nodes.vertices.size();
  impl_->motion.setZero(static_cast<Eigen::Index>(4 * count), 3);
  for (std::uint32_t n = 0; n < count; ++n) {
    const auto at = static_cast<Eigen::Index>(4 * n);
    impl_->motion.row(at) = impl_->at(n).transpose();
    impl_->motion.block<3, 3>(at + 1, 0).setIdentity();
  }
  impl_->in_cell.assign(count, 0);
  for (const std::uint32_t cell : nodes.cell) ++impl_->in_cell[cell];
  double sum = 0;
  for (const auto& edge : nodes.edges)
    sum += (impl_->at(edge[0]) - impl_->at(edge[1])).squaredNorm();
  const double mean = nodes.edges.empty() ? 1.0 : sum / static_cast<double>(nodes.edges.size());
  for (const auto& edge : nodes.edges) {
    const double squared = (impl_->at(edge[0]) - impl_->at(edge[1])).squaredNorm();
    impl_->stiff.push_back(mean / std::max(squared, 0.01 * mean));
  }
}

Coarse::~Coarse() = default;

void Coarse::Impl::add_stiffness(double stiffness, std::vector<Block>& own,
                                 std::vector<Eigen::Triplet<double>>& between) const {
  for (std::size_t e = 0; e < nodes.edges.size(); ++e) {
    const std::uint32_t a = nodes.edges[e][0], b = nodes.edges[e][1];
    const double weight = stiffness * stiff[e];
    // The motion of a node, applied to its neighbour's position, should give the neighbour's own
    // motion.
    const Row4 here = row(a, at(b)), there = row(b, at(a)), place(1, 0, 0, 0);
    Block cross = -weight * (here * place.transpose() + place * there.transpose());
    own[a] += weight * (here * here.transpose() + place * place.transpose());
    own[b] += weight * (there * there.transpose() + place * place.transpose());
    const double bound = kBound * weight * (at(a) - at(b)).squaredNorm();
    for (int k = 1; k < 4; ++k) {
      own[a](k, k) += bound;
      own[b](k, k) += bound;
      cross(k, k) -= bound;
    }
    // Only entries below the diagonal are stored: their rows belong to the node with the higher
    // number, their columns to the other node.
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        between.emplace_back(static_cast<int>(4 * b) + i, static_cast<int>(4 * a) + j, cross(j, i));
      }
    }
  }
}

void Coarse::Impl::hold(std::vector<Block>& own, Eigen::MatrixX3d& right) const {
  for (std::uint32_t n = 0; n < own.size(); ++n) {
    const auto at = static_cast<Eigen::Index>(4 * n);
    own[n].diagonal() += Row4::Constant(kAtRest);
    right.block<4, 3>(at, 0) += kAtRest * motion.block<4, 3>(at, 0);
  }
}

bool Coarse::Impl::factorize(const std::vector<Block>& own,
                             std::vector<Eigen::Triplet<double>>& entries) {
  for (std::uint32_t n = 0; n < own.size(); ++n) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j <= i; ++j) {
        entries.emplace_back(static_cast<int>(4 * n) + i, static_cast<int>(4 * n) + j,
                             own[n](i, j));
      }
    }
  }
  const auto size = static_cast<Eigen::Index>(4 * own.size());
  matrix.resize(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  if (!analyzed) solver.analyzePattern(matrix);
  analyzed = true;
  solver.factorize(matrix);
  return solver.info() == Eigen::Success;
}

bool Coarse::solve(const std::vector<Match>& matches, const std::vector<Landmark>& landmarks,
                   Pull pull) {
  Impl& my = *impl_;
  const std::size_t count = my.nodes.vertices.size();
  std::vector<Block> own(count, Block::Zero());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(16 * (my.nodes.edges.size() + count));
  my.add_stiffness(pull.stiffness, own, entries);
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(static_cast<Eigen::Index>(4 * count), 3);
  std::vector<Drawn> drawn;
  const auto draw = [&](std::uint32_t vertex, const Match& match, double share) {
    const std::uint32_t node = my.nodes.cell[vertex];
    const Row4 r = my.row(node, my.rest[vertex]);
    own[node] += share * match.weight * r * r.transpose();
    right.block<4, 3>(static_cast<Eigen::Index>(4 * node), 0) +=
        share * r * match.pulled(match.point).transpose();
    if (match.along < 1) {
      drawn.push_back({node, r, match.normal, share * match.weight * (1 - match.along)});
    }
  };
  for (std::uint32_t v = 0; v < matches.size(); ++v) {
    if (matches[v].weight <= 0) continue;
    draw(v, matches[v], 1 / static_cast<double>(my.in_cell[my.nodes.cell[v]]));
  }
  for (const Landmark& mark : landmarks) {
    draw(mark.vertex, {mark.point, Vec3::Zero(), pull.landmarks * mark.weight, 1.0}, 1.0);
  }
  my.hold(own, right);
  if (!my.factorize(own, entries)) return false;
  const auto apply = [&](const Eigen::MatrixX3d& x) -> Eigen::MatrixX3d {
    Eigen::MatrixX3d out = my.matrix.selfadjointView<Eigen::Lower>() * x;
    for (const Drawn& one : drawn) {
      const auto at = static_cast<Eigen::Index>(4 * one.node);
      const Vec3 place = x.block<4, 3>(at, 0).transpose() * one.row;
      const Vec3 flat = place - one.normal * one.normal.dot(place);
      out.block<4, 3>(at, 0) -= one.free * one.row * flat.transpose();
    }
    return out;
  };
  const auto nearly = [&](const Eigen::MatrixX3d& x) -> Eigen::MatrixX3d {
    return my.solver.solve(x);
  };
  conjugate(apply, nearly, right, my.motion, kConjugate);
  return my.motion.allFinite();
}

Points Coarse::moved() const {
  const Impl& my = *impl_;
  Points out(my.rest.size(), Vec3::Zero());
  for (std::size_t v = 0; v < out.size(); ++v) {
    for (const auto& [node, share] : my.nodes.carriers[v]) {
      const Row4 r = my.row(node, my.rest[v]);
      out[v] += static_cast<double>(share) *
                (my.motion.block<4, 3>(static_cast<Eigen::Index>(4 * node), 0).transpose() * r);
    }
  }
  return out;
}

}  // namespace risorius::registering::steps
