// SPDX-License-Identifier: MIT
// JointChain: what bones keep to how each of them moves the skin.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.h"

namespace risorius::rig {

/// The bones of an armature. Each passes on all of its motion to those below it, shear included.
struct JointChain {
  using Affine = std::array<double, 12>;  // three rows of four; the fourth row is 0 0 0 1
  std::vector<std::int32_t> parents;      // -1: none
  std::vector<std::uint32_t> order;       // parents come before those below them
  std::vector<Affine> rest;               // in the armature's space
  std::vector<Affine> inverse;            // of rest

  std::uint32_t size() const { return static_cast<std::uint32_t>(parents.size()); }
};

/// In:    parents  [bones] in any order, -1: none
///        rest     float64[bones, 4, 4], in the armature's space
/// Fails: bad_index, a parent that is no bone or a circle of parents; bad_value, a matrix that is
///        not finite, whose last row is not 0 0 0 1, or that has no inverse
core::Result<JointChain> make_joint_chain(std::span<const std::int32_t> parents,
                                          const double* rest);

/// What moves the skin: pose times the inverse of rest, in the armature's space, where the pose of
/// a bone is the pose of its parent times its rest from there times T(location) R(rotation)
/// S(scale). Worked out in double; the same bits on every CPU. In:  location float32[bones, 3];
/// rotation float32[bones, 4], w x y z of any length, 0 0 0 0 is
///      half a turn about x as in Blender; scale float32[bones, 3], may be 0. What is not finite
///      spoils its bone and those below it
///      work     [bones]
/// Out: matrices float32[bones, 3, 4]; a bone that keeps nothing moves exactly as its parent
void evaluate_chain(const JointChain& chain, const float* location, const float* rotation,
                    const float* scale, JointChain::Affine* work, float* matrices) noexcept;

}  // namespace risorius::rig
