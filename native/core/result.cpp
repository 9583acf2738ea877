// SPDX-License-Identifier: MIT
// The names of the error codes, and an error as one sentence.
#include "core/result.h"

namespace risorius::core {

const char* to_string(ErrorCode code) {
  switch (code) {
    case ErrorCode::kNotDna:
      return "not_dna";
    case ErrorCode::kNotClip:
      return "not_clip";
    case ErrorCode::kUnsupportedGeneration:
      return "unsupported_generation";
    case ErrorCode::kTruncated:
      return "truncated";
    case ErrorCode::kInvalidCount:
      return "invalid_count";
    case ErrorCode::kInvalidLength:
      return "invalid_length";
    case ErrorCode::kInvalidIndex:
      return "invalid_index";
    case ErrorCode::kInvalidValue:
      return "invalid_value";
    case ErrorCode::kMissingLayer:
      return "missing_layer";
    case ErrorCode::kLimitExceeded:
      return "limit_exceeded";
    case ErrorCode::kIoOpen:
      return "io_open";
    case ErrorCode::kIoRead:
      return "io_read";
    case ErrorCode::kIoWrite:
      return "io_write";
    case ErrorCode::kInvalidArgument:
      return "invalid_argument";
  }
  return "unknown";
}

std::string Error::describe() const {
  std::string text = message;
  if (!where.empty()) text += " [" + where + "]";
  if (offset) text += " (byte " + std::to_string(*offset) + ")";
  return text;
}

}  // namespace risorius::core
