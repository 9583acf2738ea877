// SPDX-License-Identifier: MIT
// Builds dense joint groups from units.
#include <algorithm>
#include <functional>
#include <map>
#include <numeric>
#include <string>
#include <tuple>

#include "edit/units.h"

namespace risorius::edit::detail {

namespace {

using core::Buffer;
using core::ErrorCode;
using core::Result;
using Indices = std::vector<std::uint16_t>;

// The most values that a reader with the default limits accepts in one list.
constexpr std::uint64_t kMostValues = std::uint64_t{1} << 28;
constexpr std::size_t kMost = 65535;  // rows or columns

// The sort key of a new joint group. Groups are written in ascending order of it. If two groups
// write the same row, the later one wins.
struct GroupKey {
  std::uint32_t below;  // highest layer - layer, so that higher layers come first
  // levels: 0, or the number of LODs that use each unit of the group. It is not 0 if units that
  // other numbers of LODs use would change the order of the group's columns, and are therefore in
  // other groups. region: 0 for a bundle, which may have joints of several regions.
  std::uint32_t region, chain, bundle, order, levels;
  auto operator<=>(const GroupKey&) const = default;
};
using Members = std::map<GroupKey, std::vector<const Unit*>>;

// The columns of a new group, and the place of each unit's columns among them. Columns that rotate
// quaternion joints come first, in the order in which their rotations are multiplied. The compiler
// keeps this order (compile::quaternion_column_order).
class Columns {
 public:
  explicit Columns(const std::vector<const Unit*>& units) {
    add_source_orders(units);
    add_ascending(units);
    if (!units.empty() && units[0]->bundle == 0) sort_by_levels(units);
  }
  const Indices& controls() const { return controls_; }
  std::size_t place(const Unit& u, std::size_t column) const {
    return u.order >= kOfGroup ? by_source_.at(u.source[column])
                               : by_control_.at(u.columns[column]);
  }
  bool keeps_orders() const { return keeps_orders_; }

 private:
  void add_source_orders(const std::vector<const Unit*>& units) {
    std::vector<std::pair<std::uint32_t, std::uint16_t>> ordered;  // place in the source's order
    for (const Unit* u : units) {
      if (u->order < kOfGroup) continue;
      for (std::size_t c = 0; c < u->columns.size(); ++c) {
        ordered.emplace_back(u->source[c], u->columns[c]);
      }
    }
    std::ranges::sort(ordered);
    ordered.erase(std::unique(ordered.begin(), ordered.end()), ordered.end());
    for (const auto& [source, control] : ordered) {
      by_source_[source] = controls_.size();
      by_control_.try_emplace(control, controls_.size());
      controls_.push_back(control);
    }
  }

  void add_ascending(const std::vector<const Unit*>& units) {
    Indices others;
    for (const Unit* u : units) {
      if (u->order >= kOfGroup) continue;
      others.insert(others.end(), u->columns.begin(), u->columns.end());
    }
    std::ranges::sort(others);
    others.erase(std::unique(others.begin(), others.end()), others.end());
    for (const std::uint16_t control : others) {
      if (by_control_.try_emplace(control, controls_.size()).second) controls_.push_back(control);
    }
  }

  // For each column, the number of LODs at which it rotates a quaternion joint; the largest of
  // these numbers if the column rotates several quaternion joints.
  std::vector<std::uint32_t> levels_of(const std::vector<const Unit*>& units) const {
    std::vector<std::uint32_t> levels(controls_.size(), 0);
    for (const Unit* u : units) {
      if (u->order == kAnyOrder) continue;
      for (std::size_t c = 0; c < u->columns.size(); ++c) {
        std::uint32_t& to = levels[place(*u, c)];
        to = std::max(to, u->rows[0].levels);  // outside of bundles all rows have the same number
      }
    }
    return levels;
  }

  void sort_by_levels(const std::vector<const Unit*>& units) {
    const std::vector<std::uint32_t> levels = levels_of(units);
    std::vector<std::size_t> order(controls_.size()), to(controls_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, std::greater{}, [&](std::size_t c) { return levels[c]; });
    Indices controls;
    for (const std::size_t c : order) {
      to[c] = controls.size();
      controls.push_back(controls_[c]);
    }
    controls_ = std::move(controls);
    for (auto& [source, at] : by_source_) at = to[at];
    for (auto& [control, at] : by_control_) at = to[at];
    for (const Unit* u : units) {
      for (std::size_t c = 1; u->order != kAnyOrder && c < u->columns.size(); ++c) {
        keeps_orders_ &= place(*u, c - 1) < place(*u, c);
      }
    }
  }

