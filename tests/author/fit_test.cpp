// SPDX-License-Identifier: MIT
// Tests fits of joints to shapes that were made with known joints.
#include "author/fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "author/mirror.h"

namespace risorius::author {
namespace {

constexpr std::uint32_t kSide = 21;  // vertices along a side: 441 in all

/// A flat sheet of 2 x 2 units around the origin, in the plane z = 0, whose expressions move
/// nothing.
Shapes sheet(std::size_t expressions) {
  Shapes out;
  out.expressions = expressions;
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      out.neutral.push_back({-1.0 + 0.1 * x, -1.0 + 0.1 * y, 0.0});
      const std::uint32_t v = y * kSide + x;
      if (x + 1 < kSide) out.edges.push_back({v, v + 1});
      if (y + 1 < kSide) out.edges.push_back({v, v + kSide});
    }
  }
  out.displacements.assign(3 * expressions * out.vertex_count(), 0.0f);
  return out;
}

float& at(Shapes& shapes, std::size_t v, std::size_t e, std::size_t k) {
  return shapes.displacements[3 * (v * shapes.expressions + e) + k];
}

double bump(const Vector3& p, double x, double y) {
  const double d = ((p[0] - x) * (p[0] - x) + (p[1] - y) * (p[1] - y)) / 0.36;
  return d < 1.0 ? (1.0 - d) * (1.0 - d) : 0.0;
}

/// Three expressions: the left side (x > 0) rises, the right side rises, the left side rotates
/// about y.
Shapes two_sides() {
  Shapes out = sheet(3);
  const double angle = 0.3;
  for (std::size_t v = 0; v < out.vertex_count(); ++v) {
    const Vector3& p = out.neutral[v];
    const double left = bump(p, 0.5, 0.0), right = bump(p, -0.5, 0.0);
    at(out, v, 0, 2) = static_cast<float>(0.1 * left);
    at(out, v, 1, 2) = static_cast<float>(0.1 * right);
    at(out, v, 2, 0) = static_cast<float>(left * (p[0] - 0.5) * (std::cos(angle) - 1.0));
    at(out, v, 2, 2) = static_cast<float>(-left * (p[0] - 0.5) * std::sin(angle));
  }
  return out;
}

/// The position of vertex v in expression e that the fit's joints give, by Rodrigues' formula.
Vector3 posed(const Shapes& shapes, const Fit& fit, std::size_t v, std::size_t e) {
  Vector3 out{};
  const Vector3& p = shapes.neutral[v];
  for (std::size_t i = 0; i < fit.influences; ++i) {
    const double w = double{fit.weights[v * fit.influences + i]};
    const std::size_t j = fit.weight_joints[v * fit.influences + i];
    const JointMotion& m = fit.motions[j * shapes.expressions + e];
    const Vector3& c = fit.joints[j];
    const Vector3 a{p[0] - c[0], p[1] - c[1], p[2] - c[2]};
    const Vector3& r = m.rotation;
    const double angle = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
    const double s = angle > 0 ? std::sin(angle) / angle : 1.0;
    const double t = angle > 0 ? (1.0 - std::cos(angle)) / (angle * angle) : 0.5;
    const double dot = r[0] * a[0] + r[1] * a[1] + r[2] * a[2];
    const Vector3 cross{r[1] * a[2] - r[2] * a[1], r[2] * a[0] - r[0] * a[2],
                        r[0] * a[1] - r[1] * a[0]};
    for (std::size_t k = 0; k < 3; ++k) {
      const double turned = std::cos(angle) * a[k] + s * cross[k] + t * dot * r[k];
      out[k] += w * (c[k] + turned + m.translation[k]);
    }
  }
  return out;
}

double largest_error(const Shapes& shapes, const Fit& fit) {
  double most = 0.0;
  for (std::size_t v = 0; v < shapes.vertex_count(); ++v) {
    for (std::size_t e = 0; e < shapes.expressions; ++e) {
      const Vector3 p = posed(shapes, fit, v, e);
      double square = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double goal = shapes.neutral[v][k] +
                            double{shapes.displacements[3 * (v * shapes.expressions + e) + k]};
        square += (p[k] - goal) * (p[k] - goal);
      }
      most = std::max(most, std::sqrt(square));
    }
  }
  return most;
}

