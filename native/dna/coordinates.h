// SPDX-License-Identifier: MIT
// A Dna in another coordinate system or other units.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/result.h"
#include "dna/dna.h"

namespace risorius::dna {

/// What stays nullopt stays as it is in the file.
struct CoordinateTarget {
  std::optional<CoordinateSystem> axes;
  std::optional<std::uint32_t> rotation_sequence;            // 0 xyz 1 xzy 2 yxz 3 yzx 4 zxy 5 zyx
  std::optional<std::array<std::int32_t, 3>> rotation_sign;  // 1 or -1
  std::optional<std::uint8_t> face_winding_order;            // 0 ccw 1 cw
  std::optional<std::uint16_t> translation_unit;             // 0 cm 1 m
  std::optional<std::uint16_t> rotation_unit;                // 0 degrees 1 radians
};

/// The same character in the target's axes, rotation order, signs, winding and units: everything is
/// computed in double and rounded once. A target equal to the source changes no bit. Vectors and
/// quaternions only change places and signs, so they stay exact; so do rotations about one axis and
/// those whose order of axes stays the same. Other rotations become angles with the middle one
/// within 90 degrees; at its pole the last one is 0. Rotation deltas of a joint group are taken as
/// one rotation per joint and column, as the reference does; scale deltas keep their sign (design
/// ruling 5). A joint's rows come to lie together, rows and columns of zeros go, and a LOD that
/// used any row of a joint uses all of them.
/// Appends to warnings what the format cannot convert, by field.
/// Fails: kInvalidArgument (the target makes no sense), kInvalidValue (the file's own system makes
/// no sense), and as validate.
core::Result<Dna> convert_coordinates(const Dna& dna, const CoordinateTarget& target,
                                      std::vector<Warning>& warnings);

}  // namespace risorius::dna
