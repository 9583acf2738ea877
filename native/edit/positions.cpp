// SPDX-License-Identifier: MIT
#include "edit/positions.h"

#include <cmath>

namespace risorius::edit::detail {

namespace {

Turn multiply(const Turn& a, const Turn& b) {
  return {
      a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
      a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector rotate(const Turn& q, const Vector& v) {
  const Vector axis{q.x, q.y, q.z};
  const Vector t = cross(axis, v), u = cross(axis, t);
  Vector out;
  for (std::size_t k = 0; k < 3; ++k) out[k] = v[k] + 2.0 * (q.w * t[k] + u[k]);
  return out;
}

}  // namespace

double degrees_between(const Turn& a, const Turn& b) {
  const Turn d = multiply({-a.x, -a.y, -a.z, a.w}, b);
  const double sine = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
  return 2.0 * std::atan2(sine, std::fabs(d.w)) * 57.295779513082320877;
}

Skeleton::Skeleton(const dna::Dna& dna, const rig::EulerConvention& euler) : euler_(euler) {
  const dna::Definition& d = dna.definition;
  const std::size_t n = d.joint_names.size();
  quaternions_.assign(n, false);
  const auto& entries = dna.joint_behavior_metadata.joint_representations;
  for (std::size_t j = 0; j < n; ++j) {
    Vector t{}, r{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (j < d.neutral_joint_translations.count()) t[k] = d.neutral_joint_translations.at(j, k);
      if (j < d.neutral_joint_rotations.count()) r[k] = d.neutral_joint_rotations.at(j, k);
    }
    translations_.push_back(t);
    rotations_.push_back(r);
    parents_.push_back(j < d.joint_parents.size() ? d.joint_parents[j]
                                                  : static_cast<std::uint32_t>(j));
    quaternions_[j] = j < entries.size() && entries[j].rotation == 1;
  }
  std::vector<bool> done(n, false);
  std::vector<std::uint32_t> chain;
  for (std::uint32_t j = 0; j < n; ++j) {
    for (std::uint32_t p = j; !done[p]; p = parents_[p]) {
      chain.push_back(p);
      done[p] = true;
    }
    order_.insert(order_.end(), chain.rbegin(), chain.rend());
    chain.clear();
  }
}

Turn Skeleton::turn(const std::array<double, 3>& angles) const {
  Turn q;
  for (const std::uint8_t axis : euler_.order) {
    const double half = 0.5 * angles[axis] * double{euler_.signs[axis]} *
                        (euler_.radians_per_unit == 1.0f ? 1.0 : 0.017453292519943295769);
    const double s = std::sin(half);
    q = multiply({axis == 0 ? s : 0.0, axis == 1 ? s : 0.0, axis == 2 ? s : 0.0, std::cos(half)},
                 q);
  }
  return q;
}

Local Skeleton::local(std::size_t joint, const float* delta) const {
  Local out;
  Vector angles{}, neutral = rotations_[joint];
  for (std::size_t k = 0; k < 3; ++k) {
    out.translation[k] = translations_[joint][k] + double{delta[k]};
    angles[k] = double{delta[3 + k]};
    out.scale[k] = 1.0 + double{delta[6 + k]};
  }
  if (quaternions_[joint]) {
    out.rotation = multiply(turn(neutral), turn(angles));
  } else {
    for (std::size_t k = 0; k < 3; ++k) neutral[k] += angles[k];
    out.rotation = turn(neutral);
  }
  return out;
}

void Skeleton::place(const std::vector<Local>& locals, std::vector<Vector>& positions) const {
  std::vector<Turn> turns(locals.size());
  std::vector<Vector> scales(locals.size());
  for (const std::uint32_t j : order_) {
    const Local& local = locals[j];
    turns[j] = local.rotation;
    scales[j] = local.scale;
    positions[j] = local.translation;
    const std::uint32_t p = parents_[j];
    if (p == j) continue;
    Vector arm = local.translation;
    for (std::size_t k = 0; k < 3; ++k) arm[k] *= scales[p][k];
    arm = rotate(turns[p], arm);
    for (std::size_t k = 0; k < 3; ++k) {
      positions[j][k] = positions[p][k] + arm[k];
      scales[j][k] *= scales[p][k];
    }
    turns[j] = multiply(turns[p], local.rotation);
  }
}

}  // namespace risorius::edit::detail
