// SPDX-License-Identifier: MIT
// Encodes clips as .rzc files, lossless. FORMAT.md describes the format.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "clip/clip.h"
#include "clip/codec/little_endian.h"
#include "core/result.h"

namespace risorius::clip {

inline constexpr std::size_t kDefaultBlockFrames = 512;

/// Encodes frames incrementally.
class Encoder {
 public:
  /// In: block_frames  1 to 4096: frames that are compressed and read together
  /// Fails: kInvalidArgument with the field (such as a repeated name or a rate that is not above 0)
  static core::Result<Encoder> create(Head head, std::size_t block_frames = kDefaultBlockFrames);

  /// Appends frames.
  /// In: frames [n, controls]; times [n] if the clip has them, else empty: seconds, finite, each
  ///     after the one before
  /// Fails: kInvalidArgument, and nothing is appended
  core::Status append(std::span<const float> frames, std::span<const double> times);
  void add(Event event) { pending_.push_back(std::move(event)); }
  /// Encodes the remaining frames and events and the index. Afterwards nothing may be appended.
  void finish();

  /// Returns the bytes that were encoded since the last call of take, and removes them from the
  /// encoder: before finish, the head and the full blocks.
  Bytes take();
  const Head& head() const { return head_; }
  std::uint64_t frame_count() const { return frames_ + filled_; }

 private:
  friend core::Result<Bytes> encode(const Clip& clip, std::size_t block_frames);
  struct Block {
    std::uint64_t offset;
    std::uint32_t size, frames;
  };
  void put_block(const float* curves, std::size_t stride, std::span<const double> times,
                 std::size_t frames);

  Head head_;
  std::size_t block_frames_ = 0, filled_ = 0;
  std::uint64_t frames_ = 0, written_ = 0;
  std::vector<float> curves_;  // [controls, block_frames], of which filled_ frames are valid
  std::vector<double> times_;
  double last_time_ = 0.0;
  std::vector<Event> pending_, events_;
  std::vector<Block> blocks_;
  Bytes out_;
};

/// Encodes a clip as the bytes of a .rzc file. Fails: kInvalidArgument with the field.
core::Result<Bytes> encode(const Clip& clip, std::size_t block_frames = kDefaultBlockFrames);

}  // namespace risorius::clip
