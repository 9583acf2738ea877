// SPDX-License-Identifier: MIT
// Compares bones and skin with a plain reference in double, with the instruction set of
// RISORIUS_SIMD.
#include "rig/outputs/skin.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "rig/outputs/joint_chain.h"

namespace risorius::rig {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
using Matrix = std::array<std::array<double, 4>, 4>;

Matrix identity() { return {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}; }

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix out{};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t k = 0; k < 4; ++k) out[i][j] += a[i][k] * b[k][j];
    }
  }
  return out;
}

// Inverts a matrix by Gauss-Jordan elimination with the largest pivot.
Matrix inverse(Matrix m) {
  Matrix out = identity();
  for (std::size_t c = 0; c < 4; ++c) {
    std::size_t best = c;
    for (std::size_t r = c; r < 4; ++r) {
      if (std::fabs(m[r][c]) > std::fabs(m[best][c])) best = r;
    }
    std::swap(m[c], m[best]), std::swap(out[c], out[best]);
    const double pivot = m[c][c];
    for (std::size_t k = 0; k < 4; ++k) m[c][k] /= pivot, out[c][k] /= pivot;
    for (std::size_t r = 0; r < 4; ++r) {
      const double share = r == c ? 0 : m[r][c];
      for (std::size_t k = 0; k < 4; ++k) {
        m[r][k] -= share * m[c][k], out[r][k] -= share * out[c][k];
      }
    }
  }
  return out;
}

Matrix kept(const float* location, const float* rotation, const float* scale) {
  double length = 0;
  for (std::size_t i = 0; i < 4; ++i) length += double{rotation[i]} * rotation[i];
  length = std::sqrt(length);
  const double w = rotation[0] / length, x = rotation[1] / length, y = rotation[2] / length,
               z = rotation[3] / length;
  Matrix m = identity();
  m[0] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 0};
  m[1] = {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 0};
  m[2] = {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), 0};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) m[r][c] *= double{scale[c]};
    m[r][3] = double{location[r]};
  }
  return m;
}

// Bones in any order that form a tree, with their transforms.
struct Armature {
  std::vector<std::int32_t> parents;
  std::vector<double> rest;
  std::vector<float> location, rotation, scale;

  std::size_t size() const { return parents.size(); }

  Matrix rest_of(std::size_t b) const {
    Matrix m;
    for (std::size_t i = 0; i < 16; ++i) m[i / 4][i % 4] = rest[b * 16 + i];
    return m;
  }

  // The pose of a bone as Blender defines it: pose of the parent * rest matrix relative to the
  // parent * transform.
  Matrix pose(std::size_t b) const {
    const Matrix own = kept(&location[b * 3], &rotation[b * 4], &scale[b * 3]);
    if (parents[b] < 0) return product(rest_of(b), own);
    const auto p = static_cast<std::size_t>(parents[b]);
    return product(pose(p), product(product(inverse(rest_of(p)), rest_of(b)), own));
  }

  std::vector<float> matrices() const {
    const JointChain chain = make_joint_chain(parents, rest.data()).value();
    std::vector<JointChain::Affine> work(size());
    std::vector<float> out(size() * 12);
    evaluate_chain(chain, location.data(), rotation.data(), scale.data(), work.data(), out.data());
    return out;
  }
};

Armature random_armature(std::size_t bones, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> any(-1.0f, 1.0f);
  std::vector<std::int32_t> order(bones);
  for (std::size_t i = 0; i < bones; ++i) order[i] = static_cast<std::int32_t>(i);
  std::ranges::shuffle(order, random);
  Armature a;
  a.parents.resize(bones, -1);
  for (std::size_t i = 1; i < bones; ++i) {
    a.parents[static_cast<std::size_t>(order[i])] = order[random() % i];
  }
  for (std::size_t b = 0; b < bones; ++b) {
    for (std::size_t i = 0; i < 16; ++i) {
      const double v = (i % 5 == 0 ? 1.0 : 0.0) + 0.3 * double{any(random)};
      a.rest.push_back(i < 12 ? v : (i == 15 ? 1.0 : 0.0));
    }
    for (int i = 0; i < 3; ++i) a.location.push_back(0.1f * any(random));
    for (int i = 0; i < 4; ++i) a.rotation.push_back((i == 0 ? 2.0f : 0.0f) + any(random));
    for (int i = 0; i < 3; ++i) a.scale.push_back(1.0f + 0.3f * any(random));
  }
  return a;
}