FitOptions few(std::size_t joints) {
  FitOptions out;
  out.joints = joints;
  out.rounds = 10;
  out.smoothness = 0.01;
  return out;
}

TEST(Fit, MoreJointsComeNearer) {
  const Shapes shapes = two_sides();  // displacements are up to 0.18 long
  double before = 0.02;
  for (const std::size_t joints : {3u, 9u}) {
    auto fit = fit_joints(shapes, few(joints));
    ASSERT_TRUE(fit) << fit.error().describe();
    EXPECT_EQ(fit->joints.size(), joints);
    const double error = largest_error(shapes, *fit);
    EXPECT_LT(error, before) << joints;
    before = error / 2;
  }
}

TEST(Fit, WeightsAreNotNegativeAndSumToOne) {
  FitOptions options = few(12);
  options.influences = 3;
  const Shapes shapes = two_sides();
  auto fit = fit_joints(shapes, options);
  ASSERT_TRUE(fit) << fit.error().describe();
  ASSERT_EQ(fit->weights.size(), 3 * shapes.vertex_count());
  for (std::size_t v = 0; v < shapes.vertex_count(); ++v) {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_GE(fit->weights[3 * v + i], 0.0f);
      sum += double{fit->weights[3 * v + i]};
    }
    EXPECT_NEAR(sum, 1.0, 1e-6);
  }
}

TEST(Fit, TheNumberOfThreadsChangesNoBit) {
  const Shapes shapes = two_sides();
  FitOptions options = few(9);
  options.threads = 1;
  auto one = fit_joints(shapes, options);
  options.threads = 3;
  auto three = fit_joints(shapes, options);
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->weights, three->weights);
  EXPECT_EQ(one->weight_joints, three->weight_joints);
  EXPECT_EQ(one->joints, three->joints);
  for (std::size_t i = 0; i < one->motions.size(); ++i) {
    EXPECT_EQ(one->motions[i].rotation, three->motions[i].rotation);
    EXPECT_EQ(one->motions[i].translation, three->motions[i].translation);
  }
}

TEST(Fit, BothSidesOfASymmetricMeshAreAlike) {
  const Shapes shapes = two_sides();
  const Mirror mirror = find_mirror(shapes);
  ASSERT_FALSE(mirror.empty());
  EXPECT_EQ(mirror.expressions[0], 1u);
  EXPECT_EQ(mirror.expressions[2], Mirror::kNone);
  auto fit = fit_joints(shapes, few(9));
  ASSERT_TRUE(fit);
  for (std::size_t j = 0; j < fit->joints.size(); ++j) {
    const Vector3& p = fit->joints[j];
    const Vector3& q = fit->joints[fit->mirrored[j]];
    EXPECT_NEAR(p[0], -q[0], 1e-9);
    EXPECT_NEAR(p[1], q[1], 1e-9);
  }
  for (std::size_t v = 0; v < shapes.vertex_count(); ++v) {
    std::vector<float> here(fit->joints.size()), there(fit->joints.size());
    for (std::size_t i = 0; i < fit->influences; ++i) {
      const std::size_t a = v * fit->influences + i;
      const std::size_t b = mirror.vertices[v] * fit->influences + i;
      here[fit->weight_joints[a]] += fit->weights[a];
      there[fit->mirrored[fit->weight_joints[b]]] += fit->weights[b];
    }
    for (std::size_t j = 0; j < here.size(); ++j) EXPECT_NEAR(here[j], there[j], 1e-6);
  }
}

/// The largest displacement of any vertex in expression e if only joint j moves.
double effect(const Shapes& shapes, const Fit& fit, std::size_t j, std::size_t e) {
  Fit alone = fit;
  for (std::size_t other = 0; other < fit.joints.size(); ++other) {
    if (other != j) alone.motions[other * shapes.expressions + e] = {};
  }
  double most = 0.0;
  for (std::size_t v = 0; v < shapes.vertex_count(); ++v) {
    const Vector3 p = posed(shapes, alone, v, e);
    const Vector3& q = shapes.neutral[v];
    most = std::max(most, std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]));
  }
  return most;
}

