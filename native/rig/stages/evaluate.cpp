// SPDX-License-Identifier: MIT
#include "rig/stages/evaluate.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "rig/stages/stages.h"

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
    std::uint16_t* candidates = work_.candidates.data();
    std::size_t n = 0;
    for (const std::uint16_t control : active) {
      for (std::uint32_t i = begins[control]; i < begins[control + 1]; ++i) {
        candidates[n] = rig_.watched[i].psd;
        n += controls_[rig_.watched[i].other] <= 0.0f ? 0 : 1;  // clamped, another factor is 0
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      const Psd& psd = rig_.psds[candidates[i]];
      set(psd.output, corrective(rig_, psd, controls_));
    }
  }
  // In: from  what they read. The output may be a raw control, which is active by itself.
  void one(std::uint32_t p, const float* from) noexcept {
    const Psd& psd = rig_.psds[p];
    const float value = corrective(rig_, psd, from);
    if (psd.output < rig_.raw_count) {
      controls_[psd.output] = value;
    } else {
      set(psd.output, value);
    }
  }

 private:
  void set(std::uint32_t output, float value) noexcept {
    if (value == 0.0f) return;
    controls_[output] = value;
    const std::uint32_t p = output - rig_.raw_count;
    work_.psd_bits[p / 64] |= std::uint64_t{1} << (p % 64);
  }

  const Rig& rig_;
  Workspace& work_;
  float* controls_;
};

// The columns of each group that are not at rest. By ascending control, so that sums have one
// order.
void list_columns(const Rig& rig, std::uint32_t lod, Workspace& work,
                  const float* controls) noexcept {
  const std::uint32_t live = rig.live_groups[lod];
  const std::span active(work.active.data(), work.active_count);
  detail::count_columns(rig, live, active, work.column_begins.data());
  std::uint32_t* next = work.column_begins.data() + 1;
  for (const std::uint16_t control : active) {
    const float v = controls[control];
    detail::for_columns(rig, control, live, [&](const JointColumn& column) {
      work.columns[next[column.group]++] = {column.offset, v};
    });
  }
}

constexpr std::size_t kAhead = 2;

// Asks for the columns of a group while the group before is summed: they lie all over the matrices,
// where the hardware does not see them coming.
void prefetch_columns(const Rig& rig, std::uint32_t lod, const Workspace& work,
                      std::size_t i) noexcept {
  if (i >= rig.live_groups[lod]) return;
  const std::size_t size = rig.is_half() ? 2 : 4;
  const std::size_t bytes = rig.joint_group_lods[i * rig.lod_count + lod] * size;
  const auto* values = rig.is_half() ? reinterpret_cast<const char*>(rig.joint_halves.data())
                                     : reinterpret_cast<const char*>(rig.joint_values.data());
  for (std::uint32_t c = work.column_begins[i]; c < work.column_begins[i + 1]; ++c) {
    const char* column = values + work.columns[c].offset * size;
    for (std::size_t at = 0; at < bytes; at += 64) simd::prefetch(column + at);
  }
}

