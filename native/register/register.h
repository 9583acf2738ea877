// SPDX-License-Identifier: MIT
// A template surface laid onto a target surface of any topology.
//
// Sources: Amberg, Romdhani and Vetter, "Optimal Step Nonrigid ICP Algorithms for Surface
// Registration" (2007): closest points, a stiffness that decreases, landmarks; Sumner, Schmid and
// Pauly, "Embedded Deformation for Shape Manipulation" (2007): affine motions of few nodes carry
// the many vertices; Li, Sumner and Pauly, "Global Correspondence Optimization for Non-Rigid
// Registration of Depth Scans" (2008): matches that are not trusted; Pottmann et al., "Integral
// Invariants for Robust Geometry Processing" (2009): how a surface bends, seen over a radius.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "author/shapes.h"
#include "author/simplify.h"
#include "core/result.h"

namespace risorius::registering {

using author::Triangle;
using author::Vector3;

/// Triangles are counter-clockwise seen from outside.
struct Mesh {
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
};

/// A vertex of the template and the point of the target that it belongs to.
struct Pair {
  std::uint32_t vertex = 0;
  Vector3 point{};
  double weight = 1.0;  // beside other pairs
};

struct RegisterOptions {
  static constexpr std::size_t kMostTemplate = 300'000;     // vertices
  static constexpr std::size_t kMostTarget = 1'500'000;     // vertices
  static constexpr std::size_t kMostTriangles = 4'000'000;  // of the target
  static constexpr std::size_t kLeast = 100;                // triangles of either surface

  /// Millimetres of one unit of the template; a head of another size is measured as if it had the
  /// size of the template.
  double mm = 10.0;
  /// [template vertices] not 0: the vertex has a counterpart on the target, if that is whole there.
  /// Others are carried along. Empty: every vertex that is not hidden in a cavity has one.
  std::vector<std::uint8_t> trusted;
  /// [template vertices] the vertex of the other side, itself in the middle; empty: no symmetry.
  std::vector<std::uint32_t> mirrored;
  /// How much what one side finds counts for the other; 1: as much as what that finds itself.
  double symmetry = 0.0;
  std::size_t nodes = 2000;  // of the first, coarse steps
  double noise = 2.0;        // mm, of the points of pairs
  std::size_t threads = 0;   // 0: one for each core; the result does not depend on it
};

struct Registered {
  std::vector<Vector3> points;         // [template vertices] on the target
  std::vector<std::int32_t> triangle;  // [template vertices] of the target; -1: none
  std::vector<Vector3> shares;         // barycentric coordinates in it, sum 1
  std::vector<double> distance;        // from it, in the target's unit
  std::vector<std::uint8_t> trusted;   // not 0: the target has this vertex
};

/// Told of what is done, 0 to 1; false stops the work.
using Progress = std::function<bool(double)>;

/// Lays a template onto a target.
/// In: start  [template vertices] the template near the target; empty: what the pairs tell, at
///            least three that lie on no line
/// Fails: kInvalidArgument (options, too few triangles or pairs, nothing of the target is near the
///        start; "stopped" where progress said so), kInvalidLength (start, options), kInvalidIndex
///        (a corner, a pair's vertex), kInvalidValue (not finite), kLimitExceeded (vertices)
/// Cost: some 60 bytes for each vertex of the target and 2 kB for each of the template
core::Result<Registered> register_surface(const Mesh& templ, const Mesh& target,
                                          const std::vector<Pair>& pairs,
                                          const std::vector<Vector3>& start,
                                          const RegisterOptions& options,
                                          const Progress& progress = {});

}  // namespace risorius::registering
