// SPDX-License-Identifier: MIT
// The stages that compute all other controls from the raw ones: networks, solvers and correctives.
// A corrective is a product of other controls, its factors. A watched corrective is in the list of
// one of its factors, its watcher, and is not visited while the watcher is 0.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "rig/stages/stages.h"
#include "simd/four.h"

namespace risorius::rig {

namespace {

float corrective(const Rig& rig, const Psd& psd, const float* values) noexcept {
  const std::uint16_t* factors = rig.psd_factors.data() + psd.factors_begin;
  float product = psd.weight;
  for (std::uint32_t f = 0; f < psd.factor_count; ++f)
    product *= detail::clamp01(values[factors[f]]);
  return product > 1.0f ? 1.0f : product;
}

// Appends the controls from begin up to end that are not 0. Runs of eight controls that are 0 are
// skipped by one test, because most controls are 0 in most frames.
// Out: number of controls appended
std::size_t append_active(const float* controls, std::uint32_t begin, std::uint32_t end,
                          std::uint16_t* active) noexcept {
  constexpr std::uint32_t kTogether = 8;
  std::size_t n = 0;
  for (std::uint32_t c = begin; c < end;) {
    if (end - c >= kTogether && detail::rest_eight(controls + c)) {
      c += kTogether;
      continue;
    }
    for (const std::uint32_t next = std::min(end, c + kTogether); c < next; ++c) {
      active[n] = static_cast<std::uint16_t>(c);
      n += controls[c] != 0.0f ? 1 : 0;
    }
  }
  return n;
}

bool rests_any(const Rig& rig, const Psd& psd, auto rests) noexcept {
  const std::uint16_t* factors = rig.psd_factors.data() + psd.factors_begin;
  return std::any_of(factors, factors + psd.factor_count, rests);
}

// Lists the watched correctives that can differ from 0. A new list has the correctives of which two
// factors, the control that watches the corrective and Watch::other, are not 0. Their further
// factors are not tested, because that takes longer than it saves if the list is used only once.
// If the evaluation before had the same active controls, its list is used again. At
// the first such use, correctives with any factor at 0 are removed from it.
// In:  kept    the evaluation before had the same active controls
//      rests   rests(control): whether a control is 0
// Out: work    firing, firing_count, fires_all (true: such correctives have been removed)
template <class Rests>
void list_firing(const Rig& rig, std::uint32_t lod, std::span<const std::uint16_t> active,
                 bool kept, Workspace& work, Rests rests) noexcept {
  std::uint16_t* firing = work.firing.data();
  if (kept) {
    if (std::exchange(work.fires_all, true)) return;
    const auto at_rest = [&](std::uint16_t p) { return rests_any(rig, rig.psds[p], rests); };
    std::uint16_t* left = std::remove_if(firing, firing + work.firing_count, at_rest);
    work.firing_count = static_cast<std::size_t>(left - firing);
    return;
  }
  const std::uint32_t* begins =
      rig.watch_begins.data() + std::size_t{lod} * (std::size_t{rig.control_count} + 1);
  std::size_t n = 0;
  for (const std::uint16_t control : active) {
    for (std::uint32_t i = begins[control]; i < begins[control + std::size_t{1}]; ++i) {
      firing[n] = rig.watched[i].psd;
      n += rests(rig.watched[i].other) ? 0 : 1;
    }
  }
  work.firing_count = n;
  work.fires_all = false;
  work.firing_for.keep(rig, lod, active);
}

class Correctives {
 public:
  Correctives(const Rig& rig, Workspace& work, float* controls)
      : rig_(rig), work_(work), controls_(controls) {}

