// SPDX-License-Identifier: MIT
// DirectFace: evaluates controls to the finished vertices of a face's meshes, for many faces at
// once.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/aligned.h"
#include "core/result.h"
#include "rig/outputs/bone_space.h"
#include "rig/outputs/joint_chain.h"
#include "rig/outputs/morph.h"
#include "rig/outputs/skin.h"
#include "rig/pose.h"

namespace risorius::rig {

/// The parts of a face. The armature may have more bones than the rig moves. These other bones have
/// the transforms of the last call of `keep`; before the first call they stay in their rest pose.
struct FaceParts {
  struct Mesh {
    std::shared_ptr<const Morph> morph;
    std::shared_ptr<const Skin> skin;
    std::vector<float> base;  // [vertices, 3], which channels and bones then move
  };
  std::shared_ptr<const Rig> rig;
  std::shared_ptr<const BoneSpace> space;
  std::shared_ptr<const JointChain> chain;
  std::vector<std::uint32_t> rows;    // [bones of space]: index of the bone in chain
  std::vector<std::uint32_t> turned;  // bones of space that FaceFrame::turns rotate in addition
  std::vector<Mesh> meshes;
};

/// A mesh and the memory to which its vertices are written.
struct Target {
  std::uint32_t mesh = 0;
  float* out = nullptr;  // [vertices, 3]
  // Set by the evaluation: false if the mesh had not changed since it was last written, and
  // therefore was not written.
  bool written = false;
};

/// A frame of a face.
/// raw    float32[raw controls]; nullptr: `pose` is given
/// lod    the LOD of the rig, clamped to the last one; without raw it is not read
/// pose   with raw: the rig's output, null pointers are ignored; without raw: the input, joints and
///        blend_shapes are read
/// turns  float32[turned, 4], quaternions w x y z in each bone's rest axes. They are multiplied
///        from the left to the rotations of the bones FaceParts::turned; nullptr: none
/// anew   write all targets, even if nothing changed
struct FaceFrame {
  const float* raw = nullptr;
  std::uint32_t lod = 0;
  PoseView pose;
  const float* turns = nullptr;
  bool anew = false;
  std::vector<Target> targets;  // no mesh twice
};

/// Evaluates one face frame after frame. It remembers the last frame and skips unchanged meshes.
/// Not thread-safe.
class DirectFace {
 public:
  /// Prepares the evaluation of a face.
  /// Fails: kInvalidIndex, kInvalidLength or kInvalidValue if the parts do not fit together.
  static core::Result<std::unique_ptr<DirectFace>> make(FaceParts parts);

  const FaceParts& parts() const { return parts_; }
  /// Sets the transforms of all bones of FaceParts::chain: location [bones, 3], rotation [bones, 4]
  /// as w x y z, scale [bones, 3]. The bones that the rig moves get new transforms in each frame.
  void keep(const float* location, const float* rotation, const float* scale);
  /// Sets the base vertices of a mesh, which its channels and bones then move. The next frame
  /// writes the mesh.
  /// In: mesh  below the number of meshes; base  float32[vertices, 3]
  void set_base(std::uint32_t mesh, const float* base);
  /// Makes the next frame write every mesh.
  void forget() noexcept;

  // The following functions are the steps of evaluate_faces.
  /// Evaluates the rig, unless the frame has a pose, and the bones, and finds the bones and
  /// channels that changed. Allocates nothing.
  void begin(const FaceFrame& frame) noexcept;
  /// Whether the target must be written. Call it after begin.
  bool is_due(const FaceFrame& frame, const Target& target) const noexcept;
  /// Writes one block of a mesh. Call it after begin, from any thread.
  void write(const Target& target, std::uint32_t block) const noexcept;
  /// Remembers that a target was written. Call it after all of its blocks.
  void end(const Target& target) noexcept;

 private:
  struct Mesh {
    std::vector<std::uint32_t> starts;  // [channels, blocks + 1] into the deltas of the morph
    // The channels whose weight is not 0, as indices into the channels of the morph.
    std::vector<std::uint32_t> active;
    std::size_t active_count = 0;
    std::uint64_t written = 0;   // the frame in which it was last written; 0: never
    const float* out = nullptr;  // the address to which it was last written
  };

  explicit DirectFace(FaceParts parts);
  void evaluate_rig(const FaceFrame& frame) noexcept;
  void evaluate_joints(const float* joints, const float* turns) noexcept;
  void note_channels(const float* weights) noexcept;
  void list_active(std::size_t mesh, const float* weights) noexcept;

  FaceParts parts_;
  std::vector<Mesh> meshes_;
  std::uint64_t frame_ = 0;
  // The rig's workspace, the last pose that it evaluated, and the raw controls and LOD of this
  // pose.
  Workspace work_;
  Pose pose_;
  std::vector<float> raw_;
  std::uint32_t lod_ = 0;
  bool has_pose_ = false;
  // Location, rotation and scale of the bones that the rig moves, three arrays one after the other.
  std::vector<float> own_;
  // Location, rotation and scale of all bones of the armature, in this frame and in the frame
  // before.
  std::vector<float> channels_, last_channels_;
  bool has_matrices_ = false;
  std::vector<JointChain::Affine> affine_;
  std::vector<float> matrices_, last_matrices_;
  core::AlignedVector<float> rows_;
  std::vector<float> weights_;
  // [bones] and [channels]: number of the frame in which each bone and each channel changed last.
  std::vector<std::uint64_t> bone_changed_, channel_changed_;
};

/// Evaluates a frame of each face in several threads. The results do not depend on the number of
/// threads.
/// In:  faces    no face twice
///      frames   one for each face; their outputs may not overlap
///      threads  number of threads, at most 64; 0: one for each 8,192 vertices of the targets, at
///               most one per core
void evaluate_faces(std::span<DirectFace* const> faces, std::span<FaceFrame> frames,
                    std::size_t threads);

}  // namespace risorius::rig
