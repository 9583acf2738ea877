// SPDX-License-Identifier: MIT
// Joints turned by quaternions, and Euler angles as quaternions. From: dna-format 12.5
#include <algorithm>
#include <bit>
#include <cmath>

#include "rig/stages.h"

namespace risorius::rig {

namespace {

constexpr std::size_t kLanes = 16;
using Lanes = float[kLanes];

// Sine and cosine by Cephes' polynomials after a reduction by quarter turns; error below 1e-7.
// Loops of a constant count: the compiler makes vectors of them, and their bits are the same on
// every CPU.
void sine_and_cosine(const Lanes& x, Lanes& sines, Lanes& cosines) noexcept {
  constexpr float kRound = 12582912.0f;  // 1.5 * 2^23: what is added to it ends as an integer
  for (std::size_t l = 0; l < kLanes; ++l) {
    const float shifted = x[l] * 0.636619772367581343f + kRound, quarters = shifted - kRound;
    const auto n = std::bit_cast<std::uint32_t>(shifted);
    const float r = ((x[l] - quarters * 1.5703125f) - quarters * 4.837512969970703125e-4f) -
                    quarters * 7.54978995489188216e-8f;
    const float z = r * r;
    const float s =
        r + r * z * (-1.6666654611e-1f + z * (8.3321608736e-3f + z * -1.9515295891e-4f));
    const float c =
        1.0f - 0.5f * z +
        z * z * (4.166664568298827e-2f + z * (-1.388731625493765e-3f + z * 2.443315711809948e-5f));
    const std::uint32_t swap = 0u - (n & 1u);
    const auto sb = std::bit_cast<std::uint32_t>(s), cb = std::bit_cast<std::uint32_t>(c);
    sines[l] = std::bit_cast<float>(((sb & ~swap) | (cb & swap)) ^ ((n & 2u) << 30));
    cosines[l] = std::bit_cast<float>(((cb & ~swap) | (sb & swap)) ^ (((n + 1u) & 2u) << 30));
  }
}

// Angles too large for the reduction, infinities and NaN.
void repair(const Lanes& x, Lanes& sines, Lanes& cosines) noexcept {
  constexpr std::uint32_t kLimit = 0x46000000u;  // the bits of 8192
  std::uint32_t beyond = 0;
  for (std::size_t l = 0; l < kLanes; ++l) {
    beyond |= (std::bit_cast<std::uint32_t>(x[l]) & 0x7FFFFFFFu) > kLimit ? 1u : 0u;
  }
  if (beyond == 0) return;
  for (std::size_t l = 0; l < kLanes; ++l) {
    if (std::fabs(x[l]) <= 8192.0f) continue;
    sines[l] = std::sin(x[l]);
    cosines[l] = std::cos(x[l]);
  }
}

// Half angles by axis in the order of rotation to quaternions, w last.
void to_quaternions(float parity, const Lanes (&half)[3], Lanes (&q)[4]) noexcept {
  Lanes s[3], c[3];
  for (std::size_t a = 0; a < 3; ++a) {
    sine_and_cosine(half[a], s[a], c[a]);
    repair(half[a], s[a], c[a]);
  }
  for (std::size_t l = 0; l < kLanes; ++l) {
    const float cc = c[1][l] * c[0][l], cs = c[1][l] * s[0][l], sc = s[1][l] * c[0][l],
                ss = parity * (s[1][l] * s[0][l]), sk = s[2][l], ck = c[2][l];
    q[0][l] = ck * cs - parity * (sk * sc);
    q[1][l] = ck * sc + parity * (sk * cs);
    q[2][l] = sk * cc - ck * ss;
    q[3][l] = ck * cc + sk * ss;
  }
}

// The rotations of up to kLanes joints.
class EulerBlock {
 public:
  explicit EulerBlock(const EulerConvention& c) : c_(c) {
    for (std::size_t a = 0; a < 3; ++a) factor_[a] = 0.5f * c.signs[a] * c.radians_per_unit;
    parity_ = c.order[1] == (c.order[0] + 1) % 3 ? 1.0f : -1.0f;
  }
  void add(float* rotation) noexcept {
    if (rotation[0] == 0.0f && rotation[1] == 0.0f && rotation[2] == 0.0f) return;
    for (std::size_t a = 0; a < 3; ++a) {
      half_[a][count_] = rotation[c_.order[a]] * factor_[c_.order[a]];
    }
    to_[count_++] = rotation;
    if (count_ == kLanes) flush();
  }
  void flush() noexcept {
    Lanes q[4];
    to_quaternions(parity_, half_, q);
    for (std::size_t l = 0; l < count_; ++l) {
      for (std::size_t a = 0; a < 3; ++a) to_[l][c_.order[a]] = q[a][l];
      to_[l][3] = q[3][l];
    }
    count_ = 0;
  }

