// SPDX-License-Identifier: MIT
// GUI controls <-> raw controls.
#pragma once

#include "rig/rig.h"

namespace risorius::rig {

/// Raw controls from GUI controls by the conditional table; results are clamped to [0, 1], inputs
/// outside every row's range give nothing.
/// In: gui float32[G]. Out: raw float32[R].
void gui_to_raw(const Rig& rig, const float* gui, float* raw) noexcept;

/// GUI controls from raw controls, where the table can be reversed: of each GUI control's ranges
/// (rows of equal bounds) the one that most raw controls other than 0 reverse into decides by its
/// first row that reverses into it; the others are 0.
/// In: raw float32[R]. Out: gui float32[G].
void raw_to_gui(const Rig& rig, const float* raw, float* gui) noexcept;

}  // namespace risorius::rig
