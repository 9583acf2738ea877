// SPDX-License-Identifier: MIT
// Reads the names that a Rig stores.
#include "rig/rig.h"

namespace risorius::rig {

std::vector<std::string> Rig::texts(std::size_t first, std::size_t count) const {
  std::vector<std::string> out;
  for (std::size_t t = first; t < first + count; ++t) {
    const std::uint32_t begin = t == 0 ? 0 : text_ends[t - 1];
    out.emplace_back(text.data() + begin, text_ends[t] - begin);
  }
  return out;
}

}  // namespace risorius::rig
