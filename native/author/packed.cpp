// SPDX-License-Identifier: MIT
// Packs and unpacks the buffers of glTF's EXT_meshopt_compression with meshoptimizer.
#include "author/packed.h"

#include <meshoptimizer/meshoptimizer.h>

#include <algorithm>
#include <string>

#include "core/finite.h"

namespace risorius::author {

namespace {

using core::ErrorCode;

constexpr std::size_t kLargestStride = 256;
constexpr std::uint32_t kMostVertices = 1u << 30;  // differences between two corners have 30 bits
constexpr std::size_t kMostCount = std::size_t{1} << 31;
// The largest number of bytes that one packed byte can unpack to. Rows: one byte can stand for 4
// bytes in each of the 256 rows of a block. Triangles: one byte can stand for the three corners of
// a triangle, 4 bytes each.
constexpr std::size_t kMostRowBytesPerByte = 1024;
constexpr std::size_t kMostTriangleBytesPerByte = 12;

core::Status check_stride(const Packing& packing) {
  const std::size_t stride = packing.stride;
  if (packing.mode != PackedMode::kAttributes) {
    if (stride == 2 || stride == 4) return core::ok();
    return core::fail(ErrorCode::kInvalidArgument, "",
                      "a byteStride of 2 or 4 was expected, found " + std::to_string(stride));
  }
  if (stride == 0 || stride % 4 != 0 || stride > kLargestStride) {
    return core::fail(ErrorCode::kInvalidArgument, "",
                      "a byteStride of 4, 8, .. 256 was expected, found " + std::to_string(stride));
  }
  const bool vectors = packing.filter == PackedFilter::kOctahedral;
  const bool quaternions = packing.filter == PackedFilter::kQuaternion;
  if ((vectors && stride != 4 && stride != 8) || (quaternions && stride != 8)) {
    return core::fail(ErrorCode::kInvalidArgument, "",
                      std::string("a byteStride of ") + (vectors ? "4 or 8" : "8") +
                          " was expected for the filter, found " + std::to_string(stride));
  }
  return core::ok();
}

core::Status check(const Packing& packing) {
  RISORIUS_TRY(check_stride(packing));
  if (packing.mode != PackedMode::kAttributes && packing.filter != PackedFilter::kNone) {
    return core::fail(ErrorCode::kInvalidArgument, "", "a filter was expected of attributes alone");
  }
  if (packing.mode == PackedMode::kTriangles && packing.count % 3 != 0) {
    return core::fail(
        ErrorCode::kInvalidArgument, "",
        "three corners a triangle were expected, found " + std::to_string(packing.count));
  }
  if (packing.count > kMostCount) {
    return core::fail(ErrorCode::kInvalidArgument, "",
                      "a count of " + std::to_string(kMostCount) + " at most was expected, found " +
                          std::to_string(packing.count));
  }
  return core::ok();
}

int decode(std::uint8_t* to, std::span<const std::uint8_t> packed, const Packing& packing) {
  switch (packing.mode) {
    case PackedMode::kAttributes:
      return meshopt_decodeVertexBuffer(to, packing.count, packing.stride, packed.data(),
                                        packed.size());
    case PackedMode::kTriangles:
      return meshopt_decodeIndexBuffer(to, packing.count, packing.stride, packed.data(),
                                       packed.size());
    case PackedMode::kIndices:
      return meshopt_decodeIndexSequence(to, packing.count, packing.stride, packed.data(),
                                         packed.size());
  }
  return -1;
}

void take_filter_off(std::uint8_t* rows, const Packing& packing) {
  switch (packing.filter) {
    case PackedFilter::kNone:
      break;
    case PackedFilter::kOctahedral:
      meshopt_decodeFilterOct(rows, packing.count, packing.stride);
      break;
    case PackedFilter::kQuaternion:
      meshopt_decodeFilterQuat(rows, packing.count, packing.stride);
      break;
    case PackedFilter::kExponential:
      meshopt_decodeFilterExp(rows, packing.count, packing.stride);
      break;
  }
}

/// Converts corners to uint32, which meshoptimizer expects.
/// In: rows    little-endian corners
///     stride  bytes of a corner, 2 or 4
std::vector<std::uint32_t> corners_of(std::span<const std::uint8_t> rows, std::size_t stride) {
  std::vector<std::uint32_t> out(rows.size() / stride);
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (std::size_t byte = stride; byte-- > 0;) out[i] = out[i] << 8 | rows[stride * i + byte];
  }
  return out;
}

}  // namespace

