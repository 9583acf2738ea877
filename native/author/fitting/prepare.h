// SPDX-License-Identifier: MIT
// Converts the caller's arguments to the fit's own units. Private to native/author.
#pragma once

#include <cstddef>
#include <vector>

#include "author/fit.h"
#include "author/fitting/problem.h"
#include "core/result.h"

namespace risorius::author::detail {

/// Fails: as fit_joints
core::Status check(const Shapes& shapes, const FitOptions& options);

/// The problem without its pivots, which take_pivots adds. In: shapes, options  must have passed
/// `check`
Problem make_problem(const Shapes& shapes, const FitOptions& options);
/// Adds pivots to the problem, converted to the fit's unit, and pairs each pivot with the pivot on
/// the other side of the face.
void take_pivots(const std::vector<Pivot>& pivots, Problem& problem);
/// The first state: the given joints, and the head, a joint without motion, if all given joints
/// move. The first joint without motion gets the whole weight of all vertices. Also fills
/// problem.nearest_given.
/// In: own  number of expressions without the added mirrored ones
State start(Problem& problem, const std::vector<GivenJoint>& given, std::size_t own);
/// Sets the initial weights of the vertices; weights without influences change nothing.
/// Fails: kInvalidLength, kInvalidIndex (a joint), kInvalidValue (a weight)
core::Status take_start(const StartWeights& start, State& state);

}  // namespace risorius::author::detail
