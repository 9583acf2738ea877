// SPDX-License-Identifier: MIT
// Rebuilds joint groups as dense blocks of joints that the same controls drive.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.h"
#include "dna/dna.h"

namespace risorius::edit {

/// The effects below which a coefficient is small, measured while its control is 1. 0: no
/// coefficient of this kind is small.
struct Threshold {
  double translation_mm = 0.0;
  double rotation_degrees = 0.0;
  double scale = 0.0;  // 0.01 is one per cent of a joint's size
};

struct RegroupOptions {
  /// Joints of each region. Joints that no region lists are grouped by the controls that drive
  /// them.
  std::vector<std::vector<std::uint16_t>> regions;
  Threshold threshold;
  /// A column of a region is foreign if its control moves at most this share of the region's
  /// joints.
  double foreign_share = 0.25;
  // Number of random poses that are compared, in addition to each control alone.
  std::uint32_t combinations = 200;
  std::uint64_t seed = 0;      // of the random poses
  std::uint32_t timed = 1000;  // evaluations that are timed; 0: none
};

struct GroupSizes {
  std::uint64_t groups = 0, rows = 0;
  std::uint64_t coefficients = 0;  // stored, zeros included
  std::uint64_t nonzero = 0;
};

/// The largest difference of one kind between two rigs, and the joint, expression and LOD at which
/// it occurs.
struct LargestChange {
  double value = 0.0;
  std::string joint;       // "" if nothing differs
  std::string expression;  // a raw control, or "combination 17"
  std::uint32_t lod = 0;
};

struct Changes {
  LargestChange translation_mm;    // of a joint relative to its parent
  LargestChange rotation_degrees;  // of a joint relative to its parent
  LargestChange scale;
  LargestChange position_mm;  // of a joint in the face, including the effects of its ancestors
  std::uint32_t expressions = 0, combinations = 0;
};

struct RegroupReport {
  GroupSizes before, after;
  std::vector<std::vector<std::uint16_t>> regions;  // joints of each region that joint groups move
  std::uint64_t removed = 0;                        // coefficients other than 0 that were removed
  Changes changes;
  double microseconds_before = 0.0, microseconds_after = 0.0;  // of an evaluation, median
};

struct Regrouped {
  dna::Dna dna;
  RegroupReport report;
};

/// Rebuilds the joint groups of a face. Joints are put into regions. The rows of a region and the
/// controls that move it make one dense group, in which rows that more LODs use come first. Small
/// coefficients in columns foreign to their region are removed. With a threshold of 0 the poses are
/// equal to the last bit on the scalar path; on other paths sums may have another order. Each row
/// is used at the same LODs as before.
///
/// Joints with quaternions keep every coefficient and the order in which their rotations are
/// multiplied. A region gets several groups if several source groups write the same attribute of a
/// joint, if a LOD uses rows that a finer LOD does not use, or if columns of quaternions need
/// different orders. A corrective that other parts of the rig read remains in use at each LOD where
/// it is used.
///
/// Fails: kInvalidArgument, kInvalidIndex (regions, options), kLimitExceeded (the dense groups of a
///        region do not fit the format), and as validate and compile.
/// Cost:  clustering grows with the square of the number of joints times the controls
core::Result<Regrouped> regroup(const dna::Dna& dna, const RegroupOptions& options = {});

}  // namespace risorius::edit
