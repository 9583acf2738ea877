// SPDX-License-Identifier: MIT
// Measures how fast a processor issues the skinning kernel's instructions if memory is no limit.
#pragma once

#include <cstddef>
#include <string_view>

namespace risorius::bench {

/// Issues the reads and multiply-adds that `Kernels::skin` of an instruction set needs for this
/// number of influences: a row of the matrix for each influence, and bones and weights for each
/// four influences. The data are in the first-level cache. Other work for each vertex is left out.
/// In: set         avx512 or avx2; any other name: registers of four floats
///     influences  rounded up to a multiple of 480
void issue_skin(std::string_view set, std::size_t influences);

}  // namespace risorius::bench
