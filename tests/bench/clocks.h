// SPDX-License-Identifier: MIT
// Measures durations by clocks that the benchmark library lacks.
#pragma once

#include <benchmark/benchmark.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <vector>

namespace risorius::bench {

template <class F>
double wall_seconds_of(F f) {
  const auto start = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The processor time in seconds that this process takes during f, summed over its threads. Time
/// that the system gave to other processes does not count. On a system without a clock of processor
/// time, the wall time of f.
template <class F>
double own_seconds_of(F f) {
#ifdef CLOCK_PROCESS_CPUTIME_ID
  const auto now = [] {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  };
  const double start = now();
  f();
  return now() - start;
#else
  return wall_seconds_of(f);
#endif
}

/// Writes to 256 MB, more than all caches have, so that they lose their content.
inline void empty_caches() {
  static std::vector<std::uint64_t> memory((std::size_t{256} << 20) / 8, 1);
  for (std::size_t i = 0; i < memory.size(); i += 8) ++memory[i];
  benchmark::ClobberMemory();
}

}  // namespace risorius::bench
