// SPDX-License-Identifier: MIT
// Vectors whose storage begins on a cache line (64 bytes), as the compute kernels need it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <vector>

namespace risorius::core {

/// An allocator for std::vector whose memory begins on a multiple of kAlignment bytes.
template <class T, std::size_t kAlignment = 64>
struct AlignedAllocator {
  using value_type = T;
  template <class U>
  struct rebind {
    using other = AlignedAllocator<U, kAlignment>;
  };
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U, kAlignment>&) {}
  T* allocate(std::size_t n) {
    return static_cast<T*>(::operator new(n * sizeof(T), std::align_val_t(kAlignment)));
  }
  void deallocate(T* p, std::size_t) { ::operator delete(p, std::align_val_t(kAlignment)); }
  bool operator==(const AlignedAllocator&) const { return true; }
};

/// The content of new memory: zeros, or undefined.
enum class Fill { kZero, kNothing };
/// Allocates memory that begins on a multiple of 64 bytes. Blocks of 2 MiB and more begin on a
/// multiple of 2 MiB; Linux then uses large pages if it has them, because random reads then need
/// fewer address translations.
/// In: size  in bytes
std::shared_ptr<std::uint8_t> allocate_pages(std::size_t size, Fill fill = Fill::kZero);

template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace risorius::core
