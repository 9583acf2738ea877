// SPDX-License-Identifier: MIT
// Lists the rows of joint groups as units: single rows, or all rotation rows of a quaternion
// joint. Finds which units overwrite each other and which may share a group.
#include "edit/units.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "compile/compile.h"
#include "dna/controls.h"

namespace risorius::edit::detail {

namespace {

// Number of LODs that use a row. LOD l uses row r if lods[l] > r.
std::uint32_t levels_of(const dna::JointGroup& g, std::uint32_t row, std::uint32_t lod_count) {
  std::uint32_t n = 0;
  for (std::uint32_t l = 0; l < lod_count && l < g.lods.size(); ++l) n += g.lods[l] > row ? 1 : 0;
  return n;
}

bool rotates(std::uint16_t output) { return output % 9 >= 3 && output % 9 <= 5; }

// Makes a unit of one row, with its controls in ascending order. If the group names a control
// twice, its values are added.
void take_linear(const dna::JointGroup& g, std::uint32_t row, Unit& unit) {
  const std::size_t columns = g.input_indices.size();
  const float* from = g.values.data() + row * columns;
  std::vector<std::pair<std::uint16_t, double>> entries;
  for (std::size_t c = 0; c < columns; ++c) {
    if (from[c] != 0.0f) entries.emplace_back(g.input_indices[c], from[c]);
  }
  std::ranges::stable_sort(entries, {}, &std::pair<std::uint16_t, double>::first);
  for (std::size_t i = 0; i < entries.size();) {
    double sum = 0.0;
    const std::uint16_t control = entries[i].first;
    for (; i < entries.size() && entries[i].first == control; ++i) sum += entries[i].second;
    const auto value = static_cast<float>(sum);
    if (value == 0.0f) continue;
    unit.columns.push_back(control);
    unit.values.push_back(value);
  }
}

bool is_ascending(const std::vector<std::uint16_t>& values) {
  return std::ranges::adjacent_find(values, std::greater_equal<>()) == values.end();
}

// Adds the columns and values of a quaternion joint's rotation rows, in the order in which the
// columns' rotations are multiplied.
void take_rotation(const dna::JointGroup& g, std::uint32_t group,
                   const std::vector<std::uint32_t>& order, Unit& unit) {
  const std::size_t columns = g.input_indices.size();
  std::vector<std::uint32_t> mine;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::uint32_t c = order[i];
    const auto turns = [&](const Row& r) { return g.values[r.row * columns + c] != 0.0f; };
    if (!std::ranges::any_of(unit.rows, turns)) continue;
    mine.push_back(c);
    unit.columns.push_back(g.input_indices[c]);
    unit.source.push_back(static_cast<std::uint32_t>(i));
  }
  for (const Row& r : unit.rows) {
    for (const std::uint32_t c : mine) unit.values.push_back(g.values[r.row * columns + c]);
  }
  unit.order = is_ascending(unit.columns) ? kAscending : kOfGroup + group;
}

// Adds the columns and values of the rotations of a group to the units of its quaternion joints.
// In: turned  joint -> number of its unit
void take_rotations(const dna::Dna& dna, std::uint32_t index, const std::vector<bool>& quaternions,
                    const std::map<std::uint32_t, std::size_t>& turned, std::vector<Unit>& units) {
  if (turned.empty()) return;
  const dna::JointGroup& g = dna.behavior.joint_groups[index];
  const auto order = compile::quaternion_column_order(g, dna.descriptor.lod_count, quaternions);
  bool mixed = false;
  for (const auto& [joint, unit] : turned) {
    take_rotation(g, index, order, units[unit]);
    const auto& rows = units[unit].rows;
    const auto other = [&](const Row& r) { return r.levels != rows[0].levels; };
    mixed |= std::ranges::any_of(rows, other);
  }
  for (const auto& [joint, unit] : turned) {
    if (!mixed) continue;
    units[unit].bundle = index + 1;
    units[unit].order = kOfGroup + index;
  }
}

void add_group(const dna::Dna& dna, std::uint32_t index, const std::vector<bool>& quaternions,
               std::vector<Unit>& out) {
  const dna::JointGroup& g = dna.behavior.joint_groups[index];
  const std::uint32_t lod_count = dna.descriptor.lod_count;
  std::map<std::uint32_t, std::size_t> turned;  // joint -> unit
  const auto new_unit = [&](std::uint32_t joint) -> Unit& {
    Unit& unit = out.emplace_back();
    unit.joint = joint;
    unit.is_quaternion = quaternions[joint];
    return unit;
  };
  for (std::uint32_t r = 0; r < g.output_indices.size(); ++r) {
    const Row row{g.output_indices[r], index, r, levels_of(g, r, lod_count)};
    if (row.levels == 0) continue;
    const std::uint32_t joint = row.output / 9u;
    if (!quaternions[joint] || !rotates(row.output)) {
      Unit& unit = new_unit(joint);
      unit.rows.push_back(row);
      take_linear(g, r, unit);
      continue;
    }
    const auto [at, added] = turned.try_emplace(joint, out.size());
    (added ? new_unit(joint) : out[at->second]).rows.push_back(row);
  }
  take_rotations(dna, index, quaternions, turned, out);
}

// [LODs] for each LOD whether it uses a row; the finest LOD is first.
std::vector<bool> lods_of(const dna::Dna& dna, const Row& row) {
  std::vector<bool> out(dna.descriptor.lod_count);
  const auto& lods = dna.behavior.joint_groups[row.group].lods;
  for (std::size_t l = 0; l < out.size(); ++l) out[l] = lods[l] > row.row;
  return out;
}

// Puts units whose rows skip a LOD into chains. Usually each row is used from LOD 0 up to some LOD.
// A unit with a row that skips a LOD can share a group only with units whose rows are used at the
// same LODs. These units are one chain.
void find_chains(const dna::Dna& dna, std::vector<Unit>& units) {
  std::map<std::vector<std::vector<bool>>, std::vector<Unit*>> chains;
  for (Unit& unit : units) {
    if (unit.bundle != 0) continue;  // rows of one source group nest, even if they skip LODs
    std::vector<std::vector<bool>> sets;
    bool skips = false;
    for (const Row& row : unit.rows) {
      sets.push_back(lods_of(dna, row));
      skips |= !std::ranges::is_sorted(sets.back(), std::greater<>());
    }
    std::ranges::sort(sets);
    if (skips) chains[std::move(sets)].push_back(&unit);
  }
  std::uint32_t chain = 0;
  for (const auto& [sets, members] : chains) {
    ++chain;
    for (Unit* unit : members) unit->chain = chain;
  }
}

// A number for the output of a unit: its attribute, or the rotation of its quaternion joint.
std::uint32_t key_of(const Unit& unit) {
  const std::uint16_t output = unit.rows[0].output;
  return unit.is_quaternion && rotates(output) ? unit.joint * 9u + 3u : output;
}

// The row that decides whether a unit is written at a LOD. A later row of the unit overwrites an
// earlier row that writes the same rotation attribute. Of the rows that are not overwritten, the
// first one decides.
const Row& deciding_row(const Unit& unit) {
  const Row* first = nullptr;
  for (std::size_t i = 0; i < unit.rows.size(); ++i) {
    const auto again = [&](const Row& r) { return r.output == unit.rows[i].output; };
    const auto rest = unit.rows.begin() + static_cast<std::ptrdiff_t>(i) + 1;
    if (std::any_of(rest, unit.rows.end(), again)) continue;
    if (first == nullptr) first = &unit.rows[i];
  }
  return *first;
}

// Whether later units overwrite this one at each LOD where it has a row.
bool is_hidden(const dna::Dna& dna, const Unit& unit, const std::vector<const Unit*>& later) {
  const auto& groups = dna.behavior.joint_groups;
  for (std::uint32_t l = 0; l < dna.descriptor.lod_count; ++l) {
    const auto has = [&](const Row& r) { return groups[r.group].lods[l] > r.row; };
    if (!std::ranges::any_of(unit.rows, has)) continue;
    const auto hides = [&](const Unit* u) { return has(deciding_row(*u)); };
    if (!std::ranges::any_of(later, hides)) return false;
  }
  return true;
}

// Removes units that later ones overwrite at every LOD, unless they keep a corrective in use or
// belong to a bundle, whose order of columns depends on all its units.
void remove_hidden(const dna::Dna& dna, std::vector<Unit>& units) {
  const std::vector<bool> watched = watched_correctives(dna);
  std::map<std::uint32_t, std::vector<std::size_t>> writers;
  for (std::size_t i = 0; i < units.size(); ++i) writers[key_of(units[i])].push_back(i);
  std::vector<bool> gone(units.size(), false);
  for (const auto& [key, list] : writers) {
    std::vector<const Unit*> later;
    for (std::size_t n = list.size(); n-- > 0;) {
      const Unit& unit = units[list[n]];
      const auto keeps = [&](std::uint16_t c) { return watched[c]; };
      gone[list[n]] = !later.empty() && unit.bundle == 0 &&
                      !std::ranges::any_of(unit.columns, keeps) && is_hidden(dna, unit, later);
      if (!gone[list[n]]) later.push_back(&unit);
    }
  }
  std::size_t i = 0;
  std::erase_if(units, [&](const Unit&) { return gone[i++]; });
}

}  // namespace

