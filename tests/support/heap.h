// SPDX-License-Identifier: MIT
// Counts the heap memory of a piece of code. Works only with glibc and without a sanitizer: see
// tests/support/CMakeLists.txt.
#pragma once

#include <cstddef>

namespace risorius::testing_support {

/// Counts the heap memory of this executable from its construction on: every malloc, operator new
/// included. A block that realloc copies counts twice during the copy; pages that the kernel moves
/// do not. kept() is the growth of the bytes in use since construction, which must not be negative,
/// and peak() the largest growth so far. A newer object takes the place of an older one, which must
/// not be used again.
class HeapCount {
 public:
  HeapCount();
  std::size_t kept() const;
  std::size_t peak() const;
};

}  // namespace risorius::testing_support
