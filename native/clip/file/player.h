// SPDX-License-Identifier: MIT
// A clip frame by frame, as a rig takes it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "clip/file/reader.h"

namespace risorius::clip {

/// Holds the block that a frame lies in, decoded: frames that follow cost a copy of what moves.
class Player {
 public:
  explicit Player(Reader reader);

  /// Values of all controls [controls], in the order of the clip's names, until the next call.
  /// Fails: as Reader::read. Cost: a block is read, decoded and allocated when the frame lies in
  /// another one than the frame before; else nothing is allocated.
  core::Result<std::span<const float>> frame(std::uint64_t index);

  const Reader& reader() const { return reader_; }

 private:
  core::Status load(std::size_t block);

  Reader reader_;
  std::uint64_t begin_ = 0, end_ = 0;  // frames that are decoded
  std::vector<std::uint32_t> moving_;  // controls that do not rest in them
  std::vector<float> curves_;          // [moving, frames]
  std::vector<float> values_;          // of the frame
};

}  // namespace risorius::clip
