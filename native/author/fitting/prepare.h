// SPDX-License-Identifier: MIT
// From what a caller gives to a fit's own numbers. Private to native/author.
#pragma once

#include <cstddef>
#include <vector>

#include "author/fit.h"
#include "author/fitting/problem.h"
#include "core/result.h"

namespace risorius::author::detail {

/// Fails: as fit_joints, whose words for the arguments the errors take.
core::Status check(const Shapes& shapes, const FitOptions& options);

/// The problem without its pivots. In: shapes, options  checked
Problem make_problem(const Shapes& shapes, const FitOptions& options);
/// The pivots in the fit's unit, each with that of the other side.
void take_pivots(const std::vector<Pivot>& pivots, Problem& problem);
/// The given joints, and a head that rests where none of them does: all vertices are the head's.
/// In: own  expressions without those that are added as mirrors
/// Out: problem.nearest_given
State start(Problem& problem, const std::vector<GivenJoint>& given, std::size_t own);
/// Takes the weights to begin with. Fails: see fit_weights
core::Status take_start(const StartWeights& start, State& state);

}  // namespace risorius::author::detail
