// SPDX-License-Identifier: MIT
// A Rig as one block of bytes: how it is made, opened and checked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "core/result.h"
#include "rig/rig.h"

namespace risorius::rig {

enum class BlockCheck {
  kHeader,  // version, sizes and places of the arrays: for bytes that this process wrote
  kHash,    // and the hash, which finds every changed bit: for bytes that this program once wrote
  kFull,    // and every index against its space: for bytes from anywhere, forged ones as well
};

/// The joint_values of a Rig where data has none: they are written straight into the block, for a
/// copy of them would take longer than all the rest.
struct LateValues {
  std::size_t count = 0;
  std::function<void(std::span<float>)> write;  // overwrites all of them
};

/// Copies the arrays into one block and opens it.
/// In:    data     as compile() makes it: it is not checked
///        kernels  that the rig is evaluated with; they must outlive it
/// Fails: kLimitExceeded (an array of more elements than an index reaches)
core::Result<Rig> make_rig(const RigData& data, const simd::Kernels& kernels,
                           const LateValues& late = {});

/// A Rig from the bytes of Rig::block(). Copies nothing: they stay where owner keeps them.
/// In:    bytes    aligned to 64
///        check    how far the bytes are trusted
///        kernels  as make_rig has them
/// Fails: kInvalidValue, kInvalidIndex (bytes that are no Rig of this version and machine),
///        kInvalidArgument (alignment)
core::Result<Rig> open_rig(std::span<const std::uint8_t> bytes, std::shared_ptr<const void> owner,
                           BlockCheck check, const simd::Kernels& kernels);

/// Blocks of other versions are refused.
std::uint32_t block_version();

/// Puts the hash of a block's bytes into its header. In: at least a header's size.
void seal_block(std::span<std::uint8_t> bytes);

}  // namespace risorius::rig
