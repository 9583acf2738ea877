// SPDX-License-Identifier: MIT
// Computes the skinning matrices of an armature's bones, parents before children. An Affine has the
// upper three rows of a matrix; its fourth row is 0 0 0 1.
#include "rig/outputs/joint_chain.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace risorius::rig {
namespace {

using core::ErrorCode;
using core::fail;
using core::Result;
using Affine = JointChain::Affine;

constexpr Affine kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

// A matrix counts as not invertible if its determinant, after its columns are scaled to length 1,
// is below this.
constexpr double kLeastDeterminant = 1e-9;

Affine product(const Affine& a, const Affine& b) {
  Affine out;
  for (std::size_t r = 0; r < 12; r += 4) {
    for (std::size_t c = 0; c < 4; ++c) {
      out[r + c] = a[r] * b[c] + a[r + 1] * b[4 + c] + a[r + 2] * b[8 + c];
    }
    out[r + 3] += a[r + 3];
  }
  return out;
}

double column_length(const Affine& m, std::size_t c) {
  return std::sqrt(m[c] * m[c] + m[4 + c] * m[4 + c] + m[8 + c] * m[8 + c]);
}

// Inverts a matrix. Out: out  the inverse; false if the matrix is not invertible
bool invert(const Affine& m, Affine& out) {
  const double c0 = m[5] * m[10] - m[6] * m[9], c1 = m[6] * m[8] - m[4] * m[10],
               c2 = m[4] * m[9] - m[5] * m[8];
  const double determinant = m[0] * c0 + m[1] * c1 + m[2] * c2;
  const double size = column_length(m, 0) * column_length(m, 1) * column_length(m, 2);
  if (!(std::fabs(determinant) > kLeastDeterminant * size)) return false;
  const double d = 1.0 / determinant;
  if (!std::isfinite(d)) return false;
  out = {c0 * d, (m[2] * m[9] - m[1] * m[10]) * d, (m[1] * m[6] - m[2] * m[5]) * d, 0,
         c1 * d, (m[0] * m[10] - m[2] * m[8]) * d, (m[2] * m[4] - m[0] * m[6]) * d, 0,
         c2 * d, (m[1] * m[8] - m[0] * m[9]) * d,  (m[0] * m[5] - m[1] * m[4]) * d, 0};
  for (std::size_t r = 0; r < 12; r += 4) {
    out[r + 3] = -(out[r] * m[3] + out[r + 1] * m[7] + out[r + 2] * m[11]);
  }
  return true;
}

std::string bone_name(std::size_t bone) { return "bone " + std::to_string(bone); }

// Sorts parents before their children. Fails: kInvalidIndex (a parent that does not exist, or a
// cycle of parents)
Result<std::vector<std::uint32_t>> sorted(std::span<const std::int32_t> parents) {
  const std::size_t n = parents.size();
  std::vector<std::uint32_t> order;
  order.reserve(n);
  std::vector<std::uint8_t> done(n);
  std::vector<std::uint32_t> path;
  for (std::size_t start = 0; start < n; ++start) {
    std::size_t bone = start;
    while (done[bone] == 0) {
      path.push_back(static_cast<std::uint32_t>(bone));
      if (path.size() > n) {
        return fail(ErrorCode::kInvalidIndex, "parents",
                    bone_name(bone) + " is in a circle of parents; a tree was expected");
      }
      const std::int32_t parent = parents[bone];
      if (parent == -1) break;
      if (parent < -1 || static_cast<std::size_t>(parent) >= n) {
        return fail(ErrorCode::kInvalidIndex, "parents",
                    bone_name(bone) + " has the parent " + std::to_string(parent) +
                        "; -1 or a bone below " + std::to_string(n) + " was expected");
      }
      bone = static_cast<std::size_t>(parent);
    }
    for (; !path.empty(); path.pop_back()) {
      done[path.back()] = 1;
      order.push_back(path.back());
    }
  }
  return order;
}

// The matrix T(location) R(rotation) S(scale), as in Blender: the rotation is a quaternion w x y z
// of any length; length 0 is half a turn about x.
Affine basis(const float* location, const float* rotation, const float* scale) {
  double q[4] = {rotation[0], rotation[1], rotation[2], rotation[3]};
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (length != 0) {
    for (double& x : q) x /= length;
  } else {
    q[1] = 1;
  }
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double s0 = scale[0], s1 = scale[1], s2 = scale[2];
  return {(1 - 2 * (y * y + z * z)) * s0, 2 * (x * y - w * z) * s1,
          2 * (x * z + w * y) * s2,       location[0],
          2 * (x * y + w * z) * s0,       (1 - 2 * (x * x + z * z)) * s1,
          2 * (y * z - w * x) * s2,       location[1],
          2 * (x * z - w * y) * s0,       2 * (y * z + w * x) * s1,
          (1 - 2 * (x * x + y * y)) * s2, location[2]};
}

bool is_nothing(const float* location, const float* rotation, const float* scale) {
  return location[0] == 0 && location[1] == 0 && location[2] == 0 && rotation[1] == 0 &&
         rotation[2] == 0 && rotation[3] == 0 && std::fabs(rotation[0]) > 0 && scale[0] == 1 &&
         scale[1] == 1 && scale[2] == 1;
}

}  // namespace

Result<JointChain> make_joint_chain(std::span<const std::int32_t> parents, const double* rest) {
  auto order = sorted(parents);
  if (!order) return std::move(order).propagate();
  JointChain chain{{parents.begin(), parents.end()}, std::move(order).value(), {}, {}};
  chain.rest.resize(parents.size());
  chain.inverse.resize(parents.size());
  for (std::size_t b = 0; b < parents.size(); ++b, rest += 16) {
    std::copy(rest, rest + 12, chain.rest[b].begin());
    if (!std::all_of(rest, rest + 16, [](double v) { return std::isfinite(v); })) {
      return fail(ErrorCode::kInvalidValue, "rest",
                  "the rest matrix of " + bone_name(b) + " has a value that is not finite");
    }
    if (rest[12] != 0 || rest[13] != 0 || rest[14] != 0 || rest[15] != 1) {
      return fail(ErrorCode::kInvalidValue, "rest",
                  "0 0 0 1 was expected as the last row of the rest matrix of " + bone_name(b));
    }
    if (!invert(chain.rest[b], chain.inverse[b])) {
      return fail(ErrorCode::kInvalidValue, "rest",
                  "the rest matrix of " + bone_name(b) + " has no inverse");
    }
  }
  return chain;
}

void evaluate_chain(const JointChain& chain, const float* location, const float* rotation,
                    const float* scale, JointChain::Affine* work, float* matrices) noexcept {
  for (const std::uint32_t b : chain.order) {
    const float *l = location + std::size_t{b} * 3, *q = rotation + std::size_t{b} * 4,
                *s = scale + std::size_t{b} * 3;
    const std::int32_t parent = chain.parents[b];
    const Affine& above = parent < 0 ? kIdentity : work[parent];
    // rest * basis * rest^-1 is the bone's own motion in the armature's space. Rest matrices
    // relative to the parent are not needed, because they cancel out.
    if (is_nothing(l, q, s)) {
      work[b] = above;
    } else {
      const Affine own = product(product(chain.rest[b], basis(l, q, s)), chain.inverse[b]);
      work[b] = parent < 0 ? own : product(above, own);
    }
    float* out = matrices + std::size_t{b} * 12;
    for (std::size_t i = 0; i < 12; ++i) out[i] = static_cast<float>(work[b][i]);
  }
}

}  // namespace risorius::rig
