// SPDX-License-Identifier: MIT
// Symmetry: matches of one side of a head are added to the other side.
#pragma once

#include <cstdint>
#include <vector>

#include "register/matching/types.h"

namespace risorius::registering::steps {

/// Adds to each match the match of its mirror vertex, reflected in the current symmetry plane.
/// In: mirrored  [V] the mirror vertex; a vertex in the middle is its own
///     share     factor of the weight of the reflected match
///     missing   true: only vertices without a match get a reflected one
void add_mirrored(const std::vector<std::uint32_t>& mirrored, const Points& points, double share,
                  bool missing, std::vector<Match>& matches);

}  // namespace risorius::registering::steps
