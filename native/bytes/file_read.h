// SPDX-License-Identifier: MIT
// A whole file in memory, and whose it is.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "core/result.h"

namespace risorius::bytes {

struct FileBytes {
  std::span<const std::uint8_t> bytes;  // on a multiple of 64
  std::shared_ptr<const void> owner;    // of bytes
  /// The user of this process owns the file and nobody else may write it. Asked of the open file,
  /// not of its name. Never true where files have no such modes (Windows).
  bool is_own = false;
};

enum class ReadBy {
  kCopy,
  /// The pages of the file itself: costs nothing before they are used. A file that is cut short or
  /// written to meanwhile ends the process or changes under its reader: only for files that are
  /// replaced as a whole (write_file_atomically). A copy where the system has no such maps.
  kMap,
};

/// Fails: kIoOpen, kIoRead (the system's reason; what is no plain file; a file that is cut while it
///        is read)
core::Result<FileBytes> read_file(const std::filesystem::path& path, ReadBy by = ReadBy::kCopy);

}  // namespace risorius::bytes
