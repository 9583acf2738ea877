// SPDX-License-Identifier: MIT
// Tests least squares with bounds. Each problem is strictly convex, so it has one solution, which
// the conditions of Karush, Kuhn and Tucker identify.
#include "solve/bounded.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace risorius::solve {
namespace {

using Doubles = std::vector<double>;

Doubles random(std::mt19937& random, std::size_t n, double low, double high) {
  std::uniform_real_distribution<double> values(low, high);
  Doubles out(n);
  for (double& v : out) v = values(random);
  return out;
}

/// The largest violation of the conditions of a minimum with bounds; 0: x is the minimum. Expects x
/// to be within its bounds.
/// In: slope      gradient of the smooth part of the function at x
///     low, high  bounds of x
///     rest       values of x at which the sparse part of the function is 0
///     kink       slope of the sparse part: kink above rest, -kink below rest
double violation(const Doubles& x, const Doubles& slope, const Doubles& low, const Doubles& high,
                 const Doubles& rest, const Doubles& kink) {
  double worst = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_GE(x[i], low[i]);
    EXPECT_LE(x[i], high[i]);
    double down = slope[i] - kink[i], up = slope[i] + kink[i];  // slopes to the left and right
    if (x[i] > rest[i]) down = up;
    if (x[i] < rest[i]) up = down;
    if (x[i] < high[i]) worst = std::max(worst, -up);  // a larger value would be better
    if (x[i] > low[i]) worst = std::max(worst, down);
  }
  return worst;
}

TEST(LeastChange, SharesAWishAsTheColumnsReach) {
  const Doubles a{1, 2}, b{1}, low{0, 0}, high{1, 1};
  Doubles x(2);
  least_change(1, 2, a.data(), b.data(), low.data(), high.data(), 1e-9, x.data());
  EXPECT_NEAR(x[0], 0.2, 1e-6);
  EXPECT_NEAR(x[1], 0.4, 1e-6);
}

TEST(LeastChange, GivesWhatABoundTakesToTheOthers) {
  const Doubles a{1, 2}, b{1}, low{0, 0}, high{1, 0.3};
  Doubles x(2);
  least_change(1, 2, a.data(), b.data(), low.data(), high.data(), 1e-9, x.data());
  EXPECT_NEAR(x[0], 0.4, 1e-6);
  EXPECT_NEAR(x[1], 0.3, 1e-6);
}

TEST(LeastChange, MeetsTheConditionsOfTheLeast) {
  std::mt19937 numbers(7);
  for (int i = 0; i < 60; ++i) {
    const std::size_t rows = 1 + static_cast<std::size_t>(i) % 9, columns = 40;
    const Doubles a = random(numbers, rows * columns, -1, 1);
    // In every second case many values of b are too large to be reached within the bounds.
    const Doubles b = random(numbers, rows, -1, 1.0 + 20.0 * (i % 2));
    const Doubles low = random(numbers, columns, -0.4, 0), high = random(numbers, columns, 0, 0.4);
    const double ridge = i % 3 == 0 ? 1.0 : 1e-6;
    Doubles x(columns), slope(columns), none(columns, 0.0);
    least_change(rows, columns, a.data(), b.data(), low.data(), high.data(), ridge, x.data());
    for (std::size_t r = 0; r < rows; ++r) {
      double left = -b[r];
      for (std::size_t c = 0; c < columns; ++c) left += a[r * columns + c] * x[c];
      for (std::size_t c = 0; c < columns; ++c) slope[c] += a[r * columns + c] * left;
    }
    for (std::size_t c = 0; c < columns; ++c) slope[c] += ridge * x[c];
    EXPECT_LT(violation(x, slope, low, high, x, none), 1e-6) << i;
  }
}

TEST(LeastChange, StaysWhereNothingIsFree) {
  const Doubles a{1, 2}, b{1}, bound{0.25, 0.5};
  Doubles x(2);
  least_change(1, 2, a.data(), b.data(), bound.data(), bound.data(), 1e-9, x.data());
  EXPECT_EQ(x, bound);
}

TEST(Descend, MeetsTheConditionsOfTheLeast) {
  std::mt19937 numbers(11);
  constexpr std::size_t kCount = 30;
  for (int i = 0; i < 40; ++i) {
    // Columns 0 and 1 are nearly equal, like the controls of a jaw and of its extreme position.
    Doubles a = random(numbers, 50 * kCount, -1, 1);
    for (std::size_t r = 0; r < 50; ++r)
      a[r * kCount + 1] = a[r * kCount] + 0.01 * a[r * kCount + 1];
    Doubles h(kCount * kCount), g = random(numbers, kCount, -30, 30);
    for (std::size_t r = 0; r < 50; ++r) {
      for (std::size_t j = 0; j < kCount * kCount; ++j) {
        h[j] += a[r * kCount + j / kCount] * a[r * kCount + j % kCount];
      }
    }
    const Doubles low = random(numbers, kCount, -1, 0), high = random(numbers, kCount, 0, 1);
    const Doubles rest(kCount, 0.0), sparse(kCount, i % 2 == 0 ? 3.0 : 0.0);
    Doubles x(kCount, 0.0), slope(kCount);
    descend({kCount, h.data(), g.data(), low.data(), high.data(), rest.data(), sparse.data()}, 1e-7,
            x.data());
    for (std::size_t r = 0; r < kCount; ++r) {
      slope[r] = -g[r];
      for (std::size_t c = 0; c < kCount; ++c) slope[r] += h[r * kCount + c] * x[c];
    }
    EXPECT_LT(violation(x, slope, low, high, rest, sparse), 1e-4) << i;
  }
}

