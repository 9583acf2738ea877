// SPDX-License-Identifier: MIT
// Allocates memory that begins on a cache line; large blocks get large pages of the system.
#include "core/aligned.h"

#include <cstring>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace risorius::core {

std::shared_ptr<std::uint8_t> allocate_pages(std::size_t size, Fill fill) {
  constexpr std::size_t kLarge = std::size_t{2} << 20;
  const std::size_t alignment = size >= kLarge ? kLarge : 64;
  void* memory = ::operator new(size, std::align_val_t(alignment));
#if defined(__linux__) && defined(MADV_HUGEPAGE)
  // A hint to use large pages; the system may ignore it.
  if (alignment == kLarge) madvise(memory, size, MADV_HUGEPAGE);
#endif
  if (fill == Fill::kZero) std::memset(memory, 0, size);
  const auto release = [alignment](std::uint8_t* p) {
    ::operator delete(p, std::align_val_t(alignment));
  };
  return std::shared_ptr<std::uint8_t>(static_cast<std::uint8_t*>(memory), release);
}

}  // namespace risorius::core
