// SPDX-License-Identifier: MIT
// A source of bytes for readers: bytes in memory, or a file that is read piece by piece.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "core/result.h"

namespace risorius::bytes {

class Source {
 public:
  virtual ~Source() = default;
  virtual std::uint64_t size() const = 0;
  /// Reads up to out.size() bytes from offset on. Out: the number of bytes read; it is less than
  /// out.size() at the end of the source, or if the file cannot be read.
  virtual std::size_t read(std::uint64_t offset, std::span<std::uint8_t> out) = 0;
  /// All bytes, if they are in memory for the lifetime of the source; otherwise empty.
  virtual std::span<const std::uint8_t> view() const { return {}; }
};

/// Reads from memory that outlives the source.
class SpanSource final : public Source {
 public:
  explicit SpanSource(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_.size(); }
  std::size_t read(std::uint64_t offset, std::span<std::uint8_t> out) override;
  std::span<const std::uint8_t> view() const override { return bytes_; }

 private:
  std::span<const std::uint8_t> bytes_;
};

/// Opens a file for reading. It is not mapped, because a mapped file that is cut short would crash
/// the process. Fails: kIoOpen (a folder; the system's reason), kIoRead (the size is not known).
core::Result<std::unique_ptr<Source>> open_file(const std::filesystem::path& path);

}  // namespace risorius::bytes
