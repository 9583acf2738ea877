// SPDX-License-Identifier: MIT
// Writes little-endian numbers to a vector and reads them from untrusted bytes.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace risorius::clip {

static_assert(std::endian::native == std::endian::little, "files are read as they lie in memory");

using Bytes = std::vector<std::uint8_t>;
using View = std::span<const std::uint8_t>;

template <class T>
void put(Bytes& out, T value) {
  const auto* first = reinterpret_cast<const std::uint8_t*>(&value);
  out.insert(out.end(), first, first + sizeof value);
}

/// Appends an integer of variable length: seven bits per byte, the lowest bits first; the top bit
/// of a byte is set if more bytes follow.
inline void put_count(Bytes& out, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) out.push_back(static_cast<std::uint8_t>(value | 0x80));
  out.push_back(static_cast<std::uint8_t>(value));
}

inline void put_text(Bytes& out, const std::string& text) {
  put_count(out, text.size());
  out.insert(out.end(), text.begin(), text.end());
}

/// Appends the number of leading bytes that `text` shares with `before`, then its remaining bytes.
inline void put_next_text(Bytes& out, const std::string& before, const std::string& text) {
  std::size_t same = 0;
  while (same < before.size() && same < text.size() && before[same] == text[same]) ++same;
  put_count(out, same);
  put_text(out, text.substr(same));
}

/// Reads one number after the other. After the first failure every result is zero or empty.
class Cursor {
 public:
  explicit Cursor(View bytes) : bytes_(bytes) {}

  bool failed() const { return failed_; }
  std::size_t position() const { return at_; }
  std::size_t left() const { return bytes_.size() - at_; }

  template <class T>
  T get() {
    T value{};
    const View from = take(sizeof value);
    if (!failed_) std::memcpy(&value, from.data(), sizeof value);
    return value;
  }
  std::uint64_t count() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const auto byte = get<std::uint8_t>();
      value |= std::uint64_t{byte & 0x7Fu} << shift;
      if (byte < 0x80) return failed_ ? 0 : value;
    }
    failed_ = true;
    return 0;
  }
  View take(std::uint64_t size) {
    if (failed_ || size > left()) {
      failed_ = true;
      return {};
    }
    at_ += static_cast<std::size_t>(size);
    return bytes_.subspan(at_ - static_cast<std::size_t>(size), static_cast<std::size_t>(size));
  }
  std::string text() {
    const View from = take(count());
    return {from.begin(), from.end()};
  }
  std::string next_text(const std::string& before) {
    const std::uint64_t same = count();
    if (same > before.size()) failed_ = true;
    if (failed_) return {};
    return before.substr(0, static_cast<std::size_t>(same)) + text();
  }

 private:
  View bytes_;
  std::size_t at_ = 0;
  bool failed_ = false;
};

}  // namespace risorius::clip
