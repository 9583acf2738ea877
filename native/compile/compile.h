// SPDX-License-Identifier: MIT
// Dna -> Rig and Mesh -> Morph: the only folder that knows both sides.
#pragma once

#include <array>
#include <memory>

#include "core/result.h"
#include "dna/dna.h"
#include "rig/morph.h"
#include "rig/rig.h"

namespace risorius::compile {

enum class Precision { kFloat32, kFloat16 };

struct CompileOptions {
  const simd::Kernels* kernels = nullptr;     // nullptr: the best that this CPU has
  Precision precision = Precision::kFloat32;  // of the joint matrices
};

/// Compiles the behavior of a face. The result keeps nothing of the Dna.
/// Fails: kInvalidIndex, kInvalidLength, kInvalidValue with the field: a Dna may have been edited;
///        kInvalidValue for a joint value beyond 65504 in float16.
/// From:  dna-format 12; joint matrices by columns, so that inactive columns cost nothing
core::Result<rig::Rig> compile(const dna::Dna& dna, const CompileOptions& options = {});

/// Compiles the blend shape targets of one mesh; each delta d is stored as matrix * d.
/// In:    matrix  row-major 3x3, e.g. the file's axes and units to the scene's
/// Fails: kInvalidIndex
core::Result<rig::Morph> compile_morph(const dna::Dna& dna, std::size_t mesh_index,
                                       const std::array<float, 9>& matrix);

}  // namespace risorius::compile
