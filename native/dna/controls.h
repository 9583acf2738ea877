// SPDX-License-Identifier: MIT
// The control space raw | corrective | network | RBF pose, when some of its layers go. Private to
// native/dna.
#pragma once

#include <cstddef>
#include <string>

#include "core/result.h"
#include "dna/dna.h"

namespace risorius::dna::detail {

/// Takes the layer of this id ("mlbh" ...) out, its controls still counted as unread.
void drop_layer(std::string_view id, Dna& dna);

/// Closes the gaps that unread controls leave, so that the value can be written as a file of its
/// own. What an unread control drives goes with it (it would stay 0): columns of joint groups,
/// entries of channels and maps, correctives with such a factor. Out: how many of these went.
/// Fails: kInvalidArgument (a network, a pose or a setup reads or writes an unread control).
core::Result<std::size_t> forget_unread_controls(Dna& dna);

}  // namespace risorius::dna::detail
