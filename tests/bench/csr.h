// SPDX-License-Identifier: MIT
// The baseline of the evaluator's benchmarks: an evaluation in the shortest scalar code, with the
// joint groups as one compressed sparse row matrix.
#pragma once

#include <cstdint>
#include <vector>

#include "dna/dna.h"

namespace risorius::bench {

/// The matrix of all joint groups at one LOD, one row per joint attribute, one column per control.
struct Csr {
  std::vector<std::uint32_t> begins;  // [rows + 1] index of each row's first value
  std::vector<std::uint16_t> columns;
  std::vector<float> values;

  void multiply(const float* controls, float* out) const;
};

class Baseline {
 public:
  Baseline(const dna::Dna& dna, std::uint32_t lod);
  /// Evaluates the raw controls of one frame: correctives, joint groups, channels and maps.
  /// Neural networks, RBF solvers, and swing and twist setups are left out.
  void evaluate(const float* raw);
  const Csr& matrix() const { return matrix_; }
  const std::vector<float>& joints() const { return joints_; }

 private:
  const dna::Dna& dna_;
  std::uint32_t lod_;
  Csr matrix_;
  std::vector<float> controls_, joints_, shapes_, maps_;
};

}  // namespace risorius::bench