/// The index, in Fit::motions, of the mirrored joint in the mirrored expression.
std::size_t other_side(const Mirror& mirror, const Fit& fit, std::size_t j, std::size_t e,
                       std::size_t expressions) {
  return fit.mirrored[j] * expressions + mirror.expressions[e];
}

bool rests(const JointMotion& m) { return m.rotation == Vector3{} && m.translation == Vector3{}; }

TEST(Fit, JointsLeaveExpressionsInWhichTheyDoLittleAndOthersTakeOver) {
  const Shapes shapes = two_sides();
  const Mirror mirror = find_mirror(shapes);
  const double least = 0.01;
  FitOptions options = few(12);
  auto all = fit_joints(shapes, options);
  options.least_effect = least;
  options.threads = 1;
  auto few_each = fit_joints(shapes, options);
  options.threads = 3;
  auto again = fit_joints(shapes, options);
  ASSERT_TRUE(all && few_each && again);
  EXPECT_EQ(few_each->weights, again->weights);
  Fit cut = *all;
  std::size_t resting = 0, small = 0;
  for (std::size_t j = 0; j < all->joints.size(); ++j) {
    for (std::size_t e = 0; e < shapes.expressions; ++e) {
      const std::size_t at = j * shapes.expressions + e;
      if (effect(shapes, *all, j, e) < least) {
        cut.motions[at] = {};
        ++small;
      }
      if (e < 2) {  // the third expression has no counterpart
        const std::size_t other = other_side(mirror, *few_each, j, e, shapes.expressions);
        EXPECT_EQ(rests(few_each->motions[at]), rests(few_each->motions[other]));
      }
      if (rests(few_each->motions[at])) ++resting;
      EXPECT_EQ(few_each->motions[at].rotation, again->motions[at].rotation);
      EXPECT_EQ(few_each->motions[at].translation, again->motions[at].translation);
    }
  }
  EXPECT_GT(small, 3u);
  EXPECT_GE(resting, small);
  EXPECT_LT(largest_error(shapes, *few_each), 0.7 * largest_error(shapes, cut));
  EXPECT_LT(largest_error(shapes, *few_each), 0.8 * least);
}

TEST(Fit, WhatIsBoundIsTheBestOfItsRounds) {
  const Shapes shapes = two_sides();
  FitOptions options = few(6);
  options.emphasis = 8.0;  // so large that some rounds become worse
  bool any = false;
  for (std::size_t rounds = 5; rounds < 15; ++rounds) {
    options.rounds = rounds;
    options.bound = false;
    auto last = fit_joints(shapes, options);
    options.bound = true;
    auto best = fit_joints(shapes, options);
    ASSERT_TRUE(last && best);
    // The result of the best round may have a slightly larger error here than the result of the
    // last round. The fit compares its rounds over four expressions (it adds the mirror image of
    // the third expression), but largest_error() has only three.
    EXPECT_LE(largest_error(shapes, *best), 1.1 * largest_error(shapes, *last)) << rounds;
    any = any || largest_error(shapes, *best) < 0.9 * largest_error(shapes, *last);
  }
  EXPECT_TRUE(any);
}

TEST(Fit, AGivenJointKeepsItsMotionAndGetsWhatItMoves) {
  const Shapes shapes = two_sides();
  GivenJoint head, riser;
  riser.position = {0.5, 0.0, 0.0};
  riser.motions.resize(3);
  riser.motions[0].translation = {0.0, 0.0, 0.1};
  riser.motions[2].rotation = {0.0, 0.3, 0.0};
  FitOptions options = few(4);
  options.symmetric = false;
  options.given = {head, riser};
  auto fit = fit_joints(shapes, options);
  ASSERT_TRUE(fit) << fit.error().describe();
  EXPECT_EQ(fit->joints[1], riser.position);
  EXPECT_NEAR(fit->motions[3 * 1 + 2].rotation[1], 0.3, 1e-12);
  const std::size_t top = 10 * kSide + 15;  // the vertex at (0.5, 0)
  float share = 0.0f;
  for (std::size_t i = 0; i < fit->influences; ++i) {
    const std::size_t a = top * fit->influences + i;
    if (fit->weight_joints[a] == 1) share += fit->weights[a];
  }
  EXPECT_GT(share, 0.9f);
}

