// SPDX-License-Identifier: MIT
// The full check of a block. Private to native/rig.
#pragma once

#include "core/result.h"
#include "rig/rig.h"

namespace risorius::rig::detail {

/// Scratch memory is at most 1 MiB and 64 times the block: counts of values and regions are numbers
/// that no array backs.
bool scratch_fits(const Rig& r);

/// Fails: kInvalidIndex (an index or a size in a block that evaluation cannot take).
core::Status check_everything(const Rig& rig);

}  // namespace risorius::rig::detail
