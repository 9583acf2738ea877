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

// A column of a joint group's matrix in the file, and the index of its first value in the rig's
// joint_values.
struct KeptColumn {
  std::uint32_t column, offset;
};

// The stored columns of all joint groups. Their values stay in the matrices of the file until the
// rig's block is allocated.
struct KeptMatrices {
  struct Matrix {
    const dna::JointGroup* group;
    std::uint32_t rows;  // number of rows that are stored, the first ones
    std::vector<KeptColumn> columns;
  };
  std::vector<Matrix> matrices;
  // Ranges (begin, end) of joint_values that belong to no column: between columns, and after the
  // last column.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> gaps;
  std::size_t size = 0;  // number of values of all columns and gaps

  // Writes all columns, and zeros into the gaps. Out: to  [size], the rig's joint_values
  void write(std::span<float> to) const;
};

}  // namespace risorius::compile::detail
