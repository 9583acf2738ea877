// SPDX-License-Identifier: MIT
// Least squares with bounds on the unknowns: least_change() solves the dual problem, which has one
// unknown for each row, and descend() minimises a quadratic function by coordinate descent with
// Newton steps.
#include "solve/bounded.h"

#include <algorithm>
#include <cmath>

namespace risorius::solve {

namespace {

/// Solves m x = b for a symmetric positive definite m [n, n], of which only the lower triangle is
/// read, and which is overwritten. An unknown whose pivot is 0 or, by rounding, negative gets the
/// value 0. In: x  the right side b. Out: x  the solution
void solve_symmetric(std::size_t n, double* m, double* x) {
  for (std::size_t j = 0; j < n; ++j) {
    double* row = m + j * n;
    for (std::size_t i = 0; i <= j; ++i) {
      const double* other = m + i * n;
      double sum = row[i];
      for (std::size_t k = 0; k < i; ++k) sum -= row[k] * other[k];
      if (i < j) {
        row[i] = other[i] > 0.0 ? sum / other[i] : 0.0;
      } else {
        row[i] = sum > 0.0 ? std::sqrt(sum) : 0.0;
      }
    }
  }
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t k = 0; k < j; ++k) x[j] -= m[j * n + k] * x[k];
    x[j] = m[j * n + j] > 0.0 ? x[j] / m[j * n + j] : 0.0;
  }
  for (std::size_t j = n; j-- > 0;) {
    for (std::size_t k = j + 1; k < n; ++k) x[j] -= m[k * n + j] * x[k];
    x[j] = m[j * n + j] > 0.0 ? x[j] / m[j * n + j] : 0.0;
  }
}

double length(const std::vector<double>& v) {
  double sum = 0.0;
  for (const double x : v) sum += x * x;
  return std::sqrt(sum);
}

/// The dual problem of least_change, with an unknown y for each row.
struct Dual {
  std::size_t rows, columns;
  const double *a, *b, *low, *high;
  double ridge;

  /// Computes x(y) = clip(a^T y / ridge, low, high).
  /// Out: x  x(y); slope  y + a x - b, the gradient of value()
  void image(const std::vector<double>& y, double* x, std::vector<double>& slope) const {
    std::fill(x, x + columns, 0.0);
    for (std::size_t r = 0; r < rows; ++r) {
      for (std::size_t c = 0; c < columns; ++c) x[c] += a[r * columns + c] * y[r];
    }
    for (std::size_t c = 0; c < columns; ++c) x[c] = std::clamp(x[c] / ridge, low[c], high[c]);
    for (std::size_t r = 0; r < rows; ++r) {
      slope[r] = y[r] - b[r];
      for (std::size_t c = 0; c < columns; ++c) slope[r] += a[r * columns + c] * x[c];
    }
  }
  /// The value of the dual function, which is minimised.
  double value(const std::vector<double>& y) const {
    double sum = 0.0;
    for (std::size_t r = 0; r < rows; ++r) sum += y[r] * (0.5 * y[r] - b[r]);
    for (std::size_t c = 0; c < columns; ++c) {
      double t = 0.0;
      for (std::size_t r = 0; r < rows; ++r) t += a[r * columns + c] * y[r];
      const double x = std::clamp(t / ridge, low[c], high[c]);
      sum += t * x - 0.5 * ridge * x * x;
    }
    return sum;
  }
  /// A Newton step, the change of y, at the y for which image() gave x and slope.
  std::vector<double> step(const double* x, const std::vector<double>& slope) const {
    std::vector<double> m(rows * rows), out(rows);
    for (std::size_t c = 0; c < columns; ++c) {
      if (!(x[c] > low[c] && x[c] < high[c])) continue;
      for (std::size_t r = 0; r < rows; ++r) {
        const double scaled = a[r * columns + c] / ridge;
        for (std::size_t s = 0; s <= r; ++s) m[r * rows + s] += scaled * a[s * columns + c];
      }
    }
    for (std::size_t r = 0; r < rows; ++r) m[r * rows + r] += 1.0, out[r] = -slope[r];
    solve_symmetric(rows, m.data(), out.data());
    return out;
  }
};

/// The state while a Quadratic is minimised. slope is g - h x.
struct Descent {
  const Quadratic& q;
  double* x;
  std::vector<double> slope;

