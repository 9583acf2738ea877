// SPDX-License-Identifier: MIT
// Plays a clip frame by frame to a rig.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "clip/file/reader.h"

namespace risorius::clip {

/// Plays a clip frame by frame. The block of the most recently read frame stays decoded, so that
/// another frame of this block only costs a copy of the moving curves.
class Player {
 public:
  explicit Player(Reader reader);

  /// Values of all controls [controls], in the order of the clip's names; valid until the next
  /// call.
  /// Fails: kInvalidArgument (the clip has no such frame), kLimitExceeded, kInvalidValue,
  ///        kInvalidLength, kTruncated
  /// Cost:  reads, decodes and allocates if the frame is in another block than the frame of the
  ///        previous call; otherwise allocates nothing
  core::Result<std::span<const float>> frame(std::uint64_t index);

  const Reader& reader() const { return reader_; }

 private:
  core::Status load(std::size_t block);

  Reader reader_;
  std::uint64_t begin_ = 0, end_ = 0;  // the decoded frames
  std::vector<std::uint32_t> moving_;  // controls that the block does not describe as constant
  std::vector<float> curves_;          // [moving, frames]
  std::vector<float> values_;          // [controls], of the frame that was requested last
};

}  // namespace risorius::clip
