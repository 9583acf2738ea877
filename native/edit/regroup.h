// SPDX-License-Identifier: MIT
// Joint groups made anew: dense blocks of the joints that the same controls drive.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/result.h"
#include "dna/dna.h"

namespace risorius::edit {

/// Effects of a coefficient while its control is 1. One that is below is small, 0 makes none small.
struct Threshold {
  double translation_mm = 0.0;
  double rotation_degrees = 0.0;
  double scale = 0.0;  // 0.01 is one per cent of a joint's size
};

struct RegroupOptions {
  /// Joints of each region. Joints that no region lists, and all where there are none, come
  /// together by what drives them.
  std::vector<std::vector<std::uint16_t>> regions;
  Threshold threshold;
  /// A column is foreign to a region where it moves no more than this share of its joints.
  double foreign_share = 0.25;
  std::uint32_t combinations = 200;  // random poses that are compared, beside the single ones
  std::uint64_t seed = 0;            // of the random poses
  std::uint32_t timed = 1000;        // evaluations that are timed, 0: none
};

struct GroupSizes {
  std::uint64_t groups = 0, rows = 0;
  std::uint64_t coefficients = 0;  // stored, zeros too
  std::uint64_t nonzero = 0;
};

/// The largest difference of one kind between two rigs, and where it was.
struct LargestChange {
  double value = 0.0;
  std::string joint;       // "" where nothing differs
  std::string expression;  // a raw control, or "combination 17"
  std::uint32_t lod = 0;
};

struct Changes {
  LargestChange translation_mm;    // of a joint against its parent
  LargestChange rotation_degrees;  // of a joint against its parent
  LargestChange scale;
  LargestChange position_mm;  // of a joint in the face, with what its ancestors do to it
  std::uint32_t expressions = 0, combinations = 0;
};

struct RegroupReport {
  GroupSizes before, after;
  std::vector<std::vector<std::uint16_t>> regions;  // joints of each, of those that groups move
  std::uint64_t removed = 0;                        // coefficients other than 0 that were taken out
  Changes changes;
  double microseconds_before = 0.0, microseconds_after = 0.0;  // of an evaluation, median
};

struct Regrouped {
  dna::Dna dna;
  RegroupReport report;
};

/// The same face with other joint groups, however they were stored: joints are put into regions,
/// each region's rows and the controls that move it make one dense group, rows that coarser LODs
/// use come first. Coefficients that are small in a column foreign to their region are taken out
/// and nothing else is: with a threshold of 0 the function stays as it was, to the order of sums
/// (on the scalar path, to the last bit). A row is used at the LODs where it was.
///
/// Joints that are turned by quaternions keep every coefficient and the order of their product.
/// Where several groups write a row, or LODs do not nest, or columns of quaternions have an
/// order that others cannot share, a region has several groups. A corrective that other things
/// read as well stays in use at each LOD where it was.
///
/// Fails: kInvalidArgument, kInvalidIndex (regions, options), kLimitExceeded (regions whose dense
///        groups do not fit the format), and as validate and compile.
/// Cost:  clustering grows with the square of the number of joints times the controls
core::Result<Regrouped> regroup(const dna::Dna& dna, const RegroupOptions& options = {});

}  // namespace risorius::edit
