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

// Number of bytes at the start of a file: mark (4 bytes), version (4), and number of bytes of the
// head that follows (4).
inline constexpr std::size_t kHeadStart = 12;
// Number of bytes of a block's head: mark (4 bytes), number of bytes after the head (4), number of
// frames (4), index of the first frame (8), and the hash (8) of these fields and of the bytes after
// the head.
inline constexpr std::size_t kBlockStart = 28;
// Number of bytes of the end of a file: offset of the index (8 bytes), size of the index (4), mark
// (4), and the hash (8) of the index and these fields.
inline constexpr std::size_t kEndSize = 24;
inline constexpr std::size_t kHashSize = 8;

// Maps the bits of a time, a double, to an integer so that ascending times give ascending integers
// if these are read as int64. The file stores second differences of these integers.
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

/// Reads events. Memory is allocated event by event, because the count in the file may be wrong.
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
