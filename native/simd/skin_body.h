// SPDX-License-Identifier: MIT
// The skinning kernel over a type S, for the file of each instruction set. S has
//   Sum: what the matrices of a vertex are blended in; zero(); kInFlight: vertices at once, so that
//   one need not wait for the sums of another; kAtOnce: influences of one Weights; weights(const
//   float*); add<i>(sum, weights, row): weight i of these times a row; finish(sum, point, out);
//   pack(matrix, row): skin_rows of one matrix.
// After RISORIUS_TARGET.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "simd/kernels.h"
#include "simd/kernels_inline.h"

namespace risorius::simd {

namespace {

template <class S, std::size_t kFirst>
RISORIUS_INLINE void add_influence(typename S::Sum& sum, const float* rows,
                                   const std::uint16_t* bones, const typename S::Weights& weights) {
  S::template add<kFirst>(sum, weights, rows + std::size_t{bones[kFirst]} * kSkinRow);
}

template <class S, std::size_t... kInfluence>
RISORIUS_INLINE void add_all(typename S::Sum& sum, const float* rows, const std::uint16_t* bones,
                             const float* weights, std::index_sequence<kInfluence...>) {
  const typename S::Weights all = S::weights(weights);
  (add_influence<S, kInfluence>(sum, rows, bones, all), ...);
}

// kVertices that have as many influences each.
template <class S, std::size_t... kVertex>
RISORIUS_INLINE void skin_some(const float* rows, const std::uint16_t* bones, const float* weights,
                               std::size_t n, const std::uint16_t* vertices, const float* points,
                               float* out, std::index_sequence<kVertex...>) {
  typename S::Sum sums[] = {(static_cast<void>(kVertex), S::zero())...};
  std::size_t i = 0;
  for (; i + S::kAtOnce <= n; i += S::kAtOnce) {
    (add_all<S>(sums[kVertex], rows, bones + kVertex * n + i, weights + kVertex * n + i,
                std::make_index_sequence<S::kAtOnce>{}),
     ...);
  }
  for (; i < n; ++i) {
    (add_all<S>(sums[kVertex], rows, bones + kVertex * n + i, weights + kVertex * n + i,
                std::make_index_sequence<1>{}),
     ...);
  }
  (S::finish(sums[kVertex], points + std::size_t{vertices[kVertex]} * 3,
             out + std::size_t{vertices[kVertex]} * 3),
   ...);
}

template <class S>
RISORIUS_TARGET void skin(const float* rows, const SkinPart& part, const float* points,
                          float* out) {
  const std::uint16_t* vertices = part.vertices;
  const std::uint16_t* bones = part.bones;
  const float* weights = part.weights;
  for (const SkinRun* run = part.runs; run < part.runs + part.run_count; ++run) {
    const std::size_t n = run->influences;
    std::size_t left = run->vertices;
    if (n == 0) {
      for (; left > 0; --left, ++vertices) {
        for (std::size_t i = std::size_t{*vertices} * 3, end = i + 3; i < end; ++i) {
          out[i] = points[i];
        }
      }
      continue;
    }
    for (; left >= S::kInFlight; left -= S::kInFlight) {
      skin_some<S>(rows, bones, weights, n, vertices, points, out,
                   std::make_index_sequence<S::kInFlight>{});
      vertices += S::kInFlight, bones += S::kInFlight * n, weights += S::kInFlight * n;
    }
    for (; left > 0; --left) {
      skin_some<S>(rows, bones, weights, n, vertices, points, out, std::make_index_sequence<1>{});
      vertices += 1, bones += n, weights += n;
    }
  }
}

template <class S>
RISORIUS_TARGET void skin_rows(const float* matrices, std::size_t n, float* rows) {
  for (; n > 0; --n, matrices += 12, rows += kSkinRow) {
    float less[12];
    for (std::size_t i = 0; i < 12; ++i) less[i] = matrices[i] - (i % 5 == 0 ? 1.0f : 0.0f);
    S::pack(less, rows);
  }
}

// A matrix as it is, row after row: for vectors of four.
RISORIUS_INLINE void pack_rows(const float* matrix, float* row) {
  for (std::size_t i = 0; i < 12; ++i) row[i] = matrix[i];
  for (std::size_t i = 12; i < kSkinRow; ++i) row[i] = 0.0f;
}
// Column after column, each with a 0 behind it: for wider vectors, which multiply columns by the
// numbers of a point and have few sums left then.
RISORIUS_INLINE void pack_columns(const float* matrix, float* row) {
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t r = 0; r < 3; ++r) row[4 * c + r] = matrix[4 * r + c];
    row[4 * c + 3] = 0.0f;
  }
}

}  // namespace

}  // namespace risorius::simd
