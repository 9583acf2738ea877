// SPDX-License-Identifier: MIT
// Mixes layers of curves, reactions and exclusive controls to the controls of one frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/aligned.h"
#include "core/result.h"

namespace risorius::clip {

/// The curves of a clip in the caller's memory.
struct CurvesView {
  std::span<const std::string> names;
  std::span<const float> values;  // [names, frames]
  std::size_t frame_count = 0;
  double rate = 60.0;             // frames per second
  double start = 0.0;             // seconds
  std::span<const double> times;  // [frames], ascending seconds; empty: start + i / rate
};

/// How a layer is combined with the layers below it: v is the layer's value, b the value below, and
/// m the layer's weight times its mask.
enum class Blend : std::uint8_t {
  kOverride,  // b * (1 - m) + v * m
  kAdditive,  // b + v * m
  kMax,       // b * (1 - m) + max(b, v) * m
};

/// Behaviour of a layer before its start and after its end.
enum class Extend : std::uint8_t {
  kHold,         // both ends are held
  kHoldForward,  // nothing before the start; the end is held
  kNothing,
  kRepeat,  // repeated before the start and after the end
};

/// A polyline y(x), constant before its first and after its last point. A line with one point is
/// constant everywhere.
struct Line {
  std::vector<double> x, y;  // x ascending
  double at(double x) const noexcept;
};

/// The curves of a layer, prepared for playing: values frame by frame, controls in the mixer's
/// order, and constant curves separate. Curves for which the mixer has no control, or whose mask is
/// 0, are left out. An object never changes, so that several layers and mixers can share it.
class LayerCurves {
 public:
  /// In:    controls  the names of the mixer's controls
  ///        curves    the curves of the layer, which are copied
  ///        mask      float[controls] in [0, 1], or empty: all 1
  /// Fails: kInvalidLength, kInvalidValue, with the field
  static core::Result<std::shared_ptr<const LayerCurves>> make(
      std::span<const std::string> controls, const CurvesView& curves, std::span<const float> mask);

  std::size_t control_count() const { return control_count_; }
  std::size_t frame_count() const { return frame_count_; }
  double first_time() const;  // seconds, on the clip's own clock
  double last_time() const;

 private:
  friend class Mixer;
  /// Controls that are consecutive both in the mixer and in the columns of this layer: index of the
  /// first control in the mixer, the first column, and their number.
  struct Run {
    std::uint32_t control, column, count;
  };
  struct Channels {
    std::vector<Run> runs;
    core::AlignedVector<float> masks;   // [columns]
    core::AlignedVector<float> values;  // [frames, columns]; of constants [columns]
  };
  struct Place {
    std::size_t first;  // index of the frame at or before the time
    float part;         // 0 at frame `first`, 1 at the next frame
  };
  struct Sorter;
  Place place(double time) const noexcept;

  Channels moving_, constant_, zero_;  // zero_: constants at 0, which an additive layer skips
  std::size_t control_count_ = 0, frame_count_ = 0;
  double rate_ = 60.0, start_ = 0.0;
  std::vector<double> times_;
};

/// A layer: its curves, their timing and their weight. Times are in seconds of the scene, clip
/// times in seconds of the clip. Without a warp the clip's part [first, last] begins at start,
/// lasts (last - first) * scale and is played repeat times; end is derived. With a warp, start and
/// end become its first and last scene time; first, last, scale, repeat and reverse are ignored,
/// and a descending warp plays backwards. A single frame is held from start to end, which by
/// default is at all times.
struct Layer {
  static constexpr double kAlways = std::numeric_limits<double>::infinity();

