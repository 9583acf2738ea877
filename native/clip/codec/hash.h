// SPDX-License-Identifier: MIT
// The checksum of .rzc files.
#pragma once

#include <cstdint>
#include <span>

namespace risorius::clip {

/// XXH64 with the seed 0, as its specification has it.
std::uint64_t xxh64(std::span<const std::uint8_t> bytes);

}  // namespace risorius::clip