TEST(JointChain, MovesAsTheReferenceDoesWhateverTheOrderOfTheBones) {
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    const Armature a = random_armature(60, seed);
    const std::vector<float> found = a.matrices();
    for (std::size_t b = 0; b < a.size(); ++b) {
      const Matrix wanted = product(a.pose(b), inverse(a.rest_of(b)));
      for (std::size_t i = 0; i < 12; ++i) {
        ASSERT_NEAR(found[b * 12 + i], wanted[i / 4][i % 4], 1e-5) << "bone " << b;
      }
    }
  }
}

TEST(JointChain, BonesThatKeepNothingMoveExactlyAsTheirParents) {
  Armature a = random_armature(20, 4);
  const auto root = static_cast<std::size_t>(std::ranges::find(a.parents, -1) - a.parents.begin());
  for (std::size_t b = 0; b < 20; ++b) {
    if (b == root) continue;
    for (std::size_t i = 0; i < 3; ++i) a.location[b * 3 + i] = 0, a.scale[b * 3 + i] = 1;
    for (std::size_t i = 1; i < 4; ++i) a.rotation[b * 4 + i] = 0;
  }
  const std::vector<float> found = a.matrices();
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i], found[root * 12 + i % 12]);
}

TEST(JointChain, AScaleOfNothingIsTakenAndWhatIsNotFiniteStaysInItsBranch) {
  Armature a = random_armature(3, 5);
  a.parents = {-1, 0, -1};
  a.scale[0] = a.scale[1] = a.scale[2] = 0;
  for (const float v : a.matrices()) EXPECT_TRUE(std::isfinite(v));
  a.rotation[0] = kNaN;
  const std::vector<float> found = a.matrices();
  EXPECT_TRUE(std::isnan(found[0]) && std::isnan(found[12]));
  for (std::size_t i = 24; i < 36; ++i) EXPECT_TRUE(std::isfinite(found[i]));
}

TEST(JointChain, AQuaternionOfLengthZeroIsHalfATurnAboutX) {
  Armature a = random_armature(1, 6);
  std::ranges::fill(a.rest, 0.0);
  for (std::size_t i = 0; i < 16; i += 5) a.rest[i] = 1;
  a.location = {0, 0, 0}, a.rotation = {0, 0, 0, 0}, a.scale = {1, 1, 1};
  EXPECT_EQ(a.matrices(), (std::vector<float>{1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0}));
}

TEST(JointChain, WrongTreesAndMatricesAreErrors) {
  const std::vector<double> rest(Armature(random_armature(2, 7)).rest);
  const auto fails = [&](std::vector<std::int32_t> parents, std::vector<double> matrices) {
    return !make_joint_chain(parents, matrices.data()).has_value();
  };
  EXPECT_FALSE(fails({-1, 0}, rest));
  EXPECT_TRUE(fails({1, 0}, rest));
  EXPECT_TRUE(fails({0, -1}, rest));
  EXPECT_TRUE(fails({-1, 2}, rest));
  EXPECT_TRUE(fails({-2, -1}, rest));
  for (const std::size_t i : {0u, 12u, 15u, 31u}) {
    std::vector<double> wrong = rest;
    wrong[i] = i == 0 ? std::numeric_limits<double>::infinity() : 0.5;
    EXPECT_TRUE(fails({-1, 0}, wrong)) << i;
  }
  std::vector<double> flat = rest;
  for (std::size_t i = 8; i < 12; ++i) flat[16 + i] = 2 * flat[16 + i - 4];
  EXPECT_TRUE(fails({-1, 0}, flat));
}

// ---- skin

// The influences of a mesh's vertices, and its points. Some vertices may have no influence.
struct Mesh {
  std::vector<std::uint32_t> offsets{0}, bones;
  std::vector<float> weights, points;

  std::uint32_t size() const { return static_cast<std::uint32_t>(offsets.size() - 1); }
  Skin skin(std::uint32_t bone_count) const {
    return make_skin(size(), offsets, bones, weights, bone_count).value();
  }
};

