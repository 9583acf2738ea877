// SPDX-License-Identifier: MIT
// What a benchmark ran on.
#pragma once

#include <fstream>
#include <string>

namespace risorius::bench {

inline std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown CPU";
}

inline const char* compiler() {
#ifdef __clang__
  return "clang " __clang_version__;
#elif defined(__GNUC__)
  return "gcc " __VERSION__;
#else
  return "another compiler";
#endif
}

inline const char* commit() {
#ifdef RISORIUS_COMMIT
  return RISORIUS_COMMIT;
#else
  return "unknown";
#endif
}

}  // namespace risorius::bench
