// SPDX-License-Identifier: MIT
// Evaluates one face frame after frame to the finished vertices of its meshes: the Rig gives joints
// and weights of blend shape channels, the space (BoneSpace) turns joints into bones, the chain
// (JointChain) gives the matrices of all bones, and a Morph and a Skin move the vertices of each
// mesh in blocks of 1,024.
#include "rig/direct/direct_face.h"

#include <algorithm>
#include <cstring>
#include <string>

#include "rig/stages/evaluate.h"

namespace risorius::rig {
namespace {

using core::ErrorCode;
using core::fail;
using core::Result;
using core::Status;

Status check_rows(const FaceParts& parts) {
  const std::uint32_t bones = parts.chain->size();
  const std::size_t own = parts.space->bones.size();
  if (parts.rows.size() != own) {
    return fail(ErrorCode::kInvalidLength, "rows",
                "a bone for each of " + std::to_string(own) + " bones of the space was expected, " +
                    "found " + std::to_string(parts.rows.size()));
  }
  std::vector<std::uint8_t> taken(bones);
  for (const std::uint32_t row : parts.rows) {
    if (row >= bones || taken[row] != 0) {
      return fail(ErrorCode::kInvalidIndex, "rows",
                  "bone " + std::to_string(row) +
                      (row < bones ? " stands there twice"
                                   : ", but the chain has " + std::to_string(bones)));
    }
    taken[row] = 1;
  }
  for (const std::uint32_t row : parts.turned) {
    if (row >= own) {
      return fail(ErrorCode::kInvalidIndex, "turned",
                  "bone " + std::to_string(row) + ", but the space has " + std::to_string(own));
    }
  }
  return core::ok();
}

Status check_mesh(const FaceParts& parts, std::size_t m) {
  const FaceParts::Mesh& mesh = parts.meshes[m];
  const std::string where = "meshes[" + std::to_string(m) + "]";
  const std::uint32_t vertices = mesh.skin->vertex_count;
  if (mesh.morph->vertex_count != vertices || mesh.base.size() != std::size_t{vertices} * 3) {
    return fail(ErrorCode::kInvalidLength, where,
                "a Morph, a base and a Skin of as many vertices were expected, found " +
                    std::to_string(mesh.morph->vertex_count) + ", " +
                    std::to_string(mesh.base.size() / 3) + " and " + std::to_string(vertices));
  }
  if (mesh.skin->bone_count != parts.chain->size()) {
    return fail(ErrorCode::kInvalidLength, where,
                "a Skin of the chain's " + std::to_string(parts.chain->size()) +
                    " bones was expected, found " + std::to_string(mesh.skin->bone_count));
  }
  if (mesh.morph->channel_count != parts.rig->blend_shape_count) {
    return fail(ErrorCode::kInvalidLength, where,
                "a Morph of the rig's " + std::to_string(parts.rig->blend_shape_count) +
                    " blend shapes was expected, found " +
                    std::to_string(mesh.morph->channel_count));
  }
  return core::ok();
}

Status check(const FaceParts& parts) {
  if (parts.rig->joint_stride != 9) {
    return fail(ErrorCode::kInvalidValue, "rig", "a Rig of rotation='euler' was expected");
  }
  if (parts.space->joint_count != parts.rig->joint_count) {
    return fail(ErrorCode::kInvalidLength, "space",
                "a BoneSpace of the rig's " + std::to_string(parts.rig->joint_count) +
                    " joints was expected, found " + std::to_string(parts.space->joint_count));
  }
  RISORIUS_TRY(check_rows(parts));
  for (std::size_t m = 0; m < parts.meshes.size(); ++m) RISORIUS_TRY(check_mesh(parts, m));
  return core::ok();
}

// Where the deltas of each block of vertices begin in each channel of a morph: [channels, blocks +
// 1].
std::vector<std::uint32_t> block_starts(const Morph& morph, std::uint32_t blocks) {
  std::vector<std::uint32_t> starts;
  starts.reserve(morph.channels.size() * (std::size_t{blocks} + 1));
  for (std::size_t c = 0; c < morph.channels.size(); ++c) {
    std::uint32_t at = morph.channel_offsets[c];
    for (std::uint32_t b = 0; b < blocks; ++b) {
      while (at < morph.channel_offsets[c + 1] && morph.deltas[at].vertex / kSkinBlock < b) ++at;
      starts.push_back(at);
    }
    starts.push_back(morph.channel_offsets[c + 1]);
  }
  return starts;
}

bool same_bits(const float* a, const float* b, std::size_t n) {
  return n == 0 || std::memcmp(a, b, n * sizeof(float)) == 0;
}

void copy_to(const std::vector<float>& from, float* to) {
  if (to != nullptr) std::copy(from.begin(), from.end(), to);
}

// rotation = turn * rotation; both are w x y z.
void add_turn(const float* turn, float* rotation) {
  const Quaternion q = multiply({turn[1], turn[2], turn[3], turn[0]},
                                {rotation[1], rotation[2], rotation[3], rotation[0]});
  rotation[0] = q.w, rotation[1] = q.x, rotation[2] = q.y, rotation[3] = q.z;
}

}  // namespace

Result<std::unique_ptr<DirectFace>> DirectFace::make(FaceParts parts) {
  RISORIUS_TRY(check(parts));
  return std::unique_ptr<DirectFace>(new DirectFace(std::move(parts)));
}

DirectFace::DirectFace(FaceParts parts)
    : parts_(std::move(parts)), work_(make_workspace(*parts_.rig)), pose_(make_pose(*parts_.rig)) {
  const std::size_t bones = parts_.chain->size();
  raw_.resize(parts_.rig->raw_count);
  own_.resize(parts_.space->bones.size() * 10);
  channels_.resize(bones * 10);
  last_channels_.resize(bones * 10);
  for (std::size_t b = 0; b < bones; ++b) {
    channels_[bones * 3 + b * 4] = 1;
    std::fill_n(channels_.begin() + static_cast<std::ptrdiff_t>(bones * 7 + b * 3), 3, 1.0f);
  }
  affine_.resize(bones);
  matrices_.resize(bones * 12);
  last_matrices_.resize(bones * 12);
  rows_.resize((bones + 1) * simd::kSkinRow);  // the last row is for influences without a bone
  weights_.resize(parts_.rig->blend_shape_count);
  bone_changed_.resize(bones);
  channel_changed_.resize(weights_.size());
  for (const FaceParts::Mesh& mesh : parts_.meshes) {
    Mesh own;
    own.starts = block_starts(*mesh.morph, mesh.skin->block_count());
    own.active.resize(mesh.morph->channels.size());
    meshes_.push_back(std::move(own));
  }
}

void DirectFace::keep(const float* location, const float* rotation, const float* scale) {
  const std::size_t bones = parts_.chain->size();
  std::copy(location, location + bones * 3, channels_.begin());
  std::copy(rotation, rotation + bones * 4,
            channels_.begin() + static_cast<std::ptrdiff_t>(bones * 3));
  std::copy(scale, scale + bones * 3, channels_.begin() + static_cast<std::ptrdiff_t>(bones * 7));
}

void DirectFace::set_base(std::uint32_t mesh, const float* base) {
  std::vector<float>& kept = parts_.meshes[mesh].base;
  std::copy(base, base + kept.size(), kept.begin());
  meshes_[mesh].written = 0;
}

void DirectFace::forget() noexcept {
  for (Mesh& mesh : meshes_) mesh.written = 0;
}

void DirectFace::begin(const FaceFrame& frame) noexcept {
  ++frame_;
  if (frame.raw != nullptr) evaluate_rig(frame);
  const bool own = frame.raw != nullptr;
  const float* weights = own ? pose_.blend_shapes.data() : frame.pose.blend_shapes;
  evaluate_joints(own ? pose_.joints.data() : frame.pose.joints, frame.turns);
  note_channels(weights);
  for (const Target& target : frame.targets) list_active(target.mesh, weights);
}

void DirectFace::evaluate_rig(const FaceFrame& frame) noexcept {
  if (!has_pose_ || lod_ != frame.lod || !same_bits(raw_.data(), frame.raw, raw_.size())) {
    evaluate(*parts_.rig, frame.raw, frame.lod, true, work_, pose_);
    std::copy(frame.raw, frame.raw + raw_.size(), raw_.begin());
    lod_ = frame.lod, has_pose_ = true;
  }
  copy_to(pose_.joints, frame.pose.joints);
  copy_to(pose_.blend_shapes, frame.pose.blend_shapes);
  copy_to(pose_.animated_maps, frame.pose.animated_maps);
  copy_to(pose_.controls, frame.pose.controls);
}

void DirectFace::evaluate_joints(const float* joints, const float* turns) noexcept {
  const std::size_t own = parts_.rows.size(), bones = parts_.chain->size();
  float *location = own_.data(), *rotation = location + own * 3, *scale = rotation + own * 4;
  evaluate_bones(*parts_.space, joints, location, rotation, scale);
  for (std::size_t t = 0; turns != nullptr && t < parts_.turned.size(); ++t) {
    add_turn(turns + t * 4, rotation + std::size_t{parts_.turned[t]} * 4);
  }
  float *all = channels_.data(), *turned = all + bones * 3, *scaled = turned + bones * 4;
  for (std::size_t i = 0; i < own; ++i) {
    const std::size_t b = parts_.rows[i];
    std::copy_n(location + i * 3, 3, all + b * 3);
    std::copy_n(rotation + i * 4, 4, turned + b * 4);
    std::copy_n(scale + i * 3, 3, scaled + b * 3);
  }
  if (has_matrices_ && same_bits(channels_.data(), last_channels_.data(), channels_.size())) return;
  last_channels_ = channels_;  // of equal size, so that nothing is allocated
  evaluate_chain(*parts_.chain, all, turned, scaled, affine_.data(), matrices_.data());
  for (std::size_t b = 0; b < bones; ++b) {
    if (has_matrices_ && same_bits(&matrices_[b * 12], &last_matrices_[b * 12], 12)) continue;
    bone_changed_[b] = frame_;
    parts_.rig->kernels->skin_rows(&matrices_[b * 12], 1, &rows_[b * simd::kSkinRow]);
  }
  std::swap(matrices_, last_matrices_);
  has_matrices_ = true;
}

void DirectFace::note_channels(const float* weights) noexcept {
  for (std::size_t c = 0; c < weights_.size(); ++c) {
    if (same_bits(&weights[c], &weights_[c], 1)) continue;
    weights_[c] = weights[c];
    channel_changed_[c] = frame_;
  }
}

void DirectFace::list_active(std::size_t mesh, const float* weights) noexcept {
  Mesh& own = meshes_[mesh];
  const std::vector<std::uint16_t>& channels = parts_.meshes[mesh].morph->channels;
  own.active_count = 0;
  for (std::uint32_t c = 0; c < channels.size(); ++c) {
    if (weights[channels[c]] != 0.0f) own.active[own.active_count++] = c;
  }
}

bool DirectFace::is_due(const FaceFrame& frame, const Target& target) const noexcept {
  const Mesh& own = meshes_[target.mesh];
  if (frame.anew || own.written == 0 || own.out != target.out) return true;
  const FaceParts::Mesh& mesh = parts_.meshes[target.mesh];
  const auto after = [&own](const std::vector<std::uint64_t>& changed) {
    return [&own, &changed](std::uint16_t i) { return changed[i] > own.written; };
  };
  return std::ranges::any_of(mesh.morph->channels, after(channel_changed_)) ||
         std::ranges::any_of(mesh.skin->bones_used, after(bone_changed_));
}

void DirectFace::write(const Target& target, std::uint32_t block) const noexcept {
  const FaceParts::Mesh& mesh = parts_.meshes[target.mesh];
  const Mesh& own = meshes_[target.mesh];
  const Morph& morph = *mesh.morph;
  const std::uint32_t stride = mesh.skin->block_count() + 1, first = block * kSkinBlock;
  const std::size_t begin = std::size_t{first} * 3;
  alignas(64) float moved[kSkinBlock * 3];
  bool is_moved = false;
  for (std::size_t a = 0; a < own.active_count; ++a) {
    const std::uint32_t c = own.active[a];
    const std::uint32_t* range = &own.starts[std::size_t{c} * stride + block];
    if (range[0] == range[1]) continue;
    if (!is_moved) {
      const std::size_t size = std::min(mesh.base.size() - begin, std::size_t{kSkinBlock} * 3);
      std::copy_n(mesh.base.data() + begin, size, moved);
      is_moved = true;
    }
    add_deltas(&morph.deltas[range[0]], range[1] - range[0], weights_[morph.channels[c]], first,
               moved);
  }
  evaluate_skin_block(*mesh.skin, *parts_.rig->kernels, rows_.data(), block,
                      is_moved ? moved : mesh.base.data() + begin, target.out + begin);
}

void DirectFace::end(const Target& target) noexcept {
  meshes_[target.mesh].written = frame_;
  meshes_[target.mesh].out = target.out;
}

}  // namespace risorius::rig
