// SPDX-License-Identifier: MIT
// The baseline of the evaluator's benchmarks: an evaluation in the shortest scalar code, with the
// joint groups as one compressed sparse row matrix.
#include "bench/csr.h"

#include <algorithm>

#include "dna/controls.h"

namespace risorius::bench {

namespace {

float clamp01(float v) { return std::min(std::max(v, 0.0f), 1.0f); }

}  // namespace

void Csr::multiply(const float* controls, float* out) const {
  for (std::size_t r = 0; r + 1 < begins.size(); ++r) {
    float sum = 0.0f;
    for (std::uint32_t i = begins[r]; i < begins[r + 1]; ++i) {
      sum += values[i] * controls[columns[i]];
    }
    out[r] = sum;
  }
}

Baseline::Baseline(const dna::Dna& dna, std::uint32_t lod) : dna_(dna), lod_(lod) {
  const std::size_t attributes = dna.definition.joint_names.size() * 9;
  struct Row {
    const dna::JointGroup* group = nullptr;
    std::size_t row = 0;
  };
  std::vector<Row> rows(attributes);
  for (const dna::JointGroup& g : dna.behavior.joint_groups) {
    for (std::size_t r = 0; r < g.lods[lod]; ++r) rows[g.output_indices[r]] = {&g, r};
  }
  for (const Row& row : rows) {
    matrix_.begins.push_back(static_cast<std::uint32_t>(matrix_.values.size()));
    for (std::size_t c = 0; row.group != nullptr && c < row.group->input_indices.size(); ++c) {
      const float v = row.group->values[row.row * row.group->input_indices.size() + c];
      if (v == 0.0f) continue;
      matrix_.columns.push_back(row.group->input_indices[c]);
      matrix_.values.push_back(v);
    }
  }
  matrix_.begins.push_back(static_cast<std::uint32_t>(matrix_.values.size()));
  controls_.resize(dna::control_counts(dna).total());
  joints_.resize(attributes);
  shapes_.resize(dna.definition.blend_shape_channel_names.size());
  maps_.resize(dna.definition.animated_map_names.size());
}

void Baseline::evaluate(const float* raw) {
  const std::size_t raw_count = dna_.definition.raw_control_names.size();
  std::copy(raw, raw + raw_count, controls_.begin());
  std::fill(controls_.begin() + static_cast<std::ptrdiff_t>(raw_count), controls_.end(), 1.0f);
  const dna::Psds& p = dna_.behavior.psds;
  for (std::size_t i = 0; i < p.rows.size(); ++i) {
    controls_[p.rows[i]] *= p.values[i] * clamp01(controls_[p.columns[i]]);
  }
  for (std::size_t i = raw_count; i < controls_.size(); ++i) {
    controls_[i] = std::min(controls_[i], 1.0f);
  }
  matrix_.multiply(controls_.data(), joints_.data());
  const dna::BlendShapeChannels& s = dna_.behavior.blend_shape_channels;
  std::ranges::fill(shapes_, 0.0f);
  for (std::size_t i = 0; i < s.lods[lod_]; ++i) {
    shapes_[s.output_indices[i]] = controls_[s.input_indices[i]];
  }
  const dna::Conditionals& t = dna_.behavior.animated_maps.conditionals;
  std::ranges::fill(maps_, 0.0f);
  for (std::size_t i = 0; i < dna_.behavior.animated_maps.lods[lod_]; ++i) {
    const float v = controls_[t.input_indices[i]];
    if (t.from_values[i] <= v && v <= t.to_values[i]) {
      maps_[t.output_indices[i]] += t.slope_values[i] * v + t.cut_values[i];
    }
  }
  for (float& m : maps_) m = clamp01(m);
}

}  // namespace risorius::bench