core::Result<std::vector<std::uint8_t>> unpack(std::span<const std::uint8_t> packed,
                                               const Packing& packing) {
  RISORIUS_TRY(check(packing));
  const std::size_t size = packing.count * packing.stride;
  const std::size_t most =
      packing.mode == PackedMode::kAttributes ? kMostRowBytesPerByte : kMostTriangleBytesPerByte;
  if (size / most > packed.size()) {
    return core::fail(ErrorCode::kLimitExceeded, "",
                      std::to_string(packed.size()) + " packed bytes cannot hold " +
                          std::to_string(packing.count) + " rows");
  }
  std::vector<std::uint8_t> out(size);
  if (packing.count == 0) return out;
  if (decode(out.data(), packed, packing) != 0) {
    return core::fail(ErrorCode::kInvalidValue, "",
                      std::to_string(packing.count) + " packed rows of " +
                          std::to_string(packing.stride) + " bytes were expected, the " +
                          std::to_string(packed.size()) + " bytes are others or damaged");
  }
  take_filter_off(out.data(), packing);
  return out;
}

core::Result<std::vector<std::uint8_t>> pack(std::span<const std::uint8_t> rows,
                                             const Packing& packing) {
  RISORIUS_TRY(check(packing));
  if (rows.size() != packing.count * packing.stride) {
    return core::fail(ErrorCode::kInvalidLength, "",
                      std::to_string(packing.count * packing.stride) +
                          " bytes were expected, found " + std::to_string(rows.size()));
  }
  std::vector<std::uint8_t> out;
  if (packing.count == 0) return out;
  if (packing.mode == PackedMode::kAttributes) {
    out.resize(meshopt_encodeVertexBufferBound(packing.count, packing.stride));
    out.resize(meshopt_encodeVertexBuffer(out.data(), out.size(), rows.data(), packing.count,
                                          packing.stride));
    return out;
  }
  const std::vector<std::uint32_t> corners = corners_of(rows, packing.stride);
  const std::uint32_t most = *std::max_element(corners.begin(), corners.end());
  if (most >= kMostVertices) {
    return core::fail(ErrorCode::kInvalidValue, "",
                      "corners below " + std::to_string(kMostVertices) + " were expected, found " +
                          std::to_string(most));
  }
  const std::size_t vertices = std::size_t{1} + most;
  const bool triangles = packing.mode == PackedMode::kTriangles;
  out.resize(triangles ? meshopt_encodeIndexBufferBound(corners.size(), vertices)
                       : meshopt_encodeIndexSequenceBound(corners.size(), vertices));
  out.resize(
      triangles
          ? meshopt_encodeIndexBuffer(out.data(), out.size(), corners.data(), corners.size())
          : meshopt_encodeIndexSequence(out.data(), out.size(), corners.data(), corners.size()));
  return out;
}

core::Result<std::vector<std::uint8_t>> filtered(std::span<const float> values,
                                                 const Packing& packing, int bits) {
  RISORIUS_TRY(check(packing));
  const bool floats = packing.filter == PackedFilter::kExponential;
  const bool vectors = packing.filter == PackedFilter::kOctahedral;
  const int least = packing.filter == PackedFilter::kQuaternion ? 4 : 1;
  const int most = floats ? 24 : vectors && packing.stride == 4 ? 8 : 16;
  if (packing.filter == PackedFilter::kNone || bits < least || bits > most) {
    return core::fail(ErrorCode::kInvalidArgument, "bits",
                      "a filter and " + std::to_string(least) + " to " + std::to_string(most) +
                          " bits were expected, found " + std::to_string(bits));
  }
  const std::size_t width = floats ? packing.stride / 4 : 4;
  if (values.size() != packing.count * width) {
    return core::fail(ErrorCode::kInvalidLength, "values",
                      std::to_string(packing.count * width) + " numbers were expected, found " +
                          std::to_string(values.size()));
  }
  if (!std::all_of(values.begin(), values.end(), [](float x) { return core::is_finite(x); })) {
    return core::fail(ErrorCode::kInvalidValue, "values", "finite numbers were expected");
  }
  std::vector<std::uint8_t> out(packing.count * packing.stride);
  if (packing.count == 0) return out;
  if (floats) {
    meshopt_encodeFilterExp(out.data(), packing.count, packing.stride, bits, values.data(),
                            meshopt_EncodeExpSharedVector);
  } else if (vectors) {
    meshopt_encodeFilterOct(out.data(), packing.count, packing.stride, bits, values.data());
  } else {
    meshopt_encodeFilterQuat(out.data(), packing.count, packing.stride, bits, values.data());
  }
  return out;
}

}  // namespace risorius::author
