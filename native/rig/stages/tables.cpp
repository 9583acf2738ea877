// SPDX-License-Identifier: MIT
// The stage of tables with conditional rows: animated maps, and GUI controls to raw ones and back.
#include "rig/stages/tables.h"

#include <algorithm>

#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

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
  for (std::size_t o = 0; o < outputs; ++o) out[o] = detail::clamp01(out[o]);
}

bool inside(const ConditionalRow& row, float raw, float& in) noexcept {
  in = (raw - row.cut) / row.slope;
  return row.from <= in && in <= row.to;
}

}  // namespace

void gui_to_raw(const Rig& rig, const float* gui, float* raw) noexcept {
  evaluate_rows(rig.gui_rows, gui, raw, rig.raw_count);
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

void detail::channels_and_maps(const Rig& rig, std::uint32_t lod, const PoseView& pose) noexcept {
  const std::uint32_t shapes = rig.shape_lods.empty() ? 0 : rig.shape_lods[lod];
  const std::uint32_t run = std::min(shapes, rig.shape_run);
  float* to = pose.blend_shapes + (run > 0 ? rig.shape_outputs[0] : 0);
  std::fill(pose.blend_shapes, to, 0.0f);
  if (run > 0) to = std::copy_n(pose.controls + rig.shape_inputs[0], run, to);
  std::fill(to, pose.blend_shapes + rig.blend_shape_count, 0.0f);
  for (std::uint32_t i = run; i < shapes; ++i) {
    pose.blend_shapes[rig.shape_outputs[i]] = pose.controls[rig.shape_inputs[i]];
  }
  const std::uint32_t rows = rig.map_lods.empty() ? 0 : rig.map_lods[lod];
  evaluate_rows(rig.map_rows.first(rows), pose.controls, pose.animated_maps,
                rig.animated_map_count);
}

}  // namespace risorius::rig
