// SPDX-License-Identifier: MIT
// The size of a Dna, from which the limits of later stages are computed.
#pragma once

#include <cstdint>

#include "dna/dna.h"

namespace risorius::dna {

/// Bytes of its numbers and texts, with the counts of its lists, as in a file; without the
/// container around the layers. Cost: visits each list once
std::uint64_t size_in_bytes(const Dna& dna);

}  // namespace risorius::dna
