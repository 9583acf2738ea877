// SPDX-License-Identifier: MIT
// Which point of the target a vertex of the template goes to, and how far that is believed.
#pragma once

#include <memory>

#include "author/correctives/nearest.h"
#include "register/matching/feature_tree.h"
#include "register/matching/rims.h"
#include "register/matching/samples.h"

namespace risorius::registering::steps {

/// The target, in millimetres, as matches need it.
struct Target {
  Form form;
  std::vector<std::uint8_t> borders;  // as border_edges has them
  Samples samples;
};

/// The template's surface as it began, with what does not change while it moves.
struct Looks {
  std::vector<Bend> bends;           // [V]
  std::vector<double> belief;        // [V] 0: has no counterpart, 1: has one
  std::vector<double> inside;        // [V] 1: hidden in a cavity, which the target may have too
  std::vector<std::uint8_t> border;  // [V] not 0: on the border of the template
  std::vector<RimEdge> rim;          // the edges of that border
};

/// How features count: millimetres that a difference of 1 is worth.
struct Counting {
  double normal = 10.0;
  double bend = 40.0;
  double farthest = 40.0;  // mm
  double along = 0.5;      // how much a match holds along the surface, beside across it
  bool backwards = true;   // also from the target to the template
};

class Matcher {
 public:
  /// Both are kept, not copied.
  Matcher(const Target& target, const Looks& looks, std::size_t threads);

  /// [V] by position, normal and bending, among samples of the target.
  std::vector<Match> by_features(const Points& points, const Points& normals,
                                 const Counting& counting) const;
  /// The closest point of the target's triangles that look the same way.
  struct Closest {
    std::int32_t triangle = -1;
    Vec3 shares = Vec3::Zero();
    Vec3 point = Vec3::Zero();
    Vec3 normal = Vec3::Zero();  // of the target there, smooth
    double distance = 0.0;
    bool beyond_border = false;  // the template ends elsewhere than the target
  };
  std::vector<Closest> closest(const Points& points, const Points& normals, double farthest,
                               double least_cosine) const;
  /// Whether a vertex in a cavity lies on a surface so near and so parallel that it is the same.
  static bool is_inside(const Closest& found, const Vec3& normal);
  /// [V] by closest points. In: robust  mm, a distance at which a match counts a quarter
  std::vector<Match> by_distance(const Points& points, const Points& normals, double farthest,
                                 double least_cosine, double robust, double along) const;

 private:
  void add_backwards(const Points& points, const Points& normals, const Counting& counting,
                     double robust, std::vector<Match>& matches) const;
  const Target& target_;
  const Looks& looks_;
  std::size_t threads_;
  author::detail::Nearest nearest_;
  Rims rims_;
};

}  // namespace risorius::registering::steps