TEST(Descend, ComesNearTheLeastWhereControlsDoNearlyTheSame) {
  std::mt19937 numbers(13);
  constexpr std::size_t kCount = 4, kRows = 5;
  for (int i = 0; i < 200; ++i) {
    Doubles a = random(numbers, kRows * kCount, -1, 1), h(kCount * kCount), g(kCount);
    for (std::size_t r = 0; r < kRows; ++r) {
      for (std::size_t c = 1; c < kCount; ++c)
        a[r * kCount + c] = a[r * kCount] + 0.01 * a[r * kCount + c];
    }
    for (std::size_t r = 0; r < kRows; ++r) {
      for (std::size_t j = 0; j < kCount * kCount; ++j) {
        h[j] += a[r * kCount + j / kCount] * a[r * kCount + j % kCount];
      }
    }
    const Doubles goal = random(numbers, kCount, -1.5, 1.5);  // often outside of the bounds
    const Doubles low = random(numbers, kCount, -1, -0.2), high = random(numbers, kCount, 0.2, 1);
    for (std::size_t j = 0; j < kCount * kCount; ++j) g[j / kCount] += h[j] * goal[j % kCount];
    const Doubles rest(kCount, 0.0), sparse(kCount, i % 2 == 0 ? 1e-4 : 0.0);
    Doubles x(kCount, 0.0), slope(kCount);
    descend({kCount, h.data(), g.data(), low.data(), high.data(), rest.data(), sparse.data()}, 1e-7,
            x.data());
    for (std::size_t c = 0; c < kCount; ++c) {
      slope[c] = -g[c];
      for (std::size_t k = 0; k < kCount; ++k) slope[c] += h[c * kCount + k] * x[k];
    }
    EXPECT_LT(violation(x, slope, low, high, rest, sparse), 0.005 * h[0]) << i;
  }
}

TEST(Descend, LeavesAtRestWhatIsNotWorthItsPrice) {
  const Doubles h{2, 0, 0, 2}, g{1, 1}, low{-1, -1}, high{1, 1}, rest{0, 0.1}, sparse{1.5, 0.2};
  Doubles x{0.3, 0.3};
  descend({2, h.data(), g.data(), low.data(), high.data(), rest.data(), sparse.data()}, 1e-9,
          x.data());
  EXPECT_EQ(x[0], 0.0);          // |g| is below the sparse weight
  EXPECT_NEAR(x[1], 0.4, 1e-9);  // (1 - 0.2) / 2
}

TEST(Normal, IsTheProductOfTheJacobian) {
  std::mt19937 numbers(3);
  Jacobian jacobian;
  jacobian.controls = 5, jacobian.points = 40;  // the second block is not full
  jacobian.blocks.resize(2);
  Doubles dense(120 * 5);
  for (std::size_t b = 0; b < 2; ++b) {
    jacobian.blocks[b].controls = {static_cast<std::uint32_t>(b), 3, 4};
    const std::size_t points = b == 0 ? 32 : 8;
    for (const std::uint32_t c : jacobian.blocks[b].controls) {
      const Doubles column = random(numbers, 96, -1, 1);
      for (std::size_t r = 0; r < 96; ++r) {
        const auto value = static_cast<float>(r < 3 * points ? column[r] : 0.0);
        jacobian.blocks[b].values.push_back(value);
        if (r < 3 * points) dense[(96 * b + r) * 5 + c] = double{value};
      }
    }
  }
  const Doubles residual = random(numbers, 120, -1, 1);
  Doubles h(25), g(5);
  normal_matrix(jacobian, h.data());
  gradient(jacobian, residual.data(), g.data());
  for (std::size_t i = 0; i < 5; ++i) {
    double pull = 0.0;
    for (std::size_t r = 0; r < 120; ++r) pull += dense[r * 5 + i] * residual[r];
    EXPECT_NEAR(g[i], pull, 1e-5);
    for (std::size_t k = 0; k < 5; ++k) {
      double sum = 0.0;
      for (std::size_t r = 0; r < 120; ++r) sum += dense[r * 5 + i] * dense[r * 5 + k];
      EXPECT_NEAR(h[i * 5 + k], sum, 1e-4);
    }
  }
}

}  // namespace
}  // namespace risorius::solve