TEST(Fit, AnotherMeshHangsOnTheSameJoints) {
  const Shapes shapes = two_sides();
  GivenJoint head, left, right;
  left.position = {0.5, 0.0, 0.0};
  right.position = {-0.5, 0.0, 0.0};
  left.motions.resize(3);
  right.motions.resize(3);
  left.motions[0].translation = right.motions[1].translation = {0.0, 0.0, 0.1};
  left.motions[2].rotation = {0.0, 0.3, 0.0};
  FitOptions options = few(3);
  auto fit = fit_weights(shapes, {head, left, right}, options);
  ASSERT_TRUE(fit) << fit.error().describe();
  EXPECT_EQ(fit->joints.size(), 3u);
  EXPECT_LT(largest_error(shapes, *fit), 0.004);
}

TEST(Fit, WhatIsMoreImportantComesNearer) {
  Shapes shapes = two_sides();
  FitOptions options = few(5);
  options.symmetric = false;
  options.emphasis = 0.0;
  const auto left_error = [&] {
    auto fit = fit_joints(shapes, options);
    EXPECT_TRUE(fit) << fit.error().describe();
    Shapes left = shapes;
    for (std::size_t v = 0; v < left.vertex_count(); ++v) {
      if (left.neutral[v][0] > 0.0) continue;
      // Only errors of the left side shall count. Therefore the right side is changed to have no
      // error: its goal is the rest pose, and all its weights go to joint 0, which does not move.
      for (std::size_t e = 0; e < left.expressions; ++e) {
        for (std::size_t k = 0; k < 3; ++k) at(left, v, e, k) = 0.0f;
      }
      for (std::size_t i = 0; i < fit->influences; ++i) {
        fit->weight_joints[v * fit->influences + i] = 0;
      }
    }
    return largest_error(left, *fit);
  };
  const double alike = left_error();
  for (const Vector3& p : shapes.neutral) shapes.importance.push_back(p[0] > 0.0 ? 1.0 : 1e-4);
  EXPECT_LT(left_error(), 0.8 * alike);
}

TEST(Fit, WhatIsImportantIsNotSmoothedAway) {
  Shapes shapes = sheet(1);
  for (std::size_t y = 1; y < kSide; y += 2) {  // peaks between vertices that stay
    for (std::size_t x = 1; x < kSide; x += 2) at(shapes, y * kSide + x, 0, 2) = 0.1f;
  }
  const std::size_t peak = 11 * kSide + 11;
  GivenJoint head, riser;
  riser.motions.resize(1);
  riser.motions[0].translation = {0.0, 0.0, 0.1};
  FitOptions options = few(2);
  options.smoothness = 10.0;
  options.symmetric = false;
  const auto error = [&] {
    auto fit = fit_weights(shapes, {head, riser}, options);
    EXPECT_TRUE(fit) << fit.error().describe();
    return std::abs(posed(shapes, *fit, peak, 0)[2] - 0.1);
  };
  const double alike = error();
  EXPECT_GT(alike, 0.01);
  shapes.importance.assign(shapes.vertex_count(), 1.0);
  shapes.importance[peak] = 100.0;
  EXPECT_LT(error(), 0.1 * alike);
}

