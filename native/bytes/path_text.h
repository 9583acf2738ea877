// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

namespace risorius::bytes {

/// A path for people to read, in UTF-8. path::string() throws on Windows where the system's code
/// page lacks a character.
inline std::string utf8(const std::filesystem::path& path) {
  const std::u8string text = path.u8string();
  return {text.begin(), text.end()};
}

}  // namespace risorius::bytes
