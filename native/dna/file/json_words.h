// SPDX-License-Identifier: MIT
// The names of members and layers in JSON, for reading and writing. Private to native/dna/file.
#pragma once

#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "dna/layers.h"
#include "dna/schema.h"

namespace risorius::dna::detail {

inline constexpr const char* kAxes3[] = {"xs", "ys", "zs"};
inline constexpr const char* kAxes2[] = {"us", "vs"};
/// The JSON name of plane p of a list of vectors: xs, ys, zs, or us, vs.
template <std::size_t kPlanes>
const char* axis(std::size_t p) {
  return kPlanes == 3 ? kAxes3[p] : kAxes2[p];
}

/// The JSON name of a member: the field's name in camelCase, unless it has a special name.
inline std::string json_name(const Name& name) {
  if (name.json != nullptr) return name.json;
  std::string out;
  bool up = false;
  for (const char* c = name.dna; *c != '\0'; ++c) {
    if (*c == '_') {
      up = true;
      continue;
    }
    out += up && *c >= 'a' && *c <= 'z' ? static_cast<char>(*c - 'a' + 'A') : *c;
    up = false;
  }
  return out;
}

/// The JSON name of a layer: its id and version, such as "desc1.1".
inline std::string layer_name(const KnownLayer& layer) {
  return std::string(layer.id) + std::to_string(layer.version >> 16) + "." +
         std::to_string(layer.version & 0xFFFF);
}

inline std::string to_hex(const void* data, std::size_t size) {
  constexpr char kDigits[] = "0123456789abcdef";
  const auto* bytes = static_cast<const unsigned char*>(data);
  std::string out;
  out.reserve(2 * size);
  for (std::size_t i = 0; i < size; ++i) {
    out += kDigits[bytes[i] >> 4];
    out += kDigits[bytes[i] & 15];
  }
  return out;
}

/// Converts hex digits to bytes. Nullopt if the text has other characters or an odd length.
inline std::optional<std::string> from_hex(std::string_view text) {
  if (text.size() % 2 != 0) return std::nullopt;
  std::string out(text.size() / 2, '\0');
  for (std::size_t i = 0; i < out.size(); ++i) {
    unsigned value = 0;
    const char* begin = text.data() + 2 * i;
    const auto [end, error] = std::from_chars(begin, begin + 2, value, 16);
    if (error != std::errc{} || end != begin + 2) return std::nullopt;
    out[i] = static_cast<char>(value);
  }
  return out;
}

}  // namespace risorius::dna::detail