TEST(Fit, WeightsGoOnFromThoseOfTheFinerMesh) {
  const Shapes shapes = two_sides();
  auto fit = fit_joints(shapes, few(9));
  ASSERT_TRUE(fit);
  std::vector<GivenJoint> joints(fit->joints.size());
  for (std::size_t j = 1; j < joints.size(); ++j) {  // the first joint never moves
    joints[j].position = fit->joints[j];
    const auto first = fit->motions.begin() + static_cast<std::ptrdiff_t>(3 * j);
    joints[j].motions.assign(first, first + 3);
  }
  StartWeights start{fit->influences, fit->weight_joints, fit->weights};
  auto again = fit_weights(shapes, joints, few(9), start);
  ASSERT_TRUE(again) << again.error().describe();
  EXPECT_LT(largest_error(shapes, *again), 1.1 * largest_error(shapes, *fit));
  // 30 joints without motion, more than the number of candidate joints of a vertex, must not take
  // the place of a moving joint among the candidates.
  std::vector<GivenJoint> many(30);
  many.insert(many.end(), joints.begin() + 1, joints.end());
  StartWeights later = start;
  for (std::uint16_t& joint : later.joints) {
    if (joint > 0) joint = static_cast<std::uint16_t>(joint + 29);
  }
  auto beside = fit_weights(shapes, many, few(9), later);
  ASSERT_TRUE(beside) << beside.error().describe();
  EXPECT_LT(largest_error(shapes, *beside), 1.1 * largest_error(shapes, *fit));
  start.joints[5] = 9;
  start.weights[5] = 1.0f;
  EXPECT_EQ(fit_weights(shapes, joints, few(9), start).error().code,
            core::ErrorCode::kInvalidIndex);
  start.weights[5] = -1.0f;
  EXPECT_EQ(fit_weights(shapes, joints, few(9), start).error().code,
            core::ErrorCode::kInvalidValue);
  start.weights.pop_back();
  EXPECT_EQ(fit_weights(shapes, joints, few(9), start).error().code,
            core::ErrorCode::kInvalidLength);
}

/// The sheet `shapes`, half as wide, twice as deep and sheared; its displacements are scaled in the
/// same way but not sheared.
Shapes reshaped(Shapes shapes) {
  for (Vector3& p : shapes.neutral) p = {0.5 * p[0], p[1], 2.0 * p[2] + 0.1 * p[1]};
  for (std::size_t i = 0; i < shapes.displacements.size(); i += 3) {
    shapes.displacements[i] *= 0.5f;
    shapes.displacements[i + 2] *= 2.0f;
  }
  return shapes;
}

TEST(Fit, AnotherFaceOfTheTopologyTakesJointsAndWeightsOver) {
  const Shapes shapes = two_sides(), other = reshaped(two_sides());
  FitOptions options = few(9);
  options.given.resize(1);
  auto fit = fit_joints(shapes, options);
  ASSERT_TRUE(fit) << fit.error().describe();
  const StartWeights weights{fit->influences, fit->weight_joints, fit->weights};
  const std::vector<std::uint32_t> middles(8, kInTheMiddle);
  // On the sheet of the first fit, fit_motions() finds motions with nearly the same error, and does
  // not change the weights.
  auto same = fit_motions(shapes, options, weights, middles);
  ASSERT_TRUE(same) << same.error().describe();
  EXPECT_LT(largest_error(shapes, *same), 1.2 * largest_error(shapes, *fit));
  EXPECT_EQ(same->weight_joints, fit->weight_joints);
  for (std::size_t i = 0; i < fit->weights.size(); ++i) {
    EXPECT_NEAR(same->weights[i], fit->weights[i], 1e-6f);
  }
  auto there = fit_motions(other, options, weights, middles);
  ASSERT_TRUE(there) << there.error().describe();
  auto own = fit_joints(other, options);  // joints and weights fitted to this sheet
  ASSERT_TRUE(own);
  EXPECT_LT(largest_error(other, *there), 3.0 * largest_error(other, *own));
  for (std::size_t j = 1; j < 9; ++j) {  // at the mean of its vertices, weighted by squared weight
    Vector3 sum{};
    double total = 0.0;
    for (std::size_t v = 0; v < other.vertex_count(); ++v) {
      for (std::size_t i = v * fit->influences; i < (v + 1) * fit->influences; ++i) {
        if (fit->weight_joints[i] != j) continue;
        const double square = double{fit->weights[i]} * double{fit->weights[i]};
        for (std::size_t k = 0; k < 3; ++k) sum[k] += square * other.neutral[v][k];
        total += square;
      }
    }
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(there->joints[j][k], sum[k] / total, 1e-6);
  }
}

