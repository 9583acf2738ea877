// SPDX-License-Identifier: MIT
// What a piece of code takes from the heap. Only with glibc and without a sanitizer: see
// tests/support/CMakeLists.txt.
#pragma once

#include <cstddef>

namespace risorius::testing_support {

/// Counts from its construction on: every malloc of this executable, operator new included. A
/// block that realloc has to copy counts twice for that moment; pages that the kernel moves do not.
class HeapCount {
 public:
  HeapCount();
  std::size_t kept() const;
  std::size_t peak() const;
};

}  // namespace risorius::testing_support
