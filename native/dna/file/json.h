// SPDX-License-Identifier: MIT
// Dna as text. The field names and their order are the format's own (dna-format: layers), one
// member per layer named id and version: "desc1.1", "defn1.1" ...
//
// Lossless: floats are the shortest decimal that gives the same bits; -0 is -0.0; what JSON cannot
// say as a number is a text: "Infinity", "-Infinity", "NaN:7fc00000" (its bits). A text that is not
// UTF-8 is {"hex": "..."}. Layers that are not known are hex bytes at their place in the index.
#pragma once

#include <string>
#include <string_view>

#include "core/result.h"
#include "dna/dna.h"
#include "dna/file/parse.h"

namespace risorius::dna {

/// Fails: as validate.
core::Result<std::string> to_json(const Dna& dna);

/// The members of an object may come in any order, each once; "signature", "size" and "offset" are
/// passed over, any other member that is not known is an error. Allocates at most some 64 times the
/// text. Fails: kNotDna (not JSON, with the byte), kInvalidValue (a member that is missing, there
/// twice, of another type or out of range, with its path), kLimitExceeded, and as validate.
core::Result<Dna> from_json(std::string_view text, const Limits& limits = {});

}  // namespace risorius::dna
