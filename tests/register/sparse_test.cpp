// SPDX-License-Identifier: MIT
// Solves sparse linear systems by a Cholesky factorization.
#include "register/sparse.h"

#include <gtest/gtest.h>

#include <vector>

namespace risorius::registering {
namespace {

TEST(Sparse, SolvesEverySide) {
  // The matrix has the rows 2 -1 0, -1 2 -1 and 0 -1 2. Two entries add up to the middle 2. The
  // entry 99 is above the diagonal and must be ignored.
  const std::vector<std::int32_t> rows{0, 1, 1, 1, 2, 2, 0}, columns{0, 0, 1, 1, 1, 2, 2};
  const std::vector<double> values{2, -1, 1, 1, -1, 2, 99};
  const auto factors = SparseCholesky::make(rows, columns, values, 3).value();
  const std::vector<double> right{1, 0, 0, 2, 1, 0};  // sides (1, 0, 1) and (0, 2, 0)
  const std::vector<double> expected{1, 1, 1, 2, 1, 1};
  const std::vector<double> found = factors.solve(right, 2).value();
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-12);
  EXPECT_FALSE(factors.solve(right, 3));
}

TEST(Sparse, RefusesOtherMatrices) {
  const std::vector<std::int32_t> rows{0, 1, 1}, columns{0, 0, 1};
  const std::vector<double> indefinite{1, 2, 1};
  EXPECT_FALSE(SparseCholesky::make(rows, columns, indefinite, 2));
  EXPECT_FALSE(SparseCholesky::make(rows, columns, indefinite, 1));  // an entry outside
  const std::vector<double> few{1, 2};
  EXPECT_FALSE(SparseCholesky::make(rows, columns, few, 2));
}

}  // namespace
}  // namespace risorius::registering
