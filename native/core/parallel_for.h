// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace risorius::core {

/// Calls body(begin, end) on ranges that cover [0, n), on up to `threads` threads (0: all cores,
/// and never more than 256). What a body throws, such as bad_alloc, is thrown again when all
/// threads have ended; of several the first.
/// In: ranges  for each thread; several where the work of one may be far more than of another: who
/// is done takes the next
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
    } catch (...) {  // beyond the thread it would end the process
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
