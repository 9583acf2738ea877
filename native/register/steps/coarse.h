// SPDX-License-Identifier: MIT
// The first steps: nodes with affine motions that change smoothly along the surface.
#pragma once

#include <memory>

#include "register/steps/graph.h"

namespace risorius::registering::steps {

class Coarse {
 public:
  /// Both are kept, not copied. In: rest  where the vertices begin, in millimetres
  Coarse(const Nodes& nodes, const Points& rest);
  ~Coarse();

  struct Pull {
    double stiffness = 1.0;  // of the nodes, beside what vertices of a cell pull together
    double landmarks = 1.0;  // of a pair, beside the same
  };
  /// Finds the motions that bring vertices near their matches. False: the system has no solution.
  /// In: matches  [V]
  bool solve(const std::vector<Match>& matches, const std::vector<Landmark>& landmarks, Pull pull);
  /// [V] where the motions bring the vertices.
  Points moved() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace risorius::registering::steps
