// SPDX-License-Identifier: MIT
// What a function of the C API does with a failure: nothing is thrown, and the thread remembers it.
#pragma once

#include <new>
#include <string_view>

#include "api/risorius.h"
#include "core/result.h"

namespace risorius::api {

/// Remembers an error for this thread. Never throws: where memory is short the words are lost, not
/// the status.
/// In:  file  the path as it was given, or ""
/// Out: its status
risorius_status remember(const core::Error& error, std::string_view file = {}) noexcept;

/// The same of a caller's mistake.
/// In: argument  its name, and what was expected and found
risorius_status refuse(std::string_view argument, std::string_view message) noexcept;

/// The same of what no function should throw, told by constant words.
risorius_status out_of_memory() noexcept;
risorius_status internal() noexcept;

/// Runs body, which gives a status. What it throws, or the lack of memory, becomes one.
/// WebAssembly is built without exceptions; there a lack of memory ends the program.
template <class Body>
risorius_status guarded(const Body& body) noexcept {
#ifdef __cpp_exceptions
  try {
    return body();
  } catch (const std::bad_alloc&) {
    return out_of_memory();
  } catch (...) {
    return internal();
  }
#else
  return body();
#endif
}

/// Runs body, which copies words.
/// Out: false where there was no memory for them
template <class Body>
bool had_memory(const Body& body) noexcept {
#ifdef __cpp_exceptions
  try {
    body();
  } catch (const std::bad_alloc&) {
    return false;
  }
#else
  body();
#endif
  return true;
}

}  // namespace risorius::api
