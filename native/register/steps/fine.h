// SPDX-License-Identifier: MIT
// The fine steps: each vertex has a motion of its own, similar to its neighbours' motions.
#pragma once

#include <memory>

#include "register/steps/graph.h"

namespace risorius::registering::steps {

class Fine {
 public:
  /// Keeps a reference to base. In: base  [V] positions from the coarse steps
  Fine(const Graph& graph, const Points& base);
  ~Fine();

  /// Moves the vertices towards their matches. False: the system has no solution.
  /// In: stiffness  weight of the bending of the motions, against a match of weight 1
  bool solve(const std::vector<Match>& matches, double stiffness);
  const Points& points() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace risorius::registering::steps
