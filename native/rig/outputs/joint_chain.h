// SPDX-License-Identifier: MIT
// JointChain: computes the skinning matrices of an armature from the transforms of its bones.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.h"

namespace risorius::rig {

/// The bones of an armature. A bone passes its whole motion to its children, shear included.
struct JointChain {
  using Affine = std::array<double, 12>;  // three rows of four; the fourth row is 0 0 0 1
  std::vector<std::int32_t> parents;      // -1: none
  std::vector<std::uint32_t> order;       // parents come before their children
  std::vector<Affine> rest;               // in the armature's space
  std::vector<Affine> inverse;            // of the rest matrices

  std::uint32_t size() const { return static_cast<std::uint32_t>(parents.size()); }
};

/// Checks a hierarchy of bones and prepares its evaluation.
/// In:    parents  [bones] in any order, -1: none
///        rest     float64[bones, 4, 4], rest matrices in the armature's space
/// Fails: kInvalidIndex (a parent that does not exist, or a cycle of parents); kInvalidValue (a
///        matrix that is not finite, cannot be inverted, or whose last row is not 0 0 0 1)
core::Result<JointChain> make_joint_chain(std::span<const std::int32_t> parents,
                                          const double* rest);

/// Computes the skinning matrices: pose matrix times inverse rest matrix, in the armature's space.
/// The pose matrix of a bone is its parent's pose matrix times its rest matrix relative to the
/// parent times T(location) R(rotation) S(scale). Computed in double; the bits are the same on
/// every CPU.
/// In:  location  float32[bones, 3]
///      rotation  float32[bones, 4], w x y z of any length; 0 0 0 0 is half a turn about x as in
///                Blender
///      scale     float32[bones, 3], may be 0. A value that is not finite makes the matrices of its
///                bone and the bone's descendants invalid
///      work      [bones] scratch memory
/// Out: matrices  float32[bones, 3, 4]; a bone whose location, rotation and scale are neutral has
///                the matrix of its parent
void evaluate_chain(const JointChain& chain, const float* location, const float* rotation,
                    const float* scale, JointChain::Affine* work, float* matrices) noexcept;

}  // namespace risorius::rig
