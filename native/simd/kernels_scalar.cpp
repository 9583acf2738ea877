// SPDX-License-Identifier: MIT
// The kernels in plain C++, with a fixed order of operations, so that the bits are the same on
// every machine.
#include "simd/half.h"
#include "simd/kernels.h"

#define RISORIUS_TARGET
#include "simd/byte_order_body.h"
#include "simd/kernels_inline.h"
#include "simd/rotations_body.h"
#include "simd/skin_body.h"

namespace risorius::simd {

namespace {

float widened(float v) { return v; }
float widened(std::uint16_t v) { return from_half(v); }

template <class T>
void columns(const T* values, const Column* list, std::size_t n, const float* weights, float* out,
             std::size_t rows) {
  for (std::size_t r = 0; r < rows; ++r) out[r] = 0.0f;
  for (std::size_t i = 0; i < n; ++i) {
    const T* column = values + list[i].offset;
    const float weight = weights[list[i].weight];
    for (std::size_t r = 0; r < rows; ++r) out[r] += weight * widened(column[r]);
  }
}

template <class T>
void add_columns(const T* values, const Addend* columns, std::size_t n, float weight,
                 const Sums& sums) {
  for (std::size_t i = 0; i < n && columns[i].group < sums.groups; ++i) {
    const T* column = values + columns[i].offset;
    const Rows run = sums.runs[columns[i].group];
    sums.added[columns[i].group] = 1;
    float* to = sums.values + run.begin;
    for (std::size_t r = 0; r < run.count; ++r) to[r] += weight * widened(column[r]);
  }
}

template <class T>
void batch_columns(const T* values, const Column* list, std::size_t n, const float* weights,
                   float* out, std::size_t stride, std::size_t rows) {
  for (std::size_t f = 0; f < kFrames; ++f) {
    float* to = out + f * stride;
    for (std::size_t r = 0; r < rows; ++r) to[r] = 0.0f;
    for (std::size_t i = 0; i < n; ++i) {
      const T* column = values + list[i].offset;
      const float weight = weights[std::size_t{list[i].weight} * kFrames + f];
      for (std::size_t r = 0; r < rows; ++r) to[r] += weight * widened(column[r]);
    }
  }
}

void place(const Piece* pieces, std::size_t n, const PlacedFrames& frames) {
  for (std::size_t f = 0; f < frames.count; ++f) {
    float* to = frames.to + f * frames.to_stride;
    for (std::size_t i = 0; i < n; ++i, to += kPlaces) {
      const float* next = frames.from + f * frames.from_stride + pieces[i].from;
      for (std::size_t p = 0; p < kPlaces; ++p) {
        const bool taken = ((pieces[i].mask >> p) & 1u) != 0;
        to[p] = taken ? *next : 0.0f;
        next += taken ? 1 : 0;
      }
    }
  }
}

void place_more(const Piece* pieces, std::size_t n, const PlacedFrames& frames) {
  for (std::size_t f = 0; f < frames.count; ++f) {
    const float* from = frames.from + f * frames.from_stride;
    float* to = frames.to + f * frames.to_stride;
    for (std::size_t i = 0; i < n; ++i) {
      place_bits(from + pieces[i].from, pieces[i].mask, to + pieces[i].block * kPlaces);
    }
  }
}

struct Skin {
  struct Sum {
    float m[12];
  };
  using Weights = const float*;
  static constexpr std::size_t kTogether = 1;
  static Sum zero() { return {}; }
  static const float* weights(const float* four) { return four; }
  template <std::size_t kWeight>
  static void add(Sum& sum, const float* weights, const float* row) {
    for (std::size_t i = 0; i < 12; ++i) sum.m[i] += weights[kWeight] * row[i];
  }
  static void finish(const Sum& sum, const float* point, float* out) {
    const float x = point[0], y = point[1], z = point[2], from[3] = {x, y, z};
    for (std::size_t r = 0; r < 3; ++r) {
      const float* m = sum.m + 4 * r;
      out[r] = from[r] + ((m[0] * x + m[1] * y) + (m[2] * z + m[3]));
    }
  }
  static void pack(const float* matrix, float* row) { pack_rows(matrix, row); }
};

}  // namespace

const Kernels& scalar_kernels() {
  static constexpr Kernels kernels{"scalar",
                                   columns<float>,
                                   columns<std::uint16_t>,
                                   add_columns<float>,
                                   add_columns<std::uint16_t>,
                                   batch_columns<float>,
                                   batch_columns<std::uint16_t>,
                                   place,
                                   place_more,
                                   quaternions<OneByOne>,
                                   skin_rows<Skin>,
                                   skin<Skin>,
                                   native_u16,
                                   native_u32,
                                   native_f32};
  return kernels;
}

}  // namespace risorius::simd
