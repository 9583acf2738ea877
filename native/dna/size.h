// SPDX-License-Identifier: MIT
// The size of a Dna, from which the limits of memory and work for its compilation are computed.
#pragma once

#include <cstdint>

#include "dna/dna.h"

namespace risorius::dna {

/// The size that the layers have in a file: the bytes of their numbers and texts and of the counts
/// of their lists. Headers and the index do not count. Cost: visits each list once
std::uint64_t size_in_bytes(const Dna& dna);

}  // namespace risorius::dna
