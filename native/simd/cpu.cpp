// SPDX-License-Identifier: MIT
#include "simd/cpu.h"

#if defined(_MSC_VER) && (defined(_M_X64) || defined(_M_IX86))
#include <immintrin.h>
#include <intrin.h>
#endif

namespace risorius::simd {

#if defined(_MSC_VER) && (defined(_M_X64) || defined(_M_IX86))
bool cpu_has_avx2_fma() {
  int leaf1[4], leaf7[4];
  __cpuidex(leaf1, 1, 0);
  const bool os_saves = (leaf1[2] & (1 << 27)) != 0 && (_xgetbv(0) & 6) == 6;
  const bool fma = (leaf1[2] & (1 << 12)) != 0;
  __cpuidex(leaf7, 7, 0);
  return os_saves && fma && (leaf7[1] & (1 << 5)) != 0;
}
#elif defined(__x86_64__) || defined(__i386__)
bool cpu_has_avx2_fma() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
}
#else
bool cpu_has_avx2_fma() { return false; }
#endif

}  // namespace risorius::simd
