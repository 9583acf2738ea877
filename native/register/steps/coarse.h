// SPDX-License-Identifier: MIT
// The coarse steps: affine motions of nodes that change smoothly along the surface.
#pragma once

#include <memory>

#include "register/steps/graph.h"

namespace risorius::registering::steps {

class Coarse {
 public:
  /// Keeps references to the arguments. In: rest  [V] positions before any step,
  /// in millimetres
  Coarse(const Nodes& nodes, const Points& rest);
  ~Coarse();

  struct Pull {
    double stiffness = 1.0;  // of the nodes, against the mean weight of a cell's matches
    double landmarks = 1.0;  // weight of a pair, against the same mean
  };
  /// Solves for motions of the nodes that bring vertices near their matches. False: the system has
  /// no solution.
  /// In: matches  [V] the match of each vertex
  ///     pull     weights of the other equations against the matches
  bool solve(const std::vector<Match>& matches, const std::vector<Landmark>& landmarks, Pull pull);
  /// [V] positions of the vertices after the motions.
  Points moved() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace risorius::registering::steps
