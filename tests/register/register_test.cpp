// SPDX-License-Identifier: MIT
// Registers a ball with a nose onto a ball with a longer nose and other vertices.
#include "register/register.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace risorius::registering {
namespace {

struct Ball {
  Mesh mesh;
  std::vector<Vector3> directions;
};

Vector3 place(const Vector3& d, double nose) {
  const double away = (d[0] * d[0] + d[1] * d[1] + (d[2] - 1) * (d[2] - 1)) / 0.1;
  const double radius = 10 * (1 + nose * std::exp(-away));
  return {d[0] * radius, 1.2 * d[1] * radius, d[2] * radius};
}

Ball ball(std::uint32_t rows, std::uint32_t columns, double nose) {
  Ball out;
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t c = 0; c < columns; ++c) {
      const double up = std::numbers::pi * ((r + 0.5) / rows - 0.5);
      const double around = 2 * std::numbers::pi * c / columns;
      out.directions.push_back(
          {std::sin(around) * std::cos(up), std::sin(up), std::cos(around) * std::cos(up)});
      const std::uint32_t a = r * columns + c, b = r * columns + (c + 1) % columns;
      if (r + 1 == rows) continue;
      out.mesh.triangles.push_back({a, b, b + columns});
      out.mesh.triangles.push_back({a, b + columns, a + columns});
    }
  }
  for (const Vector3& d : out.directions) out.mesh.points.push_back(place(d, nose));
  return out;
}

std::vector<Pair> pairs(const Ball& of, double nose) {
  std::vector<Pair> out;
  for (std::uint32_t v = 5; v < of.directions.size(); v += 29) {
    out.push_back({v, place(of.directions[v], nose), 1.0});
  }
  return out;
}

RegisterOptions few() {
  RegisterOptions options;
  options.nodes = 150;
  return options;
}

double away(const Vector3& a, const Vector3& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

TEST(Register, LaysVerticesOntoTheTarget) {
  const Ball from = ball(22, 30, 0.2), to = ball(31, 41, 0.35);
  const auto found = register_surface(from.mesh, to.mesh, pairs(from, 0.35), {}, few());
  ASSERT_TRUE(found);
  double distance = 0, wrong = 0;
  for (std::size_t v = 0; v < from.directions.size(); ++v) {
    distance += found.value().distance[v];
    wrong += away(found.value().points[v], place(from.directions[v], 0.35));
  }
  const auto count = static_cast<double>(from.directions.size());
  EXPECT_LT(distance / count, 0.02);
  EXPECT_LT(wrong / count, 0.2);
}

TEST(Register, DoesNotDependOnThreads) {
  const Ball from = ball(12, 16, 0.2), to = ball(17, 23, 0.3);
  RegisterOptions one = few(), four = few();
  one.threads = 1;
  four.threads = 4;
  const auto a = register_surface(from.mesh, to.mesh, pairs(from, 0.3), {}, one);
  const auto b = register_surface(from.mesh, to.mesh, pairs(from, 0.3), {}, four);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a.value().points, b.value().points);
}

TEST(Register, WhatLooksTheOtherWayIsNoMatch) {
  const Ball from = ball(12, 16, 0.2);
  Ball to = ball(17, 23, 0.2);
  for (Triangle& t : to.mesh.triangles) std::swap(t[0], t[1]);
  const auto found = register_surface(from.mesh, to.mesh, {}, from.mesh.points, few());
  ASSERT_TRUE(found);
  for (const std::uint8_t trusted : found.value().trusted) EXPECT_EQ(trusted, 0);
}

TEST(Register, RefusesWhatIsNoSurface) {
  const Ball from = ball(12, 16, 0.2);
  const auto refused = [&](const Mesh& target, const std::vector<Vector3>& start) {
    const auto found = register_surface(from.mesh, target, {}, start, few());
    return found ? std::string("taken") : std::string(core::to_string(found.error().code));
  };
  Mesh bad = from.mesh;
  bad.points[3][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused(bad, from.mesh.points), "invalid_value");
  bad = from.mesh;
  bad.triangles[4][2] = 5000;
  EXPECT_EQ(refused(bad, from.mesh.points), "invalid_index");
  bad = from.mesh;
  for (Vector3& p : bad.points) p = {1, 2, 3};
  EXPECT_EQ(refused(bad, from.mesh.points), "invalid_argument");
  EXPECT_EQ(refused({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}, from.mesh.points),
            "invalid_argument");
  EXPECT_EQ(refused(from.mesh, {}), "invalid_argument");
  EXPECT_EQ(refused(from.mesh, {{0, 0, 0}}), "invalid_length");
  bad.points.resize(RegisterOptions::kMostTarget + 1);
  EXPECT_EQ(refused(bad, from.mesh.points), "limit_exceeded");
}

TEST(Register, StopsWhereProgressSaysSo) {
  const Ball from = ball(12, 16, 0.2);
  int told = 0;
  const auto found = register_surface(from.mesh, from.mesh, {}, from.mesh.points, few(),
                                      [&](double) { return ++told < 4; });
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().message, "stopped");
  EXPECT_EQ(told, 4);
}

}  // namespace
}  // namespace risorius::registering
