// SPDX-License-Identifier: MIT
// Evaluates a mixer at a time: layers, reactions, rules of controls that exclude each other.
#include "clip/mixer/mixer.h"

#include <algorithm>
#include <cmath>

namespace risorius::clip {

namespace {

// A frame number or a number of repeats is rounded to the nearest integer if it differs from this
// integer by less than this share of it (absolutely below 1).
constexpr double kLost = 1e-9;

double snapped(double x) noexcept {
  const double near = std::rint(x);
  return std::abs(x - near) < kLost * std::max(std::abs(near), 1.0) ? near : x;
}

float smooth_step(double x) noexcept {
  const auto f = static_cast<float>(x);
  return f * f * (3.0f - 2.0f * f);
}

float envelope(const ReactionPart& part, double time) noexcept {
  const double t = time - part.delay;
  const double down = part.attack + part.hold, end = down + part.release;
  if (!(t > 0.0 && t < end)) return 0.0f;
  if (t < part.attack) return smooth_step(t / part.attack);
  return t <= down ? 1.0f : smooth_step((end - t) / part.release);
}

template <Blend kBlend>
float blended(float below, float value, float weight) noexcept {
  if constexpr (kBlend == Blend::kAdditive) return below + value * weight;
  if constexpr (kBlend == Blend::kMax) value = below > value ? below : value;
  return below * (1.0f - weight) + value * weight;
}

}  // namespace

double Line::at(double wanted) const noexcept {
  if (!(wanted > x.front())) return y.front();
  if (wanted >= x.back()) return y.back();
  const auto next =
      static_cast<std::size_t>(std::upper_bound(x.begin(), x.end(), wanted) - x.begin());
  const double part = (wanted - x[next - 1]) / (x[next] - x[next - 1]);
  return y[next - 1] + (y[next] - y[next - 1]) * part;
}

double LayerCurves::first_time() const {
  return times_.empty() || frame_count_ == 0 ? start_ : times_.front();
}

double LayerCurves::last_time() const {
  if (frame_count_ < 2) return first_time();
  return times_.empty() ? start_ + static_cast<double>(frame_count_ - 1) / rate_ : times_.back();
}

LayerCurves::Place LayerCurves::place(double time) const noexcept {
  if (frame_count_ < 2) return {0, 0.0f};
  const auto last = static_cast<double>(frame_count_ - 1);
  double at = 0.0;
  if (times_.empty()) {
    at = snapped((time - start_) * rate_);
  } else if (time >= times_.back()) {
    at = last;
  } else if (time > times_.front()) {
    const auto next = std::upper_bound(times_.begin(), times_.end(), time);
    at = static_cast<double>(next - times_.begin() - 1) + (time - next[-1]) / (*next - next[-1]);
  }
  at = at > 0.0 ? std::min(at, last) : 0.0;
  const double first = std::floor(at);
  return {static_cast<std::size_t>(first), static_cast<float>(at - first)};
}

/// The weight and the clip time, in seconds, of a layer at a scene time.
struct Mixer::Moment {
  float weight;
  double clip_time;
};

bool Mixer::moment(const Layer& layer, double time, Moment& out) noexcept {
  double t = time;
  if (!(t >= layer.start && t <= layer.end)) {
    const bool before = !(t > layer.end);
    if (layer.extend == Extend::kNothing) return false;
    if (layer.extend == Extend::kHoldForward && before) return false;
    if (layer.extend == Extend::kRepeat) {
      const double length = layer.end - layer.start;
      const double turns = snapped((t - layer.start) / length);
      t = layer.start + (turns - std::floor(turns)) * length;
    } else {
      t = before ? layer.start : layer.end;
    }
  }
  double weight = layer.weight.at(t), fade = 1.0;
  if (layer.fade_in > 0.0) fade = std::min(fade, (t - layer.start) / layer.fade_in);
  if (layer.fade_out > 0.0) fade = std::min(fade, (layer.end - t) / layer.fade_out);
  out.weight = static_cast<float>(weight * fade);
  if (!(out.weight > 0.0f)) return false;
  if (layer.curves->frame_count() < 2) {
    out.clip_time = 0.0;
  } else if (!layer.warp.x.empty()) {
    out.clip_time = layer.warp.at(t);
  } else {
    const double length = (layer.last - layer.first) * layer.scale;
    // At the end of the layer, the number of repeats is layer.repeat and not computed from t,
    // because at large times rounding could make it too small.
    const double turns =
        t >= layer.end ? layer.repeat : std::min(snapped((t - layer.start) / length), layer.repeat);
    double part = turns - std::floor(turns);
    // At the end of the last repeat the clip is at its end, not at its start.
    if (part == 0.0 && t > layer.start && turns >= layer.repeat) part = 1.0;
    const double way = part * (layer.last - layer.first);
    out.clip_time = layer.reverse ? layer.last - way : layer.first + way;
  }
  return true;
}

namespace {

template <Blend kBlend, bool kBetween, class Runs>
void mix(const Runs& runs, const float* masks, const float* here, const float* next, float part,
         float weight, float* out) noexcept {
  for (const auto& run : runs) {
    float* __restrict to = out + run.control;
    const float* a = here + run.column;
    const float* b = next + run.column;
    const float* mask = masks + run.column;
    for (std::uint32_t i = 0; i < run.count; ++i) {
      const float value = kBetween ? a[i] + (b[i] - a[i]) * part : a[i];
      to[i] = blended<kBlend>(to[i], value, mask[i] * weight);
    }
  }
}

template <bool kBetween, class Channels>
void mix(Blend blend, const Channels& channels, const float* here, const float* next, float part,
         float weight, float* out) noexcept {
  const float* masks = channels.masks.data();
  switch (blend) {
    case Blend::kOverride:
      return mix<Blend::kOverride, kBetween>(channels.runs, masks, here, next, part, weight, out);
    case Blend::kAdditive:
      return mix<Blend::kAdditive, kBetween>(channels.runs, masks, here, next, part, weight, out);
    case Blend::kMax:
      return mix<Blend::kMax, kBetween>(channels.runs, masks, here, next, part, weight, out);
  }
}

}  // namespace

void Mixer::apply(const Layer& layer, const Moment& at, float* out) noexcept {
  const LayerCurves& curves = *layer.curves;
  const float* constant = curves.constant_.values.data();
  mix<false>(layer.blend, curves.constant_, constant, constant, 0.0f, at.weight, out);
  if (layer.blend != Blend::kAdditive) {
    const float* zero = curves.zero_.values.data();
    mix<false>(layer.blend, curves.zero_, zero, zero, 0.0f, at.weight, out);
  }
  if (curves.moving_.runs.empty()) return;
  const LayerCurves::Place place = curves.place(at.clip_time);
  const std::size_t columns = curves.moving_.masks.size();
  const float* here = curves.moving_.values.data() + place.first * columns;
  if (place.part == 0.0f) {
    mix<false>(layer.blend, curves.moving_, here, here, 0.0f, at.weight, out);
  } else {
    mix<true>(layer.blend, curves.moving_, here, here + columns, place.part, at.weight, out);
  }
}

void Mixer::react(double time, float* out) const noexcept {
  for (const Voice& voice : std::span(voices_).first(voice_count_)) {
    if (!(time > voice.time && time < voice.end)) continue;
    for (const ReactionPart& part : reactions_[voice.reaction]) {
      const float amount = voice.strength * envelope(part, time - voice.time);
      if (amount == 0.0f) continue;
      for (std::size_t i = 0; i < part.controls.size(); ++i) {
        const std::uint32_t c = part.controls[i];
        const float peak = std::min(high_[c], 1.0f);
        if (out[c] < peak) out[c] += (peak - out[c]) * (amount * part.weights[i]);
      }
    }
  }
}

namespace {

float measured(const Yield& rule, const float* values) noexcept {
  float all = rule.measure == Yield::Measure::kMin ? 1.0f : 0.0f;
  for (const std::uint32_t c : rule.by) {
    const float value = values[c] > 0.0f ? std::min(values[c], 1.0f) : 0.0f;
    if (rule.measure == Yield::Measure::kMax) all = std::max(all, value);
    if (rule.measure == Yield::Measure::kMin) all = std::min(all, value);
    if (rule.measure == Yield::Measure::kMean) all += value;
  }
  return rule.measure == Yield::Measure::kMean ? all / static_cast<float>(rule.by.size()) : all;
}

}  // namespace

void Mixer::exclude(float* out) noexcept {
  for (std::size_t i = 0; i < yields_.size(); ++i) {
    factors_[i] = 1.0f - yields_[i].amount * measured(yields_[i], out);
  }
  for (std::size_t i = 0; i < yields_.size(); ++i) {
    if (factors_[i] == 1.0f) continue;
    for (const std::uint32_t c : yields_[i].of) out[c] *= factors_[i];
  }
  for (const Opposites& pair : opposites_) {
    const float common = std::min(out[pair.a], out[pair.b]);
    if (!(common > 0.0f)) continue;
    out[pair.a] -= common;
    out[pair.b] -= common;
  }
}

void Mixer::clamp(float* out) const noexcept {
  const float* low = low_.data();
  const float* high = high_.data();
  for (std::size_t i = 0; i < low_.size(); ++i) {
    const float raised = out[i] > low[i] ? out[i] : low[i];
    out[i] = raised < high[i] ? raised : high[i];
  }
}

void Mixer::evaluate(double time, const float* base, float* out) noexcept {
  if (base == nullptr) {
    std::fill_n(out, control_count(), 0.0f);
  } else if (base != out) {
    std::copy_n(base, control_count(), out);
  }
  Moment at{};
  for (const Layer& layer : layers_) {
    if (layer.mute || (solo_ && !layer.solo)) continue;
    if (moment(layer, time, at)) apply(layer, at, out);
  }
  react(time, out);
  exclude(out);
  clamp(out);
}

bool Mixer::fire(std::size_t reaction, double time, float strength) noexcept {
  Voice* place = voices_.data() + voice_count_;
  if (voice_count_ < voices_.size()) {
    ++voice_count_;
  } else {
    place = std::min_element(voices_.data(), place,
                             [](const Voice& a, const Voice& b) { return a.end < b.end; });
    if (voices_.empty() || !(place->end <= time)) return false;
  }
  *place = {reaction, time, time + durations_[reaction], strength};
  return true;
}

}  // namespace risorius::clip
