// SPDX-License-Identifier: MIT
// Parses a DNA file.
#pragma once

#include <cstdint>
#include <vector>

#include "bytes/source.h"
#include "core/result.h"
#include "dna/convert/lods.h"
#include "dna/dna.h"
#include "dna/validate.h"

namespace risorius::dna {

/// Upper limits for a file that is read. In addition, a count is refused if its elements need more
/// bytes than the file has after the count.
struct Limits {
  std::uint64_t max_bytes = std::uint64_t{4} << 30;  // of the whole file; the format's own limit
  std::uint32_t max_layers = 4096;                   // entries of the index
  std::uint32_t max_count = std::uint32_t{1} << 28;  // elements of one list
  std::uint32_t max_nesting = 32;                    // levels of JSON
};

/// The parts of the file to read; other parts are skipped. The layers desc and dsce are always
/// read. Without the definition, parse fails if a layer that is read has indices of joints,
/// controls, channels or LOD lists, because the definition has the counts that limit the indices.
struct ParseOptions {
  bool definition = true;
  bool behavior = true;
  bool geometry = true;
  bool blend_shapes = true;  // false: meshes without their blend shape targets
  bool machine_learned_behavior = true;
  bool rbf_behavior = true;
  bool joint_behavior_metadata = true;
  bool twist_swing_behavior = true;
  bool unknown_layers = true;             // layers with unknown ids or versions
  bool unreferenced_blend_shapes = true;  // false: drop channels that no LOD lists
  LodSelection lods;
  Limits limits;
};

/// Reads a DNA file of generation 2, any minor version (2.9 and later by the rules of 2.8).
/// Fails: kNotDna, kUnsupportedGeneration, kTruncated, kInvalidCount, kInvalidLength,
///        kInvalidIndex, kInvalidValue, kLimitExceeded, kIoRead, kInvalidArgument (LODs that do not
///        exist), each with the field. The byte offset is missing in kInvalidArgument, and in
///        errors of validate if LODs were selected, because indices then count only kept elements
/// Cost: allocates at most a small constant times the file's size
core::Result<Dna> parse(bytes::Source& source, const ParseOptions& options = {});

/// Errors and oddities of a file, in the order of the file, each with the field and, if known, the
/// byte offset (unknown ones are last). After a layer that cannot be read the other layers are read
/// nevertheless; but then errors of indices and of lengths of lists are left out, because they
/// might only follow from the missing layer.
std::vector<Finding> check(bytes::Source& source, const Limits& limits = {});

}  // namespace risorius::dna
