// SPDX-License-Identifier: MIT
// Writing a file so that the old one is whole until the new one is.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "core/result.h"

namespace risorius::core {

/// Writes bytes to a new file beside path, flushes it to the disk and renames it over path.
/// Fails: kIoWrite with the system's reason; the old file is untouched and nothing is left behind.
Status write_file_atomically(const std::filesystem::path& path,
                             std::span<const std::uint8_t> bytes);

}  // namespace risorius::core
