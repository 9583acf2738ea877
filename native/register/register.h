// SPDX-License-Identifier: MIT
// Registers a template surface onto a target surface of any topology.
//
// Sources: Amberg, Romdhani and Vetter, "Optimal Step Nonrigid ICP Algorithms for Surface
// Registration" (2007): closest points, a stiffness that decreases, landmarks; Sumner, Schmid and
// Pauly, "Embedded Deformation for Shape Manipulation" (2007): affine motions of few nodes carry
// the many vertices; Li, Sumner and Pauly, "Global Correspondence Optimization for Non-Rigid
// Registration of Depth Scans" (2008): weights of uncertain matches; Pottmann et al., "Integral
// Invariants for Robust Geometry Processing" (2009): the bending of a surface within a radius.
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

/// A surface of triangles, counter-clockwise seen from outside.
struct Mesh {
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
};

/// A vertex of the template and the corresponding point of the target.
struct Pair {
  std::uint32_t vertex = 0;
  Vector3 point{};      // in the target's unit
  double weight = 1.0;  // against other pairs, 0 to 1e6
};

struct RegisterOptions {
  static constexpr std::size_t kMostTemplate = 300'000;     // vertices
  static constexpr std::size_t kMostTarget = 1'500'000;     // vertices
  static constexpr std::size_t kMostTriangles = 4'000'000;  // of the target
  static constexpr std::size_t kLeast = 100;                // triangles of either surface

  /// Millimetres per unit of the template. The target is scaled to the template's size before
  /// lengths are compared with limits in mm.
  double mm = 10.0;
  /// [template vertices] not 0: the vertex has a counterpart if the target has no hole there; other
  /// vertices follow their neighbours. Empty: all vertices outside cavities have a counterpart.
  std::vector<std::uint8_t> trusted;
  /// [template vertices] the mirror vertex, in the middle the vertex itself; empty: no symmetry.
  std::vector<std::uint32_t> mirrored;
  /// In the coarse steps, each vertex also gets the reflected match of its mirror vertex, whose
  /// weight is multiplied by this factor; 0: no symmetry.
  double symmetry = 0.0;
  std::size_t nodes = 2000;  // number of nodes of the coarse steps
  double noise = 2.0;        // expected error of the points of pairs in mm
  std::size_t threads = 0;   // 0: one for each core; the result does not depend on it
};

struct Registered {
  std::vector<Vector3> points;         // [template vertices] final positions, in the target's unit
  std::vector<std::int32_t> triangle;  // [template vertices] nearest target triangle; -1: none
  std::vector<Vector3> shares;         // barycentric coordinates in the triangle, sum 1
  std::vector<double> distance;        // from the triangle, in the target's unit
  std::vector<std::uint8_t> trusted;   // not 0: has a counterpart, within 0.5 mm of the target
};

/// Called with the share of the work that is done, 0 to 1; returning false stops the work.
using Progress = std::function<bool(double)>;

/// Registers a template onto a target.
/// In: start  [template vertices] positions near the target, in the target's unit; empty: computed
///            from the pairs, of which at least three must not lie on a line
/// Fails: kInvalidArgument (options, too few triangles or pairs, no surface of the target near the
///        start; "stopped" if progress returned false), kInvalidLength (start, options),
///        kInvalidIndex (a corner, a pair's vertex, options.mirrored), kInvalidValue (not finite, a
///        pair's weight), kLimitExceeded (vertices, triangles)
/// Cost: about 60 bytes per vertex of the target and 2 kB per vertex of the template
core::Result<Registered> register_surface(const Mesh& templ, const Mesh& target,
                                          const std::vector<Pair>& pairs,
                                          const std::vector<Vector3>& start,
                                          const RegisterOptions& options,
                                          const Progress& progress = {});

}  // namespace risorius::registering
