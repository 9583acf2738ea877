// SPDX-License-Identifier: MIT
// Result<T>: a value or an Error, spelled like std::expected so that C++23 can replace it.
#pragma once

#include <cassert>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace risorius::core {

enum class ErrorCode {
  kNotDna,                 // the first bytes are not a DNA signature
  kNotClip,                // the first bytes are not those of a .rzc file
  kUnsupportedGeneration,  // a DNA file of another generation than 2, a clip of another version
  kTruncated,              // the bytes end before the structure does
  kInvalidCount,           // a count that cannot fit the bytes left or a limit
  kInvalidLength,          // parallel lists of different lengths
  kInvalidIndex,           // an index outside its space
  kInvalidValue,   // any other value that makes no sense (cycle, LOD row beyond the matrix ...)
  kMissingLayer,   // a layer that the operation needs is not in the file
  kLimitExceeded,  // more than the caller's limits allow
  kIoOpen,
  kIoRead,
  kIoWrite,
  kInvalidArgument,
};

/// The name of a code as Python and the command line show it, e.g. "invalid_count".
const char* to_string(ErrorCode code);

/// What went wrong and where.
/// offset   byte offset in the file, if the error has one
/// where    the DNA field, e.g. "behavior.joint_groups[3].values"
/// message  one sentence: what was found and what was expected
struct Error {
  ErrorCode code = ErrorCode::kInvalidValue;
  std::optional<std::uint64_t> offset;
  std::string where;
  std::string message;

  /// One sentence for people: message, field and offset.
  std::string describe() const;
};

struct Unexpected {
  Error error;
};

/// A failure, which every Result and Status can be made of.
/// In: where    the field, e.g. "behavior.psds.rows[3]", or ""
///     message  one sentence: what was expected, what was found
///     offset   the byte of the file, where it is known
[[nodiscard]] inline Unexpected fail(ErrorCode code, std::string where, std::string message,
                                     std::optional<std::uint64_t> offset = std::nullopt) {
  return Unexpected{Error{code, offset, std::move(where), std::move(message)}};
}

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Unexpected failure) : state_(std::in_place_index<1>, std::move(failure.error)) {}

  bool has_value() const { return state_.index() == 0; }
  explicit operator bool() const { return has_value(); }
  T& value() & { return *std::get_if<0>(&state_); }
  const T& value() const& { return *std::get_if<0>(&state_); }
  T&& value() && { return std::move(*std::get_if<0>(&state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  const Error& error() const { return *std::get_if<1>(&state_); }
  Unexpected propagate() && { return Unexpected{std::move(*std::get_if<1>(&state_))}; }

 private:
  std::variant<T, Error> state_;
};

struct Nothing {};
using Status = Result<Nothing>;
inline Status ok() { return Status(Nothing{}); }

}  // namespace risorius::core

/// Evaluates a Status or a Result; where it failed the function that this stands in returns the
/// failure, else nothing happens and the value is dropped.
#define RISORIUS_TRY(expression)                                                \
  do {                                                                          \
    if (auto tried = (expression); !tried) return std::move(tried).propagate(); \
  } while (false)