void find_layers(const dna::Dna& dna, std::vector<Unit>& units) {
  remove_hidden(dna, units);
  std::vector<Unit*> order;
  order.reserve(units.size());
  for (Unit& unit : units) order.push_back(&unit);
  std::ranges::stable_sort(order, std::greater{}, [](const Unit* u) {
    return std::tuple(u->rows[0].group, u->bundle, u->rows[0].row);
  });
  std::map<std::uint32_t, std::uint32_t> next;  // by output: the layer of the next unit
  for (auto at = order.begin(); at != order.end();) {
    const Unit& first = **at;
    const auto other = [&](const Unit* u) {
      return first.bundle == 0 || u->bundle != first.bundle;
    };
    const auto end = std::find_if(at + 1, order.end(), other);
    std::uint32_t layer = 0;
    std::for_each(at, end, [&](const Unit* u) { layer = std::max(layer, next[key_of(*u)]); });
    std::for_each(at, end, [&](Unit* u) {
      u->layer = layer;
      next[key_of(*u)] = layer + 1;
    });
    at = end;
  }
}

std::vector<Unit> list_units(const dna::Dna& dna) {
  std::vector<Unit> units;
  const std::vector<bool> quaternions = compile::quaternion_joints(dna);
  for (std::uint32_t i = 0; i < dna.behavior.joint_groups.size(); ++i) {
    add_group(dna, i, quaternions, units);
  }
  std::ranges::stable_sort(units, {}, &Unit::joint);
  find_chains(dna, units);
  return units;
}

