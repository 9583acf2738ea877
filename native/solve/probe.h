// SPDX-License-Identifier: MIT
// Probe: some points of a skin, where raw controls bring them and what each control does to them.
//
// Derivatives are differences of the evaluated rig, one evaluation a control, so that correctives,
// solvers and networks count. An evaluation takes microseconds; what costs is the skin behind it.
// So only what a control changed is looked at: joints whose numbers are others than before and
// those below them, and the points that hang on these.
#pragma once

#include <span>
#include <vector>

#include "rig/pose.h"
#include "solve/surface.h"

namespace risorius::solve {

struct Point {
  std::uint32_t mesh, vertex;
};

/// How far a control is moved for a difference. The rig's numbers are float32, so that a derivative
/// has an error of about 2^-24 / kStep of the largest value.
inline constexpr double kStep = 1.0 / 256;

/// The Jacobian, in blocks of kBlock neighbouring points: a block has the controls that move any of
/// its points, and of each kBlock * 3 numbers.
struct Jacobian {
  static constexpr std::size_t kBlock = 32;
  struct Block {
    std::vector<std::uint32_t> controls;  // ascending
    std::vector<float> values;            // [controls, kBlock, 3]: file units per unit of control
  };
  std::size_t controls = 0, points = 0;
  std::vector<Block> blocks;
};

/// Points and the memory to work with them. Not for two threads at a time.
class Probe {
 public:
  /// In: points  each within its mesh; the surface outlives the probe
  Probe(const Surface& surface, std::span<const Point> points);

  std::size_t size() const { return points_.size(); }
  /// In:  raw  float32[R]
  /// Out: out  float64[points, 3], file units
  void positions(const float* raw, double* out);
  /// In: raw   float32[R], the pose
  ///     high  float32[R]: a control that has no room up to here is moved down
  ///     free  [R]: controls at 0 are left out
  Jacobian jacobian(const float* raw, const float* high, const std::uint8_t* free);

 private:
  struct Joint {
    std::uint32_t index;   // in the file
    std::uint32_t parent;  // in joints_, itself for a root
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
  std::vector<Joint> joints_;            // that the points need, parents first
  std::vector<std::uint32_t> channels_;  // likewise
  std::vector<std::array<float, 3>> points_;
  std::vector<std::uint32_t> influence_begins_, shape_begins_;  // [points + 1]
  std::vector<Influence> influences_;                           // joint: in joints_
  std::vector<Shape> shapes_;                                   // channel: in channels_
  // Points by what moves them.
  std::vector<std::uint32_t> joint_users_begins_, joint_users_, channel_users_begins_,
      channel_users_;

  // The pose that the derivatives are taken at.
  std::vector<float> deltas_;   // [joints_, 9]
  std::vector<float> weights_;  // [channels_]
  std::vector<Matrix> world_, skin_;
  std::vector<std::array<double, 3>> base_;  // [points_]
  // Another pose beside it.
  std::vector<Matrix> other_world_, other_skin_;
  std::vector<float> other_weights_;
  std::vector<std::uint8_t> moved_;      // [joints_]
  std::vector<std::uint32_t> marked_;    // points
  std::vector<std::uint8_t> is_marked_;  // [points_]
  // Evaluations.
  rig::Workspace work_;
  std::vector<float> raw_, joint_values_, shape_values_, map_values_, control_values_;
};

}  // namespace risorius::solve
