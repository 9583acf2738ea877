// SPDX-License-Identifier: MIT
// Replaces malloc and the other functions of the heap by functions that count the bytes in use and
// then call glibc.
#include "support/heap.h"

#include <malloc.h>

#include <algorithm>
#include <cerrno>

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);
}

namespace {

// now: bytes of heap memory in use. most: their maximum since counting began. begin: the bytes in
// use when counting began. No lock is needed, because the tests of this executable have one thread.
std::ptrdiff_t now = 0, most = 0, begin = 0;

std::ptrdiff_t size_of(void* p) { return static_cast<std::ptrdiff_t>(malloc_usable_size(p)); }

void* added(void* p) {
  now += size_of(p);
  most = std::max(most, now);
  return p;
}

// Whether a heap block has its own memory mapping, by the flag that glibc stores before the block.
bool is_mapped(void* p) { return (static_cast<std::size_t*>(p)[-1] & 2) != 0; }

}  // namespace

extern "C" {
void* malloc(std::size_t size) { return added(__libc_malloc(size)); }
void* calloc(std::size_t n, std::size_t size) { return added(__libc_calloc(n, size)); }
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return added(__libc_memalign(alignment, size));
}
void* memalign(std::size_t alignment, std::size_t size) {
  return added(__libc_memalign(alignment, size));
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  *out = added(__libc_memalign(alignment, size));
  return *out == nullptr ? ENOMEM : 0;
}
void free(void* p) {
  now -= size_of(p);
  __libc_free(p);
}
void* realloc(void* old, std::size_t size) {
  const std::ptrdiff_t old_size = size_of(old);
  const bool mapped = old != nullptr && is_mapped(old);
  void* p = __libc_realloc(old, size);
  if (p == nullptr && size > 0) return nullptr;
  const bool copied = p != old && !(mapped && p != nullptr && is_mapped(p));
  if (copied) most = std::max(most, now + size_of(p));
  now += size_of(p) - old_size;
  most = std::max(most, now);
  return p;
}
}

namespace risorius::testing_support {

HeapCount::HeapCount() { most = begin = now; }
std::size_t HeapCount::kept() const { return static_cast<std::size_t>(now - begin); }
std::size_t HeapCount::peak() const { return static_cast<std::size_t>(most - begin); }

}  // namespace risorius::testing_support
