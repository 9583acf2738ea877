// SPDX-License-Identifier: MIT
// Sparse linear systems of a symmetric positive definite matrix.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/result.h"

namespace risorius::registering {

/// The Cholesky factors of a matrix, for many right sides.
class SparseCholesky {
 public:
  /// In: rows, columns, values  of the lower triangle; entries at the same place are summed, those
  ///     above the diagonal are not read
  ///     size                   of the matrix
  /// Fails: kInvalidLength (lists), kInvalidIndex, kInvalidValue (not finite, or not positive
  ///     definite)
  static core::Result<SparseCholesky> make(std::span<const std::int32_t> rows,
                                           std::span<const std::int32_t> columns,
                                           std::span<const double> values, std::size_t size);
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  std::size_t size() const;
  /// In: right    [size][sides] by rows
  ///     threads  0: one for each core; the sides are shared among them
  /// Returns [size][sides]. Fails: kInvalidLength (right)
  core::Result<std::vector<double>> solve(std::span<const double> right, std::size_t sides,
                                          std::size_t threads = 0) const;

 private:
  struct Impl;
  explicit SparseCholesky(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace risorius::registering
