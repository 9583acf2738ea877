// SPDX-License-Identifier: MIT
// Finds the nearest of many points by position, normal and bending.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace risorius::registering::steps {

/// Size of a feature: position, normal and bending of a point, three numbers each, multiplied by
/// the weight of its kind.
inline constexpr std::size_t kFeatures = 9;
using Feature = std::array<float, kFeatures>;

/// A k-d tree that finds the nearest of many features.
class FeatureTree {
 public:
  explicit FeatureTree(std::vector<Feature> features);

  struct Found {
    std::int32_t index = -1;  // -1: none
    float squared = 0;        // squared distance
  };
  /// The nearest feature whose squared distance is below `squared`; index -1: there is none.
  Found nearest(const Feature& query, float squared) const;
  std::size_t size() const { return features_.size(); }

 private:
  struct Branch {
    float at = 0;
    std::uint32_t begin = 0, end = 0;  // range in order_
    std::uint32_t second = 0;          // second child, 0: a leaf; the first child is next in order
    std::uint8_t axis = 0;
  };
  std::uint32_t grow(std::uint32_t begin, std::uint32_t end);
  void look(const Feature& query, std::uint32_t branch, Found& best) const;

  std::vector<Feature> features_;  // in the order of order_ once built
  std::vector<std::uint32_t> order_;
  std::vector<Branch> branches_;
};

}  // namespace risorius::registering::steps
