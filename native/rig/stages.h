// SPDX-License-Identifier: MIT
// The stages after the raw controls are in place. Private to native/rig.
#pragma once

#include "rig/rig.h"

namespace risorius::rig::detail {

std::uint32_t clamp_lod(const Rig& rig, std::uint32_t lod) noexcept;
/// Correctives that read the values which stand in controls now.
void correctives_of_last_values(const Rig& rig, std::uint32_t lod, Workspace& work,
                                float* controls) noexcept;
void outputs(const Rig& rig, std::uint32_t lod, Workspace& work, Pose& pose) noexcept;

}  // namespace risorius::rig::detail
