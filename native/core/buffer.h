// SPDX-License-Identifier: MIT
// An array for numbers that are about to be read from a file; it is not filled with zeros first.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

namespace risorius::core {

/// An array whose new elements have no defined value, so that its memory is only written when the
/// array is filled. It becomes an Array without a copy. Growth uses std::realloc, which can move
/// large arrays by pages without copying their bytes.
template <class T>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= alignof(std::max_align_t));

 public:
  Buffer() = default;
  explicit Buffer(std::size_t n) { resize(n); }

  std::size_t size() const { return size_; }
  std::size_t capacity() const { return capacity_; }
  T* data() { return data_.get(); }
  T& operator[](std::size_t i) { return data_.get()[i]; }

  /// Changes the size. Elements below both the old and the new size keep their values. An empty
  /// buffer without memory allocates exactly n elements; later growth is at least by half of the
  /// capacity. Shrinking keeps the memory.
  void resize(std::size_t n) {
    if (n > capacity_) allocate(capacity_ == 0 ? n : std::max(n, capacity_ + capacity_ / 2));
    size_ = n;
  }
  void reserve(std::size_t n) {
    if (n > capacity_) allocate(n);
  }
  /// Shrinks the memory to the size of the buffer's content and gives it to the caller. The
  /// buffer is empty afterwards.
  std::shared_ptr<const T> release() {
    if (size_ < capacity_) allocate(size_);
    size_ = capacity_ = 0;
    return std::shared_ptr<const T>(std::move(data_));
  }

 private:
  struct Free {
    void operator()(T* p) const { std::free(p); }
  };
  [[noreturn]] static void no_memory() {
#ifdef __cpp_exceptions
    throw std::bad_alloc();
#else
    std::abort();  // like the standard library without exceptions (WebAssembly)
#endif
  }
  void allocate(std::size_t n) {
    if (n == 0) {
      data_.reset();
    } else {
      if (n > std::numeric_limits<std::size_t>::max() / sizeof(T)) no_memory();
      void* p = std::realloc(data_.get(), n * sizeof(T));
      if (p == nullptr) no_memory();
      (void)data_.release();  // realloc has freed the memory or returned it
      data_.reset(static_cast<T*>(p));
    }
    capacity_ = n;
  }

  std::unique_ptr<T, Free> data_;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace risorius::core
