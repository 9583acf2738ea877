// SPDX-License-Identifier: MIT
// Computes positions of points of a skin, and their derivatives by raw controls as difference
// quotients: each control is moved a little from a base pose, and only the points that this moves
// are skinned again.
#include "solve/probe.h"

#include <algorithm>
#include <cstring>

#include "rig/stages/evaluate.h"

namespace risorius::solve {

namespace {

constexpr std::uint32_t kUnused = 0xFFFFFFFFu;

/// Inverts lists: from the things that each point uses to the points that use each thing,
/// ascending. A thing is a joint or a channel.
/// In:  begins, things  the things of point p are things[begins[p]] up to things[begins[p + 1]]
///      count           number of joints or channels
///      thing           thing(t): the index of the joint or channel of an element of things
/// Out: user_begins     [count + 1] into users
///      users           the indices of the points
template <class T, class F>
void invert(const std::vector<std::uint32_t>& begins, const std::vector<T>& things,
            std::size_t count, F thing, std::vector<std::uint32_t>& user_begins,
            std::vector<std::uint32_t>& users) {
  user_begins.assign(count + 1, 0);
  for (const T& t : things) ++user_begins[thing(t) + 1];
  for (std::size_t i = 0; i < count; ++i) user_begins[i + 1] += user_begins[i];
  users.resize(things.size());
  std::vector<std::uint32_t> next(user_begins.begin(), user_begins.end() - 1);
  for (std::uint32_t p = 0; p + 1 < begins.size(); ++p) {
    for (std::uint32_t i = begins[p]; i < begins[p + 1]; ++i) users[next[thing(things[i])]++] = p;
  }
}

std::span<const std::uint32_t> users_of(const std::vector<std::uint32_t>& begins,
                                        const std::vector<std::uint32_t>& users, std::size_t i) {
  return {users.data() + begins[i], users.data() + begins[i + 1]};
}

}  // namespace

Probe::Probe(const Surface& surface, std::span<const Point> points) : surface_(surface) {
  const rig::Rig& rig = *surface.rig;
  std::vector<bool> needed(rig.joint_count, false);
  std::vector<std::uint32_t> channel_place(rig.blend_shape_count, kUnused);
  influence_begins_.push_back(0), shape_begins_.push_back(0);
  for (const Point& point : points) {
    const SkinMesh& mesh = surface.meshes[point.mesh];
    points_.push_back(mesh.positions[point.vertex]);
    for (std::uint32_t i = mesh.influence_begins[point.vertex];
         i < mesh.influence_begins[point.vertex + 1]; ++i) {
      if (mesh.influences[i].weight == 0.0f) continue;
      influences_.push_back(mesh.influences[i]);
      needed[mesh.influences[i].joint] = true;
    }
    for (std::uint32_t i = mesh.shape_begins[point.vertex]; i < mesh.shape_begins[point.vertex + 1];
         ++i) {
      std::uint32_t& place = channel_place[mesh.shapes[i].channel];
      if (place == kUnused) {
        place = static_cast<std::uint32_t>(channels_.size());
        channels_.push_back(mesh.shapes[i].channel);
      }
      shapes_.push_back({place, mesh.shapes[i].delta});
    }
    influence_begins_.push_back(static_cast<std::uint32_t>(influences_.size()));
    shape_begins_.push_back(static_cast<std::uint32_t>(shapes_.size()));
  }
  add_joints(needed);
  list_users();
  work_ = rig::make_batch_workspace(rig);
  raw_.resize(kFrames * rig.raw_count);
  joint_values_.resize(kFrames * rig.joint_count * rig.joint_stride);
  shape_values_.resize(kFrames * rig.blend_shape_count);
  map_values_.resize(kFrames * rig.animated_map_count);
  control_values_.resize(kFrames * rig.control_count);
}

void Probe::add_joints(const std::vector<bool>& needed) {
  std::vector<bool> taken = needed;
  for (auto j = surface_.order.rbegin(); j != surface_.order.rend(); ++j) {
    if (taken[*j]) taken[surface_.parents[*j]] = true;
  }
  std::vector<std::uint32_t> place(taken.size(), kUnused);
  for (const std::uint32_t j : surface_.order) {
    if (!taken[j]) continue;
    place[j] = static_cast<std::uint32_t>(joints_.size());
    joints_.push_back({j, place[surface_.parents[j]]});
  }
  for (Influence& i : influences_) i.joint = place[i.joint];
}

void Probe::list_users() {
  invert(
      influence_begins_, influences_, joints_.size(), [](const Influence& i) { return i.joint; },
      joint_users_begins_, joint_users_);
  invert(
      shape_begins_, shapes_, channels_.size(), [](const Shape& s) { return s.channel; },
      channel_users_begins_, channel_users_);
  deltas_.resize(joints_.size() * 9), weights_.resize(channels_.size());
  world_.resize(joints_.size()), skin_.resize(joints_.size());
  base_.resize(points_.size()), moved_.resize(joints_.size());
  is_marked_.resize(points_.size());
}

// Makes a frame of the last evaluation the base pose, from which difference quotients are taken.
void Probe::take(std::size_t frame) {
  const rig::Rig& rig = *surface_.rig;
  const float* joints = joint_values_.data() + frame * rig.joint_count * 9;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const Joint& joint = joints_[j];
    const float* delta = joints + std::size_t{joint.index} * 9;
    std::copy(delta, delta + 9, deltas_.begin() + static_cast<std::ptrdiff_t>(j * 9));
    const Matrix local = local_matrix(rig, joint.index, delta);
    world_[j] = joint.parent == j ? local : multiply(world_[joint.parent], local);
    skin_[j] = multiply(world_[j], surface_.neutral_inverse[joint.index]);
  }
  const float* shapes = shape_values_.data() + frame * rig.blend_shape_count;
  for (std::size_t c = 0; c < channels_.size(); ++c) weights_[c] = shapes[channels_[c]];
  other_world_ = world_, other_skin_ = skin_, other_weights_ = weights_;
  for (std::size_t p = 0; p < points_.size(); ++p) base_[p] = place(p);
}