  explicit Descent(const Quadratic& quadratic, double* start)
      : q(quadratic), x(start), slope(quadratic.g, quadratic.g + quadratic.count) {
    for (std::size_t i = 0; i < q.count; ++i) move(i, x[i], x[i]);
  }
  void move(std::size_t i, double to, double by) {
    x[i] = to;
    if (by == 0.0) return;
    const double* row = q.h + i * q.count;
    for (std::size_t k = 0; k < q.count; ++k) slope[k] -= by * row[k];
  }
  /// Moves each coordinate in turn to its minimum. Out: the largest change of a coordinate
  double sweep() {
    double largest = 0.0;
    for (std::size_t i = 0; i < q.count; ++i) {
      const double curve = q.h[i * q.count + i];
      if (!(q.low[i] < q.high[i])) continue;
      // With t = x - rest, the function of this coordinate is 1/2 curve t^2 - pull t + sparse |t|.
      const double pull = slope[i] + curve * (x[i] - q.rest[i]);
      double to = q.rest[i];
      if (std::fabs(pull) > q.sparse[i] && curve > 0.0) {
        to += (pull - std::copysign(q.sparse[i], pull)) / curve;
      } else if (q.sparse[i] == 0.0 && curve <= 0.0) {
        to = x[i];
      }
      to = std::clamp(to, q.low[i], q.high[i]);
      largest = std::max(largest, std::fabs(to - x[i]));
      move(i, to, to - x[i]);
    }
    return largest;
  }
  /// A Newton step in the free coordinates: coordinates strictly between their bounds, except those
  /// at `rest` with a sparse cost. The step is shortened so that no coordinate crosses a bound, or
  /// its `rest` value if it has a sparse cost.
  void newton() {
    std::vector<std::size_t> loose;
    for (std::size_t i = 0; i < q.count; ++i) {
      const bool at_rest = q.sparse[i] > 0.0 && x[i] == q.rest[i];
      if (x[i] > q.low[i] && x[i] < q.high[i] && !at_rest) loose.push_back(i);
    }
    const std::size_t n = loose.size();
    std::vector<double> m(n * n), step(n);
    for (std::size_t r = 0; r < n; ++r) {
      const std::size_t i = loose[r];
      for (std::size_t s = 0; s <= r; ++s) m[r * n + s] = q.h[i * q.count + loose[s]];
      // Without this ridge, the minimum would not be unique if two controls had the same effect.
      m[r * n + r] *= 1.0 + 1e-9;
      step[r] = slope[i] - (x[i] > q.rest[i] ? q.sparse[i] : -q.sparse[i]);
    }
    solve_symmetric(n, m.data(), step.data());
    double share = 1.0;
    for (std::size_t r = 0; r < n; ++r) {
      const std::size_t i = loose[r];
      double low = q.low[i], high = q.high[i];
      if (q.sparse[i] > 0.0) (x[i] > q.rest[i] ? low : high) = q.rest[i];
      if (x[i] + step[r] < low) share = std::min(share, (low - x[i]) / step[r]);
      if (x[i] + step[r] > high) share = std::min(share, (high - x[i]) / step[r]);
    }
    for (std::size_t r = 0; r < n; ++r) {
      const std::size_t i = loose[r];
      const double to = std::clamp(x[i] + share * step[r], q.low[i], q.high[i]);
      move(i, to, to - x[i]);
    }
  }
};

}  // namespace

void least_change(std::size_t rows, std::size_t columns, const double* a, const double* b,
                  const double* low, const double* high, double ridge, double* x) {
  constexpr int kMostSteps = 100, kMostHalves = 40;
  const Dual dual{rows, columns, a, b, low, high, ridge};
  std::vector<double> y(rows, 0.0), slope(rows), tried(rows);
  const double enough = 1e-10 * length(std::vector<double>(b, b + rows));
  for (int i = 0; i < kMostSteps; ++i) {
    dual.image(y, x, slope);
    if (length(slope) <= enough) return;
    const std::vector<double> step = dual.step(x, slope);
    double down = 0.0;
    for (std::size_t r = 0; r < rows; ++r) down += slope[r] * step[r];
    const double here = dual.value(y);
    double share = 1.0;
    for (int half = 0; half < kMostHalves; ++half, share *= 0.5) {
      for (std::size_t r = 0; r < rows; ++r) tried[r] = y[r] + share * step[r];
      if (dual.value(tried) <= here + 1e-4 * share * down) break;
    }
    y = tried;
  }
  dual.image(y, x, slope);
}

void descend(const Quadratic& q, double tolerance, double* x) {
  constexpr int kMostRounds = 60, kSweeps = 4;
  Descent descent(q, x);
  for (int round = 0; round < kMostRounds; ++round) {
    double largest = 0.0;
    for (int i = 0; i < kSweeps; ++i) {
      largest = descent.sweep();
      if (largest <= tolerance) break;
    }
    if (largest <= tolerance && round > 0) return;
    descent.newton();
  }
}

void normal_matrix(const Jacobian& jacobian, double* h) {
  constexpr std::size_t kRows = 3 * Jacobian::kBlock;
  const std::size_t count = jacobian.controls;
  std::fill(h, h + count * count, 0.0);
  std::vector<float> rows, sums;
  for (const Jacobian::Block& block : jacobian.blocks) {
    const std::size_t n = block.controls.size();
    rows.assign(n * kRows, 0.0f), sums.assign(n * n, 0.0f);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t r = 0; r < kRows; ++r) rows[r * n + i] = block.values[i * kRows + r];
    }
    // Row by row, so that the inner loop adds adjacent numbers.
    for (std::size_t r = 0; r < kRows; ++r) {
      const float* row = rows.data() + r * n;
      for (std::size_t i = 0; i < n; ++i) {
        if (row[i] == 0.0f) continue;
        float* to = sums.data() + i * n;
        for (std::size_t k = 0; k <= i; ++k) to[k] += row[i] * row[k];
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      double* to = h + std::size_t{block.controls[i]} * count;
      for (std::size_t k = 0; k <= i; ++k) to[block.controls[k]] += double{sums[i * n + k]};
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < i; ++k) h[k * count + i] = h[i * count + k];
  }
}

void gradient(const Jacobian& jacobian, const double* residual, double* g) {
  std::fill(g, g + jacobian.controls, 0.0);
  for (std::size_t b = 0; b < jacobian.blocks.size(); ++b) {
    const Jacobian::Block& block = jacobian.blocks[b];
    const std::size_t first = b * Jacobian::kBlock;
    const std::size_t rows = 3 * std::min(Jacobian::kBlock, jacobian.points - first);
    for (std::size_t i = 0; i < block.controls.size(); ++i) {
      const float* column = block.values.data() + i * 3 * Jacobian::kBlock;
      double sum = 0.0;
      for (std::size_t r = 0; r < rows; ++r) sum += double{column[r]} * residual[3 * first + r];
      g[block.controls[i]] += sum;
    }
  }
}

}  // namespace risorius::solve
