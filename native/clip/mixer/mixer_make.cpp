// SPDX-License-Identifier: MIT
// Checks the parts of a mixer once, so that evaluation needs no checks.
#include <algorithm>
#include <bit>
#include <cmath>
#include <string_view>
#include <unordered_map>

#include "clip/mixer/mixer.h"
#include "core/finite.h"

namespace risorius::clip {

namespace {

using core::ErrorCode;
using core::fail;

bool ascends(std::span<const double> values) {
  return std::adjacent_find(values.begin(), values.end(),
                            [](double a, double b) { return !(a < b); }) == values.end();
}

bool in_unit(double value) { return value >= 0.0 && value <= 1.0; }

bool is_line(const Line& line) {
  return line.x.size() == line.y.size() && core::all_finite(line.x) && core::all_finite(line.y) &&
         ascends(line.x);
}

core::Unexpected wrong(const std::string& where, const char* expected) {
  return fail(ErrorCode::kInvalidValue, where, std::string(expected) + " was expected");
}

core::Status check(const CurvesView& curves, std::size_t controls, std::span<const float> mask) {
  if (curves.values.size() != curves.names.size() * curves.frame_count) {
    return fail(ErrorCode::kInvalidLength, "values", "one value per name and frame was expected");
  }
  if (!mask.empty() && mask.size() != controls) {
    return fail(ErrorCode::kInvalidLength, "mask", "one value per control was expected");
  }
  if (!std::all_of(mask.begin(), mask.end(), [](float m) { return in_unit(m); })) {
    return wrong("mask", "a value from 0 to 1");
  }
  if (!(std::isfinite(curves.rate) && curves.rate > 0.0)) return wrong("rate", "a rate above 0");
  if (!std::isfinite(curves.start)) return wrong("start", "a time in seconds");
  if (curves.times.empty()) return core::ok();
  if (curves.times.size() != curves.frame_count) {
    return fail(ErrorCode::kInvalidLength, "times", "one time per frame was expected");
  }
  const bool good = ascends(curves.times) && std::isfinite(curves.times.front()) &&
                    std::isfinite(curves.times.back());
  return good ? core::ok() : wrong("times", "ascending seconds");
}

}  // namespace

/// Sorts a layer's curves by control, separately for moving, constant and zero curves.
struct LayerCurves::Sorter {
  struct Row {
    std::uint32_t control;
    float mask;
    const float* values;
  };
  std::vector<Row> moving, constant, zero;

  void add(const Row& row, std::size_t frames) {
    const auto first = std::bit_cast<std::uint32_t>(row.values[0]);
    const bool still = std::all_of(row.values, row.values + frames, [&](float v) {
      return std::bit_cast<std::uint32_t>(v) == first;
    });
    (!still ? moving : row.values[0] == 0.0f ? zero : constant).push_back(row);
  }

