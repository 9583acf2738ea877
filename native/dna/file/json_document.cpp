// SPDX-License-Identifier: MIT
// Parses JSON text to a tree of values, with limits and positions of errors.
#include "dna/file/json_document.h"

#include <optional>

namespace risorius::dna::detail {

namespace {

using core::ErrorCode;
using core::fail;
using core::Result;

// The position of the first bracket that exceeds the nesting limit. It is found before
// nlohmann::json builds any value.
std::optional<std::size_t> find_too_deep(std::string_view text, std::size_t limit) {
  std::size_t depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_text) {
      if (c == '\\') ++i;
      if (c == '"') in_text = false;
    } else if (c == '"') {
      in_text = true;
    } else if (c == '[' || c == '{') {
      if (++depth > limit) return i;
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return std::nullopt;
}

// The position of a number beyond the range of float. The exception of nlohmann::json quotes the
// number but has no position, so that the number is searched for in the text.
std::optional<std::uint64_t> find_quoted(std::string_view text, std::string_view message) {
  const std::size_t begin = message.find('\''), end = message.rfind('\'');
  if (begin == end) return std::nullopt;
  const std::size_t at = text.find(message.substr(begin + 1, end - begin - 1));
  return at == std::string_view::npos ? std::nullopt : std::optional<std::uint64_t>(at);
}

Result<Json> parse_text(std::string_view text) {
  try {
    // nlohmann::json would treat a zero byte as the end of the text.
    const std::size_t zero = text.find('\0');
    if (zero != std::string_view::npos) {
      return fail(ErrorCode::kNotDna, "", "not JSON: the text has a zero byte", zero);
    }
    return Json::parse(text);
  } catch (const RepeatedMember& member) {
    return fail(ErrorCode::kInvalidValue, member.name.empty() ? "\"\"" : member.name,
                "an object has this member twice");
  } catch (const Json::parse_error& e) {
    return fail(ErrorCode::kNotDna, "", "not JSON: the text cannot be read on from here",
                e.byte == 0 ? 0 : e.byte - 1);
  } catch (const Json::exception& e) {
    const std::string message = e.what();
    return fail(ErrorCode::kInvalidValue, "",
                "a number is beyond every float: " + message.substr(message.rfind(' ') + 1),
                find_quoted(text, message));
  }
}

}  // namespace

Result<Json> parse_document(std::string_view text, const Limits& limits) {
  if (text.size() > limits.max_bytes) {
    return fail(ErrorCode::kLimitExceeded, "",
                "the text has " + std::to_string(text.size()) + " bytes, the limit is " +
                    std::to_string(limits.max_bytes),
                0);
  }
  if (const auto at = find_too_deep(text, limits.max_nesting)) {
    return fail(
        ErrorCode::kLimitExceeded, "",
        "the levels of nesting pass the limit of " + std::to_string(limits.max_nesting) + " here",
        at);
  }
  return parse_text(text);
}

}  // namespace risorius::dna::detail