  Indices controls_;
  std::map<std::uint32_t, std::size_t> by_source_;
  std::map<std::uint16_t, std::size_t> by_control_;
  bool keeps_orders_ = true;
};

// All quaternion joints of a group share the order of its columns, in which columns with more LODs
// come first. If this order differs from the order that one of the joints needs, the units are
// divided into groups whose units are all used by the same number of LODs. In such a group the
// number of LODs moves no column.
Members separated(const Members& groups) {
  Members out;
  for (const auto& [key, list] : groups) {
    const bool whole = key.bundle != 0 || Columns(list).keeps_orders();
    for (const Unit* u : list) {
      GroupKey to = key;
      to.levels = whole ? 0 : u->rows[0].levels;
      out[to].push_back(u);
    }
  }
  return out;
}

Members list_members(const std::vector<Unit>& units, const Regions& regions) {
  Members out;
  std::uint32_t top = 0;
  for (const Unit& u : units) top = std::max(top, u.layer);
  const auto key = [&](const Unit& u, std::uint32_t order) {
    const std::uint32_t region = u.bundle == 0 ? regions.of_joint[u.joint] : 0;
    return GroupKey{top - u.layer, region, u.chain, u.bundle, order, 0};
  };
  for (const Unit& u : units) {
    if (u.order != kAnyOrder) out[key(u, u.order)].push_back(&u);
  }
  out = separated(out);
  // Units whose columns may have any order join a group with a fixed order, if there is such a
  // group with the same layer, region, chain and bundle.
  Members free;
  for (const Unit& u : units) {
    if (u.order == kAnyOrder) free[key(u, kAnyOrder)].push_back(&u);
  }
  for (auto& [at, list] : free) {
    auto found = out.lower_bound(at);
    const bool same = found != out.end() && found->first.below == at.below &&
                      found->first.region == at.region && found->first.chain == at.chain &&
                      found->first.bundle == at.bundle;
    auto& to = same ? found->second : out[at];
    to.insert(to.end(), list.begin(), list.end());
  }
  return out;
}

struct Placed {
  const Unit* unit;
  std::size_t row;
  const Row& at() const { return unit->rows[row]; }
};

// Sorts the rows of a group: rows that more LODs use come first.
std::vector<Placed> order_rows(const std::vector<const Unit*>& units) {
  std::vector<Placed> rows;
  for (const Unit* u : units) {
    for (std::size_t r = 0; r < u->rows.size(); ++r) rows.push_back({u, r});
  }
  std::ranges::stable_sort(rows, {}, [](const Placed& p) {
    return std::tuple(UINT32_MAX - p.at().levels, p.at().output, p.at().row);
  });
  return rows;
}

void fill_values(const std::vector<const Unit*>& units, const std::vector<Placed>& rows,
                 const Columns& columns, Buffer<float>& values) {
  std::fill(values.data(), values.data() + values.size(), 0.0f);
  std::map<const Unit*, std::vector<std::size_t>> places;
  for (const Unit* u : units) {
    auto& list = places[u];
    for (std::size_t c = 0; c < u->columns.size(); ++c) list.push_back(columns.place(*u, c));
  }
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const Unit& u = *rows[r].unit;
    const std::vector<std::size_t>& list = places[&u];
    const float* from = u.values.data() + rows[r].row * list.size();
    float* to = values.data() + r * columns.controls().size();
    for (std::size_t c = 0; c < list.size(); ++c) to[list[c]] = from[c];
  }
}

dna::JointGroup frame_of(const dna::Dna& dna, const std::vector<Placed>& rows) {
  const auto& groups = dna.behavior.joint_groups;
  Indices lods, outputs, joints;
  for (std::uint32_t l = 0; l < dna.descriptor.lod_count; ++l) {
    const auto uses = [&](const Placed& p) { return groups[p.at().group].lods[l] > p.at().row; };
    lods.push_back(static_cast<std::uint16_t>(std::ranges::count_if(rows, uses)));
  }
  for (const Placed& p : rows) {
    outputs.push_back(p.at().output);
    joints.push_back(static_cast<std::uint16_t>(p.unit->joint));
  }
  std::ranges::sort(joints);
  joints.erase(std::unique(joints.begin(), joints.end()), joints.end());
  dna::JointGroup g;
  g.lods = std::move(lods);
  g.output_indices = std::move(outputs);
  g.joint_indices = std::move(joints);
  return g;
}

}  // namespace

Result<std::vector<dna::JointGroup>> build_groups(const dna::Dna& dna,
                                                  const std::vector<Unit>& units,
                                                  const Regions& regions) {
  std::vector<dna::JointGroup> out;
  for (const auto& [key, list] : list_members(units, regions)) {
    const Columns columns(list);
    const std::vector<Placed> rows = order_rows(list);
    const std::size_t width = columns.controls().size();
    if (rows.size() > kMost || width > kMost || rows.size() * width > kMostValues) {
      return core::fail(ErrorCode::kLimitExceeded, "regions",
                        "a region of " + std::to_string(rows.size()) + " rows and " +
                            std::to_string(width) + " controls is too large for one joint group");
    }
    Buffer<float> values(rows.size() * width);
    fill_values(list, rows, columns, values);
    dna::JointGroup& g = out.emplace_back(frame_of(dna, rows));
    g.input_indices = Indices(columns.controls());
    g.values = std::move(values);
  }
  return out;
}

}  // namespace risorius::edit::detail
