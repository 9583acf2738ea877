// SPDX-License-Identifier: MIT
// The last steps: every vertex moves by itself, and neighbours nearly alike.
#pragma once

#include <memory>

#include "register/steps/graph.h"

namespace risorius::registering::steps {

class Fine {
 public:
  /// In: base  where the coarse steps brought the vertices: kept, not copied
  Fine(const Graph& graph, const Points& base);
  ~Fine();

  /// Moves the vertices near their matches. False: the system has no solution.
  /// In: stiffness  of how motions of neighbours bend, beside a match of weight 1
  bool solve(const std::vector<Match>& matches, double stiffness);
  const Points& points() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace risorius::registering::steps
