// SPDX-License-Identifier: MIT
// Tests of results, budgets and containers of numbers.
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <new>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/aligned.h"
#include "core/array.h"
#include "core/budget.h"
#include "core/buffer.h"
#include "core/finite.h"
#include "core/result.h"

namespace risorius::core {
namespace {

TEST(Result, HoldsAValueOrAnError) {
  Result<std::string> good = std::string("face");
  ASSERT_TRUE(good.has_value());
  EXPECT_EQ(*good, "face");
  EXPECT_EQ(good->size(), 4u);
  const Result<std::string> bad = fail(ErrorCode::kInvalidIndex, "a.b", "no such", 7);
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, ErrorCode::kInvalidIndex);
  EXPECT_EQ(bad.error().describe(), "no such [a.b] (byte 7)");
}

TEST(Result, AnErrorMovesOnIntoAResultOfAnotherType) {
  Result<int> inner = fail(ErrorCode::kIoRead, "", "cut");
  const Result<std::string> outer = std::move(inner).propagate();
  ASSERT_FALSE(outer.has_value());
  EXPECT_EQ(outer.error().code, ErrorCode::kIoRead);
  EXPECT_EQ(outer.error().describe(), "cut") << "neither a field nor an offset";
}

TEST(Result, AValueThatIsOnlyMovedComesOut) {
  Result<std::unique_ptr<int>> held = std::make_unique<int>(5);
  const std::unique_ptr<int> out = std::move(held).value();
  EXPECT_EQ(*out, 5);
}

TEST(Result, EveryCodeHasANameOfItsOwn) {
  std::set<std::string> names;
  constexpr int kLast = static_cast<int>(ErrorCode::kInvalidArgument);
  for (int code = 0; code <= kLast; ++code) names.insert(to_string(static_cast<ErrorCode>(code)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(kLast) + 1);
  EXPECT_FALSE(names.contains("unknown"));
  EXPECT_EQ(std::string(to_string(static_cast<ErrorCode>(kLast + 1))), "unknown");
}

TEST(Budget, GivesExactlyWhatItHas) {
  Budget budget("compiling", 100, 3);
  EXPECT_TRUE(budget.take_bytes(60, "a"));
  EXPECT_TRUE(budget.take_bytes(40, "a"));
  EXPECT_TRUE(budget.take_steps(3, "b"));
  EXPECT_EQ(budget.bytes(), 100u);
  EXPECT_EQ(budget.steps(), 3u);
  const Status bytes = budget.take_bytes(1, "joints");
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().code, ErrorCode::kLimitExceeded);
  EXPECT_EQ(bytes.error().where, "joints");
  EXPECT_EQ(bytes.error().message,
            "compiling takes at least 101 bytes, the limit for an input of this size is 100");
  const Status steps = budget.take_steps(2, "graph");
  ASSERT_FALSE(steps);
  EXPECT_EQ(steps.error().message,
            "compiling takes at least 5 steps, the limit for an input of this size is 3");
}

TEST(Budget, SumsThatWrapAreRefusedAndNotForgotten) {
  Budget budget("s", 100, 100);
  EXPECT_FALSE(budget.take_bytes(Budget::kUnlimited - 1, "a"));
  EXPECT_FALSE(budget.take_bytes(5, "a")) << "3 after wrapping";
  EXPECT_FALSE(budget.take_bytes(0, "a")) << "what was refused counts";
  Budget unlimited("s", Budget::kUnlimited, Budget::kUnlimited);
  EXPECT_TRUE(unlimited.take_bytes(Budget::kUnlimited, "a"));
  EXPECT_TRUE(unlimited.take_bytes(Budget::kUnlimited, "a"));
}

TEST(Buffer, KeepsWhatItHasWhenItGrows) {
  Buffer<std::uint16_t> buffer(3);
  EXPECT_EQ(buffer.capacity(), 3u) << "exactly, the first time";
  for (std::uint16_t i = 0; i < 3; ++i) buffer[i] = i;
  buffer.resize(4);
  EXPECT_EQ(buffer.size(), 4u);
  EXPECT_EQ(buffer.capacity(), 4u) << "3 and half as many again, but at least what is wanted";
  buffer.resize(5);
  EXPECT_EQ(buffer.capacity(), 6u);
  for (std::uint16_t i = 0; i < 3; ++i) EXPECT_EQ(buffer[i], i);
  const std::uint16_t* before = buffer.data();
  buffer.resize(2);
  EXPECT_EQ(buffer.data(), before) << "shrinking moves nothing";
  EXPECT_EQ(buffer.capacity(), 6u);
}

TEST(Buffer, HandsItsMemoryOverAndIsEmptyThen) {
  Buffer<float> buffer(2);
  buffer.reserve(1000);
  EXPECT_EQ(buffer.size(), 2u);
  EXPECT_EQ(buffer.capacity(), 1000u);
  buffer[0] = 1.5f;
  buffer[1] = -2.0f;
  const std::shared_ptr<const float> values = buffer.release();
  EXPECT_EQ(values.get()[0], 1.5f);
  EXPECT_EQ(values.get()[1], -2.0f);
  EXPECT_EQ(buffer.size(), 0u);
  EXPECT_EQ(buffer.capacity(), 0u);
  buffer.resize(1);  // the buffer is usable again
  buffer[0] = 3.0f;
  EXPECT_EQ(values.get()[0], 1.5f);
  EXPECT_EQ(Buffer<float>().release(), nullptr);
}

TEST(Buffer, ASizeThatWrapsIsNoMemory) {
  Buffer<double> buffer;
  EXPECT_THROW(buffer.resize(std::numeric_limits<std::size_t>::max() / 8 + 1), std::bad_alloc);
  EXPECT_EQ(buffer.size(), 0u);
}

TEST(Array, CopiesShareOneBufferThatOutlivesThem) {
  Buffer<float> buffer(2);
  buffer[0] = 1.0f;
  buffer[1] = 2.0f;
  std::shared_ptr<const void> owner;
  const float* first = nullptr;
  {
    const Array<float> array(std::move(buffer));
    const Array<float> copy = array;
    EXPECT_EQ(copy.data(), array.data());
    first = copy.data();
    owner = copy.owner();
  }
  EXPECT_EQ(first[1], 2.0f);
}

TEST(Array, WhatWasMovedFromIsEmpty) {
  Array<int> from{1, 2, 3};
  Array<int> to = std::move(from);
  EXPECT_EQ(to, (Array<int>{1, 2, 3}));
  // NOLINT(bugprone-use-after-move): the test is about the moved-from value.
  EXPECT_TRUE(from.empty());
  Array<int> assigned{9};
  assigned = std::move(to);
  EXPECT_EQ(assigned, (Array<int>{1, 2, 3}));
  EXPECT_TRUE(to.empty());  // NOLINT(bugprone-use-after-move)
}

TEST(Array, IsEqualByItsNumbers) {
  EXPECT_EQ((Array<int>{1, 2}), Array<int>(std::vector{1, 2}));
  EXPECT_FALSE((Array<int>{1, 2}) == (Array<int>{1, 3}));
  EXPECT_FALSE((Array<int>{1, 2}) == (Array<int>{1, 2, 3}));
  EXPECT_EQ(Array<int>(), Array<int>(std::vector<int>()));
}

TEST(PlanarArray, ThePlanesLieOneAfterTheOther) {
  const Vec3Array points{{1, 2, 10, 20, 100, 200}};
  EXPECT_EQ(points.count(), 2u);
  EXPECT_EQ(points.at(1, 0), 2.0f);
  EXPECT_EQ(points.at(0, 2), 100.0f);
  EXPECT_EQ(points.plane(1)[1], 20.0f);
  EXPECT_EQ(points.plane(1).size(), 2u);
}

TEST(List, CopiesAreDeepAndAnElementOutlivesItsList) {
  List<std::string> list(std::vector<std::string>{"a", "b"});
  List<std::string> copy = list;
  copy[0] = "changed";
  EXPECT_EQ(list[0], "a");
  EXPECT_FALSE(list == copy);
  const std::shared_ptr<std::string> element = list.element_ptr(1);
  list = List<std::string>();
  EXPECT_TRUE(list.empty());
  EXPECT_EQ(*element, "b");
}

TEST(Aligned, BeginsOnACacheLine) {
  for (const std::size_t size : {1u, 63u, 64u, 5000u}) {
    const AlignedVector<float> values(size);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(values.data()) % 64, 0u) << size;
  }
}

