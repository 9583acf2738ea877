// SPDX-License-Identifier: MIT
// Finds matches: for each vertex of the template a point of the target and a weight.
#pragma once

#include <memory>

#include "author/correctives/nearest.h"
#include "register/matching/feature_tree.h"
#include "register/matching/rims.h"
#include "register/matching/samples.h"

namespace risorius::registering::steps {

/// The target surface, its borders, and points sampled on it, in millimetres.
struct Target {
  Form form;
  std::vector<std::uint8_t> borders;  // the result of border_edges
  Samples samples;
};

/// Properties of the template's vertices at the start of the registration. They stay constant while
/// the vertices move.
struct Looks {
  std::vector<Bend> bends;     // [V]
  std::vector<double> belief;  // [V] 0: has no counterpart, 1: has one; between: uncertain
  // [V] 1: hidden in a cavity, which the target may also have; all 0 if the caller gave `trusted`
  std::vector<double> inside;
  std::vector<std::uint8_t> border;  // [V] not 0: on the border of the template
  std::vector<RimEdge> rim;          // the edges of that border
};

/// Weights of the search for the nearest feature.
struct Counting {
  double normal = 10.0;    // mm that a difference of 1 of the normals counts
  double bend = 40.0;      // mm that a difference of 1 of the bends counts
  double farthest = 40.0;  // mm, largest distance in the space of features
  double along = 0.5;      // weight of a match along the surface, against 1 across it
  bool backwards = true;   // also search from the target's samples to the template
};

class Matcher {
 public:
  /// Keeps references to target and looks.
  Matcher(const Target& target, const Looks& looks, std::size_t threads);

  /// [V] matches with the target's samples that are nearest by position, normal and bending.
  /// Vertices at the template's border are matched with the target's borders.
  /// In: points, normals  [V] current vertices of the template, in millimetres
  std::vector<Match> by_features(const Points& points, const Points& normals,
                                 const Counting& counting) const;
  /// The point of the target that is closest to a vertex, among triangles whose normal has at least
  /// a given cosine with the vertex's normal; triangle -1: there is none.
  struct Closest {
    std::int32_t triangle = -1;
    Vec3 shares = Vec3::Zero();
    Vec3 point = Vec3::Zero();
    Vec3 normal = Vec3::Zero();  // interpolated normal of the target, length 1
    double distance = 0.0;
    bool beyond_border = false;  // the vertex lies beside the target's border, not above it
  };
  std::vector<Closest> closest(const Points& points, const Points& normals, double farthest,
                               double least_cosine) const;
  /// Whether a vertex in a cavity of the template has a counterpart on the target: `found` is
  /// within 2 mm, and the cosine between its normal and the vertex's normal is above 0.8.
  static bool is_inside(const Closest& found, const Vec3& normal);
  /// [V] matches with the closest points of the target.
  /// In: farthest      mm, largest distance of a match
  ///     least_cosine  between the normals of a vertex and of its triangle
  ///     robust        mm, distance at which the weight of a match is a quarter
  ///     along         weight of a match along the surface, against 1 across it
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
