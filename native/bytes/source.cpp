// SPDX-License-Identifier: MIT
// Reads from a source of bytes in memory.
#include "bytes/source.h"

#include <algorithm>
#include <cstring>

namespace risorius::bytes {

std::size_t SpanSource::read(std::uint64_t offset, std::span<std::uint8_t> out) {
  if (offset >= bytes_.size()) return 0;
  const std::size_t n = std::min<std::size_t>(out.size(), bytes_.size() - std::size_t(offset));
  if (n > 0) std::memcpy(out.data(), bytes_.data() + offset, n);
  return n;
}

}  // namespace risorius::bytes
