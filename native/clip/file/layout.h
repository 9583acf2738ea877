// SPDX-License-Identifier: MIT
// The layout of a .rzc file as shared by writer and reader; see FORMAT.md.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include "clip/clip.h"
#include "clip/codec/little_endian.h"

namespace risorius::clip {

inline constexpr std::array<std::uint8_t, 4> kMagic{'R', 'Z', 'C', 0x1A};
inline constexpr std::uint32_t kVersion = 1;
inline constexpr std::uint32_t kBlockMark = 0x4B4C425A;  // "ZBLK"
inline constexpr std::uint32_t kIndexMark = 0x5844495A;  // "ZIDX"
inline constexpr std::uint32_t kEndMark = 0x444E455A;    // "ZEND"

// Bytes of magic, version and size of the body; the body and its hash follow.
inline constexpr std::size_t kHeadStart = 12;
// Bytes of a block's head: mark, size of the bytes behind the hash, frames, first frame (8), hash
// (8) of these fields and of the bytes that follow.
inline constexpr std::size_t kBlockStart = 28;
// Bytes of the end: offset of the index (8), its size, mark, and the hash (8) of these fields.
inline constexpr std::size_t kEndSize = 24;
inline constexpr std::size_t kHashSize = 8;

// Times are 8-byte floats mapped to ordered integers, stored as second differences.
inline std::uint64_t time_in_order(std::uint64_t bits) {
  return bits ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(bits) >> 63) >> 1;
}

inline void put_events(Bytes& out, const std::vector<Event>& events) {
  put_count(out, events.size());
  for (const Event& event : events) {
    put(out, event.time);
    put(out, event.duration);
    put_text(out, event.name);
    put_text(out, event.value);
  }
}

/// Reserves no memory for a count that the bytes cannot hold.
inline std::vector<Event> get_events(Cursor& in) {
  std::vector<Event> events;
  const std::uint64_t count = in.count();
  for (std::uint64_t i = 0; i < count && !in.failed(); ++i) {
    Event event;
    event.time = in.get<double>();
    event.duration = in.get<double>();
    event.name = in.text();
    event.value = in.text();
    events.push_back(std::move(event));
  }
  return events;
}

}  // namespace risorius::clip
