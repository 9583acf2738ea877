// SPDX-License-Identifier: MIT
// Compares the poses and the evaluation times of a face before and after an edit.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "compile/compile.h"
#include "core/parallel_for.h"
#include "edit/positions.h"
#include "edit/units.h"
#include "rig/stages/evaluate.h"
#include "simd/kernels.h"

namespace risorius::edit::detail {

namespace {

using core::Result;
using Frames = std::vector<float>;  // [frames, raw controls]

constexpr std::uint32_t kMostActive = 40;  // a random pose sets at most this number + 1 controls
constexpr std::size_t kFrames = 32;        // evaluated in one call

// Random numbers that are the same on every platform, unlike the distributions of the standard
// library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(engine_() % n); }
  float share() { return static_cast<float>((engine_() >> 40) + 1) / 16777216.0f; }  // (0, 1]

 private:
  std::mt19937_64 engine_;
};

Frames random_frames(const rig::Rig& rig, std::uint32_t count, std::uint64_t seed) {
  Random random(seed);
  Frames out;
  for (std::uint32_t f = 0; f < count; ++f) {
    out.insert(out.end(), rig.initial_controls.begin(),
               rig.initial_controls.begin() + rig.raw_count);
    if (rig.raw_count == 0) continue;
    float* raw = out.data() + out.size() - rig.raw_count;
    const std::uint32_t active = 2 + random.below(std::min(kMostActive, rig.raw_count));
    for (std::uint32_t i = 0; i < active; ++i) raw[random.below(rig.raw_count)] = random.share();
  }
  return out;
}

// The compared frames: one frame for each raw control, with this control at 1 and the others at
// their initial values; then the random poses.
Frames all_frames(const rig::Rig& rig, const RegroupOptions& options) {
  Frames out;
  for (std::uint32_t c = 0; c < rig.raw_count; ++c) {
    out.insert(out.end(), rig.initial_controls.begin(),
               rig.initial_controls.begin() + rig.raw_count);
    out[std::size_t{c} * rig.raw_count + c] = 1.0f;
  }
  const Frames random = random_frames(rig, options.combinations, options.seed);
  out.insert(out.end(), random.begin(), random.end());
  return out;
}

// The largest difference of one kind, in the file's translation unit or in degrees. Worsts has one
// each for translation, rotation, scale and position.
struct Worst {
  double value = 0.0;
  std::size_t joint = 0, frame = 0;
};
using Worsts = std::array<Worst, 4>;

void note(double value, std::size_t joint, std::size_t frame, Worst& worst) {
  if (std::isnan(value)) value = std::numeric_limits<double>::infinity();
  if (value > worst.value) worst = {value, joint, frame};
}

double length(const Vector& a, const Vector& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// Evaluates two rigs in blocks of frames and records the largest differences of their poses.
class Comparison {
 public:
  Comparison(const Skeleton& skeleton, const rig::Rig& before, const rig::Rig& after)
      : skeleton_(skeleton),
        rigs_{&before, &after},
        works_{rig::make_batch_workspace(before), rig::make_batch_workspace(after)} {
    for (std::size_t side = 0; side < 2; ++side) {
      const rig::Rig& r = *rigs_[side];
      joints_[side].resize(kFrames * r.joint_count * 9);
      locals_[side].resize(r.joint_count);
      places_[side].resize(r.joint_count);
    }
    shapes_.resize(kFrames * before.blend_shape_count);
    maps_.resize(kFrames * before.animated_map_count);
    controls_.resize(kFrames * before.control_count);
  }
  Worsts run(const Frames& frames, std::uint32_t lod) {
    Worsts out;
    const rig::Rig& r = *rigs_[0];
    const std::size_t count = r.raw_count == 0 ? 0 : frames.size() / r.raw_count;
    for (std::size_t begin = 0; begin < count; begin += kFrames) {
      const std::size_t n = std::min(kFrames, count - begin);
      for (std::size_t side = 0; side < 2; ++side) {
        const rig::PoseView view{joints_[side].data(), shapes_.data(), maps_.data(),
                                 controls_.data()};
        rig::evaluate_frames(*rigs_[side], frames.data() + begin * r.raw_count, n, lod, true,
                             works_[side], view);
      }
      for (std::size_t f = 0; f < n; ++f) compare_frame(f, begin + f, out);
    }
    return out;
  }

 private:
  void compare_frame(std::size_t at, std::size_t frame, Worsts& out) {
    const std::size_t size = skeleton_.joint_count() * 9;
    const float* pose[2] = {joints_[0].data() + at * size, joints_[1].data() + at * size};
    if (std::equal(pose[0], pose[0] + size, pose[1])) return;
    for (std::size_t j = 0; j < skeleton_.joint_count(); ++j) {
      for (std::size_t side = 0; side < 2; ++side) {
        locals_[side][j] = skeleton_.local(j, pose[side] + 9 * j);
      }
      // Equal bits are no difference, even if they are NaN.
      // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
      if (!std::memcmp(pose[0] + 9 * j, pose[1] + 9 * j, 9 * sizeof(float))) continue;
      const Local &a = locals_[0][j], &b = locals_[1][j];
      note(length(a.translation, b.translation), j, frame, out[0]);
      note(degrees_between(a.rotation, b.rotation), j, frame, out[1]);
      for (std::size_t k = 0; k < 3; ++k) {
        note(std::fabs(a.scale[k] - b.scale[k]), j, frame, out[2]);
      }
    }
    for (std::size_t side = 0; side < 2; ++side) skeleton_.place(locals_[side], places_[side]);
    for (std::size_t j = 0; j < skeleton_.joint_count(); ++j) {
      note(length(places_[0][j], places_[1][j]), j, frame, out[3]);
    }
  }

  const Skeleton& skeleton_;
  const rig::Rig* rigs_[2];
  rig::Workspace works_[2];
  std::vector<float> joints_[2], shapes_, maps_, controls_;
  std::vector<Local> locals_[2];
  std::vector<Vector> places_[2];
};

void report_worst(const dna::Dna& dna, const std::vector<Worsts>& of_lods, Changes& out) {
  LargestChange* to[4] = {&out.translation_mm, &out.rotation_degrees, &out.scale, &out.position_mm};
  const double mm = dna.descriptor.translation_unit == 1 ? 1000.0 : 10.0;
  const double units[4] = {mm, 1.0, 1.0, mm};
  for (std::uint32_t lod = 0; lod < of_lods.size(); ++lod) {
    for (std::size_t k = 0; k < 4; ++k) {
      const Worst& w = of_lods[lod][k];
      if (w.value * units[k] <= to[k]->value) continue;
      const std::size_t single = out.expressions;
      to[k]->value = w.value * units[k];
      to[k]->joint = dna.definition.joint_names[w.joint];
      to[k]->expression = w.frame < single ? dna.definition.raw_control_names[w.frame]
                                           : "combination " + std::to_string(w.frame - single);
      to[k]->lod = lod;
    }
  }
}

core::Status measure_changes(const dna::Dna& before, const dna::Dna& after,
                             const RegroupOptions& options, RegroupReport& report) {
  // The scalar kernels add terms in the ascending order of their controls, so the grouping of the
  // controls changes no sum.
  compile::CompileOptions scalar;
  scalar.kernels = simd::find_kernels("scalar");
  const Result<rig::Rig> a = compile::compile(before, scalar), b = compile::compile(after, scalar);
  if (!a) return core::Unexpected{a.error()};
  if (!b) return core::Unexpected{b.error()};
  const rig::Rig &rig = a.value(), &changed = b.value();
  const Skeleton skeleton(before, rig.euler);
  const Frames frames = all_frames(rig, options);
  std::vector<Worsts> worst(rig.lod_count);
  core::parallel_for(rig.lod_count, 0, [&](std::size_t begin, std::size_t end) {
    Comparison comparison(skeleton, rig, changed);
    for (std::size_t lod = begin; lod < end; ++lod) {
      worst[lod] = comparison.run(frames, static_cast<std::uint32_t>(lod));
    }
  });
  report.changes.expressions = rig.raw_count;
  report.changes.combinations = rig.raw_count == 0 ? 0 : options.combinations;
  report_worst(before, worst, report.changes);
  return core::ok();
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Measures the median time of an evaluation of both faces, in microseconds, at LOD 0 in random
// poses. The faces alternate, and each goes first equally often, so that the load of the machine
// and cold caches affect both alike.
core::Status measure_times(const dna::Dna& before, const dna::Dna& after,
                           const RegroupOptions& options, RegroupReport& report) {
  if (options.timed == 0) return core::ok();
  const Result<rig::Rig> a = compile::compile(before), b = compile::compile(after);
  if (!a) return core::Unexpected{a.error()};
  if (!b) return core::Unexpected{b.error()};
  const rig::Rig* rigs[2] = {&a.value(), &b.value()};
  rig::Workspace works[2] = {rig::make_workspace(*rigs[0]), rig::make_workspace(*rigs[1])};
  rig::Pose pose = rig::make_pose(*rigs[0]);
  const Frames frames = random_frames(*rigs[0], options.timed, options.seed + 1);
  std::vector<double> times[2];
  for (std::uint32_t f = 0; f < options.timed; ++f) {
    const float* raw = frames.data() + std::size_t{f} * rigs[0]->raw_count;
    for (const std::size_t side : {f % 2, 1 - f % 2}) {
      const auto begin = std::chrono::steady_clock::now();
      rig::evaluate(*rigs[side], raw, 0, true, works[side], pose);
      const std::chrono::duration<double, std::micro> time =
          std::chrono::steady_clock::now() - begin;
      times[side].push_back(time.count());
    }
  }
  report.microseconds_before = median(times[0]);
  report.microseconds_after = median(times[1]);
  return core::ok();
}

}  // namespace

core::Status compare(const dna::Dna& before, const dna::Dna& after, const RegroupOptions& options,
                     RegroupReport& report) {
  if (before.descriptor.lod_count == 0) return core::ok();
  RISORIUS_TRY(measure_changes(before, after, options, report));
  return measure_times(before, after, options, report);
}

}  // namespace risorius::edit::detail