// A mesh with random influences.
// In: counts  vertex v has counts[v % counts.size()] influences
Mesh random_mesh(std::size_t vertices, std::span<const std::uint32_t> counts, std::uint32_t bones,
                 std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> any(-1.0f, 1.0f), weight(0.0f, 2.0f);
  Mesh mesh;
  for (std::size_t v = 0; v < vertices; ++v) {
    for (std::uint32_t i = 0; i < counts[v % counts.size()]; ++i) {
      mesh.bones.push_back(static_cast<std::uint32_t>(random() % bones));
      mesh.weights.push_back(random() % 7 == 0 ? 0.0f : weight(random));
    }
    mesh.offsets.push_back(static_cast<std::uint32_t>(mesh.bones.size()));
    for (int i = 0; i < 3; ++i) mesh.points.push_back(any(random));
  }
  return mesh;
}

std::vector<float> evaluated(const simd::Kernels& kernels, const Mesh& mesh,
                             const std::vector<float>& matrices) {
  const auto bones = static_cast<std::uint32_t>(matrices.size() / 12);
  core::AlignedVector<float> rows((bones + 1) * simd::kSkinRow);
  kernels.skin_rows(matrices.data(), bones, rows.data());
  std::vector<float> out(mesh.points.size(), 1e30f);
  evaluate_skin(mesh.skin(bones), kernels, rows.data(), mesh.points.data(), out.data());
  return out;
}

// The expected points by Blender's formula, in double: p + sum w (M p - p) / sum w, if sum w is
// above 0.0001.
std::vector<double> reference(const Mesh& mesh, const std::vector<float>& matrices) {
  std::vector<double> out(mesh.points.begin(), mesh.points.end());
  for (std::size_t v = 0; v < mesh.size(); ++v) {
    const float* p = &mesh.points[v * 3];
    double sum = 0, moved[3] = {};
    for (std::size_t i = mesh.offsets[v]; i < mesh.offsets[v + 1]; ++i) {
      const float* m = &matrices[std::size_t{mesh.bones[i]} * 12];
      const double w = double{mesh.weights[i]};
      if (w == 0) continue;
      sum += w;
      for (std::size_t r = 0; r < 3; ++r) {
        const double to = double{m[4 * r]} * p[0] + double{m[4 * r + 1]} * p[1] +
                          double{m[4 * r + 2]} * p[2] + double{m[4 * r + 3]};
        moved[r] += w * (to - double{p[r]});
      }
    }
    for (std::size_t r = 0; r < 3; ++r) {
      if (sum > double{kLeastWeight}) out[v * 3 + r] += moved[r] / sum;
    }
  }
  return out;
}

const simd::Kernels& kernels() { return simd::usual_kernels(); }

TEST(Skin, IsTheReferenceForAnyNumberOfInfluencesAndVertices) {
  const std::vector<float> matrices = random_armature(50, 8).matrices();
  const std::vector<std::vector<std::uint32_t>> counts{{0},  {1},  {4},
                                                       {12}, {40}, {0, 1, 2, 3, 4, 5, 12, 13, 40}};
  for (const auto& each : counts) {
    for (const std::size_t vertices : {0u, 1u, 2u, 3u, 4u, 5u, 7u, 9u, 1024u, 1030u, 2100u}) {
      const Mesh mesh = random_mesh(vertices, each, 50, 9);
      const std::vector<float> out = evaluated(kernels(), mesh, matrices);
      const std::vector<double> wanted = reference(mesh, matrices);
      for (std::size_t i = 0; i < out.size(); ++i) {
        ASSERT_NEAR(out[i], wanted[i], 5e-6) << "vertex " << i / 3 << " of " << vertices;
      }
    }
  }
}

TEST(Skin, VerticesWithoutWeightStayToTheBit) {
  Mesh mesh;
  mesh.offsets = {0, 0, 2, 3, 5};
  mesh.bones = {0, 1, 1, 0, 1};
  mesh.weights = {0, 0, 1e-4f, 5e-5f, 6e-5f};
  mesh.points = {0.1f, 0.2f, 0.3f, 0.1f, 0.2f, 0.3f, 0.1f, 0.2f, 0.3f, 0, 0, 0};
  std::vector<float> matrices(24, 0.0f);
  for (std::size_t i = 0; i < 24; ++i) matrices[i] = i % 12 % 5 == 0 ? 1.0f : 0.0f;
  matrices[3] = matrices[15] = 2;  // both bones move by 2 along x
  const std::vector<float> out = evaluated(kernels(), mesh, matrices);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(out[i], mesh.points[i]);
  EXPECT_NEAR(out[9], 2.0f, 1e-6f);  // even if the sum of its weights is tiny
}