std::array<double, 3> Probe::place(std::size_t point) const {
  std::array<double, 3> v{points_[point][0], points_[point][1], points_[point][2]};
  for (std::uint32_t i = shape_begins_[point]; i < shape_begins_[point + 1]; ++i) {
    const double weight = other_weights_[shapes_[i].channel];
    if (weight == 0.0) continue;
    for (std::size_t k = 0; k < 3; ++k) v[k] += weight * double{shapes_[i].delta[k]};
  }
  if (influence_begins_[point] == influence_begins_[point + 1]) return v;
  Matrix sum{};
  for (std::uint32_t i = influence_begins_[point]; i < influence_begins_[point + 1]; ++i) {
    const Matrix& m = other_skin_[influences_[i].joint];
    const double weight = influences_[i].weight;
    for (std::size_t k = 0; k < 12; ++k) sum[k] += weight * m[k];
  }
  std::array<double, 3> out;
  for (std::size_t k = 0; k < 3; ++k) {
    out[k] = sum[4 * k] * v[0] + sum[4 * k + 1] * v[1] + sum[4 * k + 2] * v[2] + sum[4 * k + 3];
  }
  return out;
}

void Probe::mark(std::span<const std::uint32_t> users) {
  for (const std::uint32_t p : users) {
    if (is_marked_[p] != 0) continue;
    is_marked_[p] = 1;
    marked_.push_back(p);
  }
}

