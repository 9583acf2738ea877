// SPDX-License-Identifier: MIT
// find_mirror pairs the vertices and expressions of both sides of a mesh, or finds that it is not
// symmetric.
#include "author/mirror.h"

#include <gtest/gtest.h>

namespace risorius::author {
namespace {

constexpr std::uint32_t kNone = Mirror::kNone;

/// Two triangles that share the vertices 0 and 2 in the middle. Vertex 1 is on the left, vertex 3
/// on the right. The vertices are not in the order of their heights, so that a missing sort by
/// height in find_mirror() would give wrong pairs.
Shapes kite(std::size_t expressions) {
  Shapes out;
  out.neutral = {{0, 2, 0}, {1, 1, 0.5}, {0, 0, 0}, {-1, 1, 0.5}};
  out.edges = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 2}};
  out.expressions = expressions;
  out.displacements.assign(3 * expressions * 4, 0.0f);
  return out;
}

void move(Shapes& shapes, std::size_t v, std::size_t e, const Vector3& by) {
  for (std::size_t k = 0; k < 3; ++k) {
    shapes.displacements[3 * (v * shapes.expressions + e) + k] = static_cast<float>(by[k]);
  }
}

TEST(Mirror, KnowsTheVertexOfTheOtherSide) {
  EXPECT_EQ(find_mirror(kite(0)).vertices, (std::vector<std::uint32_t>{0, 3, 2, 1}));
}

TEST(Mirror, OutwardOnOneSideIsOutwardOnTheOther) {
  Shapes shapes = kite(4);
  move(shapes, 1, 0, {0.2, 0.1, 0});   // the left vertex outward and up
  move(shapes, 3, 1, {0.2, 0.1, 0});   // the right vertex inward and up: without a counterpart
  move(shapes, 3, 2, {-0.2, 0.1, 0});  // the right vertex outward and up
  move(shapes, 0, 3, {0, 0.3, 0.1});   // a middle vertex
  EXPECT_EQ(find_mirror(shapes).expressions, (std::vector<std::uint32_t>{2, kNone, 0, 3}));
}

TEST(Mirror, ThereIsNoneWhereAVertexHasNoOtherSide) {
  Shapes shapes = kite(0);
  shapes.neutral[3][2] += 0.01;
  EXPECT_TRUE(find_mirror(shapes).empty());
}

TEST(Mirror, ThereIsNoneWhereTwoVerticesHaveTheSameOtherSide) {
  Shapes shapes = kite(0);
  shapes.neutral.push_back({1, 1.0001, 0.5});  // in reach of the mirrored vertex 3, like vertex 1
  shapes.edges.push_back({0, 4});
  shapes.edges.push_back({4, 2});
  EXPECT_TRUE(find_mirror(shapes).empty());
}

TEST(Mirror, ThereIsNoneWhereAnEdgeHasNoOtherSide) {
  Shapes shapes = kite(0);
  shapes.edges.erase(shapes.edges.begin());
  EXPECT_TRUE(find_mirror(shapes).empty());
}

}  // namespace
}  // namespace risorius::author
