// SPDX-License-Identifier: MIT
// Matches borders of surfaces: a neck, an eye opening, a hole.
#pragma once

#include "register/matching/feature_tree.h"
#include "register/matching/types.h"

namespace risorius::registering::steps {

/// An edge at the border of a surface. Seen from outside, its triangle is to the left of the
/// direction from a to b.
struct RimEdge {
  std::uint32_t a = 0, b = 0;
  double loop = 0.0;  // mm, total length of the edges that are connected with it
};

/// Lists the border edges of a surface. In: borders  the result of border_edges
std::vector<RimEdge> rim_edges(const Form& form, const std::vector<std::uint8_t>& borders);

/// The borders of the target, to be matched with the borders of the template.
class Rims {
 public:
  explicit Rims(const Form& target, const std::vector<std::uint8_t>& borders);

  /// Matches border vertices of the template with borders of the target that have a similar length
  /// and outward direction. Such a match has little weight along the border and along the normal of
  /// the surface.
  /// In: points, normals  [V] current vertices of the template
  ///     farthest         mm, largest distance of a match; a different outward direction adds to
  ///                      the distance
  ///     matches          [V] replaced for border vertices with a match
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
