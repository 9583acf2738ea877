// SPDX-License-Identifier: MIT
// Reads .rzc files, whole or in parts. FORMAT.md describes the format.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "bytes/source.h"
#include "clip/clip.h"
#include "clip/codec/little_endian.h"
#include "core/result.h"

namespace risorius::clip {

/// Upper limits for a file and for one read.
struct Limits {
  std::uint32_t controls = 1u << 16;
  std::uint64_t frames = std::uint64_t{1} << 32;
  std::uint64_t head_bytes = std::uint64_t{1} << 24;  // also of all decoded names together
  std::uint64_t metadata = std::uint64_t{1} << 18;    // pairs of key and value
  // Largest number of values of one read: controls * frames, and two more values for each frame if
  // frames have times of their own.
  std::uint64_t values = std::uint64_t{1} << 29;
};

/// Whether a file without a valid end, such as an interrupted recording, is accepted.
enum class Ends { kMustBeWhole, kMayBeCut };

/// A clip file that is read in parts. It is not thread-safe: each thread needs its own Reader.
class Reader {
 public:
  /// Reads the head and the index, but no curve. With kMayBeCut and without a valid index, all
  /// blocks are read once, and the clip ends before the first incomplete or damaged block.
  /// Fails: kNotClip, kUnsupportedGeneration, kTruncated, kInvalidValue, kInvalidCount,
  ///        kInvalidLength, kLimitExceeded.
  static core::Result<Reader> open(std::unique_ptr<bytes::Source> source,
                                   Ends ends = Ends::kMustBeWhole, const Limits& limits = {});

  const Head& head() const { return head_; }
  std::uint64_t frame_count() const { return frames_; }
  const std::vector<Event>& events() const { return events_; }
  /// Number of bytes of the file that belong to the clip. Only a cut or damaged file is longer: its
  /// bytes from the first incomplete or damaged block on do not belong to the clip.
  std::uint64_t byte_count() const { return end_; }
  /// Index of the first frame of each block; the last entry is frame_count().
  const std::vector<std::uint64_t>& block_starts() const { return starts_; }

  /// Fails if read() would reject the range of frames, a control, or the number of values. Call it
  /// before allocating memory for the result.
  /// Fails: kInvalidArgument, kLimitExceeded
  core::Status may_read(std::uint64_t begin, std::uint64_t end,
                        std::span<const std::uint32_t> controls) const;

  /// Writes the curves of controls to out [controls.size(), end - begin], and the times in seconds
  /// to out_times [end - begin], unless it is null or the clip has no times of its own. The last
  /// block that was read stays in memory for the next call.
  /// In: begin <= end <= frame_count(), valid controls
  /// Fails: kInvalidArgument, kLimitExceeded, kInvalidValue, kInvalidLength, kTruncated
  core::Status read(std::uint64_t begin, std::uint64_t end, std::span<const std::uint32_t> controls,
                    float* out, double* out_times);

  /// Writes the values of the controls that a block describes as constant to `values` [controls],
  /// and appends the indices of the other controls to `moving`.
  /// Fails: kInvalidValue, kInvalidLength, kTruncated
  core::Status resting(std::size_t block, std::span<float> values,
                       std::vector<std::uint32_t>& moving);

 private:
  struct Block {
    std::uint64_t offset;
    std::uint32_t size, frames;
  };
  struct Loaded;
  core::Status read_head(const Limits& limits);
  core::Status read_names(View body, const Limits& limits);
  core::Status read_index();
  core::Status read_blocks(View index, std::uint64_t offset);
  void find_blocks();
  bool take_block(std::uint64_t offset, Block& block);
  core::Status load(std::size_t block);
  core::Status read_block(std::size_t block, std::uint64_t begin, std::uint64_t end,
                          std::span<const std::uint32_t> controls, float* out, std::size_t stride,
                          double* out_times);

  std::shared_ptr<bytes::Source> source_;
  Limits limits_;
  Head head_;
  std::uint64_t frames_ = 0, first_block_ = 0, end_ = 0;
  std::vector<Block> blocks_;
  std::vector<std::uint64_t> starts_;
  std::vector<Event> events_;
  std::shared_ptr<Loaded> loaded_;
};

/// Decodes a whole .rzc file. Fails: as Reader::open and Reader::read
core::Result<Clip> decode(View bytes, Ends ends = Ends::kMustBeWhole, const Limits& limits = {});

}  // namespace risorius::clip
