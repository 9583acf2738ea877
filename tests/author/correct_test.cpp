// SPDX-License-Identifier: MIT
// Finds and repairs faults of a flat sheet of skin above a ball; formulas give the depth of each
// vertex in the ball.
#include "author/correct.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace risorius::author {
namespace {

constexpr std::uint32_t kSheet = 41;  // vertices along the sheet, 1 mm apart
constexpr double kRadius = 6.0;       // mm, of a ball whose top lies 1 mm below the sheet

double x_of(std::uint32_t v) { return double(v % kSheet) - 20.0; }
double y_of(std::uint32_t v) { return double(v / kSheet) - 20.0; }

/// Appends the vertices of a ball, ring after ring, to `positions`; its triangles face outwards.
Skin::Solid sphere(std::vector<Vector3>& positions) {
  constexpr std::uint32_t kRings = 60, kAround = 60;
  Skin::Solid out;
  for (std::uint32_t r = 0; r <= kRings; ++r) {
    const double tilt = std::numbers::pi * r / kRings;
    for (std::uint32_t a = 0; a < kAround; ++a) {
      const double turn = 2 * std::numbers::pi * a / kAround;
      positions.push_back({kRadius * std::sin(tilt) * std::cos(turn),
                           kRadius * std::sin(tilt) * std::sin(turn),
                           kRadius * std::cos(tilt) - kRadius - 1.0});
      if (r == kRings) continue;
      const std::uint32_t p = r * kAround + a, q = r * kAround + (a + 1) % kAround;
      out.triangles.push_back({p, p + kAround, q});
      out.triangles.push_back({q, p + kAround, q + kAround});
    }
  }
  out.vertices = positions.size();
  return out;
}

/// A flat sheet of skin above a solid ball; positions in mm.
struct Scene {
  Skin skin;
  std::vector<Vector3> ball;

