// SPDX-License-Identifier: MIT
#include "api/errors.h"

#include <new>
#include <string>

namespace risorius::api {

namespace {

struct LastError {
  std::string file, field, message;
  risorius_error shown{RISORIUS_OK, "none", "", "", -1, "No call has failed."};
};

LastError& last_error() noexcept {
  thread_local LastError error;
  return error;
}

risorius_status show(risorius_status status, const char* code, const char* message) noexcept {
  last_error().shown = {status, code, "", "", -1, message};
  return status;
}

risorius_status status_of(core::ErrorCode code) noexcept {
  switch (code) {
    case core::ErrorCode::kIoOpen:
    case core::ErrorCode::kIoRead:
    case core::ErrorCode::kIoWrite:
      return RISORIUS_NOT_READABLE;
    case core::ErrorCode::kLimitExceeded:
      return RISORIUS_TOO_LARGE;
    case core::ErrorCode::kInvalidArgument:
      return RISORIUS_BAD_ARGUMENT;
    default:
      return RISORIUS_BAD_FILE;
  }
}

}  // namespace

risorius_status out_of_memory() noexcept {
  return show(RISORIUS_OUT_OF_MEMORY, "out_of_memory", "The system has no more memory.");
}

risorius_status internal() noexcept {
  return show(RISORIUS_INTERNAL, "internal", "Something was thrown that should not be.");
}

risorius_status remember(const core::Error& error, std::string_view file) noexcept {
  const risorius_status status = status_of(error.code);
  LastError& last = last_error();
  // The last error first gets a constant text: if copying the texts of `error` below runs out of
  // memory, the last error must not point into half-copied texts.
  last.shown = {status, core::to_string(error.code), "", "", -1, "There is no memory for words."};
  if (error.offset) last.shown.offset = static_cast<std::int64_t>(*error.offset);
  const bool copied = had_memory([&] {
    last.file = file;
    last.field = error.where;
    last.message = error.message;
  });
  if (!copied) return status;
  last.shown.file = last.file.c_str();
  last.shown.field = last.field.c_str();
  last.shown.message = last.message.c_str();
  return status;
}

risorius_status refuse(std::string_view argument, std::string_view message) noexcept {
  return guarded([&] {
    return remember({core::ErrorCode::kInvalidArgument, std::nullopt, std::string(argument),
                     std::string(message)});
  });
}

}  // namespace risorius::api

const risorius_error* risorius_last_error(void) { return &risorius::api::last_error().shown; }
