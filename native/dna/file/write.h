// SPDX-License-Identifier: MIT
// Writes a DNA file.
#pragma once

#include <cstdint>
#include <vector>

#include "core/result.h"
#include "dna/dna.h"

namespace risorius::dna {

struct WriteOptions {
  std::uint16_t minor = 8;  // file version 2.<minor>, 1 to 8
  /// Whether layers that the version does not know are written too, for readers that look for them.
  /// They are unknown layers and layers of newer versions. 2.1 has no place for them.
  bool newer_layers = true;
};

/// Writes the bytes of a file. Versions after 2.1 get an empty layer for each known layer that is
/// missing, in the order of the source's index. If a layer that provides controls was not loaded or
/// cannot be written, everything that its controls drive is left out too, with a warning, so that
/// the file is consistent. Rewriting a file in its own version gives the same bytes.
/// In/out: warnings  gets an entry for each layer that the version cannot hold
/// Fails: kInvalidArgument (an unknown version; a network, pose or setup that needs a dropped
///        control), kLimitExceeded (more than the format's 4 GiB), and as validate
core::Result<std::vector<std::uint8_t>> write(const Dna& dna, const WriteOptions& options,
                                              std::vector<Warning>& warnings);

}  // namespace risorius::dna
