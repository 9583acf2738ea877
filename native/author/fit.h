// SPDX-License-Identifier: MIT
// Joints, weights and joint motions that repeat shapes: smooth skinning decomposition.
//
// Sources: Le and Deng, "Smooth Skinning Decomposition with Rigid Bones" (2012) and "Robust and
// Accurate Skeletal Rigging from Mesh Sequences" (2014); Kavan, Doublestein, Prazak, Cioffi and
// Roble, "Compressed Skinning for Facial Blendshapes" (2024): a face turns little, so that a
// joint's motion is nearly linear in a rotation vector and a translation. One matrix then serves
// all expressions, and the joints of a face are solved together instead of one after the other.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "author/shapes.h"
#include "core/result.h"

namespace risorius::author {

/// Motion of a joint in an expression: a vertex p becomes position + R(rotation) (p - position) +
/// translation. rotation is a vector: its axis, as long as its angle in radians.
struct JointMotion {
  Vector3 rotation{};
  Vector3 translation{};
};

/// A joint that the rig has already: a jaw, an eye, the head. It may get weights, its motions stay.
struct GivenJoint {
  Vector3 position{};
  std::vector<JointMotion> motions;  // [expressions], or none where no expression moves it
  /// The joint of the other side, itself in the middle; kUnknown: found by place and motion.
  std::uint32_t mirrored = kUnknown;
  static constexpr std::uint32_t kUnknown = 0xffffffffu;
};

/// A point about which the vertices of some expressions turn, such as the centre of an eye for its
/// lids or the hinge of a jaw. A joint that moves mostly in these expressions is placed there,
/// because its vertices then follow an arc between 0 and 1.
struct Pivot {
  Vector3 position{};
  std::vector<std::uint32_t> expressions;
};

struct FitOptions {
  std::size_t joints = 120;    // all, the given ones too
  std::size_t influences = 8;  // joints of a vertex at most
  double smoothness = 1.0;     // 0: only the error counts; 1: as smooth as Dem Bones' default
  bool symmetric = true;       // where the mesh is: mirrored joints and weights
  /// How far the largest error is fought at the cost of the mean: 0 least squares.
  double emphasis = 3.0;
  /// A joint takes no part in an expression in which it moves no vertex so far, in the shapes'
  /// unit; the others then take over what it did. 0: all joints take part in all.
  double least_effect = 0.0;
  /// Of the last four rounds the one is kept whose largest error is the smallest; bound: of the
  /// second half of the rounds.
  bool bound = false;
  std::size_t rounds = 40;  // of weights and motions after all joints are there
  std::size_t threads = 0;  // 0: all cores; the result does not depend on it
  std::vector<GivenJoint> given;
  std::vector<Pivot> pivots;
};

struct Fit {
  std::vector<Vector3> joints;          // [J] neutral positions
  std::vector<std::uint32_t> mirrored;  // [J] the joint of the other side, itself in the middle
  std::size_t influences = 0;           // K
  std::vector<std::uint16_t> weight_joints;  // [V][K]
  std::vector<float> weights;                // [V][K], rows sum to 1; 0 where a vertex has fewer
  std::vector<JointMotion> motions;          // [J][E]
};

/// Told of what is done, 0 to 1; false stops the work.
using Progress = std::function<bool(double)>;

/// Finds joints, weights and motions for shapes.
/// Fails: kInvalidArgument (options, sizes), kInvalidValue (a value that is no finite number,
/// shapes
///        without any motion); kInvalidArgument "stopped" where progress said so
/// Cost: grows with vertices x influences x expressions, and with joints
core::Result<Fit> fit_joints(const Shapes& shapes, const FitOptions& options,
                             const Progress& progress = {});

/// Weights that a fit of weights begins with: rows as those of Fit, of any sum above 0.
struct StartWeights {
  std::size_t influences = 0;
  std::vector<std::uint16_t> joints;  // [V][influences]
  std::vector<float> weights;         // [V][influences]
};

/// Motions of new joints whose weights are known: what a rig of one face does on another one of the
/// same topology.
/// In: shapes   of the other face
///     options  joints (all), given, pivots, emphasis, least_effect and threads of it count
///     weights  by the joints of all, the given ones first, as a Fit has them
///     at       [new joints] the pivot that a joint is at; kInTheMiddle: of what it moves
/// Out: a Fit with these weights; each joint is its own other side
/// Fails: as fit_joints; kInvalidLength, kInvalidIndex, kInvalidValue (weights, at)
core::Result<Fit> fit_motions(const Shapes& shapes, const FitOptions& options,
                              const StartWeights& weights, const std::vector<std::uint32_t>& at);
inline constexpr std::uint32_t kInTheMiddle = 0xffffffffu;

/// Weights of another mesh on joints that move as they do: a coarser level of detail.
/// In: joints   with the motions of each of the shapes' expressions
///     options  influences, smoothness, threads
///     start    such as those of the finer mesh; empty: all on a joint that rests
/// Out: a Fit with the given joints alone
/// Fails: as fit_joints; kInvalidLength, kInvalidIndex, kInvalidValue (start)
core::Result<Fit> fit_weights(const Shapes& shapes, const std::vector<GivenJoint>& joints,
                              const FitOptions& options, const StartWeights& start = {});

}  // namespace risorius::author
