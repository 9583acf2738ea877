// SPDX-License-Identifier: MIT
// The curves of a run of frames as bytes: what is chosen for each control, and the codes they
// share.
#pragma once

#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "clip/codec/little_endian.h"
#include "core/result.h"

namespace risorius::clip {

inline constexpr std::size_t kMostBlockFrames = 4096;

// First byte of a block's curves, and of a coded curve that is none.
inline constexpr std::uint8_t kCodedBlock = 0, kStoredBlock = 1, kStoredChunk = 0xFF;

/// What the list of controls says of one, or of several that rest.
enum class PartKind : std::uint8_t { kZero, kConstant, kRepeated, kCoded };

/// Curves [controls, frames] that lie `stride` values apart.
struct BlockCurves {
  const float* values = nullptr;
  std::size_t stride = 0, controls = 0, frames = 0;

  std::span<const float> curve(std::size_t control) const {
    return {values + control * stride, frames};
  }
};

/// Appends the block's bytes; never more than 1 + 4 * controls * frames.
/// In: 1 to kMostBlockFrames frames.
void encode_curves(const BlockCurves& curves, Bytes& out);

/// The curves of a block. Nothing is decoded before it is asked for.
class EncodedCurves {
 public:
  /// Reads what lies where. bytes must outlive the result.
  /// Fails: kInvalidValue, kTruncated; offset counts in bytes.
  static core::Result<EncodedCurves> open(View bytes, std::size_t controls, std::size_t frames);

  EncodedCurves(EncodedCurves&&) noexcept;
  EncodedCurves& operator=(EncodedCurves&&) noexcept;
  ~EncodedCurves();

  /// Writes the frames of controls to out [controls.size(), frames], rows `stride` values apart.
  /// Fails: kInvalidValue. In: controls of this block.
  core::Status decode(std::span<const std::uint32_t> controls, float* out,
                      std::size_t stride) const;
  /// Whether a control rests in the whole block; then value is its value.
  bool is_resting(std::size_t control, float& value) const {
    if (parts_[control].kind != Part::kConstant) return false;
    value = std::bit_cast<float>(parts_[control].bits);
    return true;
  }

 private:
  struct Tables;
  struct Pending;
  struct Part {
    enum Kind : std::uint8_t { kConstant, kCoded, kStored } kind = kConstant;
    bool is_near_end = false;          // its bytes lie in tail_
    std::uint32_t bits = 0;            // of kConstant
    std::size_t offset = 0, size = 0;  // of the others' bytes
  };
  EncodedCurves();
  bool read_tables(Cursor& in);
  core::Status read_parts(Cursor& in, std::size_t controls);
  void keep_tail();
  core::Status refuse(std::size_t control, const char* message) const;
  core::Result<bool> fill(std::size_t control, float* out) const;
  core::Status decode_pair(const Pending& a, const Pending* b) const;

  View bytes_;
  std::size_t frames_ = 0;
  std::vector<Part> parts_;
  std::unique_ptr<Tables> tables_;
  Bytes tail_;  // a copy of the bytes from tail_begin_ on
  std::size_t tail_begin_ = 0;
};

}  // namespace risorius::clip
