// SPDX-License-Identifier: MIT
// How large a Dna is: what the stages behind the parser are held against.
#pragma once

#include <cstdint>

#include "dna/dna.h"

namespace risorius::dna {

/// Bytes of its numbers and texts, with the counts of its lists, as a file has them; without the
/// container around the layers. Cost: one look at each list.
std::uint64_t size_in_bytes(const Dna& dna);

}  // namespace risorius::dna
