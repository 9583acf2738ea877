// SPDX-License-Identifier: MIT
// The joint matrices of a face before they are written into its block. Private to native/compile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "dna/dna.h"

namespace risorius::compile::detail {

// A column of a joint group's matrix, and its offset in the rig's block, in floats.
struct KeptColumn {
  std::uint32_t column, offset;
};

// The stored columns of all joint groups. Their values stay in the matrices of the file until the
// rig's block is allocated.
struct KeptMatrices {
  struct Matrix {
    const dna::JointGroup* group;
    std::uint32_t rows;
    std::vector<KeptColumn> columns;
  };
  std::vector<Matrix> matrices;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> gaps;  // between columns: first, end
  std::size_t size = 0;                                       // total, in floats

  // Writes all columns into the block. Out: to  [size], overwritten
  void write(std::span<float> to) const;
};

}  // namespace risorius::compile::detail
