// SPDX-License-Identifier: MIT
// Least squares with bounds on the unknowns, such as raw controls that bring points of a skin to
// goals.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/probe.h"

namespace risorius::solve {

/// Finds the x between low and high with the least |a x - b|^2 + ridge |x|^2. With a small ridge it
/// is the shortest x among all that come equally close to b.
///
/// It is meant for few rows and many columns, such as a drag of some points: the dual problem has
/// one unknown per row. There x(y) = clip(a^T y / ridge, low, high), and y is the zero of y + a
/// x(y) - b, the gradient of a convex function. The zero is found by Newton's method with step
/// halving.
/// In:  a [rows, columns], b [rows], low <= high [columns]; all finite; ridge above 0
/// Out: x [columns], the solution; after 100 Newton steps the last approximation
void least_change(std::size_t rows, std::size_t columns, const double* a, const double* b,
                  const double* low, const double* high, double ridge, double* x);

/// A quadratic function with bounds: 1/2 x^T h x - g^T x + sum of sparse_i |x_i - rest_i|, for low
/// <= x <= high. rest_i is the value at which x_i costs nothing in the last term.
struct Quadratic {
  std::size_t count = 0;
  const double* h = nullptr;  // [count, count], symmetric, positive semidefinite
  const double* g = nullptr;  // [count]
  const double *low = nullptr, *high = nullptr, *rest = nullptr;  // [count] each
  const double* sparse = nullptr;                                 // [count], 0 or more
};
/// Minimises the function by coordinate descent, with Newton steps in the coordinates that are not
/// at a bound.
/// In:  x          [count], a start between the bounds
///      tolerance  after the first Newton step the descent ends as soon as a pass over all
///                 coordinates changes none by more than this, or after 60 Newton steps
/// Out: x          the minimum, or the approximation after 60 Newton steps
void descend(const Quadratic& q, double tolerance, double* x);

/// Computes the normal matrix. Out: h [controls, controls] = J^T J
void normal_matrix(const Jacobian& jacobian, double* h);
/// Computes the gradient of a residual.
/// In:  residual [points, 3]
/// Out: g [controls] = J^T residual
void gradient(const Jacobian& jacobian, const double* residual, double* g);

}  // namespace risorius::solve
