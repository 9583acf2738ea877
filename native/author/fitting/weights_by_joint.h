// SPDX-License-Identifier: MIT
// The weights of a fit sorted by joint. Private to native/author.
#pragma once

#include <cstdint>
#include <vector>

#include "author/fitting/problem.h"

namespace risorius::author::detail {

/// The weights of all vertices by joint: of[joint] lists the vertices that have a weight of the
/// joint, and these weights.
struct ByJoint {
  struct Entry {
    std::uint32_t vertex;
    double weight;
  };
  std::vector<std::vector<Entry>> of;
};

inline ByJoint by_joint(const State& state) {
  ByJoint out;
  out.of.resize(state.joints.size());
  for (std::uint32_t v = 0; v < state.weights.size(); ++v) {
    for (const Influence& i : state.weights[v]) out.of[i.joint].push_back({v, i.weight});
  }
  return out;
}

}  // namespace risorius::author::detail