  Scene() {
    skin.mm = 1.0;
    for (std::uint32_t v = 0; v < kSheet * kSheet; ++v) {
      skin.neutral.push_back({x_of(v), y_of(v), 0.0});
    }
    skin.face_offsets.push_back(0);
    for (std::uint32_t y = 0; y + 1 < kSheet; ++y) {
      for (std::uint32_t x = 0; x + 1 < kSheet; ++x) {
        const std::uint32_t a = y * kSheet + x;
        for (const std::uint32_t c : {a, a + 1, a + kSheet + 1, a + kSheet})
          skin.corners.push_back(c);
        skin.face_offsets.push_back(static_cast<std::uint32_t>(skin.corners.size()));
      }
    }
    skin.solids.push_back(sphere(ball));
  }
  SkinPose pose(const std::vector<Vector3>& positions) const { return {positions, {ball}}; }
  /// The sheet, smoothly pushed down by `depth` mm in its middle and by 0 mm at `reach` mm from it.
  std::vector<Vector3> pushed(double depth, double reach = 9.0) const {
    auto out = skin.neutral;
    for (std::uint32_t v = 0; v < out.size(); ++v) {
      const double d = (x_of(v) * x_of(v) + y_of(v) * y_of(v)) / (reach * reach);
      if (d < 1) out[v][2] -= depth * (1 - d) * (1 - d);
    }
    return out;
  }
};

constexpr std::uint32_t kMiddle = (kSheet * kSheet - 1) / 2;

SkinChecker checker(const Scene& scene) {
  auto made = SkinChecker::make(scene.skin);
  EXPECT_TRUE(made) << made.error().describe();
  return std::move(*made);
}

SkinFaults look(const SkinChecker& checker, const SkinPose& pose) {
  auto found = checker.look(pose);
  EXPECT_TRUE(found) << found.error().describe();
  return std::move(*found);
}

SkinFaults worse(SkinFaults a, const SkinFaults& b) {
  std::ranges::transform(a.depth, b.depth, a.depth.begin(), std::ranges::max);
  std::ranges::transform(a.stretch, b.stretch, a.stretch.begin(), std::ranges::max);
  std::ranges::transform(a.fold, b.fold, a.fold.begin(), std::ranges::min);
  return a;
}

TEST(Correct, DepthIsThatBelowTheBallsSurface) {
  const Scene scene;
  const SkinChecker check = checker(scene);
  EXPECT_EQ(std::ranges::count(check.shown(), false), 0);
  const auto rest = look(check, scene.pose(scene.skin.neutral));
  EXPECT_EQ(std::ranges::max(rest.depth), 0.0f);
  const auto positions = scene.pushed(3.0);
  const auto found = look(check, scene.pose(positions));
  for (std::uint32_t v = 0; v < positions.size(); ++v) {
    const auto& p = positions[v];
    const double away = std::hypot(p[0], p[1], p[2] + kRadius + 1.0);
    EXPECT_NEAR(found.depth[v], std::max(0.0, kRadius - away), 0.02) << v;
  }
  EXPECT_NEAR(found.depth[kMiddle], 2.0, 0.01);
  const auto sums = check.sum(found, rest);
  ASSERT_TRUE(sums);
  EXPECT_NEAR(sums->deepest, 2.0, 0.01);
  EXPECT_GT(sums->volume, 30.0);
  EXPECT_EQ(sums->widest, 0.0);
}

TEST(Correct, StretchIsAreaAndAFoldIsACosine) {
  const Scene scene;
  const SkinChecker check = checker(scene);
  auto positions = scene.skin.neutral;
  for (std::uint32_t v = 0; v < positions.size(); ++v) {
    if (x_of(v) > 10.0) positions[v][0] += 2.0;   // faces at x = 10 become three times as wide
    if (x_of(v) < -10.0) positions[v][0] += 2.0;  // faces at x = -10 fold onto their neighbours
  }
  const auto rest = look(check, scene.pose(scene.skin.neutral));
  const auto found = look(check, scene.pose(positions));
  const auto sums = check.sum(found, rest);
  ASSERT_TRUE(sums);
  EXPECT_EQ(sums->stretched, kSheet - 1);
  EXPECT_NEAR(sums->widest, 3.0, 1e-5);
  EXPECT_EQ(sums->folded, 2 * (kSheet - 1));
  EXPECT_NEAR(std::ranges::max(found.stretch), 3.0, 1e-5);
  EXPECT_NEAR(std::ranges::min(found.fold), -1.0, 1e-5);
  const auto allowed = check.sum(found, found);
  EXPECT_EQ(allowed->stretched + allowed->folded, 0u);
}

TEST(Correct, WhatTwoPartsDoTogetherIsRepairedNearTheFaultAlone) {
  const Scene scene;
  const SkinChecker check = checker(scene);
  const auto first = scene.pushed(0.9), second = scene.pushed(0.8, 14.0);
  auto both = first;
  for (std::size_t v = 0; v < both.size(); ++v) both[v][2] += second[v][2];
  const auto allowed = worse(look(check, scene.pose(first)), look(check, scene.pose(second)));
  auto repair = check.repair(scene.pose(both), allowed, {second, first});
  ASSERT_TRUE(repair) << repair.error().describe();
  EXPECT_GT(repair->before.volume, 5.0);
  EXPECT_EQ(repair->after.volume, 0.0);
  EXPECT_LE(repair->after.stretched + repair->after.folded, 0u);
  auto mended = both;
  double most = 0.0;
  for (std::uint32_t v = 0; v < mended.size(); ++v) {
    const auto& x = repair->displacement[v];
    const double length = std::hypot(x[0], x[1], x[2]);
    most = std::max(most, length);
    // All faults (vertices that are too deep in the ball) are within 3.2 mm of the middle of the
    // sheet. Only vertices within kAround of a fault may move.
    if (std::hypot(x_of(v), y_of(v)) > 3.5 + SkinChecker::kAround) {
      EXPECT_EQ(length, 0.0) << v;
    }
    for (std::size_t k = 0; k < 3; ++k) mended[v][k] += x[k];
  }
  EXPECT_GT(most, 0.4);
  EXPECT_LT(most, 0.9);  // mm undone of 1.7 mm, so that most of both parts remains
  EXPECT_LE(std::ranges::max(look(check, scene.pose(mended)).depth), SkinChecker::kDepth + 1e-3f);
}

TEST(Correct, WhatDoesMostAtAVertexStays) {
  const Scene scene;
  const SkinChecker check = checker(scene);
  // Only the wide push moves vertices that are more than 7 mm from the middle of the sheet.
  const auto narrow = scene.pushed(0.95, 7.0), wide = scene.pushed(0.6, 14.0);
  auto both = narrow;
  for (std::size_t v = 0; v < both.size(); ++v) both[v][2] += wide[v][2];
  const auto allowed = worse(look(check, scene.pose(narrow)), look(check, scene.pose(wide)));
  auto repair = check.repair(scene.pose(both), allowed, {wide, narrow});
  ASSERT_TRUE(repair) << repair.error().describe();
  EXPECT_EQ(repair->after.volume, 0.0);
  for (std::uint32_t v = 0; v < both.size(); ++v) {
    const double away = std::hypot(x_of(v), y_of(v));
    if (away > 7.1) {
      EXPECT_LT(std::abs(repair->displacement[v][2]), 0.01) << v;
    }
  }
}

/// Repairs a pose of the sheet of skin. The pose has a single part (such as an expression), and the
/// skin without this part has the same positions. So taking the part back removes no fault, and
/// only the least squares solve can help. Faults that the sheet has before the pose are allowed.
/// Expects that only vertices near the middle move and that a measurement confirms the reported
/// faults.
Repair pushed_out(const Scene& scene, const std::vector<Vector3>& positions) {
  const SkinChecker check = checker(scene);
  const auto allowed = look(check, scene.pose(scene.skin.neutral));
  auto repair = check.repair(scene.pose(positions), allowed, {positions});
  EXPECT_TRUE(repair) << repair.error().describe();
  auto mended = positions;
  for (std::uint32_t v = 0; v < mended.size(); ++v) {
    const auto& x = repair->displacement[v];
    if (std::hypot(x_of(v), y_of(v)) > 6.0 + SkinChecker::kAround) {
      EXPECT_EQ(x, Vector3{}) << v;
    }
    for (std::size_t k = 0; k < 3; ++k) mended[v][k] += x[k];
  }
  // The sums of faults that the repair reports equal the sums measured in the repaired pose.
  const auto sums = check.sum(look(check, scene.pose(mended)), allowed);
  EXPECT_NEAR(sums->volume, repair->after.volume, 1e-3);
  EXPECT_EQ(sums->stretched, repair->after.stretched);
  EXPECT_EQ(sums->folded, repair->after.folded);
  return std::move(*repair);
}

TEST(Correct, WhatCannotBeUndoneIsPushedOutOfTheBall) {
  const Scene scene;
  const Repair repair = pushed_out(scene, scene.pushed(2.0));
  EXPECT_GT(repair.before.volume, 5.0);
  EXPECT_EQ(repair.after.volume, 0.0);
  EXPECT_GT(repair.displacement[kMiddle][2], 0.8);
  EXPECT_LT(repair.displacement[kMiddle][2], 1.2);
}

TEST(Correct, AStretchThatCannotBeUndoneIsEased) {
  const Scene scene;
  auto positions = scene.skin.neutral;
  for (std::uint32_t v = 0; v < positions.size(); ++v) {  // stretch the faces at the middle
    const double d = (x_of(v) * x_of(v) + y_of(v) * y_of(v)) / 81.0;
    if (x_of(v) > 0.5 && d < 1.0) positions[v][0] += 1.9 * (1.0 - d) * (1.0 - d);
  }
  const Repair repair = pushed_out(scene, positions);
  EXPECT_GT(repair.before.stretched, 2u);
  EXPECT_EQ(repair.after.stretched, 0u);
}

TEST(Correct, AFoldThatCannotBeUndoneIsOpened) {
  const Scene scene;
  auto positions = scene.skin.neutral;
  positions[kMiddle][0] += 2.4;
  const Repair repair = pushed_out(scene, positions);
  EXPECT_GT(repair.before.folded, 0u);
  EXPECT_EQ(repair.after.folded, 0u);
}

TEST(Correct, VerticesWithoutAFaultKeepNineTenthsOfTheirWays) {
  const Scene scene;
  auto positions = scene.pushed(0.9);
  positions[kMiddle][2] += 2.8;
  const Repair repair = pushed_out(scene, positions);
  EXPECT_LT(repair.after.stretched, repair.before.stretched);
  EXPECT_GT(repair.after.stretched, 0u);  // faults are left; the checks below hold nevertheless
  for (std::uint32_t v = 0; v < positions.size(); ++v) {
    const bool near = std::max(std::abs(x_of(v)), std::abs(y_of(v))) < 2.5;
    if (near || positions[v][2] > -0.01) continue;
    EXPECT_LE(repair.displacement[v][2], -0.1 * positions[v][2]) << v;
  }
}

TEST(Correct, WhatOnePartDoesByItselfIsNoFault) {
  const Scene scene;
  const SkinChecker check = checker(scene);
  const auto deep = scene.pushed(3.0);
  const auto allowed = look(check, scene.pose(deep));
  auto repair = check.repair(scene.pose(deep), allowed, {deep});
  ASSERT_TRUE(repair);
  EXPECT_TRUE(
      std::ranges::all_of(repair->displacement, [](const Vector3& x) { return x == Vector3{}; }));
}

/// One skin of two sheets, 1 mm apart.
/// In: apart  true: the sheets face away from each other, like both sides of a thin plate; false:
///            they face each other
Scene sheets(bool apart) {
  Scene scene;
  const std::size_t count = scene.skin.neutral.size(), faces = scene.skin.corners.size();
  scene.skin.solids.clear();
  for (std::size_t v = 0; v < count; ++v) {
    auto p = scene.skin.neutral[v];
    p[2] = 1.0;
    scene.skin.neutral.push_back(p);
  }
  for (std::size_t c = 0; c < faces; c += 4) {
    for (const std::size_t k : {3u, 2u, 1u, 0u}) {
      scene.skin.corners.push_back(scene.skin.corners[c + k] + static_cast<std::uint32_t>(count));
    }
    if (apart) std::reverse(scene.skin.corners.end() - 4, scene.skin.corners.end());
    if (apart) std::reverse(scene.skin.corners.begin() + c, scene.skin.corners.begin() + c + 4);
    scene.skin.face_offsets.push_back(static_cast<std::uint32_t>(scene.skin.corners.size()));
  }
  return scene;
}

TEST(Correct, TheSkinInItselfIsFoundWhereItTouchedNothingBefore) {
  const Scene scene = sheets(false);
  const SkinChecker check = checker(scene);
  const std::size_t count = scene.skin.neutral.size() / 2;
  auto positions = scene.skin.neutral;  // the upper sheet moves down by 2 mm, through the lower one
  for (std::size_t v = count; v < positions.size(); ++v) positions[v][2] -= 2.0;
  const auto found = look(check, {positions, {}});
  // The gap is narrow, so that from outside only vertices near its rim can be seen. Faults must be
  // found only at such vertices, for which shown() is true.
  double deepest = 0.0;
  std::size_t inside = 0;
  for (std::size_t v = count; v < positions.size(); ++v) {
    inside += found.depth[v] > 0.0f;
    deepest = std::max(deepest, double{found.depth[v]});
    EXPECT_TRUE(check.shown()[v] || found.depth[v] == 0.0f);
  }
  EXPECT_GT(inside, 80u);
  EXPECT_NEAR(deepest, 1.0, 1e-5);
  EXPECT_FALSE(check.shown()[kMiddle]);
}

TEST(Correct, WhatGoesIntoOneAnotherGoesBackByHalfEach) {
  const Scene scene = sheets(false);
  const SkinChecker check = checker(scene);
  const auto allowed = look(check, {scene.skin.neutral, {}});
  const std::uint32_t count = kSheet * kSheet;
  // The upper sheet moves down at the rim of the gap, where the vertices can be seen from outside.
  auto positions = scene.skin.neutral;
  for (std::uint32_t v = 0; v < count; ++v) {
    const double d = std::hypot(x_of(v) + 20.0, y_of(v)) / 6.0;
    if (d < 1.0) positions[count + v][2] -= 1.6 * (1.0 - d * d) * (1.0 - d * d);
  }
  auto repair = check.repair({positions, {}}, allowed, {positions});
  ASSERT_TRUE(repair) << repair.error().describe();
  EXPECT_GT(repair->before.volume, 3.0);
  EXPECT_EQ(repair->after.volume, 0.0);
  double up = 0.0, down = 0.0;
  for (std::uint32_t v = 0; v < count; ++v) {
    down = std::max(down, -repair->displacement[v][2]);
    up = std::max(up, repair->displacement[count + v][2]);
  }
  EXPECT_GT(up, 0.2);
  EXPECT_NEAR(up, down, 0.02);
}

TEST(Correct, AThinPlateTouchesNothing) {
  const Scene scene = sheets(true);
  const SkinChecker check = checker(scene);
  auto positions = scene.skin.neutral;
  for (std::size_t v = positions.size() / 2; v < positions.size(); ++v) positions[v][2] -= 0.5;
  EXPECT_EQ(std::ranges::max(look(check, {positions, {}}).depth), 0.0f);
}

TEST(Correct, TheNearestPlaceIsThatOfTheFormula) {
  const Scene scene;
  const SkinChecker check = checker(scene);
  auto places = check.nearest({{3.25, -7.5, 4.0}, {40.0, 0.0, 0.0}, {-22.0, 23.0, 1.0}});
  ASSERT_TRUE(places);
  EXPECT_NEAR((*places)[0].distance, 4.0, 1e-9);
  EXPECT_NEAR((*places)[1].distance, 20.0, 1e-9);
  EXPECT_NEAR((*places)[2].distance, std::hypot(2.0, 3.0, 1.0), 1e-9);
  double x = 0.0, y = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    x += (*places)[0].shares[k] * x_of((*places)[0].corners[k]);
    y += (*places)[0].shares[k] * y_of((*places)[0].corners[k]);
  }
  EXPECT_NEAR(x, 3.25, 1e-9);
  EXPECT_NEAR(y, -7.5, 1e-9);
}

