// SPDX-License-Identifier: MIT
// Counts the heap memory of a piece of code. Works only with glibc and without a sanitizer: see
// tests/support/CMakeLists.txt.
#pragma once

#include <cstddef>

namespace risorius::testing_support {

/// Counts the heap memory of this executable from its construction on: every malloc, operator new
/// included. A block that realloc copies counts twice during the copy; pages that the kernel moves
/// do not. kept() is the number of bytes taken since construction and not freed, peak() its
/// maximum. A newer object takes the place of an older one, which must not be used again.
class HeapCount {
 public:
  HeapCount();
  std::size_t kept() const;
  std::size_t peak() const;
};

}  // namespace risorius::testing_support
