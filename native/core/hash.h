// SPDX-License-Identifier: MIT
// The checksum of compiled faces and of .rzc files. It finds damage, not tampering.
#pragma once

#include <cstdint>
#include <span>

namespace risorius::core {

/// The hash XXH64 with seed 0. It takes about as long as reading the bytes from memory.
std::uint64_t xxh64(std::span<const std::uint8_t> bytes);

}  // namespace risorius::core
