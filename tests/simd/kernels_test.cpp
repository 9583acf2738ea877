// SPDX-License-Identifier: MIT
// Every instruction set against a sum in double precision, at the sizes where loops begin and end.
#include "simd/kernels.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/aligned.h"

namespace risorius::simd {

const Kernels& scalar_kernels_unoptimised();

namespace {

struct Matrix {
  std::size_t stride, columns;
  core::AlignedVector<float> values;
};

Matrix random_matrix(std::size_t stride, std::size_t columns, std::mt19937& random) {
  std::uniform_real_distribution<float> any(-4.0f, 4.0f);
  Matrix m{stride, columns, core::AlignedVector<float>(stride * columns + 1)};
  for (float& v : m.values) v = any(random);
  return m;
}

std::vector<float> random_weights(std::size_t n, std::mt19937& random) {
  std::uniform_real_distribution<float> any(-1.5f, 1.5f);
  std::vector<float> weights(n + 1);
  for (float& v : weights) v = any(random);
  return weights;
}

std::vector<std::uint32_t> every_second(std::size_t n) {
  std::vector<std::uint32_t> columns(n + 1);
  for (std::size_t i = 0; i < n; ++i) columns[i] = static_cast<std::uint32_t>(2 * i);
  return columns;
}

std::vector<std::string> all_kernels() {
  std::vector<std::string> all{"scalar"};
  if (avx2_kernels() != nullptr) all.push_back("avx2");
  return all;
}

class SimdKernels : public testing::TestWithParam<std::string> {
 protected:
  const Kernels& kernels_ = *find_kernels(GetParam().c_str());
};

// A sum of n products, rounded in any order, fused or not, errs by at most n * eps * sum|w v| to
// first order; one more eps covers the second order at these n.
TEST_P(SimdKernels, SumWithinTheRoundingOfItsTerms) {
  std::mt19937 random(1);
  const double eps = std::numeric_limits<float>::epsilon();
  for (const std::size_t rows : {8u, 16u, 56u, 64u, 72u, 128u, 136u, 200u}) {
    for (const std::size_t n : {0u, 1u, 2u, 7u, 8u, 9u, 16u, 100u}) {
      const Matrix m = random_matrix(rows + 8, 2 * n, random);
      const std::vector<float> weights = random_weights(n, random);
      const std::vector<std::uint32_t> columns = every_second(n);
      core::AlignedVector<float> out(rows, 1e30f);
      kernels_.weighted_columns(m.values.data(), m.stride, columns.data(), weights.data(), n,
                                out.data(), rows);
      for (std::size_t r = 0; r < rows; ++r) {
        double sum = 0, size = 0;
        for (std::size_t i = 0; i < n; ++i) {
          const double term = double{weights[i]} * double{m.values[columns[i] * m.stride + r]};
          sum += term;
          size += std::fabs(term);
        }
        const double bound = static_cast<double>(n + 1) * eps * size;
        ASSERT_LE(std::fabs(double{out[r]} - sum), bound) << "row " << r << " of " << rows;
      }
    }
  }
}

TEST_P(SimdKernels, ReadOnlyTheActiveColumns) {
  std::mt19937 random(2);
  Matrix m = random_matrix(72, 20, random);
  for (std::size_t c = 1; c < m.columns; c += 2) {
    for (std::size_t r = 0; r < m.stride; ++r) m.values[c * m.stride + r] = std::nanf("");
  }
  const std::vector<float> weights = random_weights(10, random);
  const std::vector<std::uint32_t> columns = every_second(10);
  core::AlignedVector<float> out(72);
  kernels_.weighted_columns(m.values.data(), m.stride, columns.data(), weights.data(), 10,
                            out.data(), 72);
  for (const float v : out) ASSERT_FALSE(std::isnan(v));
}

TEST_P(SimdKernels, WriteOnlyTheirRows) {
  std::mt19937 random(3);
  const Matrix m = random_matrix(128, 6, random);
  const std::vector<float> weights = random_weights(3, random);
  const std::vector<std::uint32_t> columns = every_second(3);
  for (const std::size_t rows : {8u, 64u, 72u}) {
    core::AlignedVector<float> out(128, 7.0f);
    kernels_.weighted_columns(m.values.data(), m.stride, columns.data(), weights.data(), 3,
                              out.data(), rows);
    for (std::size_t r = rows; r < out.size(); ++r) ASSERT_EQ(out[r], 7.0f) << rows;
  }
}

INSTANTIATE_TEST_SUITE_P(Every, SimdKernels, testing::ValuesIn(all_kernels()),
                         [](const auto& about) { return about.param; });

TEST(ScalarKernels, SameBitsAtEveryOptimisation) {
  std::mt19937 random(4);
  const Matrix m = random_matrix(200, 200, random);
  const std::vector<float> weights = random_weights(100, random);
  const std::vector<std::uint32_t> columns = every_second(100);
  std::vector<float> fast(200), slow(200);
  scalar_kernels().weighted_columns(m.values.data(), m.stride, columns.data(), weights.data(), 100,
                                    fast.data(), 200);
  scalar_kernels_unoptimised().weighted_columns(m.values.data(), m.stride, columns.data(),
                                                weights.data(), 100, slow.data(), 200);
  for (std::size_t r = 0; r < fast.size(); ++r) {
    ASSERT_EQ(std::bit_cast<std::uint32_t>(fast[r]), std::bit_cast<std::uint32_t>(slow[r])) << r;
  }
}

}  // namespace
}  // namespace risorius::simd
