// SPDX-License-Identifier: MIT
// Converts a Dna to another coordinate system or other units.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/result.h"
#include "dna/dna.h"

namespace risorius::dna {

/// The target system. A field that is nullopt keeps the file's value.
struct CoordinateTarget {
  std::optional<CoordinateSystem> axes;
  std::optional<std::uint32_t> rotation_sequence;             // 0 xyz 1 xzy 2 yxz 3 yzx 4 zxy 5 zyx
  std::optional<std::array<std::int32_t, 3>> rotation_signs;  // 1 or -1
  std::optional<std::uint8_t> face_winding_order;             // 0 ccw 1 cw
  std::optional<std::uint16_t> translation_unit;              // 0 cm 1 m
  std::optional<std::uint16_t> rotation_unit;                 // 0 degrees 1 radians
};

/// The same character in the target's axes, rotation order, signs, winding and units. Numbers are
/// computed in double and rounded once. Numbers that change only place and sign are exact, and a
/// target equal to the source changes no bit.
///
/// If the order of the rotation axes is the same in both systems, each angle and each row of a
/// joint group has one counterpart, and every pose of the result is the converted pose. Otherwise a
/// rotation becomes angles of which the middle one is within 90 degrees (in gimbal lock the last
/// one is 0), and the rotation rows of a joint are converted together, column by column, as the
/// reference evaluator does; rows that no LOD uses are dropped. Scale deltas keep their sign.
///
/// Raw controls that carry a rotation (inputs of RBF solvers, twists and swings) refer to the new
/// axes afterwards. The numbers of networks that move joints are not converted; their layer names
/// the old axes.
/// In/out: warnings  gets entries for content that was not or only approximately converted, most
///                   with the number of joints or the first control concerned
/// Fails: kInvalidArgument (an invalid target), kInvalidValue (the file's own system is invalid, or
///        a joint group would not fit the format), and as validate
core::Result<Dna> convert_coordinates(const Dna& dna, const CoordinateTarget& target,
                                      std::vector<Warning>& warnings);

}  // namespace risorius::dna
