// SPDX-License-Identifier: MIT
// Measures how fast a processor issues the skinning kernel's instructions if memory is no limit.
// For each influence, the row of its bone (the 16 floats of the bone's matrix) is multiplied by the
// weight and added to a sum in registers; the sums have no use.
#include "bench/issue.h"

#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstring>

#if (defined(__x86_64__) || defined(_M_X64)) && !defined(_MSC_VER)
#include <immintrin.h>
#define RISORIUS_WIDE
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#define RISORIUS_NEON
#endif

namespace risorius::bench {

namespace {

constexpr std::size_t kOnce = 480, kBones = 64, kRow = 16;

struct Data {
  alignas(64) float rows[kBones * kRow];
  alignas(64) float weights[kOnce];
  alignas(64) std::uint16_t bones[kOnce];
};

const Data& data() {
  static const Data made = [] {
    Data d{};
    for (std::size_t i = 0; i < kBones * kRow; ++i) d.rows[i] = 1e-3f * static_cast<float>(i % 7);
    for (std::size_t i = 0; i < kOnce; ++i) {
      d.weights[i] = 1e-3f;
      d.bones[i] = static_cast<std::uint16_t>(i * 37 % kBones);
    }
    return d;
  }();
  return made;
}

// The matrix of a bone. Its index is one of the four 16-bit fields of `four`: the field i % 4, of
// which 0 is the lowest.
const float* row(const Data& d, std::uint64_t four, std::size_t i) {
  return d.rows + std::size_t{static_cast<std::uint16_t>(four >> (16 * (i % 4)))} * kRow;
}

std::uint64_t four_bones(const Data& d, std::size_t i) {
  std::uint64_t four;
  std::memcpy(&four, d.bones + i, sizeof four);
  return four;
}

// Each of the following functions has several independent sums in registers, so that no addition
// waits for the one before.

#ifdef RISORIUS_WIDE

__attribute__((target("avx512f,avx512dq,avx512vl"))) float issue_512(const Data& d,
                                                                     std::size_t influences) {
  constexpr std::size_t kSums = 12;
  constexpr __mmask16 kAll = 0xFFFF;
  __m512 s[kSums];
  for (__m512& sum : s) sum = _mm512_setzero_ps();
  for (std::size_t done = 0; done < influences; done += kOnce) {
    benchmark::ClobberMemory();
    for (std::size_t i = 0; i < kOnce; i += kSums) {
#pragma GCC unroll 3
      for (std::size_t k = 0; k < kSums; k += 4) {
        const std::uint64_t four = four_bones(d, i + k);
        const __m512 w = _mm512_maskz_broadcast_f32x4(kAll, _mm_load_ps(d.weights + i + k));
        const __m512 each[] = {
            _mm512_maskz_permute_ps(kAll, w, 0x00), _mm512_maskz_permute_ps(kAll, w, 0x55),
            _mm512_maskz_permute_ps(kAll, w, 0xAA), _mm512_maskz_permute_ps(kAll, w, 0xFF)};
#pragma GCC unroll 4
        for (std::size_t n = 0; n < 4; ++n) {
          s[k + n] = _mm512_fmadd_ps(each[n], _mm512_load_ps(row(d, four, n)), s[k + n]);
        }
      }
    }
  }
  float sum = 0, values[16];
  for (const __m512& v : s) {
    _mm512_storeu_ps(values, v);
    sum += values[0];
  }
  return sum;
}

__attribute__((target("avx2,fma"))) float issue_256(const Data& d, std::size_t influences) {
  constexpr std::size_t kSums = 4;
  __m256 s[kSums][2];
  for (auto& sum : s) sum[0] = sum[1] = _mm256_setzero_ps();
  for (std::size_t done = 0; done < influences; done += kOnce) {
    benchmark::ClobberMemory();
    for (std::size_t i = 0; i < kOnce; i += kSums) {
      const std::uint64_t four = four_bones(d, i);
      const __m256 w = _mm256_broadcast_ps(reinterpret_cast<const __m128*>(d.weights + i));
      const __m256 each[] = {_mm256_permute_ps(w, 0x00), _mm256_permute_ps(w, 0x55),
                             _mm256_permute_ps(w, 0xAA), _mm256_permute_ps(w, 0xFF)};
#pragma GCC unroll 4
      for (std::size_t n = 0; n < 4; ++n) {
        const float* from = row(d, four, n);
        s[n][0] = _mm256_fmadd_ps(each[n], _mm256_load_ps(from), s[n][0]);
        s[n][1] = _mm256_fmadd_ps(each[n], _mm256_load_ps(from + 8), s[n][1]);
      }
    }
  }
  float sum = 0, values[8];
  for (const auto& v : s) {
    _mm256_storeu_ps(values, _mm256_add_ps(v[0], v[1]));
    sum += values[0];
  }
  return sum;
}

// Issues the skinning kernel's reads and multiply-adds in registers of four floats, as in SSE4,
// where multiplication and addition are separate instructions. Returns a sum, so that the compiler
// keeps the work.
float issue_128(const Data& d, std::size_t influences) {
  constexpr std::size_t kSums = 4;
  __m128 s[kSums][3];
  for (auto& sum : s) sum[0] = sum[1] = sum[2] = _mm_setzero_ps();
  for (std::size_t done = 0; done < influences; done += kOnce) {
    benchmark::ClobberMemory();
    for (std::size_t i = 0; i < kOnce; i += kSums) {
#pragma GCC unroll 4
      for (std::size_t k = 0; k < kSums; ++k) {
        const float* from = d.rows + std::size_t{d.bones[i + k]} * kRow;
        const __m128 w = _mm_set1_ps(d.weights[i + k]);
        for (std::size_t r = 0; r < 3; ++r) {
          s[k][r] = _mm_add_ps(s[k][r], _mm_mul_ps(w, _mm_load_ps(from + 4 * r)));
        }
      }
    }
  }
  float sum = 0, values[4];
  for (const auto& v : s) {
    _mm_storeu_ps(values, _mm_add_ps(v[0], _mm_add_ps(v[1], v[2])));
    sum += values[0];
  }
  return sum;
}

#elif defined(RISORIUS_NEON)

float issue_128(const Data& d, std::size_t influences) {
  constexpr std::size_t kSums = 8;
  float32x4_t s[kSums][3];
  for (auto& sum : s) sum[0] = sum[1] = sum[2] = vdupq_n_f32(0.0f);
  for (std::size_t done = 0; done < influences; done += kOnce) {
    benchmark::ClobberMemory();
    for (std::size_t i = 0; i < kOnce; i += kSums) {
#pragma GCC unroll 8
      for (std::size_t k = 0; k < kSums; ++k) {
        const float* from = d.rows + std::size_t{d.bones[i + k]} * kRow;
        const float32x4_t w = vld1q_dup_f32(d.weights + i + k);
        for (std::size_t r = 0; r < 3; ++r) {
          s[k][r] = vfmaq_f32(s[k][r], w, vld1q_f32(from + 4 * r));
        }
      }
    }
  }
  float sum = 0;
  for (const auto& v : s) sum += vaddvq_f32(vaddq_f32(v[0], vaddq_f32(v[1], v[2])));
  return sum;
}

#else

float issue_128(const Data& d, std::size_t influences) {
  float s[12] = {};
  for (std::size_t done = 0; done < influences; done += kOnce) {
    benchmark::ClobberMemory();
    for (std::size_t i = 0; i < kOnce; ++i) {
      const float* from = d.rows + std::size_t{d.bones[i]} * kRow;
      for (std::size_t r = 0; r < 12; ++r) s[r] += d.weights[i] * from[r];
    }
  }
  float sum = 0;
  for (const float v : s) sum += v;
  return sum;
}

#endif

}  // namespace

void issue_skin(std::string_view set, std::size_t influences) {
#ifdef RISORIUS_WIDE
  if (set == "avx512") return benchmark::DoNotOptimize(issue_512(data(), influences));
  if (set == "avx2") return benchmark::DoNotOptimize(issue_256(data(), influences));
#else
  static_cast<void>(set);
#endif
  benchmark::DoNotOptimize(issue_128(data(), influences));
}

}  // namespace risorius::bench
