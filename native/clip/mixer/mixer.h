// SPDX-License-Identifier: MIT
// Layers of curves, reactions and exclusive controls -> the controls of one frame.
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

/// Curves in memory that the caller keeps.
struct CurvesView {
  std::span<const std::string> names;
  std::span<const float> values;  // [names, frames]
  std::size_t frame_count = 0;
  double rate = 60.0;             // frames a second
  double start = 0.0;             // seconds
  std::span<const double> times;  // [frames], ascending seconds; empty: start + i / rate
};

/// How a layer meets what lies below it; v its value, b what is below, m its weight times its mask.
enum class Blend : std::uint8_t {
  kOverride,  // b * (1 - m) + v * m
  kAdditive,  // b + v * m
  kMax,       // b * (1 - m) + max(b, v) * m
};

/// What a layer does before its start and after its end.
enum class Extend : std::uint8_t {
  kHold,         // both ends last
  kHoldForward,  // nothing before, the end lasts
  kNothing,
  kRepeat,  // over and over, both ways
};

/// Straight lines between points, held outside. One point is a constant.
struct Line {
  std::vector<double> x, y;  // x ascending
  double at(double x) const noexcept;
};

/// The curves of a layer that a mixer has and its mask lets through, made ready to be played: frame
/// by frame, in the mixer's order, what never changes kept apart. Immutable; layers and mixers
/// share it.
class LayerCurves {
 public:
  /// In:    controls  the names of the mixer's controls
  ///        curves    are copied
  ///        mask      float[controls] in [0, 1], or empty: all 1
  /// Fails: kInvalidLength, kInvalidValue, with the field.
  static core::Result<std::shared_ptr<const LayerCurves>> make(
      std::span<const std::string> controls, const CurvesView& curves, std::span<const float> mask);

  std::size_t control_count() const { return control_count_; }
  std::size_t frame_count() const { return frame_count_; }
  double first_time() const;  // seconds, on the clip's own clock
  double last_time() const;

 private:
  friend class Mixer;
  /// Neighbours in the mixer and here.
  struct Run {
    std::uint32_t control, column, count;
  };
  struct Channels {
    std::vector<Run> runs;
    core::AlignedVector<float> masks;   // [columns]
    core::AlignedVector<float> values;  // [frames, columns]; of constants [columns]
  };
  struct Place {
    std::size_t first;
    float part;  // of the way to the next frame
  };
  struct Sorter;
  Place place(double time) const noexcept;

  Channels moving_, constant_, zero_;  // zero_: constants that an additive layer need not add
  std::size_t control_count_ = 0, frame_count_ = 0;
  double rate_ = 60.0, start_ = 0.0;
  std::vector<double> times_;
};

/// A layer: curves, when and how much. Times in seconds; of the scene unless it says clip.
/// Without a warp the clip's part [first, last] begins at start, lasts (last - first) * scale and
/// is played repeat times; end is derived. With a warp its ends are start and end; scale, repeat
/// and reverse are not read then, and a warp that falls plays backwards. Of a single frame nothing
/// is played: it stands from start to end, by default always.
struct Layer {
  static constexpr double kAlways = std::numeric_limits<double>::infinity();

  std::shared_ptr<const LayerCurves> curves;
  Blend blend = Blend::kOverride;
  Extend extend = Extend::kHold;
  Line weight{{0.0}, {1.0}};  // in [0, 1]
  double start = -kAlways, end = kAlways;
  double first = 0.0, last = 0.0;  // clip time
  double scale = 1.0, repeat = 1.0;
  bool reverse = false;
  Line warp;  // scene -> clip time; empty: none
  double fade_in = 0.0, fade_out = 0.0;
  bool mute = false, solo = false;
};

/// Part of a reaction: controls that go the same way in time. The way up and the way down are
/// x * x * (3 - 2 * x).
struct ReactionPart {
  std::vector<std::uint32_t> controls;
  std::vector<float> weights;                                   // [controls], in [0, 1]
  double delay = 0.0, attack = 0.1, hold = 0.0, release = 0.3;  // seconds
};
using Reaction = std::vector<ReactionPart>;

