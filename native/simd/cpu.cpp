// SPDX-License-Identifier: MIT
// Asks the CPU with its instruction cpuid which instruction sets it has, and whether the operating
// system saves their registers. A leaf is an answer of cpuid: four words with a bit for each
// feature.
#include "simd/kernels.h"

#if defined(__x86_64__) || defined(__i386__) || defined(_M_X64) || defined(_M_IX86)
#define RISORIUS_X86
#if defined(_MSC_VER) && !defined(__clang__)
#include <immintrin.h>
#include <intrin.h>
#else
#include <cpuid.h>
#endif
#endif

namespace risorius::simd {

#ifdef RISORIUS_X86

// The following functions query the processor directly, because __builtin_cpu_supports always
// returns false with some compilers.
namespace {

struct Leaf {
  unsigned a = 0, b = 0, c = 0, d = 0;
};

#if defined(_MSC_VER) && !defined(__clang__)

Leaf read_leaf(int number) {
  int highest[4], words[4];
  __cpuidex(highest, 0, 0);
  if (highest[0] < number) return {};
  __cpuidex(words, number, 0);
  return {static_cast<unsigned>(words[0]), static_cast<unsigned>(words[1]),
          static_cast<unsigned>(words[2]), static_cast<unsigned>(words[3])};
}

unsigned saved_registers() { return static_cast<unsigned>(_xgetbv(0)); }

#else

Leaf read_leaf(unsigned number) {
  Leaf leaf;
  return __get_cpuid_count(number, 0, &leaf.a, &leaf.b, &leaf.c, &leaf.d) != 0 ? leaf : Leaf{};
}

// The XCR0 register: the kinds of registers that the system saves. The intrinsic _xgetbv would need
// a compiler option for the whole file.
unsigned saved_registers() {
  unsigned low = 0, high = 0;
  __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return low;
}

#endif

struct Features {
  bool sse4, avx2, avx512;
};

Features detect() {
  const Leaf first = read_leaf(1), seventh = read_leaf(7);
  const auto has = [](unsigned word, int bit) { return (word >> bit & 1) != 0; };
  // The kinds of registers that the system saves when it switches threads.
  const unsigned saved = has(first.c, 27) ? saved_registers() : 0;
  const bool avx = (saved & 0x06) == 0x06, wide = (saved & 0xE6) == 0xE6;
  const bool avx2 = avx && has(first.c, 12) && has(first.c, 29) && has(seventh.b, 5);
  return {has(first.c, 19), avx2,
          avx2 && wide && has(seventh.b, 16) && has(seventh.b, 17) && has(seventh.b, 30) &&
              has(seventh.b, 31)};
}

}  // namespace

bool cpu_has_sse4() { return detect().sse4; }
bool cpu_has_avx2() { return detect().avx2; }
bool cpu_has_avx512() { return detect().avx512; }

#else

bool cpu_has_sse4() { return false; }
bool cpu_has_avx2() { return false; }
bool cpu_has_avx512() { return false; }

#endif

}  // namespace risorius::simd
