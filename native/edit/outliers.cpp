// SPDX-License-Identifier: MIT
// Removes from joint groups the small coefficients in columns whose control moves few joints of the
// region, and rows that are all 0.
#include <algorithm>

#include "dna/controls.h"
#include "edit/units.h"

namespace risorius::edit::detail {

namespace {

// Counts for each corrective in watched_correctives() and each LOD the coefficients other than 0 in
// joint groups and the entries of channels and maps that read the corrective.
class Uses {
 public:
  Uses(const dna::Dna& dna, const std::vector<Unit>& units)
      : dna_(dna), lods_(dna.descriptor.lod_count), watched_(watched_correctives(dna)) {
    if (std::ranges::find(watched_, true) == watched_.end()) return;
    counts_.assign(watched_.size() * lods_, 0);
    const auto& channels = dna.behavior.blend_shape_channels;
    const auto& maps = dna.behavior.animated_maps;
    count_entries(channels.lods, channels.input_indices);
    count_entries(maps.lods, maps.conditionals.input_indices);
    // Joints that networks move also read correctives. Leaving these uses out only means that fewer
    // coefficients are removed.
    for (const Unit& u : units) {
      for (std::size_t v = 0; v < u.values.size(); ++v) {
        if (u.values[v] != 0.0f) add(u.columns[v % u.columns.size()], row_of(u, v), 1);
      }
    }
  }
  /// Removes one use of a control by a row. Returns false, and removes nothing, if it is the last
  /// use of the control at some LOD.
  bool take(std::uint16_t control, const Row& row) {
    if (!watched_[control]) return true;
    for (std::uint32_t l = 0; l < lods_; ++l) {
      if (uses(row, l) && counts_[control * lods_ + l] == 1) return false;
    }
    add(control, row, -1);
    return true;
  }
  static const Row& row_of(const Unit& u, std::size_t value) {
    return u.rows[value / u.columns.size()];
  }

 private:
  bool uses(const Row& row, std::uint32_t lod) const {
    return dna_.behavior.joint_groups[row.group].lods[lod] > row.row;
  }
  void add(std::uint16_t control, const Row& row, std::int64_t n) {
    if (!watched_[control]) return;
    for (std::uint32_t l = 0; l < lods_; ++l) {
      if (uses(row, l)) counts_[control * lods_ + l] += n;
    }
  }
  void count_entries(const core::Array<std::uint16_t>& lods,
                     const core::Array<std::uint16_t>& inputs) {
    for (std::uint32_t l = 0; l < lods_ && l < lods.size(); ++l) {
      for (std::uint32_t i = 0; i < lods[l]; ++i) ++counts_[inputs[i] * lods_ + l];
    }
  }

  const dna::Dna& dna_;
  std::size_t lods_;
  std::vector<bool> watched_;
  std::vector<std::int64_t> counts_;  // [controls, LODs]
};

// [controls] how many joints of a region each control moves.
// In: units  the units of the region, sorted by joint
std::vector<std::uint32_t> count_joints(const std::vector<const Unit*>& units,
                                        std::size_t controls) {
  std::vector<std::uint32_t> counts(controls, 0), last(controls, UINT32_MAX);
  for (const Unit* u : units) {
    for (const std::uint16_t c : u->columns) {
      if (last[c] == u->joint) continue;
      last[c] = u->joint;
      ++counts[c];
    }
  }
  return counts;
}

// Removes columns of a unit of one row. In: keep  [columns] whether each column stays
void keep_columns(const std::vector<bool>& keep, Unit& u) {
  std::size_t n = 0;
  for (std::size_t c = 0; c < keep.size(); ++c) {
    if (!keep[c]) continue;
    u.columns[n] = u.columns[c];
    u.values[n++] = u.values[c];
  }
  u.columns.resize(n);
  u.values.resize(n);
}

}  // namespace

std::uint64_t remove_outliers(const dna::Dna& dna, const Regions& regions, const Effects& effects,
                              double foreign_share, std::vector<Unit>& units) {
  if (effects.nothing_is_small()) return 0;
  Uses uses(dna, units);
  std::vector<std::vector<Unit*>> members(regions.count);
  for (Unit& u : units) members[regions.of_joint[u.joint]].push_back(&u);
  std::uint64_t removed = 0;
  for (const std::vector<Unit*>& list : members) {
    const std::vector<const Unit*> all(list.begin(), list.end());
    const auto counts = count_joints(all, dna::control_counts(dna).total());
    std::size_t joints = 0;
    for (std::size_t i = 0; i < list.size(); ++i) {
      joints += i == 0 || list[i]->joint != list[i - 1]->joint ? 1 : 0;
    }
    const double most = foreign_share * static_cast<double>(joints);
    for (Unit* u : list) {
      if (u->is_quaternion) continue;
      std::vector<bool> keep(u->columns.size(), true);
      for (std::size_t c = 0; c < keep.size(); ++c) {
        const bool small = effects.of(u->rows[0].output, u->values[c]) < 1.0;
        const bool foreign = static_cast<double>(counts[u->columns[c]]) <= most;
        if (small && foreign && uses.take(u->columns[c], u->rows[0])) keep[c] = false;
      }
      removed += static_cast<std::uint64_t>(std::ranges::count(keep, false));
      keep_columns(keep, *u);
    }
  }
  return removed;
}

void remove_zero_rows(std::vector<Unit>& units) {
  std::vector<Unit> out;
  for (std::size_t i = 0; i < units.size();) {
    const std::size_t begin = i;
    while (i < units.size() && units[i].joint == units[begin].joint) ++i;
    const auto first = units.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = units.begin() + static_cast<std::ptrdiff_t>(i);
    // No row is removed if a unit of the joint overwrites another unit at some LOD, because the
    // overwriting row may be a row of zeros. At least one row of a joint is kept, so that the rig
    // knows that the joint may move.
    const bool layered = std::any_of(first, last, [](const Unit& u) { return u.layer > 0; });
    const auto goes = [&](const Unit& u) { return u.is_zero() && !u.is_quaternion && !layered; };
    auto kept = std::count_if(first, last, [&](const Unit& u) { return !goes(u); });
    for (auto u = first; u != last; ++u) {
      if (goes(*u) && kept++ > 0) continue;
      out.push_back(std::move(*u));
    }
  }
  units = std::move(out);
}

}  // namespace risorius::edit::detail