TEST(Skin, BonesAtRestChangeNoBit) {
  std::vector<float> matrices(600);
  for (std::size_t i = 0; i < 600; ++i) matrices[i] = i % 12 % 5 == 0 ? 1.0f : 0.0f;
  const std::vector<std::uint32_t> counts{3, 12};
  const Mesh mesh = random_mesh(100, counts, 50, 10);
  EXPECT_EQ(evaluated(kernels(), mesh, matrices), mesh.points);
}

TEST(Skin, WhatIsNotFiniteSpoilsTheVerticesOfItsBoneAlone) {
  std::vector<float> matrices = random_armature(50, 11).matrices();
  const std::vector<std::uint32_t> counts{1, 2, 3, 5};
  Mesh mesh = random_mesh(500, counts, 50, 12);
  const std::vector<float> clean = evaluated(kernels(), mesh, matrices);
  // The matrix of bone 0 is NaN. Vertices must become NaN only if they have a weight on it,
  // although vertices with fewer influences are filled up with influences of weight 0.
  for (std::size_t i = 0; i < 12; ++i) matrices[i] = kNaN;
  mesh.points[0] = kNaN;
  const std::vector<float> out = evaluated(kernels(), mesh, matrices);
  for (std::size_t v = 0; v < mesh.size(); ++v) {
    bool holds = v == 0;
    for (std::size_t i = mesh.offsets[v]; i < mesh.offsets[v + 1]; ++i) {
      holds = holds || (mesh.bones[i] == 0 && mesh.weights[i] != 0);
    }
    EXPECT_EQ(std::isnan(out[v * 3]), holds) << v;
    EXPECT_TRUE(holds || out[v * 3] == clean[v * 3]) << v;
  }
}

TEST(Skin, MayBeEvaluatedInPlace) {
  const std::vector<float> matrices = random_armature(50, 13).matrices();
  const std::vector<std::uint32_t> counts{4, 12, 0};
  const Mesh mesh = random_mesh(1100, counts, 50, 14);
  core::AlignedVector<float> rows(51 * simd::kSkinRow);
  kernels().skin_rows(matrices.data(), 50, rows.data());
  std::vector<float> points = mesh.points;
  evaluate_skin(mesh.skin(50), kernels(), rows.data(), points.data(), points.data());
  EXPECT_EQ(points, evaluated(kernels(), mesh, matrices));
}

TEST(Skin, Sse4HasTheBitsOfTheScalarPath) {
  if (simd::sse4_kernels() == nullptr) GTEST_SKIP() << "this CPU has no SSE4";
  const std::vector<float> matrices = random_armature(50, 15).matrices();
  const std::vector<std::uint32_t> counts{1, 2, 3, 4, 5, 12, 40, 0};
  const Mesh mesh = random_mesh(1500, counts, 50, 16);
  EXPECT_EQ(evaluated(*simd::sse4_kernels(), mesh, matrices),
            evaluated(simd::scalar_kernels(), mesh, matrices));
}

TEST(Skin, WrongListsAreErrors) {
  using Numbers = std::vector<std::uint32_t>;
  const auto code = [](Numbers offsets, Numbers bones, std::vector<float> weights) {
    const auto skin = make_skin(2, offsets, bones, weights, 3);
    return skin ? std::string() : skin.error().where;
  };
  EXPECT_EQ(code({0, 1, 2}, {0, 2}, {1, 1}), "");
  EXPECT_EQ(code({0, 1}, {0}, {1}), "offsets");
  EXPECT_EQ(code({1, 1, 2}, {0, 2}, {1, 1}), "offsets");
  EXPECT_EQ(code({0, 2, 1}, {0, 2}, {1, 1}), "offsets");
  EXPECT_EQ(code({0, 1, 3}, {0, 2}, {1, 1}), "offsets");
  EXPECT_EQ(code({0, 1, 2}, {0, 2}, {1}), "weights");
  EXPECT_EQ(code({0, 1, 2}, {0, 3}, {1, 1}), "bones");
  EXPECT_EQ(code({0, 1, 2}, {0, 2}, {1, -1}), "weights");
  EXPECT_EQ(code({0, 1, 2}, {0, 2}, {kNaN, 1}), "weights");
  EXPECT_EQ(code({0, 1, 2}, {0, 2}, {1, std::numeric_limits<float>::infinity()}), "weights");
  EXPECT_FALSE(make_skin(0, Numbers{0}, {}, {}, 0x10000).has_value());
}

}  // namespace
}  // namespace risorius::rig
