// SPDX-License-Identifier: MIT
// Compiles a Dna to a Rig and a Mesh to a Morph. Only this folder knows both sides.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/budget.h"
#include "core/result.h"
#include "dna/dna.h"
#include "rig/outputs/morph.h"
#include "rig/rig.h"

namespace risorius::compile {

enum class Rotation { kEuler, kQuaternion };
enum class Precision { kFloat32, kFloat16 };

struct CompileOptions {
  const simd::Kernels* kernels = nullptr;     // nullptr: as simd::find_kernels(nullptr)
  Precision precision = Precision::kFloat32;  // of the joint matrices
  Rotation rotation = Rotation::kEuler;       // form of the rotations in a pose
  core::Budget* budget = nullptr;             // nullptr: budget_for(dna)
};

/// The limits for compiling a face and evaluating it once at every LOD. Memory for lists and
/// matrices: 1 MiB plus 64 times the face's bytes; copies of the file's lists do not count. Steps:
/// 2^28 plus 256 times the face's bytes.
core::Budget budget_for(const dna::Dna& dna);

/// Compiles the behavior of a face. The result does not refer to the Dna.
/// Fails: kInvalidIndex, kInvalidLength, kInvalidValue with the field, because a Dna may have been
///        edited; kInvalidValue for a joint value beyond 65504 in float16; kLimitExceeded (more
///        controls or joint attributes than 16-bit indices reach, more values than 32-bit indices
///        reach, the budget); kInvalidArgument if RISORIUS_SIMD has an unknown name or names
///        kernels that this CPU lacks
/// From:  dna-format 12; joint matrices are stored by columns, so that inactive columns cost
///        nothing
core::Result<rig::Rig> compile(const dna::Dna& dna, const CompileOptions& options = {});

/// The version of compile's results. It is raised when the poses of an existing file change, and
/// rigs that another version compiled are then compiled again.
constexpr std::uint32_t kVersion = 2;

/// [joints]: whether the file's joint metadata declares the joint's rotation a quaternion.
std::vector<bool> quaternion_joints(const dna::Dna& dna);

/// The columns of a joint group that rotate quaternion joints, in the order in which their
/// rotations are multiplied. The order follows the reference evaluator, whose storage swaps columns
/// that are empty at a LOD to the end. Columns that are sorted by the number of their LODs, largest
/// first, keep their order.
/// In:    quaternion_joints  for all joints of the file, from quaternion_joints()
/// Out:   columns of the group, each at most once
/// Cost:  proportional to the values of the rows that rotate quaternion joints
std::vector<std::uint32_t> quaternion_column_order(const dna::JointGroup& g,
                                                   std::uint32_t lod_count,
                                                   const std::vector<bool>& quaternion_joints);

/// Compiles the blend shape targets of one mesh; each delta d is stored as matrix * d.
/// In:    matrix  row-major 3x3, for example from the file's axes and units to the scene's
/// Fails: kInvalidIndex
core::Result<rig::Morph> compile_morph(const dna::Dna& dna, std::size_t mesh_index,
                                       const std::array<float, 9>& matrix);

}  // namespace risorius::compile
