// SPDX-License-Identifier: MIT
// The kernels over a vector type V, compiled once for each instruction set. The including file
// defines RISORIUS_TARGET (the functions' target attribute: in a file compiled with -mavx2 the
// linker could pick an inline standard function that older CPUs cannot run) and V with
//   Reg, kLanes, zero(), set(float), load(const float*), load(const uint16_t*), store(float*, Reg),
//   madd(a, b, sum): sum + a * b, order(mask): a decoded Piece::mask, expand(from, order, to) and
//   expand_more(from, order, to): `place` and `place_more` of kernels.h for one piece, optionally
//   orders(mask): another decoded form, faster if many frames use it; kBlocks and kBatchBlocks:
//   most registers of rows that one call of block() or batch_block() sums; kBatchFrames: frames
//   that one call of batch_block() computes; Parts: like OneByOne of rotations_body.h; Skin: like S
//   of skin_body.h.
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "simd/byte_order_body.h"
#include "simd/kernels.h"
#include "simd/rotations_body.h"
#include "simd/skin_body.h"

namespace risorius::simd {

namespace {

// The sums of some frames: sums[f][r] is register r of the rows of frame f. The loops are unrolled
// by templates, because gcc 12 keeps sums of a loop in memory.
template <class Frames, class Rows>
struct BlockSums;
template <std::size_t... kFrame, std::size_t... kRow>
struct BlockSums<std::index_sequence<kFrame...>, std::index_sequence<kRow...>> {
  V::Reg sums[sizeof...(kFrame)][sizeof...(kRow)];

