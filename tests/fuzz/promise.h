// SPDX-License-Identifier: MIT
// A broken promise ends a fuzz target like a crash. One promise is that an input takes at most a
// given multiple of its size from the heap.
#pragma once

#include <sanitizer/allocator_interface.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "support/promises.h"

namespace risorius::fuzz {

inline void demand(const std::string& broken_promise) {
  if (broken_promise.empty()) return;
  std::fprintf(stderr, "broken promise: %s\n", broken_promise.c_str());
  std::abort();
}

namespace heap {

// Heap bytes taken and not freed since the last HeapBound was made, and their maximum. Only one
// thread allocates.
inline std::ptrdiff_t now = 0, most = 0;

inline void added(const volatile void*, std::size_t size) {
  now += static_cast<std::ptrdiff_t>(size);
  most = std::max(most, now);
}
inline void freed(const volatile void* p) {
  // A block that the sanitizer does not own is not counted; the sanitizer reports it and ends the
  // process.
  auto* block = const_cast<void*>(p);
  if (__sanitizer_get_ownership(block) == 0) return;
  now -= static_cast<std::ptrdiff_t>(__sanitizer_get_allocated_size(block));
}
inline const int kInstalled = __sanitizer_install_malloc_and_free_hooks(added, freed);

}  // namespace heap

/// Demands in its destructor that the heap bytes in use never grew by more than beside + times *
/// size since its construction, for an input of `size` bytes.
class HeapBound {
 public:
  HeapBound(std::size_t size, std::size_t times, std::size_t beside)
      : size_(size), most_(times * size + beside) {
    heap::now = heap::most = 0;
  }
  HeapBound(const HeapBound&) = delete;
  HeapBound& operator=(const HeapBound&) = delete;
  ~HeapBound() {
    const auto peak = static_cast<std::size_t>(heap::most);
    if (heap::kInstalled == 0) demand("the heap is counted");
    if (peak <= most_) return;
    demand(std::to_string(size_) + " bytes take " + std::to_string(peak) +
           " bytes of the heap, at most " + std::to_string(most_) + " were expected");
  }

  /// Allows more heap, for sizes that an input states as a number without having a list of that
  /// size.
  void allow(std::size_t bytes) { most_ += bytes; }

 private:
  std::size_t size_, most_;
};

}  // namespace risorius::fuzz
