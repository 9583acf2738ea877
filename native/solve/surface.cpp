// SPDX-License-Identifier: MIT
// Copies the hierarchy of a face's joints and, for each mesh, the influences and blend shapes of
// its vertices, and computes the matrices of joints.
#include "solve/surface.h"

#include <cmath>
#include <string>
#include <utility>

#include "dna/validate.h"

namespace risorius::solve {

namespace {

using core::ErrorCode;
using core::fail;
using core::Result;
using core::Status;

constexpr std::array<float, 9> kNeutral{};

Status check_fit(const dna::Dna& dna, const rig::Rig& rig, std::uint32_t lod) {
  const std::size_t joints = dna.definition.joint_names.size();
  if (rig.joint_stride != 9 || rig.joint_count != joints ||
      rig.raw_count != dna.definition.raw_control_names.size() ||
      rig.blend_shape_count != dna.definition.blend_shape_channel_names.size()) {
    return fail(ErrorCode::kInvalidArgument, "rig",
                "a rig of this file with Euler angles was expected");
  }
  const std::uint32_t lods = rig.lod_count == 0 ? 1 : rig.lod_count;
  if (lod >= lods) {
    return fail(ErrorCode::kInvalidArgument, "lod",
                "0 to " + std::to_string(lods - 1) + " was expected, found " + std::to_string(lod));
  }
  return core::ok();
}

/// Sorts joints so that parents come first. validate() has excluded cycles.
std::vector<std::uint32_t> parents_first(const std::vector<std::uint32_t>& parents) {
  std::vector<std::uint32_t> order, chain;
  std::vector<bool> done(parents.size(), false);
  for (std::uint32_t j = 0; j < parents.size(); ++j) {
    for (std::uint32_t p = j; !done[p]; p = parents[p]) {
      chain.push_back(p);
      done[p] = true;
    }
    order.insert(order.end(), chain.rbegin(), chain.rend());
    chain.clear();
  }
  return order;
}

/// The inverse of a matrix that rotates and translates.
Matrix rigid_inverse(const Matrix& m) {
  Matrix out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      out[4 * i + k] = m[4 * k + i];
      out[4 * i + 3] -= m[4 * k + i] * m[4 * k + 3];
    }
  }
  return out;
}

void add_shapes(const dna::Mesh& mesh, SkinMesh& out) {
  out.shape_begins.assign(out.positions.size() + 1, 0);
  for (const dna::BlendShapeTarget& t : mesh.blend_shape_targets) {
    for (const std::uint32_t v : t.vertex_indices) ++out.shape_begins[v + 1];
  }
  for (std::size_t v = 0; v < out.positions.size(); ++v) {
    out.shape_begins[v + 1] += out.shape_begins[v];
  }
  std::vector<std::uint32_t> next(out.shape_begins.begin(), out.shape_begins.end() - 1);
  out.shapes.resize(out.shape_begins.back());
  for (const dna::BlendShapeTarget& t : mesh.blend_shape_targets) {
    for (std::size_t i = 0; i < t.vertex_indices.size(); ++i) {
      out.shapes[next[t.vertex_indices[i]]++] = {
          t.blend_shape_channel_index, {t.deltas.at(i, 0), t.deltas.at(i, 1), t.deltas.at(i, 2)}};
    }
  }
}

SkinMesh skin_mesh(const dna::Mesh& mesh) {
  SkinMesh out;
  out.positions.resize(mesh.positions.count());
  for (std::size_t v = 0; v < out.positions.size(); ++v) {
    out.positions[v] = {mesh.positions.at(v, 0), mesh.positions.at(v, 1), mesh.positions.at(v, 2)};
  }
  out.influence_begins.assign(mesh.skin_offsets.begin(), mesh.skin_offsets.end());
  if (out.influence_begins.empty()) out.influence_begins.assign(out.positions.size() + 1, 0);
  for (std::size_t i = 0; i < mesh.skin_weights.size(); ++i) {
    out.influences.push_back({mesh.skin_joint_indices[i], mesh.skin_weights[i]});
  }
  add_shapes(mesh, out);
  return out;
}

}  // namespace

Matrix multiply(const Matrix& a, const Matrix& b) {
  Matrix out;
  for (std::size_t i = 0; i < 12; i += 4) {
    for (std::size_t k = 0; k < 4; ++k) {
      out[i + k] = a[i] * b[k] + a[i + 1] * b[4 + k] + a[i + 2] * b[8 + k];
    }
    out[i + 3] += a[i + 3];
  }
  return out;
}

Matrix local_matrix(const rig::Rig& rig, std::uint32_t joint, const float* delta) {
  const float* neutral = rig.neutral_joints.data() + std::size_t{joint} * 9;
  const double radians = rig.euler.radians_per_unit == 1.0f ? 1.0 : 0.017453292519943295769;
  Matrix out{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  for (const std::uint8_t axis : rig.euler.order) {
    const double angle = (double{neutral[3 + axis]} + double{delta[3 + axis]}) *
                         double{rig.euler.signs[axis]} * radians;
    if (angle == 0.0) continue;
    const double c = std::cos(angle), s = std::sin(angle);
    const std::size_t i = 4 * ((axis + 1u) % 3), j = 4 * ((axis + 2u) % 3);
    for (std::size_t k = 0; k < 3; ++k) {
      const double a = out[i + k], b = out[j + k];
      out[i + k] = c * a - s * b;
      out[j + k] = s * a + c * b;
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) out[4 * i + k] *= 1.0 + double{delta[6 + k]};
    out[4 * i + 3] = double{neutral[i]} + double{delta[i]};
  }
  return out;
}

Result<Surface> make_surface(const dna::Dna& dna, std::shared_ptr<const rig::Rig> rig,
                             std::uint32_t lod) {
  std::vector<dna::Warning> warnings;
  RISORIUS_TRY(dna::validate(dna, warnings));
  RISORIUS_TRY(check_fit(dna, *rig, lod));
  Surface out;
  out.lod = lod;
  const std::size_t joints = dna.definition.joint_names.size();
  for (std::uint32_t j = 0; j < joints; ++j) {
    const bool known = j < dna.definition.joint_parents.size();
    out.parents.push_back(known ? dna.definition.joint_parents[j] : j);
  }
  out.order = parents_first(out.parents);
  std::vector<Matrix> world(joints);
  out.neutral_inverse.resize(joints);
  for (const std::uint32_t j : out.order) {
    const Matrix local = local_matrix(*rig, j, kNeutral.data());
    world[j] = out.parents[j] == j ? local : multiply(world[out.parents[j]], local);
    out.neutral_inverse[j] = rigid_inverse(world[j]);
  }
  for (const dna::Mesh& mesh : dna.geometry.meshes) out.meshes.push_back(skin_mesh(mesh));
  out.rig = std::move(rig);
  return out;
}

}  // namespace risorius::solve
