// SPDX-License-Identifier: MIT
// The stages that settle the controls: networks, solvers and correctives from the raw ones.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

float corrective(const Rig& rig, const Psd& psd, const float* values) noexcept {
  const std::uint16_t* factors = rig.psd_factors.data() + psd.factors_begin;
  float product = psd.weight;
  for (std::uint32_t f = 0; f < psd.factor_count; ++f)
    product *= detail::clamp01(values[factors[f]]);
  return product > 1.0f ? 1.0f : product;
}

// Whether eight controls are 0, of either sign.
bool rest(const float* controls) noexcept {
  constexpr std::uint64_t kSigns = 0x8000'0000'8000'0000;
  std::uint64_t pairs[4];
  std::memcpy(pairs, controls, sizeof(pairs));
  return ((pairs[0] | pairs[1] | pairs[2] | pairs[3]) & ~kSigns) == 0;
}

// Faces are sparse in time: what rests at 0 costs no more than being passed over here, eight
// controls at a time where all of them rest.
std::size_t append_active(const float* controls, std::uint32_t begin, std::uint32_t end,
                          std::uint16_t* active) noexcept {
  constexpr std::uint32_t kTogether = 8;
  std::size_t n = 0;
  for (std::uint32_t c = begin; c < end;) {
    if (end - c >= kTogether && rest(controls + c)) {
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

class Correctives {
 public:
  Correctives(const Rig& rig, Workspace& work, float* controls)
      : rig_(rig), work_(work), controls_(controls) {}

  // In: active  controls that are not 0, without the correctives
  void watched(std::uint32_t lod, std::span<const std::uint16_t> active) noexcept {
    if (!work_.firing_for.are(rig_, lod, active)) {
      list_firing(lod, active);
      work_.firing_for.keep(rig_, lod, active);
    } else if (!work_.fires_all) {
      shorten();
    }
    for (std::size_t i = 0; i < work_.firing_count; ++i) {
      const Psd& psd = rig_.psds[work_.firing[i]];
      const float value = corrective(rig_, psd, controls_);
      // 0 times NaN: it is at rest here, as it is where it was left out.
      if (std::isnan(value) && rests(psd)) continue;
      set(psd.output, value);
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
  // Those of which two factors are known not to be 0.
  void list_firing(std::uint32_t lod, std::span<const std::uint16_t> active) noexcept {
    const std::uint32_t* begins =
        rig_.watch_begins.data() + std::size_t{lod} * (rig_.control_count + 1);
    std::uint16_t* firing = work_.firing.data();
    std::size_t n = 0;
    for (const std::uint16_t control : active) {
      for (std::uint32_t i = begins[control]; i < begins[control + 1]; ++i) {
        firing[n] = rig_.watched[i].psd;
        n += controls_[rig_.watched[i].other] == 0.0f ? 0 : 1;
      }
    }
    work_.firing_count = n;
    work_.fires_all = false;
  }
  bool rests(const Psd& psd) const noexcept {
    const std::uint16_t* factors = rig_.psd_factors.data() + psd.factors_begin;
    return std::any_of(factors, factors + psd.factor_count,
                       [&](std::uint16_t factor) { return controls_[factor] == 0.0f; });
  }
  // Leaves those of which no factor is 0. It takes longer than one evaluation gains by it, so it is
  // done where a second one has the same active controls.
  void shorten() noexcept {
    const auto begin = work_.firing.begin();
    const auto end = begin + static_cast<std::ptrdiff_t>(work_.firing_count);
    const auto left =
        std::remove_if(begin, end, [&](std::uint16_t p) { return rests(rig_.psds[p]); });
    work_.firing_count = static_cast<std::size_t>(left - begin);
    work_.fires_all = true;
  }
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
// columns are read. Frames of a batch need mostly the same: the first one asks for it.
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
  if (!work.warm) touch(rig, lod, {work.active.data(), n}, work);
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

void run(const Rig& rig, std::uint32_t step, std::uint32_t lod, Workspace& work,
         float* controls) noexcept {
  if (step_kind(step) == StepKind::kOperation) {
    detail::run_operation(rig, step_index(step), lod, work, controls);
  } else {
    detail::run_solver(rig, step_index(step), work, controls);
  }
}

}  // namespace

namespace detail {

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
