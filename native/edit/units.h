// SPDX-License-Identifier: MIT
// The rows of all joint groups, freed from their groups. Private to native/edit.
#pragma once

#include <cstdint>
#include <vector>

#include "dna/dna.h"
#include "edit/regroup.h"

namespace risorius::edit::detail {

/// Where a row came from; that tells the LODs that use it.
struct Row {
  std::uint16_t output = 0;  // joint * 9 + attribute
  std::uint32_t group = 0, row = 0;
  std::uint32_t levels = 0;  // number of LODs that use it, more than 0
};

/// How the columns of a unit are multiplied: in any order, in ascending order, or as in source
/// group order - kOfGroup.
constexpr std::uint32_t kAnyOrder = 0, kAscending = 1, kOfGroup = 2;

/// Rows that stay together: one, or those that turn one quaternion joint.
struct Unit {
  std::uint32_t joint = 0;
  bool is_quaternion = false;  // the joint's: nothing of it is ever small
  std::uint32_t layer = 0;     // units in later groups that write the same rows
  std::uint32_t chain = 0;     // LODs of units of one chain nest in each other
  std::uint32_t order = kAnyOrder;
  // Units of one bundle stay in one group of their own, 0: none. Where rows of a quaternion come in
  // at different LODs the order of its columns hangs on the other quaternions of its source group.
  std::uint32_t bundle = 0;
  std::vector<Row> rows;
  std::vector<std::uint16_t> columns;  // controls; linear: ascending, each once
  std::vector<std::uint32_t> source;   // kOfGroup: the columns' places in the order of their group
  std::vector<float> values;           // [rows, columns]

  bool is_zero() const { return columns.empty(); }
};

/// Every row that some LOD uses, by joint and then in the order of the file. Columns with no value
/// are gone, a control that a group names twice is there once (but for quaternions). In: a Dna that
/// compile accepts.
std::vector<Unit> list_units(const dna::Dna& dna);

/// The last writer of a row is in layer 0, the one before it in layer 1; the higher is written
/// first. Units that others hide at every LOD go, unless they keep a corrective in use.
void find_layers(const dna::Dna& dna, std::vector<Unit>& units);

/// How much a coefficient does while its control is 1, against the threshold: below 1 is small.
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

/// True for correctives that something else than joints, channels and maps reads: where nothing
/// uses them they rest, and what reads them would see it.
std::vector<bool> watched_correctives(const dna::Dna& dna);

/// Which region each joint is in; kNoRegion for joints that no unit moves.
constexpr std::uint32_t kNoRegion = UINT32_MAX;
struct Regions {
  std::vector<std::uint32_t> of_joint;
  std::uint32_t count = 0;
};

/// In: significant_only  leave out what is small when joints are compared
Regions find_regions(const dna::Dna& dna, const std::vector<Unit>& units, const Effects& effects,
                     const RegroupOptions& options, bool significant_only);

/// Takes small coefficients out of columns foreign to their region. Out: how many.
std::uint64_t remove_outliers(const dna::Dna& dna, const Regions& regions, const Effects& effects,
                              double foreign_share, std::vector<Unit>& units);

/// Rows of zeros go where the joint has another row. After find_layers.
void remove_zero_rows(std::vector<Unit>& units);

/// Fails: kLimitExceeded
core::Result<std::vector<dna::JointGroup>> build_groups(const dna::Dna& dna,
                                                        const std::vector<Unit>& units,
                                                        const Regions& regions);

/// Differences and times of two faces that differ in their joint groups only.
core::Status compare(const dna::Dna& before, const dna::Dna& after, const RegroupOptions& options,
                     RegroupReport& report);

}  // namespace risorius::edit::detail
