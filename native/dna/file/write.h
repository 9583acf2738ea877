// SPDX-License-Identifier: MIT
// Dna -> bytes.
#pragma once

#include <cstdint>
#include <vector>

#include "core/result.h"
#include "dna/dna.h"

namespace risorius::dna {

struct WriteOptions {
  std::uint16_t minor = 8;  // file version 2.<minor>, 1 to 8
  /// Layers that the version does not know (unknown ones and newer ones) are written all the same,
  /// for readers that look for them; false leaves them out. 2.1 has no place for them.
  bool newer_layers = true;
};

/// Serialises. Later versions than 2.1 get an empty layer of each kind that they know and that is
/// missing, in the order of the source's index. Appends to warnings what the version cannot hold,
/// by layer. What the controls of a layer drive that is left out or was not loaded goes with them,
/// with a warning, so that the file is whole in itself. Rewriting a file for its own version gives
/// its bytes.
/// Fails: kInvalidArgument (another version; a network, pose or setup that needs such a control),
/// kLimitExceeded (more than the format's 4 GiB), and as validate.
core::Result<std::vector<std::uint8_t>> write(const Dna& dna, const WriteOptions& options,
                                              std::vector<Warning>& warnings);

}  // namespace risorius::dna