void joints(const Rig& rig, std::uint32_t lod, Workspace& work, const PoseView& pose) noexcept {
  list_columns(rig, lod, work, pose.controls);
  for (std::size_t i = 0; i < kAhead; ++i) prefetch_columns(rig, lod, work, i);
  for (std::size_t i = 0; i < rig.live_groups[lod]; ++i) {
    prefetch_columns(rig, lod, work, i + kAhead);
    const std::uint32_t rows = rig.joint_group_lods[i * rig.lod_count + lod];
    if (rows == 0) continue;
    const simd::Column* columns = work.columns.data() + work.column_begins[i];
    const std::uint32_t count = work.column_begins[i + 1] - work.column_begins[i];
    float* out = work.rows.data() + rig.joint_groups[i].rows_begin;
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

// Controls that are not at rest, without the correctives.
std::size_t list_sources(const Rig& rig, const float* controls, Workspace& work) noexcept {
  const std::size_t n = append_active(controls, 0, rig.raw_count, work.active.data());
  work.raw_active = n;
  return n + append_active(controls, rig.raw_count + rig.psd_count, rig.control_count,
                           work.active.data() + n);
}

std::uint32_t touch_column(const Rig& rig, std::uint32_t column) noexcept {
  const std::uint32_t at = rig.joint_columns[column].offset;
  return rig.is_half() ? rig.joint_halves[at] : std::bit_cast<std::uint32_t>(rig.joint_values[at]);
}

// Reads one value of everything that these controls will need. None of these reads waits for
// another, so with cold caches they are on their way at once, and the pages are known when the
// columns are fetched: a CPU drops a prefetch from a page that it has to look up.
void touch(const Rig& rig, std::uint32_t lod, std::span<const std::uint16_t> controls,
           Workspace& work) noexcept {
  const std::uint32_t* watches =
      rig.watch_begins.data() + std::size_t{lod} * (rig.control_count + 1);
  const std::uint32_t* columns = rig.joint_column_begins.data();
  std::uint32_t sum = 0;
  for (const std::uint16_t c : controls) sum += watches[c] + columns[c];
  for (const std::uint16_t c : controls) {
    if (columns[c] < columns[c + 1]) sum += rig.joint_columns[columns[c]].group;
    if (watches[c] < watches[c + 1]) sum += rig.watched[watches[c]].psd;
  }
  for (const std::uint16_t c : controls) {
    if (columns[c] < columns[c + 1]) {
      sum += touch_column(rig, columns[c]) + touch_column(rig, columns[c + 1] - 1);
    }
    if (watches[c] < watches[c + 1]) sum += rig.psds[rig.watched[watches[c]].psd].factors_begin;
  }
  work.touched = sum;
}

// The correctives that a control watches; the others are left at 0.
void start_correctives(const Rig& rig, std::uint32_t lod, Workspace& work,
                       float* controls) noexcept {
  std::fill(controls + rig.raw_count, controls + rig.raw_count + rig.psd_count, 0.0f);
  std::fill(work.psd_bits.begin(), work.psd_bits.end(), 0u);
  const std::size_t n = list_sources(rig, controls, work);
  touch(rig, lod, {work.active.data(), n}, work);
  Correctives(rig, work, controls).watched(lod, {work.active.data(), n});
}

// In ascending order: raw, correctives, networks and poses. In: as list_sources left it, but for
// later steps.
void list_active(const Rig& rig, bool had_steps, Workspace& work, const float* controls) noexcept {
  std::uint16_t* active = work.active.data();
  std::size_t n = had_steps ? append_active(controls, 0, rig.raw_count, active) : work.raw_active;
  for (std::size_t word = 0; word < work.psd_bits.size(); ++word) {
    for (std::uint64_t bits = work.psd_bits[word]; bits != 0; bits &= bits - 1) {
      const auto p = word * 64 + static_cast<std::size_t>(std::countr_zero(bits));
      active[n++] = static_cast<std::uint16_t>(rig.raw_count + p);
    }
  }
  n += append_active(controls, rig.raw_count + rig.psd_count, rig.control_count, active + n);
  work.active_count = n;
}

}  // namespace

namespace detail {

void count_columns(const Rig& rig, std::uint32_t live, std::span<const std::uint16_t> active,
                   std::uint32_t* begins) noexcept {
  std::fill(begins, begins + live + 2, 0u);
  for (const std::uint16_t control : active) {
    for_columns(rig, control, live, [&](const JointColumn& column) { ++begins[column.group + 2]; });
  }
  for (std::uint32_t i = 2; i < live + 2; ++i) begins[i] += begins[i - 1];
}

std::uint32_t clamp_lod(const Rig& rig, std::uint32_t lod) noexcept {
  return rig.lod_count == 0 ? 0 : std::min(lod, rig.lod_count - 1);
}

void run(const Rig& rig, std::uint32_t step, std::uint32_t lod, Workspace& work,
         float* controls) noexcept {
  if (step_kind(step) == StepKind::kOperation) {
    run_operation(rig, step_index(step), lod, work, controls);
  } else {
    run_solver(rig, step_index(step), work, controls);
  }
}

void settled_controls(const Rig& rig, std::uint32_t lod, Workspace& work,
                      float* controls) noexcept {
  for (const std::uint32_t step : rig.steps_of(lod, kEarly)) run(rig, step, lod, work, controls);
  start_correctives(rig, lod, work, controls);
  Correctives all(rig, work, controls);
  for (const std::uint32_t step : rig.steps_of(lod, kChained)) {
    if (step_kind(step) == StepKind::kPsd) {
      all.one(step_index(step), controls);
    } else {
      run(rig, step, lod, work, controls);
    }
  }
  list_active(rig, !rig.steps_of(lod, kChained).empty(), work, controls);
}

void latent_controls(const Rig& rig, std::uint32_t lod, Workspace& work, float* controls) noexcept {
  for (const std::uint32_t step : rig.steps_of(lod, kReference)) {
    run(rig, step, lod, work, controls);
  }
  if (!rig.steps.empty()) {
    std::copy(controls, controls + rig.control_count, work.last_controls.begin());
  }
  start_correctives(rig, lod, work, controls);
  Correctives all(rig, work, controls);
  for (const StepList list : {kChained, kCyclic}) {
    for (const std::uint32_t step : rig.steps_of(lod, list)) {
      if (step_kind(step) == StepKind::kPsd) all.one(step_index(step), work.last_controls.data());
    }
  }
  list_active(rig, !rig.steps.empty(), work, controls);
}

void begin(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
           float* controls) noexcept {
  // What is settled does not read a corrective before it is set.
  const std::uint32_t rest = rig.raw_count + (settle ? rig.psd_count : 0);
  std::copy(raw, raw + rig.raw_count, controls);
  std::copy(rig.initial_controls.begin() + rest, rig.initial_controls.end(), controls + rest);
  if (settle) {
    settled_controls(rig, lod, work, controls);
  } else {
    latent_controls(rig, lod, work, controls);
  }
}

// Extra pieces add to places that the first ones left at 0.
void place_rows(const Rig& rig, std::uint32_t lod, const float* rows, float* joints) noexcept {
  const std::size_t places = std::size_t{rig.joint_count} * rig.joint_stride,
                    whole = places / simd::kPlaces;
  const std::size_t blocks = (places + simd::kPlaces - 1) / simd::kPlaces;
  const simd::Piece* pieces = rig.joint_pieces.data() + lod * blocks;
  rig.kernels->place(pieces, whole, rows, joints);
  if (whole < blocks) {
    float last[simd::kPlaces];
    rig.kernels->place(pieces + whole, 1, rows, last);
    std::copy(last, last + places % simd::kPlaces, joints + whole * simd::kPlaces);
  }
  const std::uint32_t extra = rig.extra_begins[lod];
  rig.kernels->place_more(rig.extra_pieces.data() + extra, rig.extra_begins[lod + 1] - extra, rows,
                          joints);
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
  rotations(rig, lod, work, pose);
  channels_and_maps(rig, lod, pose);
}

}  // namespace detail

void gui_to_raw(const Rig& rig, const float* gui, float* raw) noexcept {
  evaluate_rows(rig.gui_rows, gui, raw, rig.raw_count);
}

namespace {

bool inside(const ConditionalRow& row, float raw, float& in) noexcept {
  in = (raw - row.cut) / row.slope;
  return row.from <= in && in <= row.to;
}

// A face without LODs has nothing that moves.
void rest(const Rig& rig, const float* raw, const PoseView& pose) noexcept {
  std::copy(raw, raw + rig.raw_count, pose.controls);
  std::copy(rig.initial_controls.begin() + rig.raw_count, rig.initial_controls.end(),
            pose.controls + rig.raw_count);
  std::fill(pose.joints, pose.joints + std::size_t{rig.joint_count} * rig.joint_stride, 0.0f);
  if (rig.joint_stride == 10) detail::euler_joints(rig, 0, pose.joints);
  std::fill(pose.blend_shapes, pose.blend_shapes + rig.blend_shape_count, 0.0f);
  std::fill(pose.animated_maps, pose.animated_maps + rig.animated_map_count, 0.0f);
}

}  // namespace

void raw_to_gui(const Rig& rig, const float* raw, float* gui) noexcept {
  std::fill(gui, gui + rig.gui_count, 0.0f);
  std::uint32_t last = kNone, most = 0;
  for (const GuiRange& range : rig.gui_ranges) {
    if (range.gui != last) most = 0;
    last = range.gui;
    std::uint32_t count = 0;
    float first = 0, in = 0;
    bool found = false;
    for (std::uint32_t i = range.rows_begin; i < range.rows_end; ++i) {
      const ConditionalRow& row = rig.gui_rows[rig.gui_range_rows[i]];
      if (!inside(row, raw[row.output], in)) continue;
      if (!found) first = in;
      found = true;
      count += raw[row.output] != 0.0f ? 1 : 0;
    }
    if (count <= most) continue;
    most = count;
    gui[range.gui] = first;
  }
}

void evaluate(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
              const PoseView& pose) noexcept {
  const std::uint32_t level = detail::clamp_lod(rig, lod);
  if (rig.lod_count == 0) return rest(rig, raw, pose);
  detail::begin(rig, raw, level, settle, work, pose.controls);
  detail::outputs(rig, level, work, pose);
}

}  // namespace risorius::rig
