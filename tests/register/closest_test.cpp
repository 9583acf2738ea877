// SPDX-License-Identifier: MIT
// Tests ClosestPoints: the point of a surface that is closest to a given point, and the first point
// of the surface that a ray hits.
#include "register/closest.h"

#include <gtest/gtest.h>

#include <cmath>

namespace risorius::registering {
namespace {

/// Two squares with sides of length 1 that face each other. The normal of the square at z = 0 is
/// +z, the normal of the square at z = 1 is -z.
ClosestPoints slit() {
  return ClosestPoints::make({{0, 0, 0},
                              {1, 0, 0},
                              {1, 1, 0},
                              {0, 1, 0},
                              {0, 0, 1},
                              {1, 0, 1},
                              {1, 1, 1},
                              {0, 1, 1}},
                             {{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}})
      .value();
}

TEST(Closest, IsTheNearerSquare) {
  const auto hits = slit().nearest({{0.25, 0.5, 0.4}, {2, 0.5, 0}}, {}, {}).value();
  EXPECT_LE(hits[0].triangle, 1);
  EXPECT_DOUBLE_EQ(hits[0].distance, 0.4);
  EXPECT_DOUBLE_EQ(hits[1].distance, 1.0);  // beyond the edge
}

TEST(Closest, KeepsToTheSideOfItsNormal) {
  const auto hits = slit().nearest({{0.5, 0.25, 0.4}}, {{0, 0, -3}}, {0.5}).value();
  EXPECT_GE(hits[0].triangle, 2);
  EXPECT_DOUBLE_EQ(hits[0].distance, 0.6);
}

TEST(Closest, FindsNothingBeyondItsReach) {
  ClosestPoints::Limits limits;
  limits.farthest = 0.3;
  EXPECT_EQ(slit().nearest({{0.5, 0.5, 0.5}}, {}, limits).value()[0].triangle, -1);
}

TEST(Closest, FirstHitIsTheNearerOneAlongTheRay) {
  const auto hits = slit()
                        .first_hit({{0.25, 0.5, 3}, {0.25, 0.5, 3}, {5, 5, 3}},
                                   {{0, 0, -2}, {0, 0, 1}, {0, 0, -1}}, {})
                        .value();
  EXPECT_GE(hits[0].triangle, 2);
  EXPECT_DOUBLE_EQ(hits[0].distance, 2.0);
  EXPECT_EQ(hits[1].triangle, -1);
  EXPECT_EQ(hits[2].triangle, -1);
  const Vector3& s = hits[0].shares;
  EXPECT_DOUBLE_EQ(s[0] + s[1] + s[2], 1.0);
}

TEST(Closest, RefusesBadSurfacesAndQueries) {
  const auto bad = ClosestPoints::make({{0, 0, 0}}, {{0, 1, 0}});
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().where, "triangles[0]");
  EXPECT_FALSE(ClosestPoints::make({{0, NAN, 0}}, {}));
  EXPECT_FALSE(slit().nearest({{0, 0, INFINITY}}, {}, {}));
  EXPECT_FALSE(slit().nearest({{0, 0, 0}}, {{0, 0, 1}, {0, 0, 1}}, {}));
  EXPECT_FALSE(slit().first_hit({{0, 0, 0}}, {{0, 0, 0}}, {}));
  EXPECT_EQ(ClosestPoints::make({}, {}).value().nearest({{0, 0, 0}}, {}, {}).value()[0].triangle,
            -1);
}

}  // namespace
}  // namespace risorius::registering
