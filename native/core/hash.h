// SPDX-License-Identifier: MIT
// The checksum of compiled faces and of .rzc files: it finds damage, not intent.
#pragma once

#include <cstdint>
#include <span>

namespace risorius::core {

/// XXH64 with the seed 0, as its specification has it; as fast as memory.
std::uint64_t xxh64(std::span<const std::uint8_t> bytes);

}  // namespace risorius::core
