// SPDX-License-Identifier: MIT
// Simplifies a flat sheet to fewer triangles. The simplified sheet has the same area, and more
// triangles near changes of an attribute.
#include "author/simplify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace risorius::author {
namespace {

constexpr std::uint32_t kCorners = 17;

/// A flat square sheet of 17 x 17 vertices, whose sides have length 1.
Surface square() {
  Surface out;
  for (std::uint32_t y = 0; y < kCorners; ++y) {
    for (std::uint32_t x = 0; x < kCorners; ++x) {
      out.positions.push_back({static_cast<float>(x) / 16.0f, static_cast<float>(y) / 16.0f, 0.0f});
    }
  }
  for (std::uint32_t y = 0; y + 1 < kCorners; ++y) {
    for (std::uint32_t x = 0; x + 1 < kCorners; ++x) {
      const std::uint32_t a = y * kCorners + x;
      out.triangles.push_back({a, a + 1, a + kCorners});
      out.triangles.push_back({a + 1, a + kCorners + 1, a + kCorners});
    }
  }
  return out;
}

double area(const Surface& surface, const std::vector<Triangle>& triangles) {
  double sum = 0.0;
  for (const Triangle& t : triangles) {
    const auto& a = surface.positions[t[0]];
    const auto& b = surface.positions[t[1]];
    const auto& c = surface.positions[t[2]];
    sum += 0.5 *
           (double{b[0] - a[0]} * double{c[1] - a[1]} - double{b[1] - a[1]} * double{c[0] - a[0]});
  }
  return sum;
}

TEST(Simplify, AFlatSheetBecomesFewTrianglesOfTheSameArea) {
  const Surface surface = square();
  auto few = simplify(surface, 20);
  ASSERT_TRUE(few) << few.error().describe();
  EXPECT_LE(few->triangles.size(), 20u);
  EXPECT_GE(few->triangles.size(), 2u);
  EXPECT_NEAR(area(surface, few->triangles), 1.0, 1e-6);
  EXPECT_NEAR(few->error, 0.0, 1e-4);
}

TEST(Simplify, WhatAnAttributeShowsIsKept) {
  Surface surface = square();
  surface.attribute_count = 1;
  for (std::uint32_t c = 0; c < surface.positions.size(); ++c) {
    // The attribute is high only in one corner of the sheet, whereas all positions lie in one
    // plane.
    const float x = surface.positions[c][0], y = surface.positions[c][1];
    surface.attributes.push_back(std::max(0.0f, 0.5f - x) * std::max(0.0f, 0.5f - y) * 4.0f);
  }
  auto some = simplify(surface, 120);
  ASSERT_TRUE(some);
  std::size_t hill = 0;
  for (const Triangle& t : some->triangles) {
    const auto low = [&](std::uint32_t c) {
      return surface.positions[c][0] <= 0.5f && surface.positions[c][1] <= 0.5f;
    };
    hill += std::all_of(t.begin(), t.end(), low) ? 1 : 0;
  }
  EXPECT_GT(2 * hill, some->triangles.size());  // over half the triangles on 1/4 of the area
}

TEST(Simplify, EnoughTrianglesChangeNothing) {
  const Surface surface = square();
  auto all = simplify(surface, surface.triangles.size());
  ASSERT_TRUE(all);
  EXPECT_EQ(all->triangles, surface.triangles);
  EXPECT_EQ(all->error, 0.0);
}

TEST(Simplify, RefusesWhatDoesNotFitTogether) {
  Surface surface = square();
  surface.attribute_count = 2;
  EXPECT_EQ(simplify(surface, 9).error().code, core::ErrorCode::kInvalidLength);
  surface.attribute_count = 33;
  EXPECT_EQ(simplify(surface, 9).error().code, core::ErrorCode::kInvalidArgument);
  surface = square();
  surface.triangles[3][1] = 289;
  EXPECT_EQ(simplify(surface, 9).error().code, core::ErrorCode::kInvalidIndex);
  surface = square();
  surface.positions[7][2] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(simplify(surface, 9).error().code, core::ErrorCode::kInvalidValue);
  surface = square();
  surface.attribute_count = 1;
  surface.attributes.assign(surface.positions.size(), std::numeric_limits<float>::infinity());
  EXPECT_EQ(simplify(surface, 9).error().code, core::ErrorCode::kInvalidValue);
}

}  // namespace
}  // namespace risorius::author
