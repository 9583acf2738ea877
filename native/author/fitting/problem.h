// SPDX-License-Identifier: MIT
// What the steps of a fit share. Private to native/author.
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

/// The shapes in the fit's own unit (the size of the mesh is 1, its middle the origin).
struct Problem {
  std::size_t vertices = 0, expressions = 0, influences = 0, threads = 0;
  Vec3 middle = Vec3::Zero();
  double scale = 1.0;           // from the input's unit to the fit's
  std::vector<Vec3> positions;  // [V]
  // [V][3][E], because most loops go over all expressions of one axis; mirrored expressions that
  // were missing at the end
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
  bool to_pivots = false;  // whether joints are placed there already
  double smoothness = 0.0;
  /// What weights changed by goes on by this share: rounds that follow each other mostly go one
  /// way.
  double momentum = 0.0;
  std::size_t near = 5;            // joints that a vertex tries because they are near
  std::vector<double> importance;  // [V] of a vertex' squared error, mean 1
  std::vector<double> asked;       // [V] of it, what the caller asked for
  /// [V] the given joint that alone comes nearest to what the vertex does, or Mirror::kNone.
  std::vector<std::uint32_t> nearest_given;

  const float* of_vertex(std::size_t v) const { return displacements.data() + v * expressions * 3; }
  bool is_representative(std::size_t v) const { return mirror.empty() || mirror.vertices[v] >= v; }
};

/// How a joint in an expression moves a vertex p: matrix * (p, 1), without p itself.
using Affine = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

struct Joint {
  Vec3 position = Vec3::Zero();
  Vec3 place = Vec3::Zero();  // the middle of what it moves: its position, if that is no pivot
  std::uint32_t mirrored = 0;
  bool rests = false;              // no expression moves it
  bool given = false;              // it stays where it is and moves as it did
  std::vector<Mat3> rotations;     // [E]
  std::vector<Vec3> translations;  // [E]
  std::vector<Affine> motions;     // [E] of the two above
  std::vector<bool> idle;          // [E] it takes no part in the expression; empty: in all of them

  bool is_idle(std::size_t expression) const { return !idle.empty() && idle[expression]; }
};

struct Influence {
  std::uint32_t joint = 0;
  double weight = 0.0;
};

struct State {
  std::vector<Joint> joints;
  std::vector<std::vector<Influence>> weights;  // [V] by joint's number
  std::vector<std::vector<Influence>> solved;   // [V] what they were before they went on; or empty
};

/// Best weights for the motions that there are; with momentum, ahead of them.
void solve_weights(const Problem& problem, State& state);
/// Best motions for the weights that there are.
/// In: left  what remains of the displacements, see find_residual
void solve_motions(const Problem& problem, State& state, std::vector<float>& left);
/// Joints leave the expressions in which they move no vertex by `least`, for good.
void leave_expressions(const Problem& problem, State& state, double least);
/// Out: [V][3][E] displacements less what the joints do
void find_residual(const Problem& problem, const State& state, std::vector<float>& left);
/// Joints where the given ones leave most, until there are `count`.
void add_joints(const Problem& problem, State& state, const std::vector<float>& left,
                std::size_t count);
/// Joints' neutral positions to the middle of what they move, or to the pivot of the expressions
/// that they mostly move in; the given ones are left alone.
void move_joints(const Problem& problem, State& state);

void rest(Joint& joint, std::size_t expressions);
void update_motion(Joint& joint, std::size_t expression);

}  // namespace risorius::author::detail