  RISORIUS_INLINE void clear(std::size_t f) { ((sums[f][kRow] = V::zero()), ...); }
  RISORIUS_INLINE void clear() { (clear(kFrame), ...); }
  RISORIUS_INLINE void add(std::size_t f, V::Reg weight, const V::Reg* rows) {
    ((sums[f][kRow] = V::madd(weight, rows[kRow], sums[f][kRow])), ...);
  }
  // Adds a column to the sums of all frames. In: weights  one for each frame
  template <class T>
  RISORIUS_INLINE void add(const T* column, const float* weights) {
    const V::Reg rows[] = {V::load(column + kRow * V::kLanes)...};
    (add(kFrame, V::set(weights[kFrame]), rows), ...);
  }
  RISORIUS_INLINE void store(std::size_t f, float* out) const {
    (V::store(out + kRow * V::kLanes, sums[f][kRow]), ...);
  }
  RISORIUS_INLINE void store(float* out, std::size_t stride) const {
    (store(kFrame, out + kFrame * stride), ...);
  }
};
template <std::size_t kFrameCount, std::size_t kCount>
using Block = BlockSums<std::make_index_sequence<kFrameCount>, std::make_index_sequence<kCount>>;

template <int kCount, class T>
RISORIUS_TARGET void block(const T* values, const Column* columns, std::size_t n,
                           const float* weights, float* out) {
  Block<1, kCount> sums;
  sums.clear();
  for (std::size_t i = 0; i < n; ++i) {
    sums.add(values + columns[i].offset, weights + columns[i].weight);
  }
  sums.store(out, 0);
}

// Sums columns for V::kBatchFrames frames. Each value is read once for all of these frames.
template <int kCount, class T>
RISORIUS_TARGET void batch_block(const T* values, const Column* columns, std::size_t n,
                                 const float* weights, float* out, std::size_t stride) {
  Block<V::kBatchFrames, kCount> sums;
  sums.clear();
  for (std::size_t i = 0; i < n; ++i) {
    sums.add(values + columns[i].offset, weights + std::size_t{columns[i].weight} * kFrames);
  }
  sums.store(out, stride);
}

template <class T, int... kCounts>
constexpr auto block_table(std::integer_sequence<int, kCounts...>) {
  return std::array{&block<kCounts + 1, T>...};
}
template <class T, int... kCounts>
constexpr auto batch_block_table(std::integer_sequence<int, kCounts...>) {
  return std::array{&batch_block<kCounts + 1, T>...};
}

// Divides the registers of the rows into the smallest number of blocks of at most `most` registers
// and about equal size, and calls f(first register, number of registers) for each block.
template <class F>
void for_blocks(std::size_t rows, std::size_t most, F f) {
  const std::size_t all = (rows + V::kLanes - 1) / V::kLanes, blocks = (all + most - 1) / most;
  for (std::size_t b = 0, at = 0; b < blocks; ++b) {
    const std::size_t count = (all - at) / (blocks - b);
    f(at, count);
    at += count;
  }
}

template <class T>
void columns(const T* values, const Column* list, std::size_t n, const float* weights, float* out,
             std::size_t rows) {
  static constexpr auto kTable =
      block_table<T>(std::make_integer_sequence<int, static_cast<int>(V::kBlocks)>{});
  for_blocks(rows, V::kBlocks, [&](std::size_t at, std::size_t count) {
    kTable[count - 1](values + at * V::kLanes, list, n, weights, out + at * V::kLanes);
  });
}

// to = sums + weight * values, for kWidest numbers.
template <class T>
RISORIUS_INLINE void add(V::Reg weight, const T* values, const float* sums, float* to) {
  for (std::size_t l = 0; l < kWidest; l += V::kLanes) {
    V::store(to + l, V::madd(weight, V::load(values + l), V::load(sums + l)));
  }
}

template <class T>
RISORIUS_TARGET void add_columns(const T* values, const Addend* columns, std::size_t n,
                                 float weight, const Sums& sums) {
  const V::Reg weights = V::set(weight);
  const Sums all = sums;
  for (const Addend* at = columns; at < columns + n && at->group < all.groups; ++at) {
    const T* from = values + at->offset;
    const Rows run = all.runs[at->group];
    all.added[at->group] = 1;
    float* to = all.values + run.begin;
    std::size_t r = 0;
    for (; r + kWidest <= run.count; r += kWidest) add(weights, from + r, to + r, to + r);
    if (r == run.count) continue;
    float last[kWidest];
    add(weights, from + r, to + r, last);
    for (std::size_t l = 0; r < run.count; ++l, ++r) to[r] = last[l];
  }
}

template <class T>
void batch_columns(const T* values, const Column* list, std::size_t n, const float* weights,
                   float* out, std::size_t stride, std::size_t rows) {
  static constexpr auto kTable =
      batch_block_table<T>(std::make_integer_sequence<int, static_cast<int>(V::kBatchBlocks)>{});
  for (std::size_t f = 0; f < kFrames; f += V::kBatchFrames) {
    for_blocks(rows, V::kBatchBlocks, [&](std::size_t at, std::size_t count) {
      kTable[count - 1](values + at * V::kLanes, list, n, weights + f,
                        out + f * stride + at * V::kLanes, stride);
    });
  }
}

template <class Set, bool kMany>
RISORIUS_INLINE auto order_of(std::uint32_t mask) {
  if constexpr (kMany && requires { Set::orders(mask); }) {
    return Set::orders(mask);
  } else {
    return Set::order(mask);
  }
}

// Places the pieces in all frames. Each mask is decoded only once. kMore: true as place_more, false
// as place of kernels.h; kMany: there are several frames.
template <bool kMore, bool kMany>
RISORIUS_INLINE void place_in(const Piece* pieces, std::size_t n, PlacedFrames frames) {
  for (std::size_t i = 0; i < n; ++i) {
    const auto order = order_of<V, kMany>(pieces[i].mask);
    const float* from = frames.from + pieces[i].from;
    float* to = frames.to + (kMore ? pieces[i].block : i) * kPlaces;
    for (std::size_t f = 0; f < frames.count; ++f) {
      kMore ? V::expand_more(from, order, to) : V::expand(from, order, to);
      from += frames.from_stride;
      to += frames.to_stride;
    }
  }
}

// A single frame has its own branch, because it needs no loop over frames.
template <bool kMore>
RISORIUS_TARGET void place(const Piece* pieces, std::size_t n, const PlacedFrames& frames) {
  if (frames.count == 1) {
    place_in<kMore, false>(pieces, n, {frames.from, 0, frames.to, 0, 1});
  } else {
    place_in<kMore, true>(pieces, n, frames);
  }
}

constexpr Kernels make_kernels(const char* name, FewColumns few = {}) {
  return {name,
          columns<float>,
          columns<std::uint16_t>,
          add_columns<float>,
          add_columns<std::uint16_t>,
          batch_columns<float>,
          batch_columns<std::uint16_t>,
          place<false>,
          place<true>,
          quaternions<V::Parts>,
          skin_rows<V::Skin>,
          skin<V::Skin>,
          native_u16,
          native_u32,
          native_f32,
          few};
}

}  // namespace

}  // namespace risorius::simd
