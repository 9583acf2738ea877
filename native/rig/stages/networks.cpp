// SPDX-License-Identifier: MIT
// Neural networks: the operations of their graph (gather reads controls, scatter writes controls),
// and the joints that the networks move.
// From: dna-format 12.3, 12.5
#include <algorithm>
#include <cmath>

#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

void activate(const MlLayer& layer, float* values, std::uint32_t count) noexcept {
  for (std::uint32_t i = 0; i < count; ++i) {
    const float v = values[i];
    switch (layer.activation) {
      case 1:
        values[i] = v < 0.0f ? 0.0f : v;
        break;
      case 2:
        values[i] = v < 0.0f ? layer.alpha * v : v;
        break;
      case 3:
        values[i] = std::tanh(v);
        break;
      case 4:
        values[i] = 1.0f / (1.0f + std::exp(-v));
        break;
      default:
        break;
    }
  }
}

// Runs one layer of a network with the kernel of the joint matrices. The biases are an additional
// column whose input is 1. Inputs at 0 are skipped.
void run_layer(const Rig& rig, const MlLayer& layer, std::uint32_t rows, const float* in,
               std::uint32_t inputs, Workspace& work, float* out) noexcept {
  std::size_t n = 0;
  const auto add = [&](std::uint32_t column, std::size_t weight) {
    work.layer_columns[n++] = {layer.weights_begin + column * layer.rows,
                               static_cast<std::uint32_t>(weight)};
  };
  add(0, work.layers[0].size() - 1);
  for (std::uint32_t i = 0; i < std::min(inputs, layer.columns); ++i) {
    if (in[i] != 0.0f) add(i + 1, i);
  }
  rig.kernels->columns(rig.ml_weights.data(), work.layer_columns.data(), n, in, out, rows);
  activate(layer, out, rows);
}

// Copies the values that an operation reads from other operations to one list of at most `most`
// values.
// Out: number of values
std::uint32_t join(const Rig& rig, const MlOperation& op, const float* values, std::uint32_t most,
                   float* to) noexcept {
  std::uint32_t n = 0;
  for (std::uint32_t s = 0; s < op.segment_count; ++s) {
    const MlSegment& segment = rig.ml_segments[op.segments_begin + s];
    const std::uint32_t count = std::min(segment.count, most - n);
    std::copy(values + segment.begin, values + segment.begin + count, to + n);
    n += count;
  }
  return n;
}

// Runs a network. Rows that the LOD does not compute are 0.
void run_network(const Rig& rig, const MlOperation& op, std::uint32_t lod,
                 Workspace& work) noexcept {
  float* values = work.operation_values.data();
  float *in = work.layers[0].data(), *out = work.layers[1].data();
  std::uint32_t count = join(rig, op, values, rig.widest_layer, in);
  for (std::uint32_t l = op.items_begin; l < op.items_begin + op.item_count; ++l) {
    const std::uint32_t rows = rig.ml_layer_rows[std::size_t{l} * rig.lod_count + lod];
    run_layer(rig, rig.ml_layers[l], rows, in, count, work, out);
    std::swap(in, out);
    count = rows;
  }
  count = std::min(count, op.value_count);
  float* to = values + op.values_begin;
  std::fill(std::copy(in, in + count, to), to + op.value_count, 0.0f);
}

void run_sum(const Rig& rig, const MlOperation& op, float* values) noexcept {
  float* to = values + op.values_begin;
  std::fill(to, to + op.value_count, 0.0f);
  for (std::uint32_t s = 0; s < op.segment_count; ++s) {
    const MlSegment& segment = rig.ml_segments[op.segments_begin + s];
    for (std::uint32_t i = 0; i < std::min(segment.count, op.value_count); ++i) {
      to[i] += segment.weight * values[segment.begin + i];
    }
  }
}

void run_scatter(const Rig& rig, const MlOperation& op, bool rests, const float* values,
                 float* controls) noexcept {
  const MlControl* items = rig.ml_controls.data() + op.items_begin;
  std::uint32_t n = 0;
  for (std::uint32_t s = 0; s < op.segment_count; ++s) {
    const MlSegment& segment = rig.ml_segments[op.segments_begin + s];
    for (std::uint32_t i = 0; i < segment.count && n < op.item_count; ++i, ++n) {
      if (items[n].control == kNone) continue;
      controls[items[n].control] = rests ? items[n].rest : values[segment.begin + i];
    }
  }
}

