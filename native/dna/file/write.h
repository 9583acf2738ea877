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
  /// These layers are unknown layers and layers of newer versions. A 2.1 file cannot store them.
  bool newer_layers = true;
};

/// Writes the bytes of a file. Versions after 2.1 have the layers in the order of the source's
/// index, then the other layers of the version, which are empty if `dna` lacks them. If a layer
/// that provides controls was not loaded or cannot be written, everything that its controls drive
/// is left out too, with a warning, so that the file is consistent. A file with all layers of its
/// version, loaded whole and without warnings, gets the same bytes in this version.
/// In/out: warnings  gets an entry for each layer and field that the version cannot hold, and one
///                   entry if other content is left out with the controls that drive it
/// Fails: kInvalidArgument (an unknown version; a network, pose or setup that needs a dropped
///        control), kLimitExceeded (more than the format's 4 GiB), and as validate
core::Result<std::vector<std::uint8_t>> write(const Dna& dna, const WriteOptions& options,
                                              std::vector<Warning>& warnings);

}  // namespace risorius::dna
