// SPDX-License-Identifier: MIT
// Converts GUI controls (the sliders of the rig's control panel) to raw controls (the inputs of an
// evaluation) and back.
#pragma once

#include "rig/rig.h"

namespace risorius::rig {

/// Computes raw controls from GUI controls by the conditional table. Results are clamped to [0, 1];
/// an input outside the intervals of all rows adds nothing.
/// In: gui float32[GUI controls]. Out: raw float32[raw controls].
void gui_to_raw(const Rig& rig, const float* gui, float* raw) noexcept;

/// Computes GUI controls from raw controls by inverting the rows of the table. The rows of a GUI
/// control with equal bounds form a range. A row has an inverse if the input that gives the value
/// of its raw control is inside the bounds. For each GUI control the range with the most rows that
/// have an inverse and a raw control other than 0 wins; among equal ranges the first one wins. The
/// first row of this range with an inverse gives the value, even if its raw control is 0. If no
/// range has a row with an inverse and a raw control other than 0, the GUI control is 0.
/// In: raw float32[raw controls]. Out: gui float32[GUI controls].
void raw_to_gui(const Rig& rig, const float* raw, float* gui) noexcept;

}  // namespace risorius::rig
