// SPDX-License-Identifier: MIT
// The check of a Dna: lists of one length, indices inside their space.
#pragma once

#include <vector>

#include "core/result.h"
#include "dna/dna.h"

namespace risorius::dna {

/// One thing that is wrong (an error: the file is refused) or odd (a warning).
struct Finding {
  bool is_error = false;
  core::Error error;  // code of a warning: kInvalidValue
};

/// Checks that lists that belong together have one length, that every index is in its space, that
/// the joint hierarchy has no cycle and LOD rows fit their matrix. Appends oddities that can be
/// read safely to warnings.
/// Fails: kInvalidLength, kInvalidIndex, kInvalidValue, with the field and no offset.
core::Status validate(const Dna& dna, std::vector<Warning>& warnings);
/// The same of everything but the geometry: what evaluation reads.
core::Status validate_behavior(const Dna& dna, std::vector<Warning>& warnings);

namespace detail {

/// What was seen while the numbers were read and need not be looked for again.
struct Known {
  bool finite = false;          // every element of every Array<float>
  bool vertex_indices = false;  // those of blend shape targets are below their mesh's vertex count
};

/// validate, but every error and not only the first.
std::vector<Finding> find_all(const Dna& dna, Known known = {});

/// The validate() above, without looking again for what is known.
core::Status validate(const Dna& dna, Known known, std::vector<Warning>& warnings);

}  // namespace detail
}  // namespace risorius::dna
