// SPDX-License-Identifier: MIT
// Buffers of meshes as glTF's EXT_meshopt_compression packs them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/result.h"

namespace risorius::author {

/// The content of a buffer: attributes of vertices, corners of triangles, or single corners.
enum class PackedMode { kAttributes, kTriangles, kIndices };

/// How attributes were changed before packing: not at all, unit vectors (rows of 4 int8 or int16),
/// unit quaternions (rows of 4 int16), or floats as 2^E * M.
enum class PackedFilter { kNone, kOctahedral, kQuaternion, kExponential };

/// The fields that EXT_meshopt_compression adds to a buffer view.
struct Packing {
  std::size_t count = 0;
  std::size_t stride = 0;  // bytes of a row: 4, 8 .. 256 for attributes, 2 or 4 for corners
  PackedMode mode = PackedMode::kAttributes;
  PackedFilter filter = PackedFilter::kNone;
};

/// Unpacks count * stride bytes. An unpacked corner may be any number: the caller must check that
/// its vertex exists.
/// Fails: kInvalidArgument (a stride, count or filter that the mode does not have),
///        kLimitExceeded (a count that the packed bytes cannot hold; found before memory is taken),
///        kInvalidValue (bytes of another mode, or damaged bytes)
core::Result<std::vector<std::uint8_t>> unpack(std::span<const std::uint8_t> packed,
                                               const Packing& packing);

/// Packs rows so that `unpack` and every reader of the extension return the same rows, except that
/// a triangle may begin with another of its corners. If the packing has a filter, the rows must
/// come from `filtered`.
/// In: rows  count * stride bytes
/// Fails: kInvalidArgument as unpack, kInvalidLength (rows), kInvalidValue (a corner of 2^30 or
///        more)
core::Result<std::vector<std::uint8_t>> pack(std::span<const std::uint8_t> rows,
                                             const Packing& packing);

/// Rows of packing.stride bytes from which `unpack` with the filter restores the values.
/// In: values  packing.count rows of 4 numbers for unit vectors and quaternions, or of stride / 4
///             numbers for floats
///     bits    precision of a component: 1 to 16 for vectors (at most 8 if the stride is 4), 4 to
///             16 for quaternions, 1 to 24 for floats
/// Fails: kInvalidArgument (a packing without filter; a stride or bits that the filter rejects),
///        kInvalidLength (values), kInvalidValue (a value that is not finite)
core::Result<std::vector<std::uint8_t>> filtered(std::span<const float> values,
                                                 const Packing& packing, int bits);

}  // namespace risorius::author
