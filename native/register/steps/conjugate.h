// SPDX-License-Identifier: MIT
// Conjugate gradients, preconditioned by the known factors of a similar system.
#pragma once

#include <Eigen/Core>

namespace risorius::registering::steps {

/// Solves apply(x) = right by conjugate gradients. The matrix and the preconditioner are symmetric
/// positive definite.
/// In: apply    the product of the matrix and x
///     nearly   the preconditioner: solves a similar system
///     x        a guess; becomes the solution
///     rounds   largest number of rounds
/// Source: Hestenes and Stiefel, "Methods of Conjugate Gradients for Solving Linear Systems" (1952)
template <class Apply, class Nearly>
void conjugate(const Apply& apply, const Nearly& nearly, const Eigen::MatrixX3d& right,
               Eigen::MatrixX3d& x, int rounds) {
  constexpr double kEnough = 1e-6;  // of the first squared residual in the preconditioner's norm
  Eigen::MatrixX3d rest = right - apply(x), near = nearly(rest), way = near;
  double left = rest.cwiseProduct(near).sum();
  const double first = left;
  for (int round = 0; round < rounds && left > kEnough * first && left > 0; ++round) {
    const Eigen::MatrixX3d along = apply(way);
    const double step = left / way.cwiseProduct(along).sum();
    x += step * way;
    rest -= step * along;
    near = nearly(rest);
    const double now = rest.cwiseProduct(near).sum();
    way = near + (now / left) * way;
    left = now;
  }
}

}  // namespace risorius::registering::steps
