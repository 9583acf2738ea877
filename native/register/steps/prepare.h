// SPDX-License-Identifier: MIT
// What a registration begins with: both surfaces checked, in millimetres around one origin.
#pragma once

#include "register/matching/matcher.h"

namespace risorius::registering::steps {

/// From the target's unit to millimetres of the template, and back.
struct Scale {
  Vec3 origin = Vec3::Zero();
  double mm = 1.0;  // of one unit of the target
  Vec3 in(const Vector3& p) const { return (Vec3(p[0], p[1], p[2]) - origin) * mm; }
  Vector3 out(const Vec3& p) const {
    const Vec3 there = p / mm + origin;
    return {there[0], there[1], there[2]};
  }
};

/// Fails: as register_surface
core::Status check(const Mesh& templ, const Mesh& target, const std::vector<Pair>& pairs,
                   const std::vector<Vector3>& start, const RegisterOptions& options);
/// The template turned, scaled and moved so that the vertices of pairs come near their points; a
/// pair that disagrees with most counts little.
/// Fails: kInvalidArgument (pairs that lie on a line)
core::Result<std::vector<Vector3>> aligned(const Mesh& templ, const std::vector<Pair>& pairs);
/// Fails: kInvalidArgument (a template or a start of no size)
core::Result<Scale> scale_of(const Mesh& templ, const std::vector<Vector3>& start, double mm);
/// What of the target lies near the start, without triangles that have no area, and the triangles
/// of the whole target that these are. Fails: kInvalidArgument (too little of it is there)
core::Result<Target> near_target(const Mesh& target, const Points& start, const Scale& scale,
                                 std::size_t threads, std::vector<std::int32_t>& whole);
/// In: start  in millimetres; spacing  of samples, as those of the target have it
Looks looks_of(const Form& start, const std::vector<std::uint8_t>& trusted, double spacing,
               std::size_t threads);

}  // namespace risorius::registering::steps
