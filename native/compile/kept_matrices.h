// SPDX-License-Identifier: MIT
// The joint matrices of a face between its file and its block. Private to native/compile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "dna/dna.h"

namespace risorius::compile::detail {

// A column of a group, and where it is kept.
struct KeptColumn {
  std::uint32_t column, offset;
};

// The columns of all groups, which stay in the matrices of the file until the block is there.
struct KeptMatrices {
  struct Matrix {
    const dna::JointGroup* group;
    std::uint32_t rows;
    std::vector<KeptColumn> columns;
  };
  std::vector<Matrix> matrices;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> gaps;  // between columns: first, end
  std::size_t size = 0;                                       // of all, in floats

  // Out: to  [size], overwritten
  void write(std::span<float> to) const;
};

}  // namespace risorius::compile::detail
