// SPDX-License-Identifier: MIT
// Dna -> Rig and Mesh -> Morph: the only folder that knows both sides.
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
  const simd::Kernels* kernels = nullptr;     // nullptr: the best that this CPU has
  Precision precision = Precision::kFloat32;  // of the joint matrices
  Rotation rotation = Rotation::kEuler;       // form of the rotations in a pose
  core::Budget* budget = nullptr;             // nullptr: one of budget_for(dna)
};

/// What compiling a face may take: 1 MiB and 64 times its bytes of lists and matrices that are no
/// copies of lists in the file, and 2^28 and 256 times its bytes of steps, to compile it and to
/// evaluate it once at every LOD.
core::Budget budget_for(const dna::Dna& dna);

/// Compiles the behavior of a face. The result keeps nothing of the Dna.
/// Fails: kInvalidIndex, kInvalidLength, kInvalidValue with the field: a Dna may have been edited;
///        kInvalidValue for a joint value beyond 65504 in float16; kLimitExceeded (the format's
///        indices, the budget).
/// From:  dna-format 12; joint matrices by columns, so that inactive columns cost nothing
core::Result<rig::Rig> compile(const dna::Dna& dna, const CompileOptions& options = {});

/// What compile makes of a file; counted up where the poses of an old file change. What was
/// compiled by another version is compiled anew.
constexpr std::uint32_t kVersion = 2;

/// [joints]: those whose rotation the file's joint metadata declares a quaternion.
std::vector<bool> quaternion_joints(const dna::Dna& dna);

/// The columns of a joint group that turn quaternion joints, in the order in which their rotations
/// are multiplied: that of the reference, whose storage swaps columns that are empty at a LOD to
/// the end. Columns that already stand by the number of their LODs, most first, keep their order.
/// In:    quaternion_joints  of the group's file, as quaternion_joints() has it
/// Out:   columns of the group, each at most once
/// Cost:  the values of the rows that turn quaternion joints
std::vector<std::uint32_t> quaternion_column_order(const dna::JointGroup& g,
                                                   std::uint32_t lod_count,
                                                   const std::vector<bool>& quaternion_joints);

/// Compiles the blend shape targets of one mesh; each delta d is stored as matrix * d.
/// In:    matrix  row-major 3x3, e.g. the file's axes and units to the scene's
/// Fails: kInvalidIndex
core::Result<rig::Morph> compile_morph(const dna::Dna& dna, std::size_t mesh_index,
                                       const std::array<float, 9>& matrix);

}  // namespace risorius::compile
