// SPDX-License-Identifier: MIT
// Renumbers indices when some elements are removed.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/array.h"

namespace risorius::dna::detail {

/// Maps the old indices of the elements that stay to their new indices. Call keeps() first:
/// operator[] has no meaning for a removed element.
class IndexMap {
 public:
  static constexpr std::uint32_t kDropped = 0xFFFFFFFF;
  IndexMap() = default;
  explicit IndexMap(const std::vector<bool>& keep) : to_(keep.size(), kDropped) {
    for (std::size_t i = 0; i < keep.size(); ++i) {
      if (keep[i]) to_[i] = static_cast<std::uint32_t>(kept_++);
    }
  }
  bool keeps(std::size_t i) const { return i < to_.size() && to_[i] != kDropped; }
  std::uint16_t operator[](std::size_t i) const { return static_cast<std::uint16_t>(to_[i]); }
  std::size_t size() const { return to_.size(); }
  std::size_t kept() const { return kept_; }

 private:
  std::vector<std::uint32_t> to_;
  std::size_t kept_ = 0;
};

/// Lowers the row counts of LODs after rows were removed. LOD l uses the rows [0, lods[l]), so that
/// removing row r lowers every count above r. Each row is visited once, independent of the number
/// of LODs.
/// In:     keep  [rows] whether each row stays
/// In/out: lods  [LODs] number of leading rows that each LOD uses
template <class Keep>
void drop_rows(const Keep& keep, core::Array<std::uint16_t>& lods) {
  std::vector<std::uint16_t> kept_before{0};
  for (std::size_t r = 0; r < keep.size() && r < 65535; ++r) {
    kept_before.push_back(static_cast<std::uint16_t>(kept_before.back() + (keep[r] ? 1 : 0)));
  }
  std::vector<std::uint16_t> out;
  out.reserve(lods.size());
  for (const std::uint16_t n : lods) {
    out.push_back(kept_before[std::min<std::size_t>(n, kept_before.size() - 1)]);
  }
  lods = std::move(out);
}

}  // namespace risorius::dna::detail
