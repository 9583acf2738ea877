// SPDX-License-Identifier: MIT
// Types that the steps of a fit share. Private to native/author.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "author/fit.h"
#include "author/mirror.h"

namespace risorius::author::detail {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// The shapes in the fit's own unit: the longest side of the mesh's bounding box is 1, and the
/// middle of the box is the origin.
struct Problem {
  std::size_t vertices = 0, expressions = 0, influences = 0, threads = 0;
  Vec3 middle = Vec3::Zero();
  double scale = 1.0;           // from the input's unit to the fit's
  std::vector<Vec3> positions;  // [V]
  // [V][3][E] displacements of the vertices. The expressions are the innermost index, because most
  // loops go over all expressions for one axis. Added mirrored expressions are the last ones.
  std::vector<float> displacements;
  std::vector<std::uint32_t> first_neighbour, neighbours;  // of vertices, as rows of a CSR matrix
  std::vector<double> motion;  // [V] root of the summed squares of its displacements
  Mirror mirror;
  std::vector<std::size_t> other_side;  // [E] the expression of the other side; empty: no mirror
  struct Pivot {
    Vec3 position = Vec3::Zero();
    std::vector<bool> expressions;  // [E]
    std::size_t mirrored = 0;       // the pivot of the other side, itself in the middle
  };
  std::vector<Pivot> pivots;
  bool to_pivots = false;  // true: move_joints may place joints at pivots
  double smoothness = 0.0;
  /// The share of a weight's change in the last round by which the weight is changed once more,
  /// because consecutive rounds mostly change a weight in the same direction.
  double momentum = 0.0;
  std::size_t near = 5;            // joints that a vertex tries because they are near
  std::vector<double> importance;  // [V] weight of a vertex's squared error, mean 1
  std::vector<double> asked;       // [V] the part of `importance` that the caller gave
  /// [V] the given joint that alone reproduces the vertex's motion best, or Mirror::kNone.
  std::vector<std::uint32_t> nearest_given;

  const float* of_vertex(std::size_t v) const { return displacements.data() + v * expressions * 3; }
  bool is_representative(std::size_t v) const { return mirror.empty() || mirror.vertices[v] >= v; }
};

/// The displacement of a vertex p by a joint in an expression is this matrix times (p, 1).
using Affine = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

struct Joint {
  Vec3 position = Vec3::Zero();
  Vec3 place = Vec3::Zero();  // the middle of its vertices; equals position unless that is a pivot
  std::uint32_t mirrored = 0;
  bool rests = false;              // no expression moves it
  bool given = false;              // position and motions are fixed
  std::vector<Mat3> rotations;     // [E]
  std::vector<Vec3> translations;  // [E]
  std::vector<Affine> motions;     // [E] computed from the two above
  // [E] true: the joint takes no part in the expression; empty: it takes part in all expressions.
  std::vector<bool> idle;

  bool is_idle(std::size_t expression) const { return !idle.empty() && idle[expression]; }
};

struct Influence {
  std::uint32_t joint = 0;
  double weight = 0.0;
};

struct State {
  std::vector<Joint> joints;
  std::vector<std::vector<Influence>> weights;  // [V] sorted by joint
  // [V] the weights before momentum was added; may be empty.
  std::vector<std::vector<Influence>> solved;
};

/// The best weights for the present motions, plus momentum if it is set.
void solve_weights(const Problem& problem, State& state);
/// The best motions for the present weights.
/// In/out: left  the residual of find_residual, for the motions before and after the call
void solve_motions(const Problem& problem, State& state, std::vector<float>& left);
/// Removes each joint for good from the expressions in which it moves every vertex by less than
/// `least`. Given joints stay; a joint and its mirror leave an expression together.
void leave_expressions(const Problem& problem, State& state, double least);
/// Computes the displacements that the joints do not reproduce.
/// Out: left  [V][3][E] the shapes' displacements minus the displacements by the joints
void find_residual(const Problem& problem, const State& state, std::vector<float>& left);
/// Adds joints at the vertices at which the present joints leave the largest error. Stops when
/// there are `count` joints in all, or when each vertex has no error or is too near to a new joint.
/// In: left  the residual of find_residual
void add_joints(const Problem& problem, State& state, const std::vector<float>& left,
                std::size_t count);
/// Moves the neutral position of each joint to the middle of its vertices, or, if
/// problem.to_pivots, to the pivot of the expressions in which it mostly moves. Given joints do not
/// move.
void move_joints(const Problem& problem, State& state);

void rest(Joint& joint, std::size_t expressions);
void update_motion(Joint& joint, std::size_t expression);

}  // namespace risorius::author::detail
