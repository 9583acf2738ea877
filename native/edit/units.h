// SPDX-License-Identifier: MIT
// The rows of all joint groups as single units. Private to native/edit.
#pragma once

#include <cstdint>
#include <vector>

#include "dna/dna.h"
#include "edit/regroup.h"

namespace risorius::edit::detail {

/// A row of a joint group in the source file. The group's LODs decide which LODs use the row.
struct Row {
  std::uint16_t output = 0;  // joint * 9 + attribute
  std::uint32_t group = 0, row = 0;
  std::uint32_t levels = 0;  // number of LODs that use it, at least 1
};

/// The order in which the rotations of a unit's columns are multiplied: any, ascending controls, or
/// the order of source group number `order - kOfGroup`.
constexpr std::uint32_t kAnyOrder = 0, kAscending = 1, kOfGroup = 2;

/// Rows that must be in the same group: a single row, or the rotation rows of one quaternion joint.
struct Unit {
  std::uint32_t joint = 0;
  // Whether the joint is a quaternion joint. None of its coefficients counts as small.
  bool is_quaternion = false;
  std::uint32_t layer = 0;  // number of later units that write the same rows
  std::uint32_t chain = 0;  // units of one chain have LODs that nest in each other
  std::uint32_t order = kAnyOrder;
  // Units of one bundle form a group without other units; 0: no bundle. If rotation rows of a
  // quaternion joint begin at different LODs, the order of its columns depends on the other
  // quaternion joints of the source group, so that all of them must be in one bundle.
  std::uint32_t bundle = 0;
  std::vector<Row> rows;
  std::vector<std::uint16_t> columns;  // controls; of a linear unit: ascending, each once
  // [columns] if order >= kOfGroup: the column's place in the order of the source group; else
  // unused.
  std::vector<std::uint32_t> source;
  std::vector<float> values;  // [rows, columns]

  bool is_zero() const { return columns.empty(); }
};

/// A unit for every row or joint rotation that some LOD uses, sorted by joint and then by place in
/// the file. Columns of zeros are dropped, and columns of the same control are added (except for
/// quaternions).
/// In: a Dna that compile accepts
std::vector<Unit> list_units(const dna::Dna& dna);

/// Numbers the units that write the same row: the last one gets layer 0, the one before it layer 1,
/// and so on. Higher layers are written first. Units that others overwrite at every LOD are
/// removed, unless they keep a corrective in use.
void find_layers(const dna::Dna& dna, std::vector<Unit>& units);

/// Computes the effect of a coefficient while its control is 1, as a share of the threshold. A
/// coefficient with an effect below 1 is small.
class Effects {
 public:
  Effects(const dna::Dna& dna, const Threshold& threshold);
  /// In: output  joint * 9 + attribute. Out: the effect as a share of the threshold.
  double of(std::uint16_t output, float value) const;
  bool nothing_is_small() const { return nothing_is_small_; }

 private:
  double per_unit_[3];  // translation, rotation, scale
  bool nothing_is_small_;
};

/// [controls] true for correctives that other correctives, networks, solvers, their poses, or twist
/// and swing setups read. If no LOD used such a corrective, evaluation would leave it at 0, and its
/// readers would change.
std::vector<bool> watched_correctives(const dna::Dna& dna);

/// The value in Regions::of_joint for a joint that no unit moves; other values are region numbers.
constexpr std::uint32_t kNoRegion = UINT32_MAX;
struct Regions {
  std::vector<std::uint32_t> of_joint;
  std::uint32_t count = 0;
};

/// Divides the joints into regions. In: significant_only  ignore small coefficients when joints are
/// compared
Regions find_regions(const dna::Dna& dna, const std::vector<Unit>& units, const Effects& effects,
                     const RegroupOptions& options, bool significant_only);

/// Removes small coefficients from columns foreign to their region. Out: number of removed
/// coefficients
std::uint64_t remove_outliers(const dna::Dna& dna, const Regions& regions, const Effects& effects,
                              double foreign_share, std::vector<Unit>& units);

/// Removes rows that are all 0 from joints that have another row, unless the joint is a quaternion
/// joint or several of its units write one row. Call it after find_layers.
void remove_zero_rows(std::vector<Unit>& units);

/// Builds the dense joint groups of all regions from the units. Fails: kLimitExceeded (a group that
/// does not fit the format)
core::Result<std::vector<dna::JointGroup>> build_groups(const dna::Dna& dna,
                                                        const std::vector<Unit>& units,
                                                        const Regions& regions);

/// Measures the differences between the poses of two faces that differ only in their joint groups,
/// and their evaluation times.
core::Status compare(const dna::Dna& before, const dna::Dna& after, const RegroupOptions& options,
                     RegroupReport& report);

}  // namespace risorius::edit::detail
