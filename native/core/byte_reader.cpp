// SPDX-License-Identifier: MIT
#include "core/byte_reader.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace risorius::core {

namespace {

constexpr std::size_t kWindowBytes = 64 * 1024;

std::uint32_t swap32(std::uint32_t v) {
  return (v >> 24) | ((v >> 8) & 0xFF00u) | ((v << 8) & 0xFF0000u) | (v << 24);
}

std::uint16_t swap16(std::uint16_t v) { return static_cast<std::uint16_t>((v >> 8) | (v << 8)); }

template <class T>
void to_native(T* values, std::size_t n) {
  if constexpr (std::endian::native == std::endian::little) {
    for (std::size_t i = 0; i < n; ++i) {
      if constexpr (sizeof(T) == 2) {
        values[i] = std::bit_cast<T>(swap16(std::bit_cast<std::uint16_t>(values[i])));
      } else {
        values[i] = std::bit_cast<T>(swap32(std::bit_cast<std::uint32_t>(values[i])));
      }
    }
  }
}

template <class T>
std::span<std::uint8_t> as_bytes(T* values, std::size_t n) {
  return {reinterpret_cast<std::uint8_t*>(values), n * sizeof(T)};
}

}  // namespace

ByteReader::ByteReader(Source& source) : source_(&source), end_(source.size()) {}

std::string ByteReader::where() const {
  std::string text;
  for (const PathPart& part : path_) {
    if (!text.empty()) text += '.';
    text += part.name;
    if (part.index >= 0) text += "[" + std::to_string(part.index) + "]";
  }
  return text;
}

void ByteReader::fail_at(std::uint64_t offset, ErrorCode code, std::string message) {
  if (!error_) error_ = Error{code, offset, where(), std::move(message)};
}

bool ByteReader::enter(std::uint64_t offset, std::uint64_t size) {
  if (failed()) return false;
  if (offset > source_->size() || size > source_->size() - offset) {
    fail_at(offset, ErrorCode::kTruncated,
            "the file ends at byte " + std::to_string(source_->size()) + ", but " +
                std::to_string(size) + " bytes were announced from byte " + std::to_string(offset));
    return false;
  }
  position_ = offset;
  end_ = offset + size;
  return true;
}

bool ByteReader::fill(std::span<std::uint8_t> out) {
  if (failed()) return false;
  if (out.size() > left()) {
    fail_at(position_, ErrorCode::kTruncated,
            std::to_string(out.size()) + " more bytes were expected, only " +
                std::to_string(left()) + " are left");
    return false;
  }
  // Short lists come by the ten thousand (skin weights): they go through the window.
  if (out.size() <= kWindowBytes / 16) {
    if (!load_window(out.size())) return false;
    if (!out.empty()) {
      std::memcpy(out.data(), window_.data() + (position_ - window_begin_), out.size());
    }
  } else if (source_->read(position_, out) != out.size()) {
    fail_at(position_, ErrorCode::kIoRead, "the file became shorter while it was read");
    return false;
  }
  position_ += out.size();
  return true;
}

bool ByteReader::load_window(std::size_t n) {
  if (position_ >= window_begin_ && position_ + n <= window_begin_ + window_size_) return true;
  window_.resize(kWindowBytes);
  window_begin_ = position_;
  window_size_ = source_->read(position_, window_);
  if (window_size_ >= n) return true;
  fail_at(position_, ErrorCode::kIoRead, "the file became shorter while it was read");
  return false;
}

const std::uint8_t* ByteReader::small(std::size_t n) {
  if (failed() || left() < n || !load_window(n)) {
    if (!failed()) fill({small_, n});  // says what is missing
    std::memset(small_, 0, sizeof(small_));
    return small_;
  }
  const std::uint8_t* at = window_.data() + (position_ - window_begin_);
  position_ += n;
  return at;
}

std::uint8_t ByteReader::u8() { return small(1)[0]; }

std::uint16_t ByteReader::u16() {
  const std::uint8_t* b = small(2);
  return static_cast<std::uint16_t>((b[0] << 8) | b[1]);
}

std::uint32_t ByteReader::u32() {
  const std::uint8_t* b = small(4);
  return (std::uint32_t{b[0]} << 24) | (std::uint32_t{b[1]} << 16) | (std::uint32_t{b[2]} << 8) |
         b[3];
}

float ByteReader::f32() { return std::bit_cast<float>(u32()); }

std::uint32_t ByteReader::count(std::uint32_t element_size) {
  const std::uint64_t at = position_;
  const std::uint32_t n = u32();
  if (failed()) return 0;
  if (std::uint64_t{n} * element_size > left()) {
    fail_at(at, ErrorCode::kInvalidCount,
            "a count of " + std::to_string(n) + " needs at least " +
                std::to_string(std::uint64_t{n} * element_size) + " bytes, only " +
                std::to_string(left()) + " are left");
    return 0;
  }
  return n;
}

std::string ByteReader::str() {
  std::string text(count(1), '\0');
  fill(as_bytes(text.data(), text.size()));
  return text;
}

std::vector<std::uint8_t> ByteReader::bytes(std::uint64_t size) {
  if (size > left()) {
    fail_at(position_, ErrorCode::kTruncated,
            std::to_string(size) + " bytes were expected, only " + std::to_string(left()) +
                " are left");
    return {};
  }
  std::vector<std::uint8_t> out(static_cast<std::size_t>(size));
  if (!fill(out)) return {};
  return out;
}

void ByteReader::skip(std::uint64_t size) {
  if (failed()) return;
  if (size > left()) {
    fail_at(position_, ErrorCode::kTruncated, "a part that is skipped ends beyond the file");
    return;
  }
  position_ += size;
}

void ByteReader::read_f32(float* out, std::size_t n) {
  if (fill(as_bytes(out, n))) to_native(out, n);
}
void ByteReader::read_u16(std::uint16_t* out, std::size_t n) {
  if (fill(as_bytes(out, n))) to_native(out, n);
}
void ByteReader::read_u32(std::uint32_t* out, std::size_t n) {
  if (fill(as_bytes(out, n))) to_native(out, n);
}

Array<float> ByteReader::f32_list() {
  std::vector<float> values(count(4));
  read_f32(values.data(), values.size());
  return values;
}
Array<std::uint16_t> ByteReader::u16_list() {
  std::vector<std::uint16_t> values(count(2));
  read_u16(values.data(), values.size());
  return values;
}
Array<std::uint32_t> ByteReader::u32_list() {
  std::vector<std::uint32_t> values(count(4));
  read_u32(values.data(), values.size());
  return values;
}

}  // namespace risorius::core
