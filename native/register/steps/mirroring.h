// SPDX-License-Identifier: MIT
// A head whose sides follow each other.
#pragma once

#include <cstdint>
#include <vector>

#include "register/matching/types.h"

namespace risorius::registering::steps {

/// Adds to each match that of the vertex of the other side, seen in the plane between both sides as
/// they lie now.
/// In: mirrored  [V] the vertex of the other side
///     share     of the weight that the other side's match has; 1: as much as the own
///     missing   only vertices that have no match of their own get one
void add_mirrored(const std::vector<std::uint32_t>& mirrored, const Points& points, double share,
                  bool missing, std::vector<Match>& matches);

}  // namespace risorius::registering::steps
