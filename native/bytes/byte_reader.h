// SPDX-License-Identifier: MIT
// A big-endian reader over a Source, which checks each read. A parser that reads bytes gets all its
// errors from this reader or reports them by fail_at(), so that each error has an offset and a
// field.
#pragma once

#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bytes/source.h"
#include "core/array.h"
#include "core/buffer.h"
#include "simd/kernels.h"

namespace risorius::bytes {

/// Reads numbers one after the other. After the first failure every read returns zero or an empty
/// list and error() keeps that failure, so that a parser checks once per struct and not once per
/// number. A file is read through a window that never reads beyond end() and begins small after a
/// jump, so that skipped bytes are not read. A source in memory is read in place; bytes are copied
/// only into the returned lists and texts.
class ByteReader {
 public:
  /// In: source   must outlive the reader
  ///     kernels  functions that swap the bytes of lists; by default the best ones for the CPU, or
  ///              the ones that the environment variable RISORIUS_SIMD names
  explicit ByteReader(Source& source, const simd::Kernels& kernels = simd::usual_kernels());

  /// The name of the kernels: "scalar", "sse4", "avx2", "avx512" or "neon".
  const char* simd() const { return kernels_->name; }

  ByteReader(const ByteReader&) = delete;
  ByteReader& operator=(const ByteReader&) = delete;

  std::uint64_t position() const {
    return window_begin_ + static_cast<std::uint64_t>(at_ - first_);
  }
  std::uint64_t end() const { return end_; }
  std::uint64_t left() const { return end_ > position() ? end_ - position() : 0; }
  bool failed() const { return error_.has_value(); }
  const core::Error& error() const { return *error_; }
  core::Unexpected take_error() { return core::Unexpected{*error_}; }
  /// Clears the error, so that reading can go on after a call of enter() with another region.
  void clear_error();
  /// Sets the largest number of elements that count() accepts for a list or a text. count() fails
  /// for a larger number even if the source has enough bytes for it.
  void set_max_count(std::uint32_t n) { max_count_ = n; }
  /// Remembers an error, unless there is one already. The error's field is where().
  /// In: offset  offset of the wrong byte in the source
  void fail_at(std::uint64_t offset, core::ErrorCode code, std::string message);

  /// Moves the position to offset and restricts reading to [offset, offset + size). Out: false,
  /// without a move, if there was a failure before, or if a part of the range lies outside of the
  /// source, which is an error (kTruncated).
  bool enter(std::uint64_t offset, std::uint64_t size);
  /// Makes the next read of the file small (512 bytes, or more if a call needs more), as after a
  /// jump: call it if few of the following bytes are needed.
  void read_small() { next_read_ = 0; }

  std::uint8_t u8() { return number<std::uint8_t>(); }
  std::uint16_t u16() { return number<std::uint16_t>(); }
  std::uint32_t u32() { return number<std::uint32_t>(); }
  float f32() { return std::bit_cast<float>(u32()); }
  /// Reads the count of a list, a u32. It fails unless count * element_size bytes are left after it
  /// and the count is at most the number of set_max_count().
  /// In:  element_size  smallest size of an element in the file, bytes
  /// Out: the count, 0 after a failure
  std::uint32_t count(std::uint32_t element_size) {
    if (ready_ - at_ >= 4) {
      const std::uint32_t n = load<std::uint32_t>(at_);
      if (n <= max_count_ && std::uint64_t{n} * element_size <= left() - 4) {
        at_ += 4;
        return n;
      }
    }
    return count_slowly(element_size);
  }
  /// The number at offset, without moving the position. Nullopt if its two bytes do not lie between
  /// the present position and end(), if they cannot be read, or after a failure.
  std::optional<std::uint16_t> peek_u16(std::uint64_t offset);
  /// Reads a count, then that number of bytes of text. If the file became shorter while it was
  /// read, this call fails, and the rest of the text is zeros.
  std::string str();
  std::vector<std::uint8_t> bytes(std::uint64_t size);
  void skip(std::uint64_t size);
  /// Reads a count, then that number of values.
  /// Out: all_finite   set to false if a value is infinite or NaN; never set to true
  core::Array<float> f32_list(bool* all_finite = nullptr);
  core::Array<std::uint16_t> u16_list();
  /// Reads a count, then that number of values.
  /// Out: largest      raised to the largest value
  core::Array<std::uint32_t> u32_list(std::uint32_t* largest = nullptr);
  /// Reads n values into out; no count precedes them. Sets all_finite as f32_list does. After a
  /// failure the content of out is undefined.
  /// In: n  number of values for which out has room; checked by count() before
  void read_f32(float* out, std::size_t n, bool* all_finite = nullptr);
  /// Read n integers into out, as read_f32 does. read_u32 raises `largest` to the largest value, as
  /// u32_list does.
  void read_u16(std::uint16_t* out, std::size_t n);
  void read_u32(std::uint32_t* out, std::size_t n, std::uint32_t* largest = nullptr);

  /// The path of the field that is being read, for errors. Objects of class Field add a name to the
  /// path and remove it again.
  std::string where() const;

 private:
  friend class Field;
  struct PathPart {
    const char* name;
    std::int64_t index;
  };
  template <class T>
  static T load(const std::uint8_t* bytes) {
    T v = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      v = static_cast<T>(v | static_cast<T>(bytes[i]) << (8 * (sizeof(T) - 1 - i)));
    }
    return v;
  }
  template <class T>
  T number() {
    if (ready_ - at_ < static_cast<std::ptrdiff_t>(sizeof(T)) && !need(sizeof(T))) return 0;
    const T v = load<T>(at_);
    at_ += sizeof(T);
    return v;
  }
  std::uint32_t count_slowly(std::uint32_t element_size);
  /// Reads n values of kSize bytes: calls take(address, count) for consecutive runs of values until
  /// n values are taken. A run ends where the loaded bytes end. Out: false after a failure
  template <std::size_t kSize, class Take>
  bool for_runs(std::size_t n, const Take& take);
  bool check_left(std::uint64_t bytes);
  bool need(std::size_t n);
  bool refill(std::size_t n, std::uint64_t wanted);
  void move_to(std::uint64_t offset);
  void bound();

  const simd::Kernels* kernels_;
  Source* source_;
  std::uint64_t end_ = 0;
  std::uint32_t max_count_ = 0xFFFFFFFF;
  // [first_, loaded_) are the loaded bytes, from offset window_begin_ of the source on: bytes of
  // the window, or all bytes of a source in memory. [at_, ready_) are the bytes that can be read
  // without a further check: they are loaded and inside the region of enter(); after a failure this
  // range is empty.
  std::uint64_t window_begin_ = 0;
  const std::uint8_t* first_ = nullptr;
  const std::uint8_t* at_ = nullptr;
  const std::uint8_t* ready_ = nullptr;
  const std::uint8_t* loaded_ = nullptr;
  core::Buffer<std::uint8_t> window_;
  std::size_t next_read_ = 0;
  std::vector<PathPart> path_;
  std::optional<core::Error> error_;
};

/// Appends a name, and an index unless it is -1, to the reader's where() while this object exists:
/// Field f(reader, "joint_groups", i);
class Field {
 public:
  Field(ByteReader& reader, const char* name, std::int64_t index = -1) : reader_(reader) {
    reader_.path_.push_back({name, index});
  }
  ~Field() { reader_.path_.pop_back(); }
  Field(const Field&) = delete;
  Field& operator=(const Field&) = delete;

 private:
  ByteReader& reader_;
};

}  // namespace risorius::bytes
