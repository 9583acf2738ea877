// SPDX-License-Identifier: MIT
// Reads a whole file into memory, and tells whether only the user of this process can write it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "core/result.h"

namespace risorius::bytes {

struct FileBytes {
  std::span<const std::uint8_t> bytes;  // begin on a multiple of 64 bytes
  std::shared_ptr<const void> owner;    // keeps the bytes alive
  /// Whether the user of this process owns the file and the file's access mode lets nobody else
  /// write to it. This is checked on the open file, not on its name. Always false on Windows, which
  /// has no such modes.
  bool is_own = false;
};

enum class ReadBy {
  kCopy,
  /// Maps the pages of the file, which costs nothing until they are used. If the file is cut short,
  /// the process crashes; if the file is written to, the bytes change. So use kMap only for files
  /// that are replaced as a whole (write_file_atomically). The file is copied if it is empty, or if
  /// the system has no maps or refuses one.
  kMap,
};

/// Reads a whole file.
/// Fails: kIoOpen (the system's reason; a folder or another file that is not plain), kIoRead (the
///        system's reason; a file that becomes shorter while it is read)
core::Result<FileBytes> read_file(const std::filesystem::path& path, ReadBy by = ReadBy::kCopy);

}  // namespace risorius::bytes
