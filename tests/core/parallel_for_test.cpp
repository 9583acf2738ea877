// SPDX-License-Identifier: MIT
// Threads share ranges: every element is visited once, and exceptions reach the caller.
#include "core/parallel_for.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace risorius::core {
namespace {

TEST(ParallelFor, EveryElementIsVisitedOnce) {
  for (const std::size_t threads : {0u, 1u, 2u, 3u, 8u, 1000u}) {
    for (const std::size_t n : {0u, 1u, 2u, 7u, 100u, 1001u}) {
      std::vector<std::atomic<int>> visits(n);
      parallel_for(n, threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) ++visits[i];
      });
      for (std::size_t i = 0; i < n; ++i) ASSERT_EQ(visits[i], 1) << n << " by " << threads;
    }
  }
}

TEST(ParallelFor, SeveralRangesOfAThreadVisitEveryElementOnce) {
  for (const std::size_t n : {1u, 7u, 1001u}) {
    std::vector<std::atomic<int>> visits(n);
    std::atomic<std::size_t> calls = 0;
    const auto visit = [&](std::size_t begin, std::size_t end) {
      ++calls;
      for (std::size_t i = begin; i < end; ++i) ++visits[i];
    };
    parallel_for(n, 3, visit, 5);
    for (std::size_t i = 0; i < n; ++i) ASSERT_EQ(visits[i], 1) << n;
    EXPECT_EQ(calls.load(), std::min(n, std::min(n, std::size_t{3}) * 5));
  }
}

TEST(ParallelFor, TakesAsManyThreadsAsAskedButNoMoreThanElementsOr256) {
  const auto threads_of = [](std::size_t n, std::size_t threads) {
    std::mutex lock;
    std::set<std::thread::id> seen;
    std::atomic<std::size_t> calls = 0;
    parallel_for(n, threads, [&](std::size_t, std::size_t) {
      ++calls;
      const std::lock_guard held(lock);
      seen.insert(std::this_thread::get_id());
    });
    EXPECT_LE(seen.size(), calls.load());
    return calls.load();
  };
  EXPECT_EQ(threads_of(100, 4), 4u);
  EXPECT_EQ(threads_of(3, 8), 3u);
  EXPECT_EQ(threads_of(5000, 5000), 256u);
  EXPECT_EQ(threads_of(0, 8), 1u) << "an empty range is one call";
}

TEST(ParallelFor, OneThreadIsTheCallersOwn) {
  std::thread::id seen;
  parallel_for(10, 1, [&](std::size_t, std::size_t) { seen = std::this_thread::get_id(); });
  EXPECT_EQ(seen, std::this_thread::get_id());
}

TEST(ParallelFor, WhatABodyThrowsIsThrownWhenAllHaveEnded) {
  std::atomic<std::size_t> done = 0;
  const auto body = [&](std::size_t begin, std::size_t end) {
    if (begin == 0) throw std::runtime_error("the first range");
    done += end - begin;
  };
  EXPECT_THROW(parallel_for(100, 4, body), std::runtime_error);
  EXPECT_EQ(done, 75u);
}

}  // namespace
}  // namespace risorius::core
