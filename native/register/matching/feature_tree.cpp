// SPDX-License-Identifier: MIT
#include "register/matching/feature_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace risorius::registering::steps {

namespace {

constexpr std::uint32_t kLeaf = 8;

float squared_distance(const Feature& a, const Feature& b) {
  float sum = 0;
  for (std::size_t i = 0; i < kFeatures; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

}  // namespace

FeatureTree::FeatureTree(std::vector<Feature> features)
    : features_(std::move(features)), order_(features_.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  if (features_.empty()) return;
  branches_.reserve(features_.size() / 2 + 1);
  grow(0, static_cast<std::uint32_t>(order_.size()));
  std::vector<Feature> sorted;
  sorted.reserve(features_.size());
  for (const std::uint32_t i : order_) sorted.push_back(features_[i]);
  features_ = std::move(sorted);
}

std::uint32_t FeatureTree::grow(std::uint32_t begin, std::uint32_t end) {
  const auto at = static_cast<std::uint32_t>(branches_.size());
  branches_.push_back({0, begin, end, 0, 0});
  if (end - begin <= kLeaf) return at;
  Feature low = features_[order_[begin]], high = low;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Feature& f = features_[order_[i]];
    for (std::size_t k = 0; k < kFeatures; ++k) {
      low[k] = std::min(low[k], f[k]);
      high[k] = std::max(high[k], f[k]);
    }
  }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < kFeatures; ++k) {
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  }
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     const float x = features_[a][axis], y = features_[b][axis];
                     return x != y ? x < y : a < b;
                   });
  branches_[at].axis = static_cast<std::uint8_t>(axis);
  branches_[at].at = features_[order_[middle]][axis];
  grow(begin, middle);
  const std::uint32_t second = grow(middle, end);
  branches_[at].second = second;
  return at;
}

FeatureTree::Found FeatureTree::nearest(const Feature& query, float squared) const {
  Found best{-1, squared};
  if (!branches_.empty()) look(query, 0, best);
  return best;
}

void FeatureTree::look(const Feature& query, std::uint32_t branch, Found& best) const {
  const Branch& of = branches_[branch];
  if (of.second == 0) {
    for (std::uint32_t i = of.begin; i < of.end; ++i) {
      const float squared = squared_distance(query, features_[i]);
      if (squared < best.squared) best = {static_cast<std::int32_t>(order_[i]), squared};
    }
    return;
  }
  const float away = query[of.axis] - of.at;
  const std::uint32_t first = branch + 1;
  look(query, away < 0 ? first : of.second, best);
  if (away * away < best.squared) look(query, away < 0 ? of.second : first, best);
}

}  // namespace risorius::registering::steps
