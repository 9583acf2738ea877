// SPDX-License-Identifier: MIT
// Conditional tables, which turn controls into animated maps, and GUI controls into raw controls
// and back; and blend shape channels, which copy controls. A row of a table adds slope * input +
// cut to its output while the input is between its bounds; neighbouring rows with the same input
// and output form a run, of which the first row that applies counts.
#include "rig/stages/tables.h"

#include <algorithm>

#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

// Adds the result of a run for the value v of its input: the first row whose interval contains v,
// or all rows if v is NaN.
void add_run(std::span<const ConditionalRow> run, float v, float* out) noexcept {
  for (const ConditionalRow& row : run) {
    const bool holds = row.from <= v && v <= row.to;
    if (holds || v != v) out[row.output] += row.slope * v + row.cut;
    if (holds) break;
  }
}

void clamp(float* values, std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i) values[i] = detail::clamp01(values[i]);
}

// Computes the animated maps. A run of rows whose input is 0 is skipped if it would only add 0.
// Values are added in the order of the rows.
void maps(const Rig& rig, std::uint32_t lod, const PoseView& pose) noexcept {
  float* out = pose.animated_maps;
  std::fill(out, out + rig.animated_map_count, 0.0f);
  const std::uint32_t rows = rig.map_lods.empty() ? 0 : rig.map_lods[lod];
  for (const RowRun& run : rig.map_runs) {
    if (run.begin >= rows) break;
    const float v = pose.controls[run.input];
    if (v == 0.0f && run.wakes == 0) continue;
    const std::uint32_t end = std::min(rig.map_rows[run.begin].run_end, rows);
    add_run(rig.map_rows.subspan(run.begin, end - run.begin), v, out);
  }
  clamp(out, rig.animated_map_count);
}

// Whether listing the channels of each active control reads fewer bytes than reading the control of
// every channel.
// In: run     number of channels that one copy sets
//     shapes  number of channels at the LOD
//     active  number of active controls
bool lists_channels(const Rig& rig, std::uint32_t run, std::uint32_t shapes,
                    std::size_t active) noexcept {
  constexpr std::size_t kLooked = 2 * sizeof(std::uint16_t) + 2 * sizeof(float),
                        kNamed = 2 * sizeof(std::uint32_t) + sizeof(std::uint16_t) + kLooked;
  return !rig.shape_begins.empty() &&
         active * kNamed + run * sizeof(float) < (shapes - run) * kLooked;
}

// Calls f(channel) for each channel of a control at the LOD. In: shapes  number of channels at the
// LOD
template <class F>
void for_channels(const Rig& rig, std::uint32_t shapes, std::uint16_t control, F f) noexcept {
  const std::uint32_t end = rig.shape_begins[control + std::size_t{1}];
  for (std::uint32_t i = rig.shape_begins[control]; i < end; ++i) {
    const std::uint16_t shape = rig.shapes_of_controls[i];
    if (shape < shapes) f(rig.shape_outputs[shape]);
  }
}

void every_channel(const Rig& rig, std::uint32_t shapes, const float* controls,
                   float* out) noexcept {
  const std::uint32_t run = std::min(shapes, rig.shape_run);
  float* to = out + (run > 0 ? rig.shape_outputs[0] : 0);
  std::fill(out, to, 0.0f);
  if (run > 0) to = std::copy_n(controls + rig.shape_inputs[0], run, to);
  std::fill(to, out + rig.blend_shape_count, 0.0f);
  for (std::uint32_t i = run; i < shapes; ++i) {
    out[rig.shape_outputs[i]] = controls[rig.shape_inputs[i]];
  }
}

void channels(const Rig& rig, std::uint32_t lod, std::span<const std::uint16_t> active,
              const PoseView& pose) noexcept {
  const std::uint32_t shapes = rig.shape_lods.empty() ? 0 : rig.shape_lods[lod];
  float* const out = pose.blend_shapes;
  if (!lists_channels(rig, std::min(shapes, rig.shape_run), shapes, active.size())) {
    return every_channel(rig, shapes, pose.controls, out);
  }
  std::fill(out, out + rig.blend_shape_count, 0.0f);
  for (const std::uint16_t control : active) {
    for_channels(rig, shapes, control,
                 [&](std::uint16_t channel) { out[channel] = pose.controls[control]; });
  }
}

