// SPDX-License-Identifier: MIT
// Least squares between bounds.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/probe.h"

namespace risorius::solve {

/// The x between low and high with the least |a x - b|^2 + ridge |x|^2: with a small ridge, of all
/// that come as near to b the shortest. Few rows and many columns, as of a drag: it goes by the
/// dual, which has as many unknowns as rows. There x is y's image clip(a^T y / ridge, low, high),
/// and y the zero of y + a x(y) - b, the slope of a convex function: Newton's method with halved
/// steps. In:  a [rows, columns], b [rows], low <= high [columns]; all finite; ridge above 0 Out: x
/// [columns]
void least_change(std::size_t rows, std::size_t columns, const double* a, const double* b,
                  const double* low, const double* high, double ridge, double* x);

/// A quadratic between bounds: 1/2 x^T h x - g^T x + sum of sparse_i |x_i - rest_i|.
struct Quadratic {
  std::size_t count = 0;
  const double* h = nullptr;  // [count, count], symmetric, not negative
  const double* g = nullptr;  // [count]
  const double *low = nullptr, *high = nullptr, *rest = nullptr;
  const double* sparse = nullptr;  // from 0
};
/// Its least x, by coordinate descent, with Newton steps among the coordinates that are at no
/// bound. In:  x  [count], a start between the bounds
///     tolerance  of a coordinate
/// Out: x
void descend(const Quadratic& q, double tolerance, double* x);

/// Out: h [controls, controls] = J^T J
void normal_matrix(const Jacobian& jacobian, double* h);
/// In:  residual [points, 3]
/// Out: g [controls] = J^T residual
void gradient(const Jacobian& jacobian, const double* residual, double* g);

}  // namespace risorius::solve