/// While `by` are on, `of` are taken down: of *= 1 - amount * s, where s in [0, 1] is the highest,
/// lowest or mean value of `by`.
struct Yield {
  enum class Measure : std::uint8_t { kMax, kMin, kMean };
  std::vector<std::uint32_t> by, of;
  Measure measure = Measure::kMax;
  float amount = 1.0f;
};

/// Two controls that undo each other: what both have is taken from both.
struct Opposites {
  std::uint32_t a, b;
};

/// A stack of layers, the reactions that were fired, and the rules of controls that exclude each
/// other, for one face.
///
/// Arithmetic, float32 unless it says otherwise, each operation rounded by itself:
/// 1. out = base, or 0.
/// 2. Layers, bottom to top. Times are doubles. t is the scene's time, brought into [start, end] as
///    `extend` says or the layer is off; weight w = float(line(t) * min((t - start) / fade_in,
///    (end - t) / fade_out, 1)), off at 0; clip time c: line(t) of the warp, or first + o / scale,
///    reversed last - o / scale, where o = (t - start) mod ((last - first) * scale) and at the end
///    of a whole number of repeats the end of the clip and not its start. Between frames
///    v = a + (b - a) * part, and m = mask * w; see Blend.
/// 3. Each reaction in the order of its place, each part with envelope e:
///    r = strength * e * weight; out += (peak - out) * r where out < peak = min(high, 1). That is
///    1 - (1 - out) * (1 - r), also where a control may be driven beyond 1.
/// 4. Yields: all s from the values as they are, then all products. Then opposites:
///    c = min(a, b); if c > 0: a -= c, b -= c.
/// 5. Clamped to the range; NaN becomes its lower end.
///
/// From: steps 1 and 2 are Blender's NLA (strips of type Clip; Replace and Add).
class Mixer {
 public:
  /// In:    controls   names, each once
  ///        low, high  [controls], low <= high
  ///        max_fired  reactions that are remembered at once
  /// Fails: kInvalidLength, kInvalidValue.
  static core::Result<Mixer> make(std::vector<std::string> controls, std::vector<float> low,
                                  std::vector<float> high, std::size_t max_fired = 256);

  std::span<const std::string> controls() const { return controls_; }
  std::size_t control_count() const { return controls_.size(); }

  /// Replaces the layers. In: layers  bottom to top.
  /// Fails: kInvalidValue, with the layer's place and field; the old layers stay.
  core::Status set_layers(std::vector<Layer> layers);
  /// Replaces the reactions and forgets what was fired.
  /// Fails: kInvalidIndex, kInvalidLength, kInvalidValue.
  core::Status set_reactions(std::vector<Reaction> reactions);
  /// Replaces the rules of controls that exclude each other. In: controls that the mixer has.
  /// Fails: kInvalidIndex, kInvalidValue.
  core::Status set_rules(std::vector<Yield> yields, std::vector<Opposites> opposites);

  /// Fires a reaction. Where max_fired are remembered the one that ended first makes room.
  /// In:   reaction  below the number of reactions
  ///       time      seconds, finite
  ///       strength  in [0, 1]
  /// Out:  false, and nothing happens, when none has ended by then
  /// Cost: no allocation
  bool fire(std::size_t reaction, double time, float strength) noexcept;
  void clear_fired() noexcept { voice_count_ = 0; }

  /// The controls at a time: a function of it, of the base and of what was fired.
  /// In:    base  float[controls] or null: 0
  /// Out:   out   float[controls], may be base
  /// Cost:  no allocation. Not for several threads at once: it has a workspace.
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
  std::size_t voice_count_ = 0;  // of those, in use
  std::vector<Yield> yields_;
  std::vector<Opposites> opposites_;
  std::vector<float> factors_;  // workspace: one per yield
};

}  // namespace risorius::clip