  std::shared_ptr<const LayerCurves> curves;
  Blend blend = Blend::kOverride;
  Extend extend = Extend::kHold;
  Line weight{{0.0}, {1.0}};  // scene time -> weight in [0, 1]
  double start = -kAlways, end = kAlways;
  double first = 0.0, last = 0.0;  // clip times
  double scale = 1.0, repeat = 1.0;
  bool reverse = false;
  Line warp;  // scene time -> clip time; empty: none
  double fade_in = 0.0, fade_out = 0.0;
  bool mute = false, solo = false;
};

/// Part of a reaction: controls that share one envelope, a factor from 0 to 1. During `attack` the
/// envelope rises, and during `release` it falls, along x * x * (3 - 2 * x), where x goes from 0 to
/// 1 and back.
struct ReactionPart {
  std::vector<std::uint32_t> controls;
  std::vector<float> weights;                                   // [controls], in [0, 1]
  double delay = 0.0, attack = 0.1, hold = 0.0, release = 0.3;  // seconds
};
using Reaction = std::vector<ReactionPart>;

/// The controls `by` reduce the controls `of`: each of `of` is multiplied by 1 - amount * s, where
/// s in [0, 1] is the highest, lowest or mean value of `by`.
struct Yield {
  enum class Measure : std::uint8_t { kMax, kMin, kMean };
  std::vector<std::uint32_t> by, of;
  Measure measure = Measure::kMax;
  float amount = 1.0f;
};

/// Two controls that cancel each other: their common amount is subtracted from both.
struct Opposites {
  std::uint32_t a, b;
};

/// A stack of layers, the fired reactions, and the rules of controls that exclude each other, for
/// one face.
///
/// Arithmetic, float32 unless stated otherwise, each operation rounded separately:
/// 1. out = base, or 0.
/// 2. Layers, bottom to top. Times are doubles. t is the scene's time, mapped into [start, end] by
///    `extend`, or the layer is off. Weight w = float(line(t) * min((t - start) / fade_in,
///    (end - t) / fade_out, 1)); the layer is off at 0. Clip time c: line(t) of the warp, or
///    first + o / scale, reversed last - o / scale, where o = (t - start) mod ((last - first) *
///    scale); at the end of a whole number of repeats it is the end of the clip, not its start.
///    Between frames v = a + (b - a) * part, and m = mask * w; see Blend.
/// 3. Each fired reaction in the order of firing, except that a reaction that replaced an ended one
///    has the position of the ended one; each part with envelope e: r = strength * e * weight;
///    out += (peak - out) * r if out < peak = min(high, 1).
///    That is 1 - (1 - out) * (1 - r), also for a control that may be driven beyond 1.
/// 4. Yields: all s are computed before any control is reduced. Then opposites:
///    c = min(a, b); if c > 0: a -= c, b -= c.
/// 5. Clamped to the range; NaN becomes its lower end.
///
/// From: steps 1 and 2 are Blender's NLA (strips of type Clip; Replace and Add).
class Mixer {
 public:
  /// In:    controls   names, each once
  ///        low, high  [controls], low <= high
  ///        max_fired  largest number of reactions that are active at the same time
  /// Fails: kInvalidLength, kInvalidValue.
  static core::Result<Mixer> make(std::vector<std::string> controls, std::vector<float> low,
                                  std::vector<float> high, std::size_t max_fired = 256);

  std::span<const std::string> controls() const { return controls_; }
  std::size_t control_count() const { return controls_.size(); }

  /// Replaces the layers. In: layers  bottom to top.
  /// Fails: kInvalidValue, with the layer's place and field; the old layers stay.
  core::Status set_layers(std::vector<Layer> layers);
  /// Replaces the reactions and stops the fired ones.
  /// Fails: kInvalidIndex, kInvalidLength, kInvalidValue.
  core::Status set_reactions(std::vector<Reaction> reactions);
  /// Replaces the rules of controls that exclude each other. In: yields, opposites  their controls
  /// are indices below control_count()
  /// Fails: kInvalidIndex, kInvalidValue.
  core::Status set_rules(std::vector<Yield> yields, std::vector<Opposites> opposites);

  /// Fires a reaction. If max_fired reactions are stored, it replaces the one that ended first.
  /// In:   reaction  below the number of reactions
  ///       time      seconds, finite
  ///       strength  in [0, 1]
  /// Out:  false, and nothing happens, if all stored reactions are still active
  /// Cost: no allocation
  bool fire(std::size_t reaction, double time, float strength) noexcept;
  void clear_fired() noexcept { voice_count_ = 0; }

  /// Computes the controls at a time. Apart from the layers, reactions and rules that are set, the
  /// result depends only on the time, the base and the fired reactions.
  /// In:    base  float[controls], or null for 0
  /// Out:   out   float[controls], may be base
  /// Cost:  allocates nothing. Not thread-safe, because it has a workspace
  void evaluate(double time, const float* base, float* out) noexcept;

 private:
  struct Voice {
    std::size_t reaction;
    double time, end;
    float strength;
  };
  struct Moment;
  static bool moment(const Layer& layer, double time, Moment& out) noexcept;
  static void apply(const Layer& layer, const Moment& at, float* out) noexcept;
  void react(double time, float* out) const noexcept;
  void exclude(float* out) noexcept;
  void clamp(float* out) const noexcept;

  std::vector<std::string> controls_;
  core::AlignedVector<float> low_, high_;
  std::vector<Layer> layers_;
  bool solo_ = false;
  std::vector<Reaction> reactions_;
  std::vector<double> durations_;  // of each reaction, seconds
  std::vector<Voice> voices_;
  std::size_t voice_count_ = 0;  // number of voices in use
  std::vector<Yield> yields_;
  std::vector<Opposites> opposites_;
  std::vector<float> factors_;  // workspace: one per yield
};

}  // namespace risorius::clip
