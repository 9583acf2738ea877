// SPDX-License-Identifier: MIT
// Dna as JSON text. The field names and their order are the format's own; each layer is one member
// named by id and version: "desc1.1", "defn1.1" ...
//
// Lossless: floats are the shortest decimal that gives the same bits, and -0 is -0.0. Numbers that
// JSON lacks are texts: "Infinity", "-Infinity", "NaN:7fc00000" (the bits of the float in hex). A
// text that is not UTF-8 is {"hex": "..."}. An unknown layer has its bytes in hex in its entry of
// the index.
#pragma once

#include <string>
#include <string_view>

#include "core/result.h"
#include "dna/dna.h"
#include "dna/file/parse.h"

namespace risorius::dna {

/// Fails: as validate.
core::Result<std::string> to_json(const Dna& dna);

/// Reads the output of to_json. Members of an object may come in any order, each once. "signature",
/// "size" and "offset" are ignored; any other unknown member is an error. Allocates at most about
/// 64 times the size of the text.
/// Fails: kNotDna (not JSON, with the byte offset), kInvalidValue (a member that is missing,
///        repeated, of another type or out of range, with its path), kUnsupportedGeneration (a
///        generation other than 2), kLimitExceeded, and as validate
core::Result<Dna> from_json(std::string_view text, const Limits& limits = {});

}  // namespace risorius::dna