TEST(Fit, JointsOfAnotherFaceLieAtItsPivots) {
  const Shapes shapes = two_sides();
  FitOptions options = few(9);
  options.given.resize(1);
  auto fit = fit_joints(shapes, options);
  ASSERT_TRUE(fit);
  const StartWeights weights{fit->influences, fit->weight_joints, fit->weights};
  options.pivots.push_back({{0.5, 0.0, -0.4}, {2}});
  std::vector<std::uint32_t> at(8, kInTheMiddle);
  at[3] = 0;
  auto there = fit_motions(shapes, options, weights, at);
  ASSERT_TRUE(there) << there.error().describe();
  EXPECT_NEAR(there->joints[4][0], 0.5, 1e-9);
  EXPECT_NEAR(there->joints[4][2], -0.4, 1e-9);
  EXPECT_NEAR(there->joints[3][2], 0.0, 1e-9);
  EXPECT_LT(largest_error(shapes, *there), 2.0 * largest_error(shapes, *fit));
}

TEST(Fit, WhatAnotherFaceCannotTakeOverIsSaid) {
  const Shapes shapes = two_sides();
  FitOptions options = few(9);
  options.given.resize(1);
  auto fit = fit_joints(shapes, options);
  ASSERT_TRUE(fit);
  StartWeights weights{fit->influences, fit->weight_joints, fit->weights};
  std::vector<std::uint32_t> at(8, kInTheMiddle);
  at[2] = 1;  // a pivot that does not exist
  auto refused = fit_motions(shapes, options, weights, at);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, core::ErrorCode::kInvalidIndex);
  EXPECT_EQ(refused.error().where, "at[2]");
  at.pop_back();  // `at` has one joint too few
  at[2] = kInTheMiddle;
  refused = fit_motions(shapes, options, weights, at);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, core::ErrorCode::kInvalidArgument);
  at.push_back(kInTheMiddle);
  weights.joints[7] = 9;
  weights.weights[7] = 0.5f;
  refused = fit_motions(shapes, options, weights, at);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, core::ErrorCode::kInvalidIndex);
  options.given[0].motions.resize(3);
  options.given[0].motions[1].translation = {0.0, 0.0, 0.1};  // every joint moves
  weights.joints[7] = 0;
  refused = fit_motions(shapes, options, weights, at);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, core::ErrorCode::kInvalidArgument);
}

TEST(Fit, JointsOfBothSidesAtOnePlaceAreToldApart) {
  const Shapes shapes = two_sides();
  // On each side two joints have the same position, and move in different expressions.
  std::vector<GivenJoint> joints(5);
  for (std::size_t j = 1; j < 5; ++j) {
    joints[j].position = {j % 2 == 1 ? 0.5 : -0.5, 0.0, -0.4};
    joints[j].motions.resize(3);
  }
  joints[1].motions[0].translation = joints[2].motions[1].translation = {0.0, 0.0, 0.1};
  joints[3].motions[2].rotation = {0.0, 0.3, 0.0};
  joints[4].motions[2].rotation = {0.0, -0.3, 0.0};
  auto fit = fit_weights(shapes, joints, few(5));
  ASSERT_TRUE(fit) << fit.error().describe();
  EXPECT_EQ(fit->mirrored, (std::vector<std::uint32_t>{0, 2, 1, 4, 3}));
  joints[1].mirrored = 2;
  EXPECT_EQ(fit_weights(shapes, joints, few(5)).error().code, core::ErrorCode::kInvalidIndex);
  joints[2].mirrored = 1;
  EXPECT_TRUE(fit_weights(shapes, joints, few(5)));
}

