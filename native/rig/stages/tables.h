// SPDX-License-Identifier: MIT
// GUI controls <-> raw controls.
#pragma once

#include "rig/rig.h"

namespace risorius::rig {

/// Raw controls from GUI controls by the conditional table. Results are clamped to [0, 1]; an input
/// outside the ranges of all rows adds nothing.
/// In: gui float32[G]. Out: raw float32[R].
void gui_to_raw(const Rig& rig, const float* gui, float* raw) noexcept;

/// GUI controls from raw controls, if the table can be inverted. Of the ranges (rows of equal
/// bounds) of each GUI control, the one wins that most raw controls other than 0 can be inverted
/// into; its first such row gives the value. Other GUI controls are 0.
/// In: raw float32[R]. Out: gui float32[G].
void raw_to_gui(const Rig& rig, const float* raw, float* gui) noexcept;

}  // namespace risorius::rig
