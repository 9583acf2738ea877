// SPDX-License-Identifier: MIT
// Computes the hash XXH64 with the library xxHash.
#include "core/hash.h"

#define XXH_INLINE_ALL  // no library to link, and no symbols that could clash with another copy
#include <xxhash.h>

namespace risorius::core {

std::uint64_t xxh64(std::span<const std::uint8_t> bytes) {
  return XXH64(bytes.data(), bytes.size(), 0);
}

}  // namespace risorius::core
