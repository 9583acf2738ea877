// SPDX-License-Identifier: MIT
// Divides a loop into ranges that several threads compute.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace risorius::core {

/// Calls body(begin, end) on ranges that cover [0, n), on up to `threads` threads (0: all cores;
/// never more than n or 256). With one thread, the caller's thread calls body(0, n) once, even if n
/// is 0. The first exception of a body, such as bad_alloc, is thrown again after all threads have
/// ended; the other threads still compute the remaining ranges.
/// In: ranges  number of ranges per thread, 1 or more; use several if ranges may differ much in
///             work, because a thread that is done takes the next range
template <class Body>
void parallel_for(std::size_t n, std::size_t threads, const Body& body, std::size_t ranges = 1) {
  if (threads == 0) threads = std::max(1u, std::thread::hardware_concurrency());
  threads = std::min({threads, std::max<std::size_t>(n, 1), std::size_t{256}});
  if (threads <= 1) {
    body(std::size_t{0}, n);
    return;
  }
  const std::size_t count = std::min(n, threads * ranges);
  std::atomic<std::size_t> next{0};
  std::mutex lock;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (std::size_t r = next++; r < count; r = next++) {
        body(n * r / count, n * (r + 1) / count);
      }
    } catch (...) {  // an exception that leaves a thread ends the process
      const std::lock_guard held(lock);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> workers;
    workers.reserve(threads);
    for (std::size_t t = 0; t < threads; ++t) workers.emplace_back(work);
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace risorius::core
