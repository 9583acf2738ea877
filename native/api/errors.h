// SPDX-License-Identifier: MIT
// Error handling of the C API: its functions throw nothing, and each thread has a last error of its
// own.
#pragma once

#include <new>
#include <string_view>

#include "api/risorius.h"
#include "core/result.h"

namespace risorius::api {

/// Stores an error as the last error of this thread, for risorius_last_error. Never throws: if
/// there is no memory for the error's texts, the texts are lost, but not the status.
/// In:  file  the path as the caller gave it, or ""
/// Out: the risorius_status for the error's code
risorius_status remember(const core::Error& error, std::string_view file = {}) noexcept;

/// Stores an invalid argument of a call as the last error of this thread.
/// In:  argument  name of the argument
///      message   the expected and the found value
/// Out: RISORIUS_BAD_ARGUMENT
risorius_status refuse(std::string_view argument, std::string_view message) noexcept;

/// Store an error as the last error of this thread, and return its status: out_of_memory a lack of
/// memory, internal an unexpected exception. The texts of these errors are constants, because
/// allocating memory could fail again.
risorius_status out_of_memory() noexcept;
risorius_status internal() noexcept;

/// Runs body, which returns a status. An exception, such as a lack of memory, becomes a status and
/// the last error of this thread. WebAssembly is built without exceptions: there a lack of memory
/// ends the program.
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

/// Runs body, which copies texts.
/// Out: false if there was no memory for them
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