TEST(Aligned, PagesAreZeroWhereThatIsAsked) {
  for (const std::size_t size : {std::size_t{0}, std::size_t{100}, std::size_t{5} << 20}) {
    const std::shared_ptr<std::uint8_t> pages = allocate_pages(size);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(pages.get()) % 64, 0u) << size;
    std::size_t set = 0;
    for (std::size_t i = 0; i < size; ++i) set += pages.get()[i] != 0;
    EXPECT_EQ(set, 0u) << size;
  }
}

template <typename Number>
class Finite : public testing::Test {};
using Numbers = testing::Types<float, double>;
TYPED_TEST_SUITE(Finite, Numbers);

TYPED_TEST(Finite, OneInfinityOrNaNAnywhereIsFound) {
  using Limits = std::numeric_limits<TypeParam>;
  std::vector<TypeParam> values = {0, -0.0f, Limits::max(), Limits::lowest(), Limits::denorm_min()};
  EXPECT_TRUE(all_finite(std::span<const TypeParam>(values)));
  EXPECT_TRUE(all_finite(std::span<const TypeParam>()));
  for (const TypeParam bad : {Limits::infinity(), -Limits::infinity(), Limits::quiet_NaN()}) {
    for (std::size_t place = 0; place < values.size(); ++place) {
      std::vector<TypeParam> broken = values;
      broken[place] = bad;
      EXPECT_FALSE(all_finite(std::span<const TypeParam>(broken))) << bad << " at " << place;
    }
  }
}

}  // namespace
}  // namespace risorius::core
