// SPDX-License-Identifier: MIT
// Surface: the skins of a face, prepared to compute where a pose of its rig moves a vertex.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/result.h"
#include "dna/dna.h"
#include "rig/rig.h"

namespace risorius::solve {

/// The upper three rows of an affine 4 x 4 matrix for column vectors.
using Matrix = std::array<double, 12>;

struct Influence {
  std::uint32_t joint;
  float weight;
};
/// The displacement, in file units, that a blend shape channel at 1 adds to a vertex before
/// skinning.
struct Shape {
  std::uint32_t channel;
  std::array<float, 3> delta;
};

/// A mesh of the file. The influences of vertex v are influences[influence_begins[v]] up to, not
/// including, influences[influence_begins[v + 1]]; shapes correspondingly.
struct SkinMesh {
  std::vector<std::array<float, 3>> positions;  // file units
  std::vector<std::uint32_t> influence_begins;
  std::vector<Influence> influences;
  std::vector<std::uint32_t> shape_begins;
  std::vector<Shape> shapes;
};

struct Surface {
  std::shared_ptr<const rig::Rig> rig;
  std::uint32_t lod = 0;
  std::vector<std::uint32_t> parents;  // [joints]; a root is its own parent
  std::vector<std::uint32_t> order;    // joints, parents first
  // [joints]: inverse of the joint's transform in the neutral pose, in the face's space.
  std::vector<Matrix> neutral_inverse;
  std::vector<SkinMesh> meshes;
};

/// Copies the parts of a face that positions need. A vertex without weights is moved only by its
/// shapes.
/// In:     rig  compiled from dna, with Euler angles as rotation
///         lod  below the number of LODs
/// Fails:  as dna::validate; kInvalidArgument (a rig or a LOD that does not fit)
core::Result<Surface> make_surface(const dna::Dna& dna, std::shared_ptr<const rig::Rig> rig,
                                   std::uint32_t lod);

/// A joint's transform relative to its parent in a pose.
/// In: delta  the joint's nine numbers of a Pose, which are added to its neutral values
Matrix local_matrix(const rig::Rig& rig, std::uint32_t joint, const float* delta);
/// The matrix a * b, which applies b first.
Matrix multiply(const Matrix& a, const Matrix& b);

}  // namespace risorius::solve