  // Computes the watched correctives.
  // In: active  controls that are not 0, without the correctives
  //     kept    the evaluation before had the same active controls
  void watched(std::uint32_t lod, std::span<const std::uint16_t> active, bool kept) noexcept {
    const auto rests = [this](std::uint16_t control) { return controls_[control] == 0.0f; };
    list_firing(rig_, lod, active, kept, work_, rests);
    for (std::size_t i = 0; i < work_.firing_count; ++i) {
      const Psd& psd = rig_.psds[work_.firing[i]];
      const float value = corrective(rig_, psd, controls_);
      // A product of 0 and NaN or infinity is NaN. The corrective must be 0 here, because other
      // evaluations skip a corrective with a factor at 0.
      if (std::isnan(value) && rests_any(rig_, psd, rests)) continue;
      set(psd.output, value);
    }
  }
  // Computes one corrective. In: from  the controls to read. If the output is a raw control, it is
  // set but not marked as active.
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

// Lists the controls that are not 0, without the correctives.
// Out: number of controls in work.active
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

// Reads one value of every list (columns and watched correctives) of the given controls. These
// reads do not depend on each other, so that a cold cache loads them in parallel, and their pages
// are in memory when the columns are read. In a batch only the first frame does it, because the
// other frames need mostly the same memory.
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

// Calls touch(), unless the cache is warm (work.warm) or the evaluation before had the same active
// controls. In the second case its lists are used again; they list the columns in one run of
// memory, so that touch() is not needed.
// Out: whether the evaluation before had the same active controls
bool reach(const Rig& rig, std::uint32_t lod, std::span<const std::uint16_t> active,
           Workspace& work) noexcept {
  const bool kept = work.firing_for.are(rig, lod, active);
  if (!kept && !work.warm) touch(rig, lod, active, work);
  return kept;
}

// Sets all correctives to 0 and computes the watched ones.
void start_correctives(const Rig& rig, std::uint32_t lod, Workspace& work,
                       float* controls) noexcept {
  std::fill(controls + rig.raw_count, controls + rig.raw_count + rig.psd_count, 0.0f);
  std::fill(work.psd_bits.begin(), work.psd_bits.end(), 0u);
  const std::size_t n = list_sources(rig, controls, work);
  const std::span<const std::uint16_t> active(work.active.data(), n);
  const bool kept = reach(rig, lod, active, work);
  Correctives(rig, work, controls).watched(lod, active, kept);
}

// Lists all active controls in ascending order: raw, corrective, network and RBF pose controls.
// In: had_steps  networks or solvers ran since list_sources and may have changed raw controls
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

void run(const Rig& rig, std::uint32_t step, std::uint32_t lod, Workspace& work,
         float* controls) noexcept {
  if (step_kind(step) == StepKind::kOperation) {
    detail::run_operation(rig, step_index(step), lod, work, controls);
  } else {
    detail::run_solver(rig, step_index(step), work, controls);
  }
}

// Transposes the raw controls of frames, so that the values of one control are adjacent.
// Out: values  [raw controls, kFrames]; frames beyond count are 0
void turn_raw(const Rig& rig, const float* raw, std::size_t count, float* values) noexcept {
  static_assert(simd::kFrames == 8);
  std::uint32_t c = 0;
  for (; count == simd::kFrames && c + 4 <= rig.raw_count; c += 4) {
    float* to = values + c * simd::kFrames;
    for (std::size_t f = 0; f < simd::kFrames; f += 4, to += 4) {
      simd::turn_four(raw + f * rig.raw_count + c, rig.raw_count, to, to + simd::kFrames,
                      to + 2 * simd::kFrames, to + 3 * simd::kFrames);
    }
  }
  for (; c < rig.raw_count; ++c) {
    float* to = values + c * simd::kFrames;
    std::fill(to, to + simd::kFrames, 0.0f);
    for (std::size_t f = 0; f < count; ++f) to[f] = raw[f * rig.raw_count + c];
  }
}

bool any_negative_0(const float* values, std::size_t count) noexcept {
  return std::any_of(values, values + count, [](float v) { return v == 0.0f && std::signbit(v); });
}

// Lists in work.active the raw controls that are not 0 in at least one frame of work.frame_weights,
// and sets their bits in work.union_bits.
// Out: signs    whether any value has its sign bit set
//      returns  the number of listed controls
std::size_t list_raw(const Rig& rig, Workspace& work, bool& signs) noexcept {
  const float* values = work.frame_weights.data();
  std::uint64_t all = 0;
  std::size_t n = 0;
  for (std::uint32_t c = 0; c < rig.raw_count; ++c, values += simd::kFrames) {
    const std::uint64_t bits = detail::bits_of_eight(values);
    const bool moves = (bits & ~detail::kSigns) != 0;
    all |= bits;
    work.active[n] = static_cast<std::uint16_t>(c);
    n += moves ? 1 : 0;
    work.union_bits[c / 64] |= std::uint64_t{moves} << (c % 64);
  }
  signs = (all & detail::kSigns) != 0;
  return n;
}

// Computes a corrective of four frames. Products and roundings have the same order as for a single
// frame, in corrective(). The result is 0 instead of NaN in frames in which a factor is 0.
// In: values  [controls, kFrames], from the first of the four frames on
simd::Four four_correctives(const Psd& psd, const std::uint16_t* factors,
                            const float* values) noexcept {
  simd::Four product = simd::Four::all(psd.weight);
  for (std::uint32_t k = 0; k < psd.factor_count; ++k) {
    const simd::Four factor = simd::Four::load(values + factors[k] * simd::kFrames);
    product = product * factor.at_least(0.0f).at_most(1.0f);
  }
  product = product.at_most(1.0f) + simd::Four::all(0.0f);  // no -0
  if (!product.any_nan()) return product;
  float one[4];
  product.store(one);
  for (std::uint32_t k = 0; k < psd.factor_count; ++k) {
    const float* factor = values + factors[k] * simd::kFrames;
    for (std::size_t f = 0; f < 4; ++f) one[f] = factor[f] == 0.0f ? 0.0f : one[f];
  }
  return simd::Four::load(one);
}

// Computes the listed correctives of all frames.
// In/out: values  [controls, kFrames] all controls, frame after frame for each control
//         bits    [controls] bits: the bit of a corrective's output is set if the corrective is not
//                 0 in some frame
void frame_correctives(const Rig& rig, std::span<const std::uint16_t> firing, float* values,
                       std::uint64_t* bits) noexcept {
  for (const std::uint16_t p : firing) {
    const Psd& psd = rig.psds[p];
    const std::uint16_t* factors = rig.psd_factors.data() + psd.factors_begin;
    bool moves = false;
    for (std::size_t f = 0; f < simd::kFrames; f += 4) {
      const simd::Four four = four_correctives(psd, factors, values + f);
      four.store(values + psd.output * simd::kFrames + f);
      moves |= four.any_but_0();
    }
    bits[psd.output / 64u] |= std::uint64_t{moves} << (psd.output % 64u);
  }
}

// Writes the controls of each frame: its raw controls, the active correctives from
// work.frame_weights, 0 for the other correctives, and the initial values of all other controls.
// Out: controls  [count, controls]
void write_frames(const Rig& rig, const float* raw, std::size_t count, const Workspace& work,
                  float* controls) noexcept {
  const std::uint32_t correctives_end = rig.raw_count + rig.psd_count;
  for (std::size_t f = 0; f < count; ++f) {
    float* to = controls + f * rig.control_count;
    to = std::copy_n(raw + f * rig.raw_count, rig.raw_count, to);
    to = std::fill_n(to, rig.psd_count, 0.0f);
    std::copy(rig.initial_controls.begin() + correctives_end, rig.initial_controls.end(), to);
  }
  for (const std::uint16_t control : std::span(work.active.data(), work.active_count)) {
    if (control < rig.raw_count || control >= correctives_end) continue;
    const float* from = work.frame_weights.data() + control * simd::kFrames;
    for (std::size_t f = 0; f < count; ++f) controls[f * rig.control_count + control] = from[f];
  }
}

}  // namespace

namespace detail {

bool go_together(const Rig& rig, std::uint32_t lod) noexcept {
  for (std::uint32_t list = 0; list < kStepLists; ++list) {
    if (!rig.steps_of(lod, static_cast<StepList>(list)).empty()) return false;
  }
  return true;
}

bool frame_controls(const Rig& rig, const float* raw, std::size_t count, std::uint32_t lod,
                    Workspace& work, float* controls) noexcept {
  float* values = work.frame_weights.data();
  std::uint64_t* bits = work.union_bits.data();
  turn_raw(rig, raw, count, values);
  bool signs = false;
  std::size_t n = list_raw(rig, work, signs);
  if (signs && any_negative_0(raw, count * rig.raw_count)) {
    std::fill_n(values, rig.raw_count * simd::kFrames, 0.0f);
    std::ranges::fill(work.union_bits, 0u);
    return false;
  }
  const std::uint32_t correctives_end = rig.raw_count + rig.psd_count;
  for (std::uint32_t c = correctives_end; c < rig.control_count; ++c) {
    if (rig.initial_controls[c] == 0.0f) continue;
    std::fill_n(values + c * simd::kFrames, count, rig.initial_controls[c]);
    work.active[n++] = static_cast<std::uint16_t>(c);
    bits[c / 64] |= std::uint64_t{1} << (c % 64);
  }
  const std::span<const std::uint16_t> active(work.active.data(), n);
  const bool kept = reach(rig, lod, active, work);
  list_firing(rig, lod, active, kept, work, [bits](std::uint16_t control) {
    return ((bits[control / 64] >> (control % 64)) & 1) == 0;
  });
  frame_correctives(rig, {work.firing.data(), work.firing_count}, values, bits);
  list_union(work);
  write_frames(rig, raw, count, work, controls);
  return true;
}

void list_union(Workspace& work) noexcept {
  std::size_t n = 0;
  for (std::size_t word = 0; word < work.union_bits.size(); ++word) {
    for (std::uint64_t bits = work.union_bits[word]; bits != 0; bits &= bits - 1) {
      work.active[n++] =
          static_cast<std::uint16_t>(word * 64 + static_cast<std::size_t>(std::countr_zero(bits)));
    }
    work.union_bits[word] = 0;
  }
  work.active_count = n;
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

}  // namespace detail

}  // namespace risorius::rig
