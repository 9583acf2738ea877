// SPDX-License-Identifier: MIT
// Compiles the rotations of quaternion joints, which the file's joint metadata declares
// quaternions: each column of a joint group that rotates such a joint becomes a quaternion, a term
// of its product. Also lists the joints that Euler angles rotate. From: dna-format 12.5
#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <numeric>
#include <utility>

#include "compile/compile.h"
#include "compile/parts.h"

namespace risorius::compile {

namespace {

using rig::RigData;

// [columns]: the first row in which the column rotates a quaternion joint; kNone: the column
// rotates no quaternion joint.
std::vector<std::uint32_t> first_turning_rows(const dna::JointGroup& g,
                                              const std::vector<bool>& quaternion_joints) {
  const std::size_t columns = g.input_indices.size();
  std::vector<std::uint32_t> first(columns, rig::kNone);
  for (std::uint32_t r = 0; r < g.output_indices.size(); ++r) {
    const std::uint32_t joint = g.output_indices[r] / 9u, attribute = g.output_indices[r] % 9u;
    if (attribute < 3 || attribute > 5 || !quaternion_joints[joint]) continue;
    const float* row = g.values.data() + r * columns;
    for (std::size_t c = 0; c < columns; ++c) {
      if (first[c] == rig::kNone && row[c] != 0.0f) first[c] = r;
    }
  }
  return first;
}

// The rows of a joint group that write a joint's rotation about x, about y and about z; kNone: the
// group has no such row.
using RotationRows = std::array<std::uint32_t, 3>;

std::map<std::uint32_t, RotationRows> rotation_rows(const dna::JointGroup& g, std::uint32_t rows) {
  std::map<std::uint32_t, RotationRows> out;
  for (std::uint32_t r = 0; r < rows; ++r) {
    const std::uint32_t joint = g.output_indices[r] / 9u, attribute = g.output_indices[r] % 9u;
    if (attribute < 3 || attribute > 5) continue;
    auto [at, added] = out.try_emplace(joint, RotationRows{rig::kNone, rig::kNone, rig::kNone});
    at->second[attribute - 3] = r;
  }
  return out;
}

// Adds column c of a group, with a term for each quaternion joint that it rotates. If a joint has
// no row for an axis, the angle about this axis is 0.
// In: rows        [quaternion joints of the group] their rotation rows
//     first_slot  index of the first of these joints in out.quaternion_joints
void add_column(const dna::JointGroup& g, std::size_t c, const std::vector<RotationRows>& rows,
                std::uint32_t first_slot, RigData& out) {
  const std::size_t columns = g.input_indices.size();
  rig::QuaternionColumn column;
  column.control = g.input_indices[c];
  column.terms_begin = static_cast<std::uint32_t>(out.quaternion_terms.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::array<float, 3> angles{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t r = rows[i][axis];
      if (r != rig::kNone) angles[axis] = g.values[std::size_t{r} * columns + c];
    }
    if (angles == std::array<float, 3>{}) continue;
    out.quaternion_terms.push_back(
        {rig::from_euler(out.euler, angles), first_slot + static_cast<std::uint32_t>(i)});
  }
  column.terms_end = static_cast<std::uint32_t>(out.quaternion_terms.size());
  if (column.terms_end > column.terms_begin) out.quaternion_columns.push_back(column);
}

// 1 + the coarsest LOD at which a group evaluates a row; 0 if no LOD evaluates it.
std::uint32_t levels_of(std::uint32_t row, const RigData& out, std::uint32_t group) {
  std::uint32_t levels = out.lod_count;
  while (levels > 0 && out.joint_group_lods[group * out.lod_count + levels - 1] <= row) --levels;
  return levels;
}

// Raises euler[joint], the number of LODs at which Euler angles rotate the joint, by the rows of a
// group. A row counts even if a later row for the same angle replaces it at finer LODs.
void count_euler_levels(const dna::JointGroup& g, std::uint32_t index,
                        const std::vector<bool>& flags, const RigData& out,
                        std::vector<std::uint32_t>& euler) {
  for (std::uint32_t r = 0; r < out.joint_groups[index].row_count; ++r) {
    const std::uint32_t joint = g.output_indices[r] / 9u, attribute = g.output_indices[r] % 9u;
    if (attribute < 3 || attribute > 5 || flags[joint]) continue;
    euler[joint] = std::max(euler[joint], levels_of(r, out, index));
  }
}

// Lists the joints that Euler angles rotate. They are sorted so that each LOD uses a number of them
// from the beginning of the list.
// In: levels  [joints] number of LODs at which Euler angles rotate the joint; 0: none
void list_euler_joints(const std::vector<std::uint32_t>& levels, RigData& out) {
  for (std::uint32_t j = 0; j < out.joint_count && out.joint_stride == 10; ++j) {
    if (levels[j] > 0) out.euler_joints.push_back(static_cast<std::uint16_t>(j));
  }
  std::ranges::stable_sort(out.euler_joints, std::greater{}, [&](auto j) { return levels[j]; });
  for (std::uint32_t l = 0; l < out.lod_count; ++l) {
    const auto count =
        std::ranges::count_if(out.euler_joints, [&](auto j) { return levels[j] > l; });
    out.euler_joint_lods.push_back(static_cast<std::uint32_t>(count));
  }
}

void add_group(const dna::JointGroup& g, std::uint32_t index, const std::vector<bool>& flags,
               RigData& out) {
  const auto first_slot = static_cast<std::uint32_t>(out.quaternion_joints.size());
  std::vector<RotationRows> turned;
  for (const auto& [joint, rows] : rotation_rows(g, out.joint_groups[index].row_count)) {
    if (!flags[joint]) continue;
    out.quaternion_joints.push_back({joint, index, *std::ranges::min_element(rows)});
    turned.push_back(rows);
  }
  if (turned.empty()) return;
  for (const std::uint32_t c : quaternion_column_order(g, out.lod_count, flags)) {
    add_column(g, c, turned, first_slot, out);
  }
}

}  // namespace

std::vector<bool> quaternion_joints(const dna::Dna& dna) {
  std::vector<bool> flags(dna.definition.joint_names.size(), false);
  const auto& entries = dna.joint_behavior_metadata.joint_representations;
  for (std::size_t j = 0; j < entries.size() && j < flags.size(); ++j) {
    flags[j] = entries[j].rotation == 1;
  }
  return flags;
}

std::vector<std::uint32_t> quaternion_column_order(const dna::JointGroup& g,
                                                   std::uint32_t lod_count,
                                                   const std::vector<bool>& quaternion_joints) {
  const std::vector<std::uint32_t> first = first_turning_rows(g, quaternion_joints);
  std::vector<std::uint32_t> order;
  for (std::uint32_t c = 0; c < first.size(); ++c) {
    if (first[c] != rig::kNone) order.push_back(c);
  }
  // The first `live` columns of the order rotate a quaternion joint at every LOD so far.
  std::size_t live = order.size();
  // The smallest row count so far. A LOD with at least as many rows leaves the order unchanged.
  std::uint32_t rows = UINT32_MAX;
  for (std::size_t l = 0; l < lod_count && l < g.lods.size(); ++l) {
    if (g.lods[l] >= rows) continue;
    rows = g.lods[l];
    for (std::size_t i = live; i-- > 0;) {
      if (first[order[i]] >= rows) std::swap(order[i], order[--live]);
    }
  }
  return order;
}

rig::EulerConvention detail::euler_convention(const dna::Dna& dna) {
  static constexpr std::uint8_t kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                                 {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  const dna::DescriptorExt& ext = dna.descriptor_ext;
  rig::EulerConvention c;
  const auto* order = kOrders[ext.rotation_sequence < 6 ? ext.rotation_sequence : 0];
  for (std::size_t i = 0; i < 3; ++i) {
    c.order[i] = order[i];
    c.signs[i] = ext.rotation_sign[i] < 0 ? -1.0f : 1.0f;
  }
  c.radians_per_unit = dna.descriptor.rotation_unit == 1 ? 1.0f : 0.0174532925199432958f;
  return c;
}

void detail::compile_quaternion_joints(const dna::Dna& dna, const Groups& groups, RigData& out) {
  const std::vector<bool> flags = quaternion_joints(dna);
  std::vector<std::uint32_t> euler(flags.size(), 0);
  // Indices of the groups in the order of the file, because the last group of the file that rotates
  // a joint counts.
  std::vector<std::uint32_t> file_order(groups.size());
  std::iota(file_order.begin(), file_order.end(), 0u);
  std::ranges::sort(file_order, {}, [&](std::uint32_t i) { return groups[i]; });
  for (const std::uint32_t i : file_order) {
    count_euler_levels(*groups[i], i, flags, out, euler);
    add_group(*groups[i], i, flags, out);
  }
  list_euler_joints(euler, out);
  if (out.quaternion_joints.empty()) return;
  std::vector<std::uint32_t>& list = out.quaternion_column_list;
  list.resize(out.quaternion_columns.size());
  std::iota(list.begin(), list.end(), 0u);
  std::ranges::stable_sort(list, {},
                           [&](std::uint32_t c) { return out.quaternion_columns[c].control; });
  out.quaternion_column_begins.assign(out.control_count + std::size_t{1}, 0);
  for (const auto& column : out.quaternion_columns) {
    ++out.quaternion_column_begins[column.control + std::size_t{1}];
  }
  std::partial_sum(out.quaternion_column_begins.begin(), out.quaternion_column_begins.end(),
                   out.quaternion_column_begins.begin());
}

}  // namespace risorius::compile
