// SPDX-License-Identifier: MIT
// Evaluates several frames with one Rig. Up to 8 frames (kFrames) form a block, which reads the
// matrices of the joint groups once; a control is active in a block if it is not 0 in one of the
// frames.
#include <algorithm>
#include <bit>

#include "rig/stages/evaluate.h"
#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

using simd::kFrames;

// Fewer frames than this are evaluated one by one, because a block takes at least the time of three
// to four single frames, even if it has fewer frames.
constexpr std::size_t kFewest = 4;

PoseView frame_of(const Rig& rig, const PoseView& first, std::size_t n) {
  return {first.joints + n * rig.joint_count * rig.joint_stride,
          first.blend_shapes + n * rig.blend_shape_count,
          first.animated_maps + n * rig.animated_map_count, first.controls + n * rig.control_count};
}

// Up to kFrames frames that share one pass over the joint matrices.
class Block {
 public:
  Block(const Rig& rig, Workspace& work, const PoseView& first, std::size_t count)
      : rig_(rig), work_(work), first_(first), count_(count) {}

  void joints(std::uint32_t lod) noexcept {
    const std::span active(work_.active.data(), work_.active_count);
    const simd::Column* columns = detail::list_columns(rig_, lod, active, work_);
    for (std::size_t n = 0; n < work_.live_count; ++n) {
      const std::size_t i = work_.live[n];
      sum(rig_.joint_groups[i], i, columns, rig_.joint_group_lods[i * rig_.lod_count + lod]);
    }
    for (const std::uint16_t control : active) {
      float* weights = work_.frame_weights.data() + std::size_t{control} * kFrames;
      std::fill(weights, weights + kFrames, 0.0f);
    }
    detail::place_rows(rig_, lod, work_, work_.rows.data(), first_.joints, count_);
  }

  /// Marks the active controls of frame f as active in the block, and stores their values.
  void take(std::size_t f) noexcept {
    const float* controls = first_.controls + f * rig_.control_count;
    for (std::size_t a = 0; a < work_.active_count; ++a) {
      const std::uint16_t control = work_.active[a];
      work_.union_bits[control / 64u] |= std::uint64_t{1} << (control % 64u);
      work_.frame_weights[control * kFrames + f] = controls[control];
    }
  }

 private:
  void sum(const JointGroup& g, std::size_t i, const simd::Column* columns,
           std::uint32_t rows) noexcept {
    const std::size_t count = work_.column_ends[i] - g.columns_begin;
    const float* weights = work_.frame_weights.data();
    float* out = work_.rows.data() + g.rows_begin;
    if (rig_.is_half()) {
      rig_.kernels->batch_half_columns(rig_.joint_halves.data(), columns + g.columns_begin, count,
                                       weights, out, stride_, rows);
    } else {
      rig_.kernels->batch_columns(rig_.joint_values.data(), columns + g.columns_begin, count,
                                  weights, out, stride_, rows);
    }
  }

  const Rig& rig_;
  Workspace& work_;
  PoseView first_;
  std::size_t count_;
  std::size_t stride_ = detail::rows_size(rig_);
};

void evaluate_block(const Rig& rig, const float* raw, std::size_t count, std::uint32_t lod,
                    bool settle, Workspace& work, const PoseView& first) noexcept {
  Block block(rig, work, first, count);
  if (detail::go_together(rig, lod) &&
      detail::frame_controls(rig, raw, count, lod, work, first.controls)) {
    detail::frame_channels_and_maps(rig, lod, count, work, first);
  } else {
    for (std::size_t f = 0; f < count; ++f) {
      const PoseView pose = frame_of(rig, first, f);
      detail::begin(rig, raw + f * rig.raw_count, lod, settle, work, pose.controls);
      block.take(f);
      work.warm = true;
      detail::channels_and_maps(rig, lod, work, pose);
    }
    detail::list_union(work);
  }
  work.warm = true;
  block.joints(lod);
  for (std::size_t f = 0; f < count; ++f) {
    detail::rotations(rig, lod, work, frame_of(rig, first, f));
  }
}

}  // namespace

void evaluate_frames(const Rig& rig, const float* raw, std::size_t count, std::uint32_t lod,
                     bool settle, Workspace& work, const PoseView& pose) noexcept {
  const std::uint32_t level = detail::clamp_lod(rig, lod);
  for (std::size_t n = 0; n < count; n += kFrames) {
    const PoseView first = frame_of(rig, pose, n);
    const float* from = raw + n * rig.raw_count;
    if (rig.lod_count == 0 || count - n < kFewest) {
      for (std::size_t f = 0; f < std::min(kFrames, count - n); ++f) {
        evaluate(rig, from + f * rig.raw_count, level, settle, work, frame_of(rig, first, f));
      }
    } else {
      evaluate_block(rig, from, std::min(kFrames, count - n), level, settle, work, first);
    }
  }
  work.warm = false;
}

}  // namespace risorius::rig
