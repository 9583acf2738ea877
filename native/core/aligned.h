// SPDX-License-Identifier: MIT
// Vectors whose storage begins on a cache line, for kernels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <vector>

namespace risorius::core {

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

/// Memory for what is read at random: in large pages where it is large and the system has them, so
/// that finding it costs no more than reading it.
enum class Fill { kZero, kNothing };
std::shared_ptr<std::uint8_t> allocate_pages(std::size_t size, Fill fill = Fill::kZero);

template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace risorius::core
