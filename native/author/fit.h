// SPDX-License-Identifier: MIT
// Joints, weights and joint motions that reproduce shapes: smooth skinning decomposition.
//
// Sources: Le and Deng, "Smooth Skinning Decomposition with Rigid Bones" (2012) and "Robust and
// Accurate Skeletal Rigging from Mesh Sequences" (2014); Kavan, Doublestein, Prazak, Cioffi and
// Roble, "Compressed Skinning for Facial Blendshapes" (2024): joints of a face turn little, so that
// a joint's motion is nearly linear in a rotation vector and a translation. One matrix then serves
// all expressions, and all joints are solved together.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "author/shapes.h"
#include "core/result.h"

namespace risorius::author {

/// Motion of a joint in an expression. A vertex p becomes position + R(rotation) (p - position) +
/// translation, in the axes of the shapes. rotation is a vector along the axis of a right-handed
/// rotation; its length is the angle in radians.
struct JointMotion {
  Vector3 rotation{};
  Vector3 translation{};
};

/// A joint that the rig has already, such as a jaw, an eye or the head. The fit may give it
/// weights, but does not change its motions.
struct GivenJoint {
  Vector3 position{};
  std::vector<JointMotion> motions;  // [expressions]; empty: no expression moves it
  /// Index of the joint on the other side of the face; of this joint itself if it lies in the
  /// middle; kUnknown: the fit finds it by place and motion.
  std::uint32_t mirrored = kUnknown;
  static constexpr std::uint32_t kUnknown = 0xffffffffu;
};

/// A point about which vertices turn in some expressions, such as the centre of an eye for its lids
/// or the hinge of a jaw. A joint that moves mostly in these expressions is placed at this point,
/// so that its vertices follow an arc while the expression goes from 0 to 1.
struct Pivot {
  Vector3 position{};
  std::vector<std::uint32_t> expressions;
};

struct FitOptions {
  std::size_t joints = 120;    // total number, given ones included
  std::size_t influences = 8;  // joints of a vertex at most
  double smoothness = 1.0;     // 0: only the error counts; 1: as smooth as Dem Bones' default
  bool symmetric = true;       // mirrored joints and weights, if the mesh is symmetric
  /// A higher value makes the largest error of a vertex smaller and the mean error larger; 0: the
  /// sum of squared errors is smallest.
  double emphasis = 3.0;
  /// A joint that is not given takes no part in an expression in which it moves every vertex by
  /// less than this, in the shapes' unit; the other joints take over. 0: all joints take part in
  /// all expressions.
  double least_effect = 0.0;
  /// The result is the round whose largest error is the smallest. false: among the last four
  /// rounds; true: among the second half of all rounds.
  bool bound = false;
  std::size_t rounds = 40;  // of weights and motions, after all joints are placed
  std::size_t threads = 0;  // 0: all cores; the result does not depend on it
  std::vector<GivenJoint> given;
  std::vector<Pivot> pivots;
};

struct Fit {
  std::vector<Vector3> joints;          // [J] neutral positions
  std::vector<std::uint32_t> mirrored;  // [J] the joint on the other side, itself in the middle
  std::size_t influences = 0;           // K
  std::vector<std::uint16_t> weight_joints;  // [V][K]
  std::vector<float> weights;                // [V][K], rows sum to 1; unused entries are 0
  std::vector<JointMotion> motions;          // [J][E]
};

/// Called with the share of the work that is done, 0 to 1; returning false stops the work.
using Progress = std::function<bool(double)>;

/// Finds joints, weights and motions for shapes.
/// Fails: kInvalidArgument (options, the number of displacements; "stopped" if progress returned
///        false), kInvalidLength (importance, motions of a given joint), kInvalidIndex (an edge, a
///        pivot's expression, a given joint's mirror), kInvalidValue (a value that is not finite,
///        shapes without any motion)
/// Cost: grows with vertices x influences x expressions, and with joints
core::Result<Fit> fit_joints(const Shapes& shapes, const FitOptions& options,
                             const Progress& progress = {});

/// Initial weights: rows as in Fit. The weights of a vertex are divided by their sum. A vertex
/// whose weights are all 0 follows the first joint without motion.
struct StartWeights {
  std::size_t influences = 0;
  std::vector<std::uint16_t> joints;  // [V][influences]
  std::vector<float> weights;         // [V][influences]
};

/// Motions of new joints whose weights are known: transfers the rig of one face to another face of
/// the same topology.
/// In: shapes   of the other face
///     options  joints (total), given (one of them without motions), pivots, emphasis,
///              least_effect and threads are used
///     weights  of all joints, the given ones first, as in a Fit
///     at       [new joints] index of the pivot at which a joint is placed; kInTheMiddle: it is
///              placed in the middle of its vertices
/// Out: a Fit with these weights; each joint is its own mirror
/// Fails: as fit_joints; kInvalidLength, kInvalidIndex, kInvalidValue (weights, at)
core::Result<Fit> fit_motions(const Shapes& shapes, const FitOptions& options,
                              const StartWeights& weights, const std::vector<std::uint32_t>& at);
inline constexpr std::uint32_t kInTheMiddle = 0xffffffffu;

/// Weights of another mesh, such as a coarser level of detail, on joints with given motions.
/// In: joints   with their motions in each expression of the shapes
///     options  influences, smoothness, symmetric and threads are used
///     start    initial weights, such as the finer mesh's; empty: all weight is on a joint that
///              does not move
/// Out: a Fit with these joints; if all of them move, a joint without motion follows them
/// Fails: as fit_joints; kInvalidLength, kInvalidIndex, kInvalidValue (start)
core::Result<Fit> fit_weights(const Shapes& shapes, const std::vector<GivenJoint>& joints,
                              const FitOptions& options, const StartWeights& start = {});

}  // namespace risorius::author
