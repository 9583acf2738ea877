// SPDX-License-Identifier: MIT
// The control space raw | corrective | network | RBF pose: the sizes of its parts, and their
// renumbering when layers that provide controls are dropped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "dna/dna.h"

namespace risorius::dna {

/// Sizes of the four parts of the control space, in its order. In a 2.4 file, which has no layer
/// rbfe, each RBF pose is a control of its own.
struct ControlCounts {
  std::uint32_t raw = 0, psd = 0, ml = 0, rbf_pose = 0;
  std::uint32_t total() const { return raw + psd + ml + rbf_pose; }
};
ControlCounts control_counts(const Dna& dna);

/// Attributes per joint in the output indices of MlJoints: 9, or 10 with quaternions.
std::uint16_t ml_joint_stride(const MlJoints& joints);

namespace detail {

/// Removes a layer. The controls that it provides still have their numbers, and are counted as
/// unread.
/// In: id  of the layer, e.g. "mlbh"
void drop_layer(std::string_view id, Dna& dna);

/// Removes the unread controls from the control space and renumbers the others, so that the Dna can
/// be written as a complete file. Everything that an unread control drives is removed, because the
/// control would remain 0: columns of joint groups, and entries of channels and maps. A corrective
/// with an unread control as a factor loses all its factors; it keeps its own control, which
/// remains 0.
/// Out:   number of removed columns and entries, and of correctives that lost their factors
/// Fails: kInvalidArgument (a network, a pose or a setup reads or writes an unread control)
core::Result<std::size_t> forget_unread_controls(Dna& dna);

/// Removes any controls other than raw controls, with everything that they drive, in the same way
/// as forget_unread_controls. The caller must then correct the fields from which the sizes of the
/// control space are computed, such as psd_count.
/// In: keep  [controls] whether each control remains; must be true for each raw control
/// Out: number of removed columns and entries, and of correctives that lost their factors because a
///      factor was removed
/// Fails: kInvalidArgument (a network, a pose or a setup reads or writes a removed control)
core::Result<std::size_t> forget_controls(const std::vector<bool>& keep, Dna& dna);

}  // namespace detail
}  // namespace risorius::dna
