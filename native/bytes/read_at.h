// SPDX-License-Identifier: MIT
// Reads an open file at any offset, on systems with pread.
#pragma once

#ifndef _WIN32

#include <cstddef>
#include <cstdint>
#include <span>

namespace risorius::bytes::detail {

/// Reads up to out.size() bytes of a file descriptor at offset, with as many calls as needed.
/// Out: the number of bytes read; if it is smaller than out.size(), errno has the reason of a
///      failure. At the end of the file errno is not set, so that a caller who needs the difference
///      sets errno to 0 before.
std::size_t read_at(int file, std::uint64_t offset, std::span<std::uint8_t> out);

}  // namespace risorius::bytes::detail

#endif
