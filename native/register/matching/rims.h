// SPDX-License-Identifier: MIT
// Where surfaces end: a neck, an eye opening, a hole.
#pragma once

#include "register/matching/feature_tree.h"
#include "register/matching/types.h"

namespace risorius::registering::steps {

/// An edge at the border of a surface. Its triangle lies to the left of the way from a to b.
struct RimEdge {
  std::uint32_t a = 0, b = 0;
  double loop = 0.0;  // mm, length of all edges that hang together with it
};

/// In: borders  as border_edges has them
std::vector<RimEdge> rim_edges(const Form& form, const std::vector<std::uint8_t>& borders);

/// The borders of a target, which those of a template find.
class Rims {
 public:
  explicit Rims(const Form& target, const std::vector<std::uint8_t>& borders);

  /// Lays vertices of the template's borders onto borders of the target that are about as long and
  /// end in the same direction; along the border a vertex is nearly free.
  /// In: points, normals  [V] of the template as it lies now
  ///     farthest         mm
  ///     matches          [V] those of border vertices that find something are replaced
  void match(const std::vector<RimEdge>& edges, const Points& points, const Points& normals,
             double farthest, std::vector<Match>& matches) const;

 private:
  struct Place {
    Vec3 point, outward;
    double loop;
  };
  std::vector<Place> places_;
  FeatureTree tree_{{}};
};

}  // namespace risorius::registering::steps
