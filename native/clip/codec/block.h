// SPDX-License-Identifier: MIT
// The curves of a run of frames as bytes: the form of each control, and the prefix codes that they
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

// The first byte of a block's curves is kCodedBlock or kStoredBlock (all values as they are). The
// first byte of a curve's chunk in a coded block is the order of its predictor, or kStoredChunk if
// the values follow as they are.
inline constexpr std::uint8_t kCodedBlock = 0, kStoredBlock = 1, kStoredChunk = 0xFF;

/// How a block describes a curve: kZero, all values are 0; kConstant, one constant value;
/// kRepeated, equal to an earlier curve of the block; kCoded, a chunk of bytes. Neighbouring curves
/// with the same constant value share one entry.
enum class PartKind : std::uint8_t { kZero, kConstant, kRepeated, kCoded };

/// Curves [controls, frames] in the caller's memory; each row begins `stride` values after the row
/// before.
struct BlockCurves {
  const float* values = nullptr;
  std::size_t stride = 0, controls = 0, frames = 0;

  std::span<const float> curve(std::size_t control) const {
    return {values + control * stride, frames};
  }
};

/// Encodes curves as a block and appends its bytes to `out`, at most 1 + 4 * controls * frames.
/// In: curves  with 1 to kMostBlockFrames frames
void encode_curves(const BlockCurves& curves, Bytes& out);

/// The curves of a block. A curve is decoded only when it is requested.
class EncodedCurves {
 public:
  /// Reads the prefix codes of a block and the kind of each curve, but decodes no curve.
  /// In:    bytes  the result of encode_curves; they must outlive the result
  /// Fails: kInvalidValue, kInvalidLength; the error's offset counts from the first of the bytes
  static core::Result<EncodedCurves> open(View bytes, std::size_t controls, std::size_t frames);

  EncodedCurves(EncodedCurves&&) noexcept;
  EncodedCurves& operator=(EncodedCurves&&) noexcept;
  ~EncodedCurves();

  /// Writes the frames of controls to out [controls.size(), frames]; rows are `stride` values
  /// apart.
  /// In:    controls  indices of controls of this block
  /// Fails: kInvalidValue
  core::Status decode(std::span<const std::uint32_t> controls, float* out,
                      std::size_t stride) const;
  /// Whether the block describes the curve of a control as one constant value. False for all
  /// controls of a kStoredBlock. Out: value  this value; set only if true
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
    bool is_near_end = false;          // its bytes are read from tail_
    std::uint32_t bits = 0;            // of kConstant: the bits of the float
    std::size_t offset = 0, size = 0;  // of the bytes of the other kinds
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
  Bytes tail_;  // a copy of the bytes from tail_begin_ on, and spare bytes after them
  std::size_t tail_begin_ = 0;
};

}  // namespace risorius::clip
