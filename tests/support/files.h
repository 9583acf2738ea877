// SPDX-License-Identifier: MIT
// Finds files for tests: committed files, and files in the folder that the environment variable
// RISORIUS_SHARED names, which a clone lacks.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace risorius::testing_support {

inline std::vector<std::uint8_t> read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline std::filesystem::path data_folder() { return RISORIUS_TEST_DATA; }

/// The folder `name` inside the folder that RISORIUS_SHARED names, or an empty path if the variable
/// is not set or the folder does not exist. The caller then reports that its test did not run.
inline std::filesystem::path shared_folder(const std::string& name) {
  const char* shared = std::getenv("RISORIUS_SHARED");
  if (shared == nullptr) return {};
  const std::filesystem::path folder = std::filesystem::path(shared) / name;
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

inline std::vector<std::filesystem::path> dna_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".dna") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace risorius::testing_support
