// SPDX-License-Identifier: MIT
// Reads an open file at any offset with the system call pread, on systems that have it.
#include "bytes/read_at.h"

#ifndef _WIN32

#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace risorius::bytes::detail {

// Unlike a seek and a read, pread is one call. It may return fewer bytes than requested.
std::size_t read_at(int file, std::uint64_t offset, std::span<std::uint8_t> out) {
  constexpr std::size_t kMost = std::size_t{1} << 30;  // macOS refuses 2 GiB and more
  std::size_t done = 0;
  while (done < out.size()) {
    const ssize_t n = ::pread(file, out.data() + done, std::min(out.size() - done, kMost),
                              static_cast<off_t>(offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    done += static_cast<std::size_t>(n);
  }
  return done;
}

}  // namespace risorius::bytes::detail

#endif
