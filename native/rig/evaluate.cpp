// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>
#include <cstring>

#include "rig/rig.h"
#include "rig/stages.h"

namespace risorius::rig {

namespace {

float clamp01(float v) { return v < 0.0f ? 0.0f : (v > 1.0f ? 1.0f : v); }

void evaluate_rows(std::span<const ConditionalRow> rows, const float* in, float* out,
                   std::size_t outputs) noexcept {
  std::fill(out, out + outputs, 0.0f);
  for (std::size_t i = 0; i < rows.size();) {
    const ConditionalRow& row = rows[i];
    const float v = in[row.input];
    const bool holds = row.from <= v && v <= row.to;
    if (holds || v != v) out[row.output] += row.slope * v + row.cut;
    i = holds ? row.run_end : i + 1;
  }
  for (std::size_t o = 0; o < outputs; ++o) out[o] = clamp01(out[o]);
}

float corrective(const Rig& rig, const Psd& psd, const float* values) noexcept {
  const std::uint16_t* factors = rig.psd_factors.data() + psd.factors_begin;
  float product = psd.weight;
  for (std::uint32_t f = 0; f < psd.factor_count; ++f) product *= clamp01(values[factors[f]]);
  return product > 1.0f ? 1.0f : product;
}

// Faces are sparse in time: what rests at 0 costs no more than being passed over here.
std::size_t append_active(const float* controls, std::uint32_t begin, std::uint32_t end,
                          std::uint16_t* active) noexcept {
  std::size_t n = 0;
  for (std::uint32_t c = begin; c < end; ++c) {
    active[n] = static_cast<std::uint16_t>(c);
    n += controls[c] != 0.0f ? 1 : 0;
  }
  return n;
}

class Correctives {
 public:
  Correctives(const Rig& rig, Workspace& work, float* controls)
      : rig_(rig), work_(work), controls_(controls) {}

  void watched(std::uint32_t lod, std::span<const std::uint16_t> active) noexcept {
    const std::uint32_t* begins =
        rig_.watch_begins.data() + std::size_t{lod} * (rig_.control_count + 1);
    for (const std::uint16_t control : active) {
      for (std::uint32_t i = begins[control]; i < begins[control + 1]; ++i) {
        const Watch watch = rig_.watched[i];
        if (controls_[watch.other] <= 0.0f) continue;  // clamped, this factor is 0
        set(watch.psd, corrective(rig_, rig_.psds[watch.psd], controls_));
      }
    }
  }
  void chained(std::uint32_t lod, const float* last) noexcept {
    for (std::uint32_t i = rig_.chained_begins[lod]; i < rig_.chained_begins[lod + 1]; ++i) {
      const std::uint32_t p = rig_.chained[i];
      set(p, corrective(rig_, rig_.psds[p], last != nullptr ? last : controls_));
    }
  }

 private:
  void set(std::uint32_t p, float value) noexcept {
    if (value == 0.0f) return;
    controls_[rig_.psds[p].output] = value;
    work_.psd_bits[p / 64] |= std::uint64_t{1} << (p % 64);
  }