Quaternion normalized(const Quaternion& q) {
  const float length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  return length == 0.0f ? Quaternion{}
                        : Quaternion{q.x / length, q.y / length, q.z / length, q.w / length};
}

std::array<float, 3> to_our_axes(const Rig& rig, const std::array<float, 3>& v) {
  std::array<float, 3> out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) out[j] += v[i] * rig.ml_basis[i * 3 + j];
  }
  return out;
}

Quaternion to_our_axes(const Rig& rig, const Quaternion& q) {
  const std::array<float, 3> axis = to_our_axes(rig, std::array{q.x, q.y, q.z});
  const float d = determinant(rig.ml_basis);
  return {d * axis[0], d * axis[1], d * axis[2], q.w};
}

void add(const std::array<float, 3>& v, float* to) {
  for (std::size_t i = 0; i < 3; ++i) to[i] += v[i];
}

void turn(const Rig& rig, const Quaternion& q, float* to) {
  if (rig.joint_stride == 9) return add(to_euler(rig.euler, q), to);
  detail::store_rotation(rig, multiply(q, {to[0], to[1], to[2], to[3]}), to);
}

// Converts a scale to the face's axes. A scale along an axis is the same in both directions, so
// that the three values are only permuted.
std::array<float, 3> scale_in_our_axes(const Rig& rig, const std::array<float, 3>& v) {
  std::array<float, 3> out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) out[j] += v[i] * std::fabs(rig.ml_basis[i * 3 + j]);
  }
  return out;
}

}  // namespace

void detail::run_operation(const Rig& rig, std::uint32_t index, std::uint32_t lod, Workspace& work,
                           float* controls) noexcept {
  const MlOperation& op = rig.ml_operations[index];
  float* values = work.operation_values.data();
  const bool rests = op.mask != kNone && work.masks[op.mask] == 0.0f;
  if (op.kind == MlOperation::kGather) {
    const MlControl* items = rig.ml_controls.data() + op.items_begin;
    for (std::uint32_t i = 0; i < op.value_count; ++i) {
      values[op.values_begin + i] = controls[items[i].control];
    }
  } else if (op.kind == MlOperation::kMlp && rests) {
    std::fill(values + op.values_begin, values + op.values_begin + op.value_count, 0.0f);
  } else if (op.kind == MlOperation::kMlp) {
    run_network(rig, op, lod, work);
  } else if (op.kind == MlOperation::kWeightedSum) {
    run_sum(rig, op, values);
  } else {
    run_scatter(rig, op, rests, values, controls);
  }
}

void detail::ml_joints(const Rig& rig, std::uint32_t lod, const PoseView& pose) noexcept {
  for (std::size_t j = 0; j < rig.ml_joints.size(); ++j) {
    if (rig.ml_joint_lods[j * rig.lod_count + lod] == 0) continue;
    const MlJoint& joint = rig.ml_joints[j];
    float v[10];
    for (std::size_t i = 0; i < 10; ++i) {
      v[i] = joint.controls[i] == kNone ? 0.0f : pose.controls[joint.controls[i]];
    }
    std::array<float, 3> translation{v[0], v[1], v[2]}, angles{v[3], v[4], v[5]},
        scale{v[7], v[8], v[9]};
    Quaternion q{v[3], v[4], v[5], v[6]};
    const bool euler_as_is = joint.is_quaternion == 0 && rig.ml_converted == 0;
    if (joint.is_quaternion == 0) q = from_euler(rig.ml_euler, angles);
    q = normalized(q);
    if (rig.ml_converted != 0) {
      translation = to_our_axes(rig, translation);
      q = to_our_axes(rig, q);
      scale = scale_in_our_axes(rig, scale);
    }
    float* rotation = rotation_of(rig, pose.joints, joint.joint);
    add(translation, rotation - 3);
    if (euler_as_is && rig.joint_stride == 9) {
      add(angles, rotation);
    } else {
      turn(rig, q, rotation);
    }
    add(scale, rotation + rig.joint_stride - 6);
  }
}

}  // namespace risorius::rig