  static Channels channels(std::vector<Row>& rows, std::size_t frames) {
    std::sort(rows.begin(), rows.end(),
              [](const Row& a, const Row& b) { return a.control < b.control; });
    Channels out;
    out.masks.resize(rows.size());
    out.values.resize(rows.size() * frames);
    for (std::uint32_t column = 0; column < rows.size(); ++column) {
      const Row& row = rows[column];
      out.masks[column] = row.mask;
      for (std::size_t f = 0; f < frames; ++f) out.values[f * rows.size() + column] = row.values[f];
      const bool follows = column > 0 && rows[column - 1].control + 1 == row.control;
      if (!follows) out.runs.push_back({row.control, column, 0});
      ++out.runs.back().count;
    }
    return out;
  }
};

core::Result<std::shared_ptr<const LayerCurves>> LayerCurves::make(
    std::span<const std::string> controls, const CurvesView& curves, std::span<const float> mask) {
  RISORIUS_TRY(check(curves, controls.size(), mask));
  std::unordered_map<std::string_view, std::uint32_t> index;
  for (std::uint32_t i = 0; i < controls.size(); ++i) index.emplace(controls[i], i);
  Sorter sorter;
  std::vector<bool> taken(controls.size());
  for (std::size_t n = 0; n < curves.names.size() && curves.frame_count > 0; ++n) {
    const auto found = index.find(curves.names[n]);
    if (found == index.end()) continue;
    const std::uint32_t control = found->second;
    if (taken[control]) return fail(ErrorCode::kInvalidValue, "names", curves.names[n] + " twice");
    taken[control] = true;
    const float weight = mask.empty() ? 1.0f : mask[control];
    if (weight == 0.0f) continue;
    sorter.add({control, weight, curves.values.data() + n * curves.frame_count},
               curves.frame_count);
  }
  auto out = std::make_shared<LayerCurves>();
  out->moving_ = Sorter::channels(sorter.moving, curves.frame_count);
  out->constant_ = Sorter::channels(sorter.constant, 1);
  out->zero_ = Sorter::channels(sorter.zero, 1);
  out->control_count_ = controls.size();
  out->frame_count_ = curves.frame_count;
  out->rate_ = curves.rate;
  out->start_ = curves.start;
  out->times_.assign(curves.times.begin(), curves.times.end());
  return std::shared_ptr<const LayerCurves>(std::move(out));
}

core::Result<Mixer> Mixer::make(std::vector<std::string> controls, std::vector<float> low,
                                std::vector<float> high, std::size_t max_fired) {
  if (low.size() != controls.size() || high.size() != controls.size()) {
    return fail(ErrorCode::kInvalidLength, "ranges", "one range per control was expected");
  }
  std::unordered_map<std::string_view, std::size_t> index;
  for (std::size_t i = 0; i < controls.size(); ++i) {
    if (!index.emplace(controls[i], i).second) {
      return fail(ErrorCode::kInvalidValue, "controls", controls[i] + " stands there twice");
    }
    if (!(low[i] <= high[i])) {
      return fail(ErrorCode::kInvalidValue, "ranges",
                  controls[i] + ": a range whose lower end is not above the upper was expected");
    }
  }
  Mixer mixer;
  mixer.controls_ = std::move(controls);
  mixer.low_.assign(low.begin(), low.end());
  mixer.high_.assign(high.begin(), high.end());
  mixer.voices_.resize(max_fired);
  return mixer;
}

namespace {

core::Status check_times(const Layer& layer, const std::string& where) {
  if (!layer.warp.x.empty()) {
    return is_line(layer.warp) && layer.warp.x.size() > 1
               ? core::ok()
               : wrong(where + ".warp", "two or more finite points by ascending scene time");
  }
  if (layer.curves->frame_count() < 2) {
    return layer.start <= layer.end ? core::ok() : wrong(where + ".end", "an end after the start");
  }
  if (!std::isfinite(layer.start)) return wrong(where + ".start", "a time in seconds");
  const bool part = std::isfinite(layer.first) && std::isfinite(layer.last);
  if (!part || !(layer.first < layer.last)) {
    return wrong(where + ".clip_range", "a part of the clip whose end is after its begin");
  }
  if (!(std::isfinite(layer.scale) && layer.scale > 0.0)) {
    return wrong(where + ".scale", "a number above 0");
  }
  const bool repeats = std::isfinite(layer.repeat) && layer.repeat > 0.0;
  return repeats ? core::ok() : wrong(where + ".repeat", "a number above 0");
}

core::Status check(const Layer& layer, std::size_t controls, const std::string& where) {
  if (!layer.curves || layer.curves->control_count() != controls) {
    return wrong(where + ".curves", "curves made for this mixer's controls");
  }
  const auto& weights = layer.weight.y;
  if (weights.empty() || !is_line(layer.weight) ||
      !std::all_of(weights.begin(), weights.end(), in_unit)) {
    return wrong(where + ".weight", "values from 0 to 1 at ascending times");
  }
  if (!(layer.fade_in >= 0.0 && std::isfinite(layer.fade_in))) {
    return wrong(where + ".fade_in", "a number of seconds");
  }
  if (!(layer.fade_out >= 0.0 && std::isfinite(layer.fade_out))) {
    return wrong(where + ".fade_out", "a number of seconds");
  }
  return check_times(layer, where);
}

void set_range(Layer& layer) {
  if (!layer.warp.x.empty()) {
    layer.start = layer.warp.x.front();
    layer.end = layer.warp.x.back();
  } else if (layer.curves->frame_count() > 1) {
    layer.end = layer.start + (layer.last - layer.first) * layer.scale * layer.repeat;
  }
}

}  // namespace

core::Status Mixer::set_layers(std::vector<Layer> layers) {
  for (std::size_t i = 0; i < layers.size(); ++i) {
    Layer& layer = layers[i];
    const std::string where = "layers[" + std::to_string(i) + "]";
    RISORIUS_TRY(check(layer, control_count(), where));
    set_range(layer);
    const bool repeats = layer.extend == Extend::kRepeat;
    if (repeats && !(std::isfinite(layer.end - layer.start) && layer.end > layer.start)) {
      if (layer.curves->frame_count() > 1) return wrong(where + ".extend", "a range to repeat");
      layer.extend = Extend::kHold;
    }
  }
  solo_ = std::any_of(layers.begin(), layers.end(), [](const Layer& l) { return l.solo; });
  layers_ = std::move(layers);
  return core::ok();
}

namespace {

core::Status check(const ReactionPart& part, std::span<const float> high,
                   const std::string& where) {
  if (part.weights.size() != part.controls.size()) {
    return fail(ErrorCode::kInvalidLength, where, "one weight per control was expected");
  }
  for (std::size_t i = 0; i < part.controls.size(); ++i) {
    if (part.controls[i] >= high.size()) {
      return fail(ErrorCode::kInvalidIndex, where, "a control of the mixer was expected");
    }
    if (!std::isfinite(high[part.controls[i]])) return wrong(where, "controls with an upper limit");
    if (!in_unit(part.weights[i])) return wrong(where + ".weights", "a value from 0 to 1");
  }
  for (const double seconds : {part.delay, part.attack, part.hold, part.release}) {
    if (!(std::isfinite(seconds) && seconds >= 0.0)) return wrong(where, "a number of seconds");
  }
  if (part.attack > 0.0 && part.release > 0.0) return core::ok();
  return wrong(where, "an attack and a release above 0 seconds");
}

}  // namespace

core::Status Mixer::set_reactions(std::vector<Reaction> reactions) {
  std::vector<double> durations;
  for (std::size_t r = 0; r < reactions.size(); ++r) {
    double duration = 0.0;
    for (std::size_t p = 0; p < reactions[r].size(); ++p) {
      const ReactionPart& part = reactions[r][p];
      const std::string where =
          "reactions[" + std::to_string(r) + "].parts[" + std::to_string(p) + "]";
      RISORIUS_TRY(check(part, high_, where));
      duration = std::max(duration, part.delay + part.attack + part.hold + part.release);
    }
    durations.push_back(duration);
  }
  clear_fired();
  reactions_ = std::move(reactions);
  durations_ = std::move(durations);
  return core::ok();
}

core::Status Mixer::set_rules(std::vector<Yield> yields, std::vector<Opposites> opposites) {
  const auto known = [&](const std::vector<std::uint32_t>& indices) {
    return std::all_of(indices.begin(), indices.end(),
                       [&](std::uint32_t c) { return c < control_count(); });
  };
  for (const Yield& rule : yields) {
    if (!known(rule.by) || !known(rule.of)) {
      return fail(ErrorCode::kInvalidIndex, "yields", "a control of the mixer was expected");
    }
    if (rule.by.empty()) return wrong("yields.by", "at least one control");
    if (!in_unit(rule.amount)) return wrong("yields.amount", "a value from 0 to 1");
  }
  for (const Opposites& pair : opposites) {
    if (!known({pair.a, pair.b}) || pair.a == pair.b) {
      return fail(ErrorCode::kInvalidIndex, "opposites", "two controls of the mixer were expected");
    }
  }
  yields_ = std::move(yields);
  opposites_ = std::move(opposites);
  factors_.resize(yields_.size());
  return core::ok();
}

}  // namespace risorius::clip
