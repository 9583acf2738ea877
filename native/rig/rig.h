// SPDX-License-Identifier: MIT
// Rig: the compiled, immutable form of a face's behavior. Knows nothing of the file it came from;
// may be shared by any number of threads and faces.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rig/arrays.h"
#include "simd/kernels.h"

namespace risorius::rig {

/// A compiled face. Its arrays are views into one block of bytes, which any number of Rigs may
/// share.
class Rig : public RigHeader, public RigArrays<View> {
 public:
  const simd::Kernels* kernels = nullptr;
  /// Unique among the Rigs that this process opens (copies share it); never 0 for an opened Rig. A
  /// workspace remembers this number with its results of earlier frames.
  std::uint64_t number = 0;

  std::vector<std::string> raw_control_names() const { return texts(0, raw_count); }
  std::vector<std::string> gui_control_names() const { return texts(raw_count, gui_count); }
  /// Ids of the layers of the file that the reader of DNA files does not know.
  std::vector<std::string> ignored_layers() const {
    return texts(raw_count + gui_count, text_ends.size() - raw_count - gui_count);
  }
  /// The steps of a list at a LOD, in the order in which they run, each packed by make_step() of
  /// arrays.h. In: lod  below the number of LODs
  std::span<const std::uint32_t> steps_of(std::uint32_t lod, StepList list) const {
    const std::uint32_t* begin = step_begins.data() + std::size_t{lod} * kStepLists + list;
    return steps.subspan(begin[0], begin[1] - begin[0]);
  }
  bool is_half() const { return !joint_halves.empty(); }
  /// The whole Rig as bytes: a header with version and hash, then the arrays. The bytes can be
  /// stored in a file as a cache for machines of the same byte order. The first call for a compiled
  /// Rig computes the hash; calls are thread-safe.
  std::span<const std::uint8_t> block() const;
  std::size_t memory_bytes() const { return sizeof(Rig) + block_.size(); }

 private:
  friend struct BlockReader;
  struct Seal;
  std::vector<std::string> texts(std::size_t first, std::size_t count) const;
  std::span<const std::uint8_t> block_;
  std::shared_ptr<const void> owner_;
  std::shared_ptr<Seal> seal_;  // null if the bytes had their hash when they were opened
};

}  // namespace risorius::rig
