// SPDX-License-Identifier: MIT
// The full check of a block. Private to native/rig.
#pragma once

#include "core/result.h"
#include "rig/rig.h"

namespace risorius::rig::detail {

/// Whether the operation values (results of network operations) and the masks of a workspace take
/// at most 1 MiB plus 64 times the size of the rig, and there are no more operation values than the
/// operations write. The block only states the numbers of operation values and regions and has no
/// array of that size, so that a forged block could demand any amount.
bool scratch_fits(const Rig& r);

/// Checks all indices and sizes that evaluation follows. Fails: kInvalidIndex
core::Status check_everything(const Rig& rig);

}  // namespace risorius::rig::detail
