// SPDX-License-Identifier: MIT
// Buffers of meshes as glTF's EXT_meshopt_compression packs them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.h"

namespace risorius::author {

/// Attributes of vertices, corners of triangles, or corners one by one.
enum class PackedMode { kAttributes, kTriangles, kIndices };

/// How the numbers of attributes were changed before they were packed: not at all, unit vectors
/// (rows of 4 int8 or int16), unit quaternions (rows of 4 int16), or floats as 2^E * M.
enum class PackedFilter { kNone, kOctahedral, kQuaternion, kExponential };

/// The extension's own words for a buffer view.
struct Packing {
  std::size_t count = 0;
  std::size_t stride = 0;  // bytes of a row: 4, 8 .. 256 for attributes, 2 or 4 for corners
  PackedMode mode = PackedMode::kAttributes;
  PackedFilter filter = PackedFilter::kNone;
};

/// count * stride bytes, whatever the packed bytes are: corners may be any number.
/// Fails: kInvalidArgument (a stride, a count or a filter that the mode does not have),
///        kLimitExceeded (a count that so few bytes cannot hold, before memory is taken for it),
///        kInvalidValue (bytes of another kind, or damaged ones)
core::Result<std::vector<std::uint8_t>> unpack(std::span<const std::uint8_t> packed,
                                               const Packing& packing);

/// Bytes that unpack, and every reader of the extension, gives back; triangles may come with their
/// corners turned. With a filter the rows are those of `filtered`.
/// In: rows  count * stride bytes
/// Fails: kInvalidArgument as unpack, kInvalidLength (rows), kInvalidValue (a corner of 2^30 or
/// more)
core::Result<std::vector<std::uint8_t>> pack(std::span<const std::uint8_t> rows,
                                             const Packing& packing);

/// Rows of packing.stride bytes that the filter of `unpack` turns into the values.
/// In: values  packing.count rows: 4 numbers for unit vectors and quaternions, stride / 4 for
/// floats
///     bits    of a component: 1 to 16 of vectors (8 where the stride is 4), 4 to 16 of
///     quaternions,
///             1 to 24 of floats
/// Fails: kInvalidArgument (a packing without filter, a stride or bits it does not have),
///        kInvalidLength (values), kInvalidValue (a value that is not finite)
core::Result<std::vector<std::uint8_t>> filtered(std::span<const float> values,
                                                 const Packing& packing, int bits);

}  // namespace risorius::author