  const Rig& rig_;
  Workspace& work_;
  float* controls_;
};

constexpr std::size_t kAhead = 2;

// The columns of each group that are not at rest. By ascending control, so that sums have one
// order.
void list_columns(const Rig& rig, Workspace& work, const float* controls) noexcept {
  for (std::size_t i = 0; i < rig.joint_groups.size(); ++i) {
    work.column_ends[i] = rig.joint_groups[i].columns_begin;
  }
  for (std::size_t a = 0; a < work.active_count; ++a) {
    const std::uint16_t control = work.active[a];
    const float v = controls[control];
    for (std::uint32_t i = rig.joint_column_begins[control];
         i < rig.joint_column_begins[control + 1]; ++i) {
      const JointColumn column = rig.joint_columns[i];
      work.columns[work.column_ends[column.group]++] = {column.offset, v};
    }
  }
}

// Asks for the columns of a group while the group before is summed: they lie all over the matrices,
// where the hardware does not see them coming.
void prefetch_columns(const Rig& rig, std::uint32_t lod, const Workspace& work,
                      std::size_t i) noexcept {
  if (i >= rig.joint_groups.size()) return;
  const JointGroup& g = rig.joint_groups[i];
  const std::size_t size = rig.is_half() ? 2 : 4;
  const std::size_t bytes = rig.joint_group_lods[i * rig.lod_count + lod] * size;
  const auto* values = rig.is_half() ? reinterpret_cast<const char*>(rig.joint_halves.data())
                                     : reinterpret_cast<const char*>(rig.joint_values.data());
  for (std::uint32_t c = g.columns_begin; c < work.column_ends[i]; ++c) {
    const char* column = values + work.columns[c].offset * size;
    for (std::size_t at = 0; at < bytes; at += 64) simd::prefetch(column + at);
  }
}

void joints(const Rig& rig, std::uint32_t lod, Workspace& work, const PoseView& pose) noexcept {
  list_columns(rig, work, pose.controls);
  for (std::size_t i = 0; i < kAhead; ++i) prefetch_columns(rig, lod, work, i);
  for (std::size_t i = 0; i < rig.joint_groups.size(); ++i) {
    prefetch_columns(rig, lod, work, i + kAhead);
    const JointGroup& g = rig.joint_groups[i];
    const std::uint32_t rows = rig.joint_group_lods[i * rig.lod_count + lod];
    if (rows == 0) continue;
    const simd::Column* columns = work.columns.data() + g.columns_begin;
    const std::uint32_t count = work.column_ends[i] - g.columns_begin;
    float* out = work.rows.data() + g.rows_begin;
    if (count == 0) {
      std::fill(out, out + rows, 0.0f);
    } else if (rig.is_half()) {
      rig.kernels->half_columns(rig.joint_halves.data(), columns, count, out, rows);
    } else {
      rig.kernels->columns(rig.joint_values.data(), columns, count, out, rows);
    }
  }
  detail::place_rows(rig, lod, work.rows.data(), pose.joints);
}

}  // namespace

namespace detail {

std::uint32_t clamp_lod(const Rig& rig, std::uint32_t lod) noexcept {
  return rig.lod_count == 0 ? 0 : std::min(lod, rig.lod_count - 1);
}

void correctives(const Rig& rig, std::uint32_t lod, const float* last, Workspace& work,
                 float* controls) noexcept {
  const std::uint32_t raw = rig.raw_count, after = raw + rig.psd_count;
  std::fill(controls + raw, controls + after, 0.0f);
  std::fill(work.psd_bits.begin(), work.psd_bits.end(), 0u);
  std::uint16_t* active = work.active.data();
  std::size_t n = append_active(controls, 0, raw, active);
  const std::size_t others = append_active(controls, after, rig.control_count, active + n);
  Correctives all(rig, work, controls);
  all.watched(lod, {active, n + others});
  all.chained(lod, last);
  // In ascending order: raw, correctives, networks and poses.
  for (std::size_t word = 0; word < work.psd_bits.size(); ++word) {
    for (std::uint64_t bits = work.psd_bits[word]; bits != 0; bits &= bits - 1) {
      const auto p = word * 64 + static_cast<std::size_t>(std::countr_zero(bits));
      active[n++] = rig.psds[p].output;
    }
  }
  if (others > 0) n += append_active(controls, after, rig.control_count, active + n);
  work.active_count = n;
}

void begin(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
           float* controls) noexcept {
  std::copy(raw, raw + rig.raw_count, controls);
  std::fill(controls + rig.raw_count, controls + rig.control_count, 0.0f);
  const float* last = nullptr;
  if (!settle && !rig.chained.empty()) {
    std::copy(controls, controls + rig.control_count, work.last_controls.begin());
    last = work.last_controls.data();
  }
  correctives(rig, lod, last, work, controls);
}

// Extra pieces add to places that the first ones left at 0.
void place_rows(const Rig& rig, std::uint32_t lod, const float* rows, float* joints) noexcept {
  const std::size_t places = std::size_t{rig.joint_count} * 9, whole = places / simd::kPlaces;
  const std::size_t blocks = (places + simd::kPlaces - 1) / simd::kPlaces;
  const simd::Piece* pieces = rig.joint_pieces.data() + lod * blocks;
  rig.kernels->place(pieces, whole, rows, joints);
  if (whole < blocks) {
    float last[simd::kPlaces];
    rig.kernels->place(pieces + whole, 1, rows, last);
    std::copy(last, last + places % simd::kPlaces, joints + whole * simd::kPlaces);
  }
  for (std::uint32_t i = rig.extra_begins[lod]; i < rig.extra_begins[lod + 1]; ++i) {
    const simd::Piece& piece = rig.extra_pieces[i];
    const float* next = rows + piece.from;
    float* to = joints + std::size_t{piece.block} * simd::kPlaces;
    for (std::uint32_t bits = piece.mask; bits != 0; bits &= bits - 1) {
      to[std::countr_zero(bits)] = *next++;
    }
  }
}

// Columns in order, each applied after the ones before (dna-format 12.5, quaternion groups).
void quaternion_joints(const Rig& rig, std::uint32_t lod, const PoseView& pose) noexcept {
  for (const QuaternionJoint& q : rig.quaternion_joints) {
    if (q.first_row >= rig.joint_group_lods[q.group * rig.lod_count + lod]) continue;
    Quaternion product;
    for (std::uint32_t t = q.terms_begin; t < q.terms_end; ++t) {
      const QuaternionTerm& term = rig.quaternion_terms[t];
      const float v = pose.controls[term.control];
      if (v == 0.0f) continue;
      const Quaternion& full = term.rotation;
      const float identity = full.w >= 0.0f ? 1.0f - v : v - 1.0f;
      const Quaternion blend{full.x * v, full.y * v, full.z * v, full.w * v + identity};
      const float length =
          std::sqrt(blend.x * blend.x + blend.y * blend.y + blend.z * blend.z + blend.w * blend.w);
      product = multiply({blend.x / length, blend.y / length, blend.z / length, blend.w / length},
                         product);
    }
    const std::array<float, 3> angles = to_euler(rig.euler, product);
    std::copy(angles.begin(), angles.end(), pose.joints + std::size_t{q.joint} * 9 + 3);
  }
}

void channels_and_maps(const Rig& rig, std::uint32_t lod, const PoseView& pose) noexcept {
  std::fill(pose.blend_shapes, pose.blend_shapes + rig.blend_shape_count, 0.0f);
  const std::uint32_t shapes = rig.shape_lods.empty() ? 0 : rig.shape_lods[lod];
  for (std::uint32_t i = 0; i < shapes; ++i) {
    pose.blend_shapes[rig.shape_outputs[i]] = pose.controls[rig.shape_inputs[i]];
  }
  const std::uint32_t rows = rig.map_lods.empty() ? 0 : rig.map_lods[lod];
  evaluate_rows(rig.map_rows.first(rows), pose.controls, pose.animated_maps,
                rig.animated_map_count);
}

void outputs(const Rig& rig, std::uint32_t lod, Workspace& work, const PoseView& pose) noexcept {
  joints(rig, lod, work, pose);
  quaternion_joints(rig, lod, pose);
  channels_and_maps(rig, lod, pose);
}

}  // namespace detail

Pose make_pose(const Rig& rig) {
  Pose pose;
  pose.joints.resize(std::size_t{rig.joint_count} * 9);
  pose.blend_shapes.resize(rig.blend_shape_count);
  pose.animated_maps.resize(rig.animated_map_count);
  pose.controls.resize(rig.control_count);
  return pose;
}

Workspace make_workspace(const Rig& rig) {
  Workspace work;
  work.active.resize(std::size_t{rig.control_count} + 1);  // one is written past the last
  work.psd_bits.resize((rig.psds.size() + 63) / 64);
  work.column_ends.resize(rig.joint_groups.size());
  work.columns.resize(rig.list_count);
  work.rows.resize(detail::rows_size(rig));
  work.last_controls.resize(rig.control_count);
  return work;
}

void gui_to_raw(const Rig& rig, const float* gui, float* raw) noexcept {
  evaluate_rows(rig.gui_rows, gui, raw, rig.raw_count);
}

void evaluate(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
              const PoseView& pose) noexcept {
  const std::uint32_t level = detail::clamp_lod(rig, lod);
  if (rig.lod_count == 0) {
    std::copy(raw, raw + rig.raw_count, pose.controls);
    std::fill(pose.controls + rig.raw_count, pose.controls + rig.control_count, 0.0f);
    std::fill(pose.joints, pose.joints + std::size_t{rig.joint_count} * 9, 0.0f);
    std::fill(pose.blend_shapes, pose.blend_shapes + rig.blend_shape_count, 0.0f);
    std::fill(pose.animated_maps, pose.animated_maps + rig.animated_map_count, 0.0f);
    return;
  }
  detail::begin(rig, raw, level, settle, work, pose.controls);
  detail::outputs(rig, level, work, pose);
}

std::vector<std::string> Rig::texts(std::size_t first, std::size_t count) const {
  std::vector<std::string> out;
  for (std::size_t t = first; t < first + count; ++t) {
    const std::uint32_t begin = t == 0 ? 0 : text_ends[t - 1];
    out.emplace_back(text.data() + begin, text_ends[t] - begin);
  }
  return out;
}

}  // namespace risorius::rig
