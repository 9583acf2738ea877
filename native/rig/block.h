// SPDX-License-Identifier: MIT
// A Rig as one block of bytes: making, opening and checking it.
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
  kHeader,  // checks version, sizes and offsets of the arrays: for bytes that this process wrote
  kHash,    // also checks the hash, which finds every changed bit: for files of this program
  kFull,    // also checks every index: for bytes of unknown origin, even forged ones
};

/// The joint_values of a Rig, if they are not in its RigData. They are written straight into the
/// block, because copying them would take longer than all other work of make_rig().
struct LateValues {
  std::size_t count = 0;
  std::function<void(std::span<float>)> write;  // overwrites all of them
};

/// Copies the arrays into one block and opens it as a Rig.
/// In:    data     the result of compile(); it is not checked
///        kernels  used in every evaluation; they must outlive the rig
///        late     writes joint_values if `data` does not have them
/// Fails: kLimitExceeded (an array with more elements than an index can address, or networks that
///        need more scratch memory than detail::scratch_fits allows)
core::Result<Rig> make_rig(const RigData& data, const simd::Kernels& kernels,
                           const LateValues& late = {});

/// A Rig from the bytes of Rig::block(). Copies nothing: the bytes stay in the memory of `owner`.
/// In:    bytes    must begin on a multiple of 64 bytes
///        check    how much is checked
///        kernels  as in make_rig
/// Fails: kInvalidValue, kInvalidIndex (bytes that are no Rig of this version and machine),
///        kInvalidArgument (alignment)
core::Result<Rig> open_rig(std::span<const std::uint8_t> bytes, std::shared_ptr<const void> owner,
                           BlockCheck check, const simd::Kernels& kernels);

/// The version of a block's layout; open_rig rejects blocks of other versions.
std::uint32_t block_version();

/// Computes the hash of a block and writes it into the block's header. In: bytes  at least as long
/// as a header
void seal_block(std::span<std::uint8_t> bytes);

}  // namespace risorius::rig
