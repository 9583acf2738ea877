// SPDX-License-Identifier: MIT
// Limits on the memory and the steps of a stage, in proportion to its input. Steps are counted; no
// time is measured.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "core/result.h"

namespace risorius::core {

/// The limits of one stage, such as compiling. The stage charges the budget before each allocation
/// or work that may grow faster than the input. Plain copies of the input are not charged.
class Budget {
 public:
  static constexpr std::uint64_t kUnlimited = ~std::uint64_t{0};

  /// In: stage       the beginning of the error message, e.g. "compiling this face"
  ///     most_bytes  largest number of bytes that may be charged, or kUnlimited
  ///     most_steps  largest number of steps that may be charged, or kUnlimited
  Budget(std::string stage, std::uint64_t most_bytes, std::uint64_t most_steps)
      : stage_(std::move(stage)), most_bytes_(most_bytes), most_steps_(most_steps) {}

  /// Adds count to the charged bytes. Fails: kLimitExceeded if the sum exceeds most_bytes; the
  /// error contains the field `where`, the sum and the limit. Even then the count stays charged.
  Status take_bytes(std::uint64_t count, const std::string& where) {
    return take(count, bytes_, most_bytes_, "bytes", where);
  }
  /// Like take_bytes, for steps and most_steps.
  Status take_steps(std::uint64_t count, const std::string& where) {
    return take(count, steps_, most_steps_, "steps", where);
  }
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t steps() const { return steps_; }

 private:
  Status take(std::uint64_t count, std::uint64_t& taken, std::uint64_t most, const char* unit,
              const std::string& where) const {
    taken = count > kUnlimited - taken ? kUnlimited : taken + count;
    if (taken <= most) return ok();
    return fail(ErrorCode::kLimitExceeded, where,
                stage_ + " takes at least " + std::to_string(taken) + " " + unit +
                    ", the limit for an input of this size is " + std::to_string(most));
  }

  std::string stage_;
  std::uint64_t most_bytes_, most_steps_, bytes_ = 0, steps_ = 0;
};

}  // namespace risorius::core
