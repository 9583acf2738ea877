// SPDX-License-Identifier: MIT
// Probe: positions of some points of a skin under raw controls, and their derivatives.
//
// Derivatives are differences of the evaluated rig, one evaluation per control, so that they
// include correctives, solvers and networks. An evaluation takes microseconds; the skinning behind
// it would cost more. Therefore only changes are skinned: the joints whose numbers changed, their
// descendants, and the points that depend on these joints.
#pragma once

#include <span>
#include <vector>

#include "rig/pose.h"
#include "solve/surface.h"

namespace risorius::solve {

struct Point {
  std::uint32_t mesh, vertex;
};

/// The step of a control for a difference quotient. The rig computes in float32, so that the
/// rounding error of a derivative is about 2^-24 / kStep = 2^-16 times the largest rounded number.
inline constexpr double kStep = 1.0 / 256;

/// The Jacobian of point positions, in blocks of kBlock points that follow each other in the list
/// of points. A block lists the controls that move any of its points, each with kBlock * 3 numbers;
/// in the last block the numbers of missing points are 0. `controls` counts all raw controls of the
/// rig, `points` all points.
struct Jacobian {
  static constexpr std::size_t kBlock = 32;
  struct Block {
    std::vector<std::uint32_t> controls;  // ascending
    std::vector<float> values;            // [controls, kBlock, 3]: file units per unit of control
  };
  std::size_t controls = 0, points = 0;
  std::vector<Block> blocks;
};

/// Computes positions and derivatives of some points. Not thread-safe, because it has scratch
/// memory.
class Probe {
 public:
  /// Prepares computations for some points.
  /// In: surface  the face's surface, which must outlive the probe
  ///     points   vertices of this surface; each must exist
  Probe(const Surface& surface, std::span<const Point> points);

  std::size_t size() const { return points_.size(); }
  /// Computes the positions of the points in a pose.
  /// In:  raw  float32[raw controls], the pose
  /// Out: out  float64[points, 3], file units
  void positions(const float* raw, double* out);
  /// Computes the derivatives of the positions.
  /// In: raw   float32[raw controls], the pose
  ///     high  float32[raw controls]: a control that a step up would move above this value is moved
  ///           down instead
  ///     free  [raw controls]: a control whose value here is 0 gets no column
  Jacobian jacobian(const float* raw, const float* high, const std::uint8_t* free);

 private:
  struct Joint {
    std::uint32_t index;   // in the file
    std::uint32_t parent;  // index in joints_; a root is its own parent
  };
  static constexpr std::size_t kFrames = 16;

  void add_joints(const std::vector<bool>& needed);
  void list_users();
  rig::PoseView poses();
  void take(std::size_t frame);
  std::array<double, 3> place(std::size_t point) const;
  void changed(std::size_t frame);
  void mark(std::span<const std::uint32_t> users);
  void add_column(std::uint32_t control, double step, Jacobian& out);

  const Surface& surface_;
  std::vector<Joint> joints_;            // joints that the points need, parents first
  std::vector<std::uint32_t> channels_;  // channels that the points need
  std::vector<std::array<float, 3>> points_;
  std::vector<std::uint32_t> influence_begins_, shape_begins_;  // [points + 1]
  std::vector<Influence> influences_;                           // joint: index in joints_
  std::vector<Shape> shapes_;                                   // channel: index in channels_
  // The points that each joint of joints_ and each channel of channels_ moves. The lists "begins"
  // have a last entry for the end.
  std::vector<std::uint32_t> joint_users_begins_, joint_users_, channel_users_begins_,
      channel_users_;

  // The base pose, from which difference quotients are taken.
  std::vector<float> deltas_;   // [joints_, 9]
  std::vector<float> weights_;  // [channels_]
  std::vector<Matrix> world_, skin_;
  std::vector<std::array<double, 3>> base_;  // [points_]
  // The pose with one control moved; equal to the base pose between two columns.
  std::vector<Matrix> other_world_, other_skin_;
  std::vector<float> other_weights_;
  std::vector<std::uint8_t> moved_;      // [joints_]: 1 if the joint differs from the base pose
  std::vector<std::uint32_t> marked_;    // points
  std::vector<std::uint8_t> is_marked_;  // [points_]
  // Memory of the rig's evaluations: inputs and outputs of kFrames frames.
  rig::Workspace work_;
  std::vector<float> raw_, joint_values_, shape_values_, map_values_, control_values_;
};

}  // namespace risorius::solve
