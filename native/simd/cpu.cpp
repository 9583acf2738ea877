// SPDX-License-Identifier: MIT
#include "simd/cpu.h"

#if defined(_MSC_VER) && !defined(__clang__) && (defined(_M_X64) || defined(_M_IX86))
#include <immintrin.h>
#include <intrin.h>
#endif

namespace risorius::simd {

#if defined(_MSC_VER) && !defined(__clang__) && (defined(_M_X64) || defined(_M_IX86))

namespace {

struct Features {
  bool sse4, avx2, avx512;
};

Features detect() {
  int leaf1[4], leaf7[4];
  __cpuidex(leaf1, 1, 0);
  __cpuidex(leaf7, 7, 0);
  const auto has = [](int word, int bit) { return (word & (1 << bit)) != 0; };
  const unsigned long long saved = has(leaf1[2], 27) ? _xgetbv(0) : 0;
  const bool avx = (saved & 6) == 6, wide = (saved & 0xE6) == 0xE6;
  const bool avx2 = avx && has(leaf1[2], 12) && has(leaf1[2], 29) && has(leaf7[1], 5);
  return {has(leaf1[2], 19), avx2,
          avx2 && wide && has(leaf7[1], 16) && has(leaf7[1], 17) && has(leaf7[1], 30) &&
              has(leaf7[1], 31)};
}

}  // namespace

bool cpu_has_sse4() { return detect().sse4; }
bool cpu_has_avx2() { return detect().avx2; }
bool cpu_has_avx512() { return detect().avx512; }

#elif defined(__x86_64__) || defined(__i386__)

bool cpu_has_sse4() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("sse4.1") != 0;
}
// Every CPU with AVX2 has F16C, which older compilers cannot ask for.
bool cpu_has_avx2() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
}
bool cpu_has_avx512() {
  return cpu_has_avx2() && __builtin_cpu_supports("avx512f") != 0 &&
         __builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
         __builtin_cpu_supports("avx512vl") != 0;
}

#else

bool cpu_has_sse4() { return false; }
bool cpu_has_avx2() { return false; }
bool cpu_has_avx512() { return false; }

#endif

}  // namespace risorius::simd
