// SPDX-License-Identifier: MIT
// A big-endian writer into memory.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace risorius::bytes {

/// Appends numbers to a growing list of bytes. Fails only if memory runs out.
class ByteWriter {
 public:
  std::size_t position() const { return bytes_.size(); }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

  void u8(std::uint8_t v) { bytes_.push_back(v); }
  void u16(std::uint16_t v) {
    u8(static_cast<std::uint8_t>(v >> 8));
    u8(static_cast<std::uint8_t>(v));
  }
  void u32(std::uint32_t v) {
    u16(static_cast<std::uint16_t>(v >> 16));
    u16(static_cast<std::uint16_t>(v));
  }
  void f32(float v) { u32(std::bit_cast<std::uint32_t>(v)); }
  void raw(std::span<const std::uint8_t> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  /// Writes the length in bytes, then the bytes.
  void str(std::string_view text) {
    u32(static_cast<std::uint32_t>(text.size()));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
  }
  /// Writes the count, then the numbers, of 2 or 4 bytes each.
  template <class T>
  void list(std::span<const T> values) {
    u32(static_cast<std::uint32_t>(values.size()));
    items(values);
  }
  /// Writes the numbers without a count.
  template <class T>
  void items(std::span<const T> values) {
    for (const T v : values) {
      if constexpr (sizeof(T) == 2) {
        u16(v);
      } else {
        u32(std::bit_cast<std::uint32_t>(v));
      }
    }
  }
  /// Overwrites the four bytes from position `at` on with v: a size or an offset that was not known
  /// when these bytes were first written.
  void patch_u32(std::size_t at, std::uint32_t v) {
    for (std::size_t i = 0; i < 4; ++i)
      bytes_[at + i] = static_cast<std::uint8_t>(v >> (24 - 8 * i));
  }

 private:
  std::vector<std::uint8_t> bytes_;
};

}  // namespace risorius::bytes
