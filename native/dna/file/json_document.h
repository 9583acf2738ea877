// SPDX-License-Identifier: MIT
// Parses a JSON text to a tree of values. Private to native/dna/file.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "dna/file/parse.h"

namespace risorius::dna::detail {

struct RepeatedMember {
  std::string name;
};

// An object that rejects a repeated member: some JSON readers use the first of the two values,
// others the last.
template <class Key, class Value, class Less, class Allocator>
struct UniqueMap : std::map<Key, Value, Less, Allocator> {
  using std::map<Key, Value, Less, Allocator>::map;
  Value& operator[](const Key& key) {
    const auto [at, added] = this->try_emplace(key);
    // NOLINTNEXTLINE(bugprone-std-exception-baseclass): only parse_document may catch it
    if (!added) throw RepeatedMember{key};
    return at->second;
  }
};

// Fractions are read as float and not as double first, so that they are rounded only once.
using Json = nlohmann::basic_json<UniqueMap, std::vector, std::string, bool, std::int64_t,
                                  std::uint64_t, float>;

/// Parses a JSON text.
/// Fails: kNotDna (not JSON, with the byte), kInvalidValue (a repeated member, a number beyond
///        float), kLimitExceeded
core::Result<Json> parse_document(std::string_view text, const Limits& limits);

}  // namespace risorius::dna::detail
