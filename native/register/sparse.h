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

/// The Cholesky factors of a matrix, which solve systems with many right sides.
class SparseCholesky {
 public:
  /// In: rows, columns, values  entries of the lower triangle; entries at the same place are
  ///                            summed, entries above the diagonal are ignored
  ///     size                   number of rows of the matrix
  /// Fails: kInvalidLength (lists), kInvalidIndex, kInvalidValue (not finite, or not positive
  ///     definite), kLimitExceeded (size)
  static core::Result<SparseCholesky> make(std::span<const std::int32_t> rows,
                                           std::span<const std::int32_t> columns,
                                           std::span<const double> values, std::size_t size);
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  std::size_t size() const;
  /// Solves systems with several right sides.
  /// In: right    [size][sides] right sides in row-major order
  ///     threads  number of threads, each of which solves some of the systems; 0: one for each core
  /// Returns the solutions [size][sides]. Fails: kInvalidLength (right)
  core::Result<std::vector<double>> solve(std::span<const double> right, std::size_t sides,
                                          std::size_t threads = 0) const;

 private:
  struct Impl;
  explicit SparseCholesky(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace risorius::registering