 private:
  const EulerConvention& c_;
  float factor_[3], parity_;
  Lanes half_[3]{};
  float* to_[kLanes]{};
  std::size_t count_ = 0;
};

bool is_identity(const Quaternion& q) {
  return q.x == 0.0f && q.y == 0.0f && q.z == 0.0f && q.w == 1.0f;
}

// The column's share of a rotation, applied after what is there.
void apply(const QuaternionTerm& term, float v, Quaternion& product) noexcept {
  const Quaternion& full = term.rotation;
  const float identity = full.w >= 0.0f ? 1.0f - v : v - 1.0f;
  const Quaternion blend{full.x * v, full.y * v, full.z * v, full.w * v + identity};
  const float length =
      std::sqrt(blend.x * blend.x + blend.y * blend.y + blend.z * blend.z + blend.w * blend.w);
  product =
      multiply({blend.x / length, blend.y / length, blend.z / length, blend.w / length}, product);
}

void find_columns(const Rig& rig, Workspace& work, const float* controls) noexcept {
  const std::uint32_t* begins = rig.quaternion_column_begins.data();
  for (std::uint32_t c = 0; c < rig.control_count; ++c) {
    if (controls[c] == 0.0f) continue;
    for (std::uint32_t i = begins[c]; i < begins[c + 1]; ++i) {
      const std::uint32_t column = rig.quaternion_column_list[i];
      work.quaternion_bits[column / 64] |= std::uint64_t{1} << (column % 64);
    }
  }
}

}  // namespace

namespace detail {

void euler_joints(const Rig& rig, float* joints) noexcept {
  for (std::uint32_t j = 0; j < rig.joint_count; ++j) rotation_of(rig, joints, j)[3] = 1.0f;
  EulerBlock block(rig.euler);
  for (const std::uint16_t joint : rig.euler_joints) block.add(rotation_of(rig, joints, joint));
  block.flush();
}

// Columns in the order of the file, so that the products are; those at rest are passed over.
void quaternion_joints(const Rig& rig, std::uint32_t lod, Workspace& work,
                       const PoseView& pose) noexcept {
  if (rig.quaternion_joints.empty()) return;
  std::fill(work.products.begin(), work.products.end(), Quaternion{});
  find_columns(rig, work, pose.controls);
  for (std::size_t word = 0; word < work.quaternion_bits.size(); ++word) {
    for (std::uint64_t bits = work.quaternion_bits[word]; bits != 0; bits &= bits - 1) {
      const QuaternionColumn& column =
          rig.quaternion_columns[word * 64 + static_cast<std::size_t>(std::countr_zero(bits))];
      for (std::uint32_t t = column.terms_begin; t < column.terms_end; ++t) {
        const QuaternionTerm& term = rig.quaternion_terms[t];
        apply(term, pose.controls[column.control], work.products[term.slot]);
      }
    }
    work.quaternion_bits[word] = 0;
  }
  for (std::size_t i = 0; i < work.products.size(); ++i) {
    const QuaternionJoint& q = rig.quaternion_joints[i];
    if (q.first_row >= rig.joint_group_lods[q.group * rig.lod_count + lod]) continue;
    float* to = rotation_of(rig, pose.joints, q.joint);
    if (is_identity(work.products[i]) && rig.joint_stride == 9) {
      std::fill(to, to + 3, 0.0f);
    } else {
      store_rotation(rig, work.products[i], to);
    }
  }
}

void rotations(const Rig& rig, std::uint32_t lod, Workspace& work, const PoseView& pose) noexcept {
  if (rig.joint_stride == 10) euler_joints(rig, pose.joints);
  quaternion_joints(rig, lod, work, pose);
  twist_and_swing(rig, pose);
  ml_joints(rig, lod, pose);
}

}  // namespace detail

}  // namespace risorius::rig
