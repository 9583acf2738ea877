// SPDX-License-Identifier: MIT
#include "register/sparse.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cmath>
#include <string>
#include <utility>

#include "core/parallel_for.h"

namespace risorius::registering {

using core::ErrorCode;
using core::fail;

struct SparseCholesky::Impl {
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factors;
  std::size_t size = 0;
};

SparseCholesky::SparseCholesky(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SparseCholesky::~SparseCholesky() = default;
SparseCholesky::SparseCholesky(SparseCholesky&&) noexcept = default;
SparseCholesky& SparseCholesky::operator=(SparseCholesky&&) noexcept = default;

std::size_t SparseCholesky::size() const { return impl_->size; }

core::Result<SparseCholesky> SparseCholesky::make(std::span<const std::int32_t> rows,
                                                  std::span<const std::int32_t> columns,
                                                  std::span<const double> values,
                                                  std::size_t size) {
  if (rows.size() != values.size() || columns.size() != values.size()) {
    return fail(ErrorCode::kInvalidLength, "values",
                "as many rows, columns and values were expected, found " +
                    std::to_string(rows.size()) + ", " + std::to_string(columns.size()) + " and " +
                    std::to_string(values.size()));
  }
  if (size > 0x7fffffffu)
    return fail(ErrorCode::kLimitExceeded, "size", "a size below 2^31 was expected");
  const auto below = static_cast<std::int64_t>(size);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (rows[i] < 0 || columns[i] < 0 || rows[i] >= below || columns[i] >= below) {
      return fail(ErrorCode::kInvalidIndex, "rows[" + std::to_string(i) + "]",
                  "a place below " + std::to_string(size) + " was expected, found (" +
                      std::to_string(rows[i]) + ", " + std::to_string(columns[i]) + ")");
    }
    if (!std::isfinite(values[i])) {
      return fail(ErrorCode::kInvalidValue, "values[" + std::to_string(i) + "]",
                  "a finite number was expected");
    }
    if (rows[i] >= columns[i]) entries.emplace_back(rows[i], columns[i], values[i]);
  }
  Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(size),
                                     static_cast<Eigen::Index>(size));
  matrix.setFromTriplets(entries.begin(), entries.end());
  auto impl = std::make_unique<Impl>();
  impl->size = size;
  impl->factors.compute(matrix);
  if (impl->factors.info() != Eigen::Success ||
      !(impl->factors.vectorD().size() == 0 || impl->factors.vectorD().minCoeff() > 0)) {
    return fail(ErrorCode::kInvalidValue, "values", "a positive definite matrix was expected");
  }
  return SparseCholesky(std::move(impl));
}

core::Result<std::vector<double>> SparseCholesky::solve(std::span<const double> right,
                                                        std::size_t sides,
                                                        std::size_t threads) const {
  if (right.size() != impl_->size * sides) {
    return fail(ErrorCode::kInvalidLength, "right",
                std::to_string(impl_->size) + " rows of " + std::to_string(sides) +
                    " numbers were expected, found " + std::to_string(right.size()) + " numbers");
  }
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto n = static_cast<Eigen::Index>(impl_->size), m = static_cast<Eigen::Index>(sides);
  const Eigen::Map<const Rows> given(right.data(), n, m);
  std::vector<double> out(right.size());
  Eigen::Map<Rows> solved(out.data(), n, m);
  core::parallel_for(sides, threads, [&](std::size_t begin, std::size_t end) {
    for (auto side = static_cast<Eigen::Index>(begin); side < static_cast<Eigen::Index>(end);
         ++side) {
      const Eigen::VectorXd one = given.col(side);
      solved.col(side) = impl_->factors.solve(one);
    }
  });
  return out;
}

}  // namespace risorius::registering
