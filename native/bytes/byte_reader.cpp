// SPDX-License-Identifier: MIT
// Reads big-endian numbers from a source of bytes, and checks before each read that the bytes are
// there. A file is read through a window: a buffer of 64 KiB with the loaded bytes. The position is
// the offset of the next byte to read.
#include "bytes/byte_reader.h"

#include <algorithm>
#include <cstring>

namespace risorius::bytes {

namespace {

constexpr std::size_t kFirstRead = 512;
constexpr std::size_t kWindowBytes =
    std::size_t{64} * 1024;  // small enough to stay in the cache between the read and the byte swap

}  // namespace

ByteReader::ByteReader(Source& source, const simd::Kernels& kernels)
    : kernels_(&kernels), source_(&source), end_(source.size()) {
  const std::span<const std::uint8_t> view = source.view();
  if (view.size() == end_) {
    first_ = at_ = view.data();
    loaded_ = first_ + view.size();
  }
  bound();
}

std::string ByteReader::where() const {
  std::string text;
  for (const PathPart& part : path_) {
    if (!text.empty() && *part.name != '\0') text += '.';
    text += part.name;
    if (part.index >= 0) text += "[" + std::to_string(part.index) + "]";
  }
  return text;
}

void ByteReader::fail_at(std::uint64_t offset, core::ErrorCode code, std::string message) {
  if (error_) return;
  error_ = core::Error{code, offset, where(), std::move(message)};
  bound();
}

void ByteReader::clear_error() {
  error_.reset();
  bound();
}

// Sets ready_, the end of the bytes that can be read without a further check or refill. After a
// failure it is the position itself, so that code which compares with ready_ need not test for a
// failure.
void ByteReader::bound() {
  const auto loaded = static_cast<std::uint64_t>(loaded_ - at_);
  ready_ = failed() ? at_ : at_ + std::min(loaded, left());
}

void ByteReader::move_to(std::uint64_t offset) {
  const auto loaded = static_cast<std::uint64_t>(loaded_ - first_);
  if (offset >= window_begin_ && offset - window_begin_ <= loaded) {
    at_ = first_ + (offset - window_begin_);
    return;
  }
  window_begin_ = offset;
  at_ = loaded_ = first_;
  next_read_ = 0;
}

bool ByteReader::enter(std::uint64_t offset, std::uint64_t size) {
  if (failed()) return false;
  if (offset > source_->size() || size > source_->size() - offset) {
    fail_at(std::min(offset, source_->size()), core::ErrorCode::kTruncated,
            "the file ends at byte " + std::to_string(source_->size()) + ", but " +
                std::to_string(size) + " bytes were announced from byte " + std::to_string(offset));
    return false;
  }
  move_to(offset);
  end_ = offset + size;
  bound();
  return true;
}

bool ByteReader::check_left(std::uint64_t bytes) {
  if (failed()) return false;
  if (bytes <= left()) return true;
  fail_at(position(), core::ErrorCode::kTruncated,
          std::to_string(bytes) + " more bytes were expected, only " + std::to_string(left()) +
              " are left");
  return false;
}

bool ByteReader::need(std::size_t n) { return check_left(n) && refill(n, n); }

// Reads the file into the window. The window then begins at the position and has at least n bytes,
// and as many of the `wanted` bytes as have room in it.
// In:  n       number of bytes that are needed now, a few
//      wanted  number of bytes that will be read soon, from n to left()
// Out: false, with an error, if the file ends before the n bytes do
bool ByteReader::refill(std::size_t n, std::uint64_t wanted) {
  if (window_.size() == 0) window_.resize(kWindowBytes);
  const auto rest = static_cast<std::size_t>(loaded_ - at_);  // a few bytes of an incomplete number
  const std::uint64_t begin = position(), most = left();
  if (rest > 0) std::memmove(window_.data(), at_, rest);
  next_read_ = std::clamp(2 * next_read_, kFirstRead, kWindowBytes);
  const std::uint64_t size =
      std::min({std::max<std::uint64_t>(next_read_, wanted), std::uint64_t{kWindowBytes}, most});
  const std::size_t got =
      source_->read(begin + rest, {window_.data() + rest, static_cast<std::size_t>(size) - rest});
  window_begin_ = begin;
  first_ = at_ = window_.data();
  loaded_ = first_ + rest + got;
  bound();
  if (rest + got >= n) return true;
  fail_at(begin, core::ErrorCode::kIoRead, "the file became shorter while it was read");
  return false;
}

template <std::size_t kSize, class Take>
bool ByteReader::for_runs(std::size_t n, const Take& take) {
  if (n <= static_cast<std::size_t>(ready_ - at_) / kSize) {
    take(at_, n);
    at_ += n * kSize;
    return true;
  }
  if (!check_left(std::uint64_t{n} * kSize)) return false;
  while (n > 0) {
    const std::size_t run = std::min(n, static_cast<std::size_t>(ready_ - at_) / kSize);
    if (run == 0) {
      if (!refill(kSize, std::uint64_t{n} * kSize)) return false;
      continue;
    }
    take(at_, run);
    at_ += run * kSize;
    n -= run;
  }
  return true;
}

std::uint32_t ByteReader::count_slowly(std::uint32_t element_size) {
  const std::uint64_t at = position();
  const std::uint32_t n = u32();
  if (failed()) return 0;
  if (std::uint64_t{n} * element_size > left()) {
    fail_at(at, core::ErrorCode::kInvalidCount,
            "a count of " + std::to_string(n) + " needs at least " +
                std::to_string(std::uint64_t{n} * element_size) + " bytes, only " +
                std::to_string(left()) + " are left");
    return 0;
  }
  if (n > max_count_) {
    fail_at(at, core::ErrorCode::kLimitExceeded,
            "a count of " + std::to_string(n) + ", the limit is " + std::to_string(max_count_));
    return 0;
  }
  return n;
}

std::optional<std::uint16_t> ByteReader::peek_u16(std::uint64_t offset) {
  std::uint8_t bytes[2];
  if (failed() || offset < position() || end_ < 2 || offset > end_ - 2) return std::nullopt;
  if (source_->read(offset, bytes) != 2) return std::nullopt;
  return load<std::uint16_t>(bytes);
}

std::string ByteReader::str() {
  std::string text(count(1), '\0');
  if (text.empty()) return text;  // memcpy accepts no null pointer, not even for 0 bytes
  char* out = text.data();
  for_runs<1>(text.size(), [&](const std::uint8_t* from, std::size_t n) {
    std::memcpy(out, from, n);
    out += n;
  });
  return text;
}

std::vector<std::uint8_t> ByteReader::bytes(std::uint64_t size) {
  if (size > left()) {
    fail_at(position(), core::ErrorCode::kTruncated,
            std::to_string(size) + " bytes were expected, only " + std::to_string(left()) +
                " are left");
    return {};
  }
  std::vector<std::uint8_t> all;
  all.reserve(static_cast<std::size_t>(size));
  const bool read = for_runs<1>(
      static_cast<std::size_t>(size),
      [&](const std::uint8_t* from, std::size_t n) { all.insert(all.end(), from, from + n); });
  if (!read) return {};
  return all;
}

void ByteReader::skip(std::uint64_t size) {
  if (failed()) return;
  if (size > left()) {
    fail_at(position(), core::ErrorCode::kTruncated, "a part that is skipped ends beyond the file");
    return;
  }
  move_to(position() + size);
  bound();
}

void ByteReader::read_f32(float* out, std::size_t n, bool* all_finite) {
  bool finite = true;
  for_runs<4>(n, [&](const std::uint8_t* from, std::size_t run) {
    finite = kernels_->native_f32(from, out, run) && finite;
    out += run;
  });
  if (all_finite != nullptr && !finite) *all_finite = false;
}
void ByteReader::read_u16(std::uint16_t* out, std::size_t n) {
  for_runs<2>(n, [&](const std::uint8_t* from, std::size_t run) {
    kernels_->native_u16(from, out, run);
    out += run;
  });
}
void ByteReader::read_u32(std::uint32_t* out, std::size_t n, std::uint32_t* largest) {
  std::uint32_t top = 0;
  for_runs<4>(n, [&](const std::uint8_t* from, std::size_t run) {
    top = std::max(top, kernels_->native_u32(from, out, run));
    out += run;
  });
  if (largest != nullptr) *largest = std::max(*largest, top);
}

core::Array<float> ByteReader::f32_list(bool* all_finite) {
  core::Buffer<float> values(count(4));
  read_f32(values.data(), values.size(), all_finite);
  if (failed()) return {};
  return values;
}
core::Array<std::uint16_t> ByteReader::u16_list() {
  core::Buffer<std::uint16_t> values(count(2));
  read_u16(values.data(), values.size());
  if (failed()) return {};
  return values;
}
core::Array<std::uint32_t> ByteReader::u32_list(std::uint32_t* largest) {
  core::Buffer<std::uint32_t> values(count(4));
  read_u32(values.data(), values.size(), largest);
  if (failed()) return {};
  return values;
}

}  // namespace risorius::bytes
