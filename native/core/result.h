// SPDX-License-Identifier: MIT
// Result<T>: a value or an Error. It has the interface of std::expected, so that C++23 can replace
// it.
#pragma once

#include <cassert>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace risorius::core {

enum class ErrorCode {
  kNotDna,                 // the file does not begin with a DNA signature
  kNotClip,                // the file does not begin with the signature of a .rzc file
  kUnsupportedGeneration,  // a DNA file of a generation other than 2, or a clip of another version
  kTruncated,              // the bytes end inside a structure
  kInvalidCount,           // a count that does not fit the remaining bytes
  kInvalidLength,          // a list of a wrong length, such as parallel lists of different lengths
  kInvalidIndex,           // an index outside its range
  kInvalidValue,           // any other impossible value (cycle, LOD row beyond the matrix ...)
  kMissingLayer,           // the file lacks a layer that the operation needs
  kLimitExceeded,          // more than a limit of the caller, an index or a budget allows
  kIoOpen,
  kIoRead,
  kIoWrite,
  kInvalidArgument,
};

/// The name of a code as Python and the command line show it, e.g. "invalid_count".
const char* to_string(ErrorCode code);

/// An error.
/// offset   byte offset in the file, if the error has one
/// where    the field of the DNA or clip, e.g. "behavior.joint_groups[3].values", or ""
/// message  one sentence with the found and the expected value
struct Error {
  ErrorCode code = ErrorCode::kInvalidValue;
  std::optional<std::uint64_t> offset;
  std::string where;
  std::string message;

  /// One sentence for the user: the message, then "[where]" and "(byte offset)" if they are known.
  std::string describe() const;
};

struct Unexpected {
  Error error;
};

/// A failure, from which any Result and Status can be constructed.
/// In: where    the field, e.g. "behavior.psds.rows[3]", or ""
///     message  one sentence: the expected and the found value
///     offset   the byte in the file, if it is known
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

/// Evaluates a Status or a Result. If it failed, the enclosing function returns the failure;
/// otherwise execution continues, without the value.
#define RISORIUS_TRY(expression)                                                \
  do {                                                                          \
    if (auto tried = (expression); !tried) return std::move(tried).propagate(); \
  } while (false)