TEST(Correct, BadInputIsOneSentence) {
  const Scene scene;
  const auto fails = [](Skin skin, core::ErrorCode code, const char* where) {
    auto made = SkinChecker::make(std::move(skin));
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, code);
    EXPECT_EQ(made.error().where, where);
  };
  Skin skin = scene.skin;
  skin.corners[7] = 5000;
  fails(skin, core::ErrorCode::kInvalidIndex, "corners[7]");
  skin = scene.skin;
  skin.face_offsets.back() += 1;
  fails(skin, core::ErrorCode::kInvalidLength, "face_offsets");
  skin = scene.skin;
  skin.neutral[3][1] = std::numeric_limits<double>::quiet_NaN();
  fails(skin, core::ErrorCode::kInvalidValue, "neutral[3]");
  skin = scene.skin;
  skin.solids[0].vertices = 5;
  fails(skin, core::ErrorCode::kInvalidIndex, "solids[0]");
  skin = scene.skin;
  skin.mm = 0.0;
  fails(skin, core::ErrorCode::kInvalidValue, "mm");
  const SkinChecker check = checker(scene);
  EXPECT_FALSE(check.look({scene.skin.neutral, {}}));
  EXPECT_FALSE(check.look({{}, {scene.ball}}));
  const auto rest = look(check, scene.pose(scene.skin.neutral));
  EXPECT_FALSE(check.sum(rest, {}));
  EXPECT_FALSE(check.repair(scene.pose(scene.skin.neutral), rest, {{{0.0, 0.0, 0.0}}}));
}

}  // namespace
}  // namespace risorius::author
