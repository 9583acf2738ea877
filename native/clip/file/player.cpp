// SPDX-License-Identifier: MIT
#include "clip/file/player.h"

#include <algorithm>

namespace risorius::clip {

Player::Player(Reader reader) : reader_(std::move(reader)) {
  values_.resize(reader_.head().names.size());
}

core::Status Player::load(std::size_t block) {
  begin_ = end_ = 0;
  moving_.clear();
  RISORIUS_TRY(reader_.resting(block, values_, moving_));
  const std::uint64_t begin = reader_.block_starts()[block];
  const std::uint64_t end = reader_.block_starts()[block + 1];
  curves_.resize(moving_.size() * static_cast<std::size_t>(end - begin));
  RISORIUS_TRY(reader_.read(begin, end, moving_, curves_.data(), nullptr));
  begin_ = begin;
  end_ = end;
  return core::ok();
}

core::Result<std::span<const float>> Player::frame(std::uint64_t index) {
  if (index < begin_ || index >= end_) {
    const std::vector<std::uint64_t>& starts = reader_.block_starts();
    RISORIUS_TRY(reader_.may_read(index, index == UINT64_MAX ? index : index + 1, {}));
    const auto after = std::upper_bound(starts.begin(), starts.end(), index);
    auto loaded = load(static_cast<std::size_t>(after - starts.begin()) - 1);
    if (!loaded) return std::move(loaded).propagate();
  }
  if (moving_.empty()) return std::span<const float>(values_);
  const auto frames = static_cast<std::size_t>(end_ - begin_);
  const float* from = curves_.data() + (index - begin_);
  for (const std::uint32_t control : moving_) {
    values_[control] = *from;
    from += frames;
  }
  return std::span<const float>(values_);
}

}  // namespace risorius::clip