Effects::Effects(const dna::Dna& dna, const Threshold& threshold) {
  const dna::Descriptor& d = dna.descriptor;
  const double unit[3] = {d.translation_unit == 1 ? 1000.0 : 10.0,
                          d.rotation_unit == 1 ? 57.295779513082320877 : 1.0, 1.0};
  const double limit[3] = {threshold.translation_mm, threshold.rotation_degrees, threshold.scale};
  for (std::size_t k = 0; k < 3; ++k) {
    per_unit_[k] = limit[k] > 0.0 ? unit[k] / limit[k] : std::numeric_limits<double>::infinity();
  }
  nothing_is_small_ = std::ranges::max(limit) <= 0.0;
}

double Effects::of(std::uint16_t output, float value) const {
  if (value == 0.0f) return 0.0;
  const double effect = std::fabs(double{value}) * per_unit_[output % 9 / 3];
  return std::isnan(effect) ? std::numeric_limits<double>::infinity() : effect;
}

std::vector<bool> watched_correctives(const dna::Dna& dna) {
  const std::size_t count = dna::control_counts(dna).total();
  std::vector<bool> read(count, false), out(count, false);
  const auto mark = [&](const auto& indices) {
    for (const auto i : indices) {
      if (i < count) read[i] = true;
    }
  };
  mark(dna.behavior.psds.columns);
  for (const auto& n : dna.machine_learned_behavior.neural_networks) mark(n.input_indices);
  for (const auto& type : dna.machine_learned_behavior_ext.types) {
    for (const auto& set : type.operations) {
      for (const auto& operation : set) {
        if (operation.operation_type == 1) mark(operation.parameters);
      }
    }
  }
  for (const auto& s : dna.rbf_behavior.solvers) mark(s.raw_control_indices);
  for (const auto& p : dna.rbf_behavior_ext.poses) mark(p.input_control_indices);
  for (const auto& t : dna.twist_swing_behavior.twists) mark(t.input_control_indices);
  for (const auto& t : dna.twist_swing_behavior.swings) mark(t.input_control_indices);
  for (const std::uint16_t p : dna.behavior.psds.rows) out[p] = read[p];
  return out;
}

}  // namespace risorius::edit::detail
