// SPDX-License-Identifier: MIT
// A checked big-endian reader over a Source. Every error of a parser comes from here or goes
// through fail() here, so that it has an offset and a field.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/array.h"
#include "core/source.h"

namespace risorius::core {

/// Reads numbers one after the other. After the first failure every read gives zero or an empty
/// list and error() stays as it was: a parser checks once per struct, not once per number.
class ByteReader {
 public:
  /// end   reading stops here (the file's size or a layer's end)
  explicit ByteReader(Source& source);

  std::uint64_t position() const { return position_; }
  std::uint64_t end() const { return end_; }
  std::uint64_t left() const { return end_ > position_ ? end_ - position_ : 0; }
  bool failed() const { return error_.has_value(); }
  const Error& error() const { return *error_; }
  Unexpected take_error() { return Unexpected{*error_}; }
  void fail_at(std::uint64_t offset, ErrorCode code, std::string message);

  /// Restricts reading to [offset, offset + size). Fails when that is outside the source.
  bool enter(std::uint64_t offset, std::uint64_t size);

  std::uint8_t u8();
  std::uint16_t u16();
  std::uint32_t u32();
  float f32();
  /// A count is believed only if count * element_size bytes are left.
  std::uint32_t count(std::uint32_t element_size);
  std::string str();
  std::vector<std::uint8_t> bytes(std::uint64_t size);
  void skip(std::uint64_t size);
  Array<float> f32_list();
  Array<std::uint16_t> u16_list();
  Array<std::uint32_t> u32_list();
  /// Reads n values without a count, straight into out. In: n already checked by count().
  void read_f32(float* out, std::size_t n);
  void read_u16(std::uint16_t* out, std::size_t n);
  void read_u32(std::uint32_t* out, std::size_t n);

  /// Field path of what is being read, for errors: push on entry, pop on exit (see Field).
  std::string where() const;

 private:
  friend class Field;
  struct PathPart {
    const char* name;
    std::int64_t index;
  };
  bool fill(std::span<std::uint8_t> out);
  bool load_window(std::size_t n);
  const std::uint8_t* small(std::size_t n);

  Source* source_;
  std::uint64_t position_ = 0;
  std::uint64_t end_ = 0;
  std::vector<std::uint8_t> window_;
  std::uint64_t window_begin_ = 0;
  std::size_t window_size_ = 0;
  std::vector<PathPart> path_;
  std::optional<Error> error_;
  std::uint8_t small_[8] = {};
};

/// Names the field while it is in scope: Field f(reader, "joint_groups", i);
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

}  // namespace risorius::core