TEST(Fit, JointsOfALidLieInTheEye) {
  Shapes shapes = two_sides();
  FitOptions options = few(9);
  options.pivots = {{{0.5, 0.0, -0.4}, {0}}, {{-0.5, 0.0, -0.4}, {1}}};
  auto fit = fit_joints(shapes, options);
  ASSERT_TRUE(fit) << fit.error().describe();
  const auto at_pivot = [&](double x) {
    return std::count_if(fit->joints.begin(), fit->joints.end(), [&](const Vector3& p) {
      return std::abs(p[0] - x) < 1e-6 && std::abs(p[2] + 0.4) < 1e-6;
    });
  };
  EXPECT_GT(at_pivot(0.5), 0);
  EXPECT_EQ(at_pivot(0.5), at_pivot(-0.5));
  EXPECT_LT(largest_error(shapes, *fit), 0.02);
  // The pivots of the eyes are slightly asymmetric: the joints of both sides are placed at the mean
  // of the pivots.
  options.pivots[1].position[0] = -0.48;
  fit = fit_joints(shapes, options);
  ASSERT_TRUE(fit) << fit.error().describe();
  EXPECT_GT(at_pivot(0.49), 0);
  EXPECT_EQ(at_pivot(0.49), at_pivot(-0.49));
  options.pivots[0].expressions = {3};
  EXPECT_NE(fit_joints(shapes, options).error().describe().find("pivots[0]"), std::string::npos);
}

TEST(Fit, SaysWhatItCannotUse) {
  const auto says = [](const Shapes& shapes, const FitOptions& options) {
    auto fit = fit_joints(shapes, options);
    return fit ? std::string("nothing") : fit.error().describe();
  };
  Shapes shapes = two_sides();
  at(shapes, 7, 1, 2) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(says(shapes, few(5)).find("displacements[7][1]"), std::string::npos);
  shapes = two_sides();
  shapes.neutral[3][1] = std::numeric_limits<double>::infinity();
  EXPECT_NE(says(shapes, few(5)).find("neutral[3]"), std::string::npos);
  EXPECT_NE(says(sheet(2), few(5)).find("no expression moves a vertex"), std::string::npos);
  shapes = two_sides();
  shapes.edges.push_back({0, 441});
  EXPECT_NE(says(shapes, few(5)).find("vertex 441 of 441"), std::string::npos);
  shapes = two_sides();
  shapes.importance.assign(441, 1.0);
  shapes.importance[9] = 0.0;
  EXPECT_NE(says(shapes, few(5)).find("importance[9]"), std::string::npos);
  shapes.importance.pop_back();
  EXPECT_NE(says(shapes, few(5)).find("found 440"), std::string::npos);
  EXPECT_NE(says(two_sides(), few(1)).find("2 to 4096"), std::string::npos);
  FitOptions options = few(5);
  options.influences = 0;
  EXPECT_NE(says(two_sides(), options).find("influences"), std::string::npos);
  options = few(5);
  options.least_effect = -1.0;
  EXPECT_NE(says(two_sides(), options).find("least_effect"), std::string::npos);
  options = few(5);
  options.given.resize(1);
  options.given[0].motions.resize(2);
  EXPECT_NE(says(two_sides(), options).find("found 2"), std::string::npos);
}

TEST(Fit, StopsWhenItIsTold) {
  int told = 0;
  auto fit = fit_joints(two_sides(), few(5), [&](double share) {
    EXPECT_GT(share, 0.0);
    return ++told < 3;
  });
  ASSERT_FALSE(fit);
  EXPECT_EQ(told, 3);
  EXPECT_EQ(fit.error().message, "stopped");
}

TEST(Fit, ALargerOrSmallerUnitIsTheSameFit) {
  Shapes shapes = two_sides();
  auto metres = fit_joints(shapes, few(5));
  for (Vector3& p : shapes.neutral) {
    for (double& x : p) x *= 1024.0;
  }
  for (float& d : shapes.displacements) d *= 1024.0f;
  auto large = fit_joints(shapes, few(5));
  ASSERT_TRUE(metres && large);
  EXPECT_EQ(metres->weights, large->weights);
}

}  // namespace
}  // namespace risorius::author
