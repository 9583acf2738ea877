// SPDX-License-Identifier: MIT
// The full check of a block. Private to native/rig.
#pragma once

#include "core/result.h"
#include "rig/rig.h"

namespace risorius::rig::detail {

/// Whether scratch memory is at most 1 MiB plus 64 times the block. The counts of values and
/// regions need this check because no array backs them.
bool scratch_fits(const Rig& r);

/// Fails: kInvalidIndex (an index or size in the block that evaluation must not follow).
core::Status check_everything(const Rig& rig);

}  // namespace risorius::rig::detail
