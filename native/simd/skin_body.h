// SPDX-License-Identifier: MIT
// The skinning kernel over a type S, compiled once for each instruction set. S has
//   Sum: the weighted sum of a vertex's matrices; zero(): an empty Sum; kTogether: number of
//   vertices whose influences are added in turn, 1, 2 or 4, so that no addition waits for the one
//   before; Weights, weights(const float*): loads four weights; add<i>(sum, weights, row): adds
//   weight i times a row; finish(sum, point, out): writes point + sum * point, and optionally
//   finish_four(sums, points, out): the same for four consecutive vertices; pack(matrix, row):
//   writes a bone's matrix minus the identity as a row of skin_rows (kernels.h).
// Include it after RISORIUS_TARGET.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include "simd/kernels.h"
#include "simd/kernels_inline.h"

namespace risorius::simd {

namespace {

// Adds four influences of a vertex to its sum, one after the other.
template <class S, std::size_t... kInfluence>
RISORIUS_INLINE void add_four(typename S::Sum& sum, const float* rows, const std::uint16_t* bones,
                              const float* weights, std::index_sequence<kInfluence...>) {
  const typename S::Weights all = S::weights(weights);
  if constexpr (S::kTogether == kSkinGroup && std::endian::native == std::endian::little) {
    // One read gets the indices of all four bones, because reads take most of the time.
    std::uint64_t four;
    std::memcpy(&four, bones, sizeof four);
    (S::template add<kInfluence>(
         sum, all,
         rows + std::size_t{static_cast<std::uint16_t>(four >> (16 * kInfluence))} * kSkinRow),
     ...);
  } else {
    (S::template add<kInfluence>(sum, all, rows + std::size_t{bones[kInfluence]} * kSkinRow), ...);
  }
}

// Computes the sums of all influences of sizeof...(kVertex) neighbouring vertices of a group.
// In: fours  number of influences of each vertex, divided by four
template <class S, std::size_t... kVertex>
RISORIUS_INLINE void add_all(typename S::Sum* sums, const float* rows, const std::uint16_t* bones,
                             const float* weights, std::size_t fours,
                             std::index_sequence<kVertex...>) {
  typename S::Sum own[] = {(static_cast<void>(kVertex), S::zero())...};
  for (; fours > 0; --fours, bones += 4 * kSkinGroup, weights += 4 * kSkinGroup) {
    (add_four<S>(own[kVertex], rows, bones + 4 * kVertex, weights + 4 * kVertex,
                 std::make_index_sequence<4>{}),
     ...);
  }
  ((sums[kVertex] = own[kVertex]), ...);
}

template <class S>
RISORIUS_INLINE void add_group(typename S::Sum* sums, const float* rows, const std::uint16_t* bones,
                               const float* weights, std::size_t fours) {
  for (std::size_t v = 0; v < kSkinGroup; v += S::kTogether) {
    add_all<S>(sums + v, rows, bones + 4 * v, weights + 4 * v, fours,
               std::make_index_sequence<S::kTogether>{});
  }
}

template <class S, std::size_t... kVertex>
RISORIUS_INLINE void finish_group(const typename S::Sum* sums, const std::uint16_t* vertices,
                                  const float* points, float* out,
                                  std::index_sequence<kVertex...>) {
  if constexpr (requires { S::finish_four(sums, points, out); }) {
    if (vertices[3] - vertices[0] == 3) {  // they ascend, so these four are consecutive
      const std::size_t at = std::size_t{vertices[0]} * 3;
      return S::finish_four(sums, points + at, out + at);
    }
  }
  (S::finish(sums[kVertex], points + std::size_t{vertices[kVertex]} * 3,
             out + std::size_t{vertices[kVertex]} * 3),
   ...);
}

RISORIUS_INLINE void copy_points(const std::uint16_t* vertices, std::size_t n, const float* points,
                                 float* out) {
  for (; n > 0; --n, ++vertices) {
    for (std::size_t i = std::size_t{*vertices} * 3, end = i + 3; i < end; ++i) out[i] = points[i];
  }
}

template <class S>
RISORIUS_TARGET void skin(const float* rows, const SkinPart& part, const float* points,
                          float* out) {
  const std::uint16_t* vertices = part.vertices;
  const std::uint16_t* bones = part.bones;
  const float* weights = part.weights;
  for (const SkinRun* run = part.runs; run < part.runs + part.run_count; ++run) {
    const std::size_t fours = run->fours, step = fours * 4 * kSkinGroup;
    std::size_t left = run->vertices;
    if (fours == 0) {
      copy_points(vertices, left, points, out);
      vertices += left;
      continue;
    }
    typename S::Sum sums[kSkinGroup];
    for (; left >= kSkinGroup; left -= kSkinGroup) {
      add_group<S>(sums, rows, bones, weights, fours);
      finish_group<S>(sums, vertices, points, out, std::make_index_sequence<kSkinGroup>{});
      vertices += kSkinGroup, bones += step, weights += step;
    }
    if (left > 0) {
      add_group<S>(sums, rows, bones, weights, fours);
      for (std::size_t v = 0; v < left; ++v) {
        const std::size_t at = std::size_t{vertices[v]} * 3;
        S::finish(sums[v], points + at, out + at);
      }
      vertices += left, bones += step, weights += step;
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

// Stores a matrix by rows, for vectors of four floats.
RISORIUS_INLINE void pack_rows(const float* matrix, float* row) {
  for (std::size_t i = 0; i < 12; ++i) row[i] = matrix[i];
  for (std::size_t i = 12; i < kSkinRow; ++i) row[i] = 0.0f;
}
// Stores a matrix by columns, each followed by a 0, for wider vectors: these multiply the columns
// by the coordinates of a point, and then need few additions.
RISORIUS_INLINE void pack_columns(const float* matrix, float* row) {
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t r = 0; r < 3; ++r) row[4 * c + r] = matrix[4 * r + c];
    row[4 * c + 3] = 0.0f;
  }
}

}  // namespace

}  // namespace risorius::simd
