// SPDX-License-Identifier: MIT
// Checks a Dna: parallel lists have one length, indices are in range.
#pragma once

#include <vector>

#include "core/result.h"
#include "dna/dna.h"

namespace risorius::dna {

/// An error (the file is refused) or an oddity (a warning).
struct Finding {
  bool is_error = false;
  core::Error error;  // code of a warning: kInvalidValue
};

/// Checks that parallel lists have one length, that every index is in range, that the joint
/// hierarchy has no cycle, and that no LOD uses more rows than its matrix has.
/// In/out: warnings  gets the oddities that can be read safely
/// Fails: kInvalidLength, kInvalidIndex, kInvalidValue, with the field and no offset
core::Status validate(const Dna& dna, std::vector<Warning>& warnings);
/// Like validate, but without the geometry, which evaluation does not read.
core::Status validate_behavior(const Dna& dna, std::vector<Warning>& warnings);

namespace detail {

/// Facts that were checked while the numbers were read, so that they need no second check.
struct Known {
  bool finite = false;  // every element of every Array<float>
  // Vertex indices of blend shape targets are below their mesh's vertex count.
  bool vertex_indices = false;
};

/// Makes the checks of validate, and returns all errors and oddities. The first 1,000 are returned,
/// and the first error even if it comes later. For several equal faults in one list, only the first
/// is returned, with the number of the others in its message.
std::vector<Finding> find_all(const Dna& dna, Known known = {});

/// Makes the checks of dna::validate, except those that `known` makes unnecessary.
core::Status validate(const Dna& dna, Known known, std::vector<Warning>& warnings);

}  // namespace detail
}  // namespace risorius::dna
