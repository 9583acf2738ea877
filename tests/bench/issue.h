// SPDX-License-Identifier: MIT
// What a processor can issue, whatever the memory is like.
#pragma once

#include <cstddef>
#include <string_view>

namespace risorius::bench {

/// As many reads and multiply-adds as `Kernels::skin` of an instruction set needs for so many
/// influences, on what the first cache holds: of each a row of the matrix, of four at once the
/// bones and the weights. What a vertex needs besides is left out.
void issue_skin(std::string_view set, std::size_t influences);

}  // namespace risorius::bench
