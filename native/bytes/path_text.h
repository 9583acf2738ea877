// SPDX-License-Identifier: MIT
// Converts paths to text for messages.
#pragma once

#include <filesystem>
#include <string>

namespace risorius::bytes {

/// A path as UTF-8 text for messages. path::string() throws on Windows if the system's code page
/// lacks a character.
inline std::string utf8(const std::filesystem::path& path) {
  const std::u8string text = path.u8string();
  return {text.begin(), text.end()};
}

}  // namespace risorius::bytes
