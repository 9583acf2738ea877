// SPDX-License-Identifier: MIT
// bytes -> Dna -> bytes, and the check of a Dna.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "core/source.h"
#include "dna/dna.h"
#include "dna/lods.h"

namespace risorius::dna {

/// What a file may ask for at most. Beside these every count is held against the bytes left.
struct Limits {
  std::uint64_t max_bytes = std::uint64_t{4} << 30;  // of the whole file: the format's own limit
  std::uint32_t max_layers = 4096;                   // entries of the index
  std::uint32_t max_count = std::uint32_t{1} << 28;  // elements of any one list
  std::uint32_t max_nesting = 32;                    // levels of JSON
};

/// What to read; the rest of the file is not touched. The descriptor is always read; the other
/// layers need the definition, rbf_behavior the behavior as well.
struct ParseOptions {
  bool definition = true;
  bool behavior = true;
  bool geometry = true;
  bool blend_shapes = true;  // false: meshes without their blend shape targets
  bool machine_learned_behavior = true;
  bool rbf_behavior = true;
  bool joint_behavior_metadata = true;
  bool twist_swing_behavior = true;
  bool unknown_layers = true;             // layers of ids or versions that are not known
  bool unreferenced_blend_shapes = true;  // false: see remove_unreferenced_blend_shapes
  LodSelection lods;
  Limits limits;
};

/// Reads a DNA file of generation 2, any minor version (dna-format: container and layers 2.1
/// to 2.8; newer minors by the rules of 2.8). Fails: kNotDna, kUnsupportedGeneration, kTruncated,
/// kInvalidCount, kInvalidLength, kInvalidIndex, kInvalidValue, kLimitExceeded, kIoRead,
/// kInvalidArgument (LODs that are not there), each with the field and, except for the last, the
/// byte offset. Cost: allocates at most a small constant times the bytes present.
core::Result<Dna> parse(core::Source& source, const ParseOptions& options = {});

/// One thing that is wrong (an error: the file is refused) or odd (a warning).
struct Finding {
  bool is_error = false;
  core::Error error;  // code of a warning: kInvalidValue
};

/// Everything that is wrong or odd in a file, in its order, each with field and byte offset. A
/// layer that cannot be read does not hide the others.
std::vector<Finding> check(core::Source& source, const Limits& limits = {});

/// Checks that lists that belong together have one length, that every index is in its space, that
/// the joint hierarchy has no cycle and LOD rows fit their matrix. Appends oddities that can be
/// read safely to warnings.
/// Fails: kInvalidLength, kInvalidIndex, kInvalidValue, with the field and no offset.
core::Status validate(const Dna& dna, std::vector<Warning>& warnings);

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

namespace detail {

/// What was seen while the numbers were read and need not be looked for again.
struct Known {
  bool finite = false;          // every element of every Array<float>
  bool vertex_indices = false;  // those of blend shape targets are below their mesh's vertex count
};

/// validate, but every error and not only the first.
std::vector<Finding> find_all(const Dna& dna, Known known = {});

core::Status validate(const Dna& dna, Known known, std::vector<Warning>& warnings);

}  // namespace detail
}  // namespace risorius::dna
