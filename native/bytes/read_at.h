// SPDX-License-Identifier: MIT
// Reading an open file at any place, where the system has pread.
#pragma once

#ifndef _WIN32

#include <cstddef>
#include <cstdint>
#include <span>

namespace risorius::bytes::detail {

/// Reads up to out.size() bytes of a file descriptor at offset, however many calls that takes.
/// Out: how many bytes there were; errno says why there were fewer, or is left as it was at the end
/// of the file.
std::size_t read_at(int file, std::uint64_t offset, std::span<std::uint8_t> out);

}  // namespace risorius::bytes::detail

#endif
