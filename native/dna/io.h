// SPDX-License-Identifier: MIT
// bytes -> Dna -> bytes, and the check of a Dna.
#pragma once

#include <cstdint>
#include <vector>

#include "core/result.h"
#include "core/source.h"
#include "dna/dna.h"

namespace risorius::dna {

/// What to read. The descriptor is always read; behavior and geometry need the definition.
struct ParseOptions {
  bool definition = true;
  bool behavior = true;
  bool geometry = true;
  bool blend_shapes = true;    // false: meshes without their blend shape targets
  bool extensions = true;      // the layers that are kept as bytes
  bool unknown_layers = true;  // layers of ids that this version does not know
};

/// Reads a DNA file of generation 2, any minor version (dna-format: container and layers 2.1
/// to 2.8; newer minors by the rules of 2.8). Fails: kNotDna, kUnsupportedGeneration, kTruncated,
/// kInvalidCount, kInvalidLength, kInvalidIndex, kInvalidValue, kIoRead, each with the byte offset
/// and the field. Cost: allocates at most a small constant times the bytes present.
core::Result<Dna> parse(core::Source& source, const ParseOptions& options = {});

/// Checks that lists that belong together have one length, that every index is in its space, that
/// the joint hierarchy has no cycle and LOD rows fit their matrix. Appends oddities that can be
/// read safely to warnings.
/// Fails: kInvalidLength, kInvalidIndex, kInvalidValue, with the field and no offset.
core::Status validate(const Dna& dna, std::vector<Warning>& warnings);

/// Serialises for file version 2.<minor>, 1 to 8. 2.1 holds descriptor, definition, behavior and
/// geometry only; what else there is is named in dropped. Later versions keep every layer there is,
/// in the order of the source's index, and get an empty one of each that they know and that is
/// missing. Rewriting a file for its own version gives its bytes.
/// Fails: kInvalidArgument (another version), kInvalidLength (a list beyond the format's limits).
core::Result<std::vector<std::uint8_t>> write(const Dna& dna, std::uint16_t minor,
                                              std::vector<std::string>& dropped);

}  // namespace risorius::dna
