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
  // Position among the units that write the same output, counted from the last one, which has 0.
  // The units of a bundle all have the highest of their positions.
  std::uint32_t layer = 0;
  // Number of the unit's chain: units whose rows skip the same LODs. 0 if every row is used from
  // LOD 0 up to some LOD, or if the unit is in a bundle. Units of different chains never share a
  // group, because a group stores one row count for each LOD and cannot skip a single row.
  std::uint32_t chain = 0;
  std::uint32_t order = kAnyOrder;
  // Units of one bundle form a group without other units; 0: no bundle. If the rotation rows of a
  // quaternion joint are used by different numbers of LODs, the order of its columns depends on the
  // other quaternion joints of the source group, so that all of them must be in one bundle.
  std::uint32_t bundle = 0;
  std::vector<Row> rows;
  std::vector<std::uint16_t> columns;  // controls; of a linear unit: ascending, each once
  // [columns] if order >= kOfGroup: position of the column in the source group's order of
  // multiplication; else unused.
  std::vector<std::uint32_t> source;
  std::vector<float> values;  // [rows, columns]

  bool is_zero() const { return columns.empty(); }
};

/// A unit for every row or joint rotation that some LOD uses, sorted by joint and then by place in
/// the file. Columns of zeros are dropped, and columns of the same control are added (except for
/// quaternions).
/// In: dna  a face that compile::compile accepts
std::vector<Unit> list_units(const dna::Dna& dna);

/// Numbers the units that write the same output: the last one gets layer 0, the one before it layer
/// 1, and so on; the units of a bundle all get the highest of their layers. Higher layers are
/// written first. Units that later ones overwrite at every LOD are removed, unless they keep a
/// corrective in use or belong to a bundle.
void find_layers(const dna::Dna& dna, std::vector<Unit>& units);

/// Computes the effect of a coefficient while its control is 1, divided by the threshold of its
/// kind (translation, rotation or scale). A coefficient with a result below 1 is small.
class Effects {
 public:
  Effects(const dna::Dna& dna, const Threshold& threshold);
  /// In: output  joint * 9 + attribute. Out: effect / threshold; infinity if the threshold is 0 and
  /// the value is not
  double of(std::uint16_t output, float value) const;
  bool nothing_is_small() const { return nothing_is_small_; }

 private:
  double per_unit_[3];  // translation, rotation, scale
  bool nothing_is_small_;
};

/// [controls] true for correctives that other correctives, networks, gather operations, RBF solvers
/// and poses, or twist and swing setups read. At a LOD that does not use such a corrective,
/// evaluation would leave it at 0, and its readers would change.
std::vector<bool> watched_correctives(const dna::Dna& dna);

/// The value in Regions::of_joint for a joint that no unit moves; other values are region numbers.
constexpr std::uint32_t kNoRegion = UINT32_MAX;
struct Regions {
  std::vector<std::uint32_t> of_joint;
  std::uint32_t count = 0;
};

/// Divides the joints that units move into regions: the regions of the options, then clusters of
/// joints that the same controls drive. In: significant_only  true: a joint's controls with only
/// small coefficients are ignored, but never more than the weaker half of its controls
Regions find_regions(const dna::Dna& dna, const std::vector<Unit>& units, const Effects& effects,
                     const RegroupOptions& options, bool significant_only);

/// Removes small coefficients from columns foreign to their region, except at quaternion joints,
/// and except the last use of a watched corrective at some LOD.
/// In:  foreign_share  a column is foreign if its control moves at most this share of the region's
///                     joints
/// Out: number of removed coefficients
std::uint64_t remove_outliers(const dna::Dna& dna, const Regions& regions, const Effects& effects,
                              double foreign_share, std::vector<Unit>& units);

/// Removes rows that are all 0, except at quaternion joints and at joints where several units write
/// one output. Of each joint at least one row stays. Call it after find_layers.
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
