// SPDX-License-Identifier: MIT
// Prepares a registration: checks both surfaces and converts them to millimetres.
#pragma once

#include "register/matching/matcher.h"

namespace risorius::registering::steps {

/// Converts positions between the target's unit and millimetres. In millimetres, the target has the
/// size of the template.
struct Scale {
  Vec3 origin = Vec3::Zero();
  double mm = 1.0;  // mm per unit of the target
  Vec3 in(const Vector3& p) const { return (Vec3(p[0], p[1], p[2]) - origin) * mm; }
  Vector3 out(const Vec3& p) const {
    const Vec3 there = p / mm + origin;
    return {there[0], there[1], there[2]};
  }
};

/// Checks the arguments of register_surface. Fails: as register_surface
core::Status check(const Mesh& templ, const Mesh& target, const std::vector<Pair>& pairs,
                   const std::vector<Vector3>& start, const RegisterOptions& options);
/// The template's vertices after the similarity transform that brings the vertices of pairs near
/// their points. Outliers among the pairs have little weight.
/// Fails: kInvalidArgument (pairs that lie on a line)
core::Result<std::vector<Vector3>> aligned(const Mesh& templ, const std::vector<Pair>& pairs);
/// The scale of the target: the template's size in mm, divided by the size of the start positions
/// in the target's unit.
/// Fails: kInvalidArgument (a template whose vertices' root mean square distance from their middle
///        is outside 10 mm to 100 m, or a start of size 0)
core::Result<Scale> scale_of(const Mesh& templ, const std::vector<Vector3>& start, double mm);
/// The triangles of the target whose middle is within 60 mm of the box around the start, without
/// triangles of area 0.
/// In:    start  the start positions in millimetres
/// Out:   whole  for each of these triangles its index in `target`
/// Fails: kInvalidArgument (too few triangles)
core::Result<Target> near_target(const Mesh& target, const Points& start, const Scale& scale,
                                 std::size_t threads, std::vector<std::int32_t>& whole);
/// Computes the properties of the template's vertices.
/// In: start    the template in millimetres
///     trusted  as in RegisterOptions
///     spacing  mm between the target's samples; samples of the template get the same spacing
Looks looks_of(const Form& start, const std::vector<std::uint8_t>& trusted, double spacing,
               std::size_t threads);

}  // namespace risorius::registering::steps
