// SPDX-License-Identifier: MIT
// The control space raw | corrective | network | RBF pose: how many of each, and what is left when
// some of the layers that provide them go.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "dna/dna.h"

namespace risorius::dna {

/// Sizes of the four parts of the control space, in its order. The poses of a 2.4 file, which has
/// no layer rbfe, are controls of their own.
struct ControlCounts {
  std::uint32_t raw = 0, psd = 0, ml = 0, rbf_pose = 0;
  std::uint32_t total() const { return raw + psd + ml + rbf_pose; }
};
ControlCounts control_counts(const Dna& dna);

/// Attributes per joint in the output indices of MlJoints: 9, or 10 with quaternions.
std::uint16_t ml_joint_stride(const MlJoints& joints);

namespace detail {

/// Takes a layer out; its controls are still counted, as unread.
/// In: id  of the layer, e.g. "mlbh"
void drop_layer(std::string_view id, Dna& dna);

/// Closes the gaps that unread controls leave, so that the value can be written as a file of its
/// own. What an unread control drives goes with it (it would stay 0): columns of joint groups,
/// entries of channels and maps, correctives with such a factor. Out: how many of these went.
/// Fails: kInvalidArgument (a network, a pose or a setup reads or writes an unread control).
core::Result<std::size_t> forget_unread_controls(Dna& dna);

/// The same for any controls: those that are not kept go, the others close the gaps. The caller
/// sets the counts of the parts that lose some. In: keep  [controls], raw ones are all kept Fails:
/// kInvalidArgument (a network, a pose or a setup reads or writes one that goes)
core::Result<std::size_t> forget_controls(const std::vector<bool>& keep, Dna& dna);

}  // namespace detail
}  // namespace risorius::dna
