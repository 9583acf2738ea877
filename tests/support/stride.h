// SPDX-License-Identifier: MIT
// Tests that change each byte of a file in turn.
#pragma once

#include <cstddef>

namespace risorius::testing_support {

// The sanitizers take four times as long and see what every fifth byte does; the plain build
// takes each one, and the fuzzers, which are sanitized too, others every time.
#if defined(RISORIUS_SANITIZED)
inline constexpr std::size_t kStride = 5;
#else
inline constexpr std::size_t kStride = 1;
#endif

}  // namespace risorius::testing_support