// Finds the joints and channels in which a frame of the last evaluation differs from the base pose,
// writes their matrices and weights to other_world_, other_skin_ and other_weights_, and marks the
// points that they move. A joint also differs if its parent does.
void Probe::changed(std::size_t frame) {
  const rig::Rig& rig = *surface_.rig;
  const float* joints = joint_values_.data() + frame * rig.joint_count * 9;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const Joint& joint = joints_[j];
    const float* delta = joints + std::size_t{joint.index} * 9;
    const bool own = std::memcmp(delta, deltas_.data() + j * 9, 9 * sizeof(float)) != 0;
    const bool carried = joint.parent != j && moved_[joint.parent] != 0;
    moved_[j] = own || carried ? 1 : 0;
    if (moved_[j] == 0) continue;
    const Matrix local = local_matrix(rig, joint.index, delta);
    other_world_[j] = joint.parent == j ? local : multiply(other_world_[joint.parent], local);
    other_skin_[j] = multiply(other_world_[j], surface_.neutral_inverse[joint.index]);
    mark(users_of(joint_users_begins_, joint_users_, j));
  }
  const float* shapes = shape_values_.data() + frame * rig.blend_shape_count;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const float weight = shapes[channels_[c]];
    if (weight == weights_[c]) continue;
    other_weights_[c] = weight;
    mark(users_of(channel_users_begins_, channel_users_, c));
  }
}

rig::PoseView Probe::poses() {
  return {joint_values_.data(), shape_values_.data(), map_values_.data(), control_values_.data()};
}

void Probe::positions(const float* raw, double* out) {
  rig::evaluate(*surface_.rig, raw, surface_.lod, true, work_, poses());
  take(0);
  for (const std::array<double, 3>& p : base_) out = std::copy(p.begin(), p.end(), out);
}

// Computes a control's column from the points that changed() marked, then restores the base pose.
// In: step  change of the control
void Probe::add_column(std::uint32_t control, double step, Jacobian& out) {
  constexpr std::size_t kNumbers = 3 * Jacobian::kBlock;
  for (const std::uint32_t p : marked_) {
    Jacobian::Block& block = out.blocks[p / Jacobian::kBlock];
    if (block.controls.empty() || block.controls.back() != control) {
      block.controls.push_back(control);
      block.values.resize(block.values.size() + kNumbers);
    }
    float* to = block.values.data() + block.values.size() - kNumbers + 3 * (p % Jacobian::kBlock);
    const std::array<double, 3> there = place(p);
    for (std::size_t k = 0; k < 3; ++k) to[k] = static_cast<float>((there[k] - base_[p][k]) / step);
    is_marked_[p] = 0;
  }
  marked_.clear();
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    if (moved_[j] != 0) other_world_[j] = world_[j], other_skin_[j] = skin_[j];
  }
  other_weights_ = weights_;
}

Jacobian Probe::jacobian(const float* raw, const float* high, const std::uint8_t* free) {
  const rig::Rig& rig = *surface_.rig;
  const std::size_t count = rig.raw_count;
  rig::evaluate_frames(rig, raw, 1, surface_.lod, true, work_, poses());
  take(0);
  Jacobian out;
  out.controls = count, out.points = points_.size();
  out.blocks.resize((points_.size() + Jacobian::kBlock - 1) / Jacobian::kBlock);
  std::vector<std::uint32_t> wanted;
  for (std::uint32_t c = 0; c < count; ++c) {
    if (free[c] != 0) wanted.push_back(c);
  }
  for (std::size_t first = 0; first < wanted.size(); first += kFrames) {
    const std::size_t frames = std::min(kFrames, wanted.size() - first);
    for (std::size_t f = 0; f < frames; ++f) {
      const std::uint32_t c = wanted[first + f];
      std::copy(raw, raw + count, raw_.data() + f * count);
      const double step = double{raw[c]} + kStep <= double{high[c]} ? kStep : -kStep;
      raw_[f * count + c] = static_cast<float>(double{raw[c]} + step);
    }
    rig::evaluate_frames(rig, raw_.data(), frames, surface_.lod, true, work_, poses());
    for (std::size_t f = 0; f < frames; ++f) {
      const std::uint32_t c = wanted[first + f];
      changed(f);
      add_column(c, double{raw_[f * count + c]} - double{raw[c]}, out);
    }
  }
  return out;
}

}  // namespace risorius::solve
