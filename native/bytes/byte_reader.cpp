// SPDX-License-Identifier: MIT
#include "bytes/byte_reader.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace risorius::core {

namespace {

constexpr std::size_t kFirstRead = 512;
constexpr std::size_t kWindowBytes = 64 * 1024;  // stays in the cache between kernel and swap

// Numbers from the file's byte order. What passes over every byte of a file should be as wide as
// the machine: the functions below exist twice, compiled for any x86-64 and for AVX2.
#if defined(__x86_64__) && defined(__GNUC__)
#define RISORIUS_INLINE inline __attribute__((always_inline))
#define RISORIUS_TARGET_AVX2 __attribute__((target("avx2")))
const bool kHasAvx2 = __builtin_cpu_supports("avx2") != 0;
#else
#define RISORIUS_INLINE inline
#define RISORIUS_TARGET_AVX2
constexpr bool kHasAvx2 = false;
#endif

RISORIUS_INLINE std::uint16_t big_endian(std::uint16_t v) {
  if constexpr (std::endian::native == std::endian::big) return v;
  return static_cast<std::uint16_t>((v >> 8) | (v << 8));
}

RISORIUS_INLINE std::uint32_t big_endian(std::uint32_t v) {
  if constexpr (std::endian::native == std::endian::big) return v;
  return (v >> 24) | ((v >> 8) & 0xFF00u) | ((v << 8) & 0xFF0000u) | (v << 24);
}

struct NothingSeen {
  template <class Word>
  RISORIUS_INLINE void see(Word) {}
};
struct Largest {
  std::uint32_t value = 0;
  RISORIUS_INLINE void see(std::uint32_t v) { value = v > value ? v : value; }
};
// Bit 31 is set when an exponent is all ones: infinite or no number.
struct Exponents {
  std::uint32_t carries = 0;
  RISORIUS_INLINE void see(std::uint32_t v) { carries |= (v & 0x7FFFFFFFu) + 0x00800000u; }
};

template <class Word, class T, class Seen>
RISORIUS_INLINE Seen to_native_inline(const std::uint8_t* from, T* to, std::size_t n) {
  Seen seen;
  for (std::size_t i = 0; i < n; ++i) {
    Word v;
    std::memcpy(&v, from + sizeof(Word) * i, sizeof(Word));
    v = big_endian(v);
    std::memcpy(to + i, &v, sizeof(Word));
    seen.see(v);
  }
  return seen;
}

template <class Word, class T, class Seen>
RISORIUS_TARGET_AVX2 Seen to_native_avx2(const std::uint8_t* from, T* to, std::size_t n) {
  return to_native_inline<Word, T, Seen>(from, to, n);
}

template <class Word, class Seen, class T>
Seen to_native(const std::uint8_t* from, T* to, std::size_t n) {
  return kHasAvx2 ? to_native_avx2<Word, T, Seen>(from, to, n)
                  : to_native_inline<Word, T, Seen>(from, to, n);
}

}  // namespace

ByteReader::ByteReader(Source& source) : source_(&source), end_(source.size()) {
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

void ByteReader::fail_at(std::uint64_t offset, ErrorCode code, std::string message) {
  if (error_) return;
  error_ = Error{code, offset, where(), std::move(message)};
  bound();
}

void ByteReader::clear_error() {
  error_.reset();
  bound();
}

// Nothing is ready after a failure: the quick ways need not ask for it.
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
    fail_at(std::min(offset, source_->size()), ErrorCode::kTruncated,
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
  fail_at(position(), ErrorCode::kTruncated,
          std::to_string(bytes) + " more bytes were expected, only " + std::to_string(left()) +
              " are left");
  return false;
}

bool ByteReader::need(std::size_t n) { return check_left(n) && refill(n, n); }

// Out: n bytes are ready, of `wanted` in sequence as many as the window holds. In: wanted <=
// left().
bool ByteReader::refill(std::size_t n, std::uint64_t wanted) {
  if (window_.size() == 0) window_.resize(kWindowBytes);
  const auto rest = static_cast<std::size_t>(loaded_ - at_);  // a few bytes of a cut number
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
  fail_at(begin, ErrorCode::kIoRead, "the file became shorter while it was read");
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
    fail_at(at, ErrorCode::kInvalidCount,
            "a count of " + std::to_string(n) + " needs at least " +
                std::to_string(std::uint64_t{n} * element_size) + " bytes, only " +
                std::to_string(left()) + " are left");
    return 0;
  }
  if (n > max_count_) {
    fail_at(at, ErrorCode::kLimitExceeded,
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
  char* out = text.data();
  for_runs<1>(text.size(), [&](const std::uint8_t* from, std::size_t n) {
    std::memcpy(out, from, n);
    out += n;
  });
  return text;
}

std::vector<std::uint8_t> ByteReader::bytes(std::uint64_t size) {
  if (size > left()) {
    fail_at(position(), ErrorCode::kTruncated,
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
    fail_at(position(), ErrorCode::kTruncated, "a part that is skipped ends beyond the file");
    return;
  }
  move_to(position() + size);
  bound();
}

void ByteReader::read_f32(float* out, std::size_t n, bool* all_finite) {
  Exponents seen;
  for_runs<4>(n, [&](const std::uint8_t* from, std::size_t run) {
    seen.carries |= to_native<std::uint32_t, Exponents>(from, out, run).carries;
    out += run;
  });
  if (all_finite != nullptr && (seen.carries >> 31) != 0) *all_finite = false;
}
void ByteReader::read_u16(std::uint16_t* out, std::size_t n) {
  for_runs<2>(n, [&](const std::uint8_t* from, std::size_t run) {
    to_native<std::uint16_t, NothingSeen>(from, out, run);
    out += run;
  });
}
void ByteReader::read_u32(std::uint32_t* out, std::size_t n, std::uint32_t* largest) {
  Largest seen;
  for_runs<4>(n, [&](const std::uint8_t* from, std::size_t run) {
    seen.see(to_native<std::uint32_t, Largest>(from, out, run).value);
    out += run;
  });
  if (largest != nullptr) *largest = std::max(*largest, seen.value);
}

Array<float> ByteReader::f32_list(bool* all_finite) {
  Buffer<float> values(count(4));
  read_f32(values.data(), values.size(), all_finite);
  if (failed()) return {};
  return values;
}
Array<std::uint16_t> ByteReader::u16_list() {
  Buffer<std::uint16_t> values(count(2));
  read_u16(values.data(), values.size());
  if (failed()) return {};
  return values;
}
Array<std::uint32_t> ByteReader::u32_list(std::uint32_t* largest) {
  Buffer<std::uint32_t> values(count(4));
  read_u32(values.data(), values.size(), largest);
  if (failed()) return {};
  return values;
}

}  // namespace risorius::core