// Computes the animated maps of all frames. A run whose input is 0 in all frames is skipped by one
// test.
// In:  values  [controls, kFrames] the values of all controls, frame after frame for each control
// Out: out     [count, maps]
void frame_maps(const Rig& rig, std::uint32_t lod, const float* values, std::size_t count,
                float* out) noexcept {
  const std::size_t maps = rig.animated_map_count;
  std::fill(out, out + count * maps, 0.0f);
  const std::uint32_t rows = rig.map_lods.empty() ? 0 : rig.map_lods[lod];
  for (const RowRun& run : rig.map_runs) {
    if (run.begin >= rows) break;
    const float* v = values + std::size_t{run.input} * simd::kFrames;
    if (run.wakes == 0 && detail::rest_eight(v)) continue;
    const std::uint32_t end = std::min(rig.map_rows[run.begin].run_end, rows);
    for (std::size_t f = 0; f < count; ++f) {
      if (v[f] == 0.0f && run.wakes == 0) continue;
      add_run(rig.map_rows.subspan(run.begin, end - run.begin), v[f], out + f * maps);
    }
  }
  clamp(out, count * maps);
}

// Computes the blend shape channels of `count` frames.
// In:  values    [controls, kFrames] the values of all controls, frame after frame for each control
//      controls  [count, controls] the transpose of values without frames beyond count
// Out: out       [count, channels]
void frame_channels(const Rig& rig, std::uint32_t lod, std::span<const std::uint16_t> active,
                    const float* values, std::size_t count, const float* controls,
                    float* out) noexcept {
  const std::uint32_t shapes = rig.shape_lods.empty() ? 0 : rig.shape_lods[lod];
  if (!lists_channels(rig, std::min(shapes, rig.shape_run), shapes, active.size())) {
    for (std::size_t f = 0; f < count; ++f) {
      every_channel(rig, shapes, controls + f * rig.control_count, out + f * rig.blend_shape_count);
    }
    return;
  }
  std::fill(out, out + count * rig.blend_shape_count, 0.0f);
  for (const std::uint16_t control : active) {
    const float* from = values + std::size_t{control} * simd::kFrames;
    for_channels(rig, shapes, control, [&](std::uint16_t channel) {
      for (std::size_t f = 0; f < count; ++f) out[f * rig.blend_shape_count + channel] = from[f];
    });
  }
}

bool inside(const ConditionalRow& row, float raw, float& in) noexcept {
  in = (raw - row.cut) / row.slope;
  return row.from <= in && in <= row.to;
}

}  // namespace

void gui_to_raw(const Rig& rig, const float* gui, float* raw) noexcept {
  std::fill(raw, raw + rig.raw_count, 0.0f);
  for (std::size_t i = 0; i < rig.gui_rows.size();) {
    const ConditionalRow& first = rig.gui_rows[i];
    add_run(rig.gui_rows.subspan(i, first.run_end - i), gui[first.input], raw);
    i = first.run_end;
  }
  clamp(raw, rig.raw_count);
}

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

void detail::channels_and_maps(const Rig& rig, std::uint32_t lod, const Workspace& work,
                               const PoseView& pose) noexcept {
  channels(rig, lod, {work.active.data(), work.active_count}, pose);
  maps(rig, lod, pose);
}

void detail::frame_channels_and_maps(const Rig& rig, std::uint32_t lod, std::size_t count,
                                     const Workspace& work, const PoseView& first) noexcept {
  const float* values = work.frame_weights.data();
  frame_channels(rig, lod, {work.active.data(), work.active_count}, values, count, first.controls,
                 first.blend_shapes);
  frame_maps(rig, lod, values, count, first.animated_maps);
}

}  // namespace risorius::rig
