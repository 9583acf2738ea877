// SPDX-License-Identifier: MIT
// Describes the machine on which a benchmark runs, and the benchmark's build.
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

const char* compiler();
const char* commit();

}  // namespace risorius::bench
