// SPDX-License-Identifier: MIT
// The stage that most of the time goes to: joint attributes as sums of the columns of active
// controls.
#include <algorithm>

#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

// The columns of each group that are not at rest. By ascending control, so that sums have one
// order.
void list_columns(const Rig& rig, std::uint32_t lod, Workspace& work,
                  const float* controls) noexcept {
  const std::uint32_t live = rig.live_groups[lod];
  const std::span active(work.active.data(), work.active_count);
  detail::count_columns(rig, live, active, work.column_begins.data());
  std::uint32_t* next = work.column_begins.data() + 1;
  for (const std::uint16_t control : active) {
    const float v = controls[control];
    detail::for_columns(rig, control, live, [&](const JointColumn& column) {
      work.columns[next[column.group]++] = {column.offset, v};
    });
  }
}

constexpr std::size_t kAhead = 2;

// Asks for the columns of a group while the group before is summed: they lie all over the matrices,
// where the hardware does not see them coming.
void prefetch_columns(const Rig& rig, std::uint32_t lod, const Workspace& work,
                      std::size_t i) noexcept {
  if (i >= rig.live_groups[lod]) return;
  const std::size_t size = rig.is_half() ? 2 : 4;
  const std::size_t bytes = rig.joint_group_lods[i * rig.lod_count + lod] * size;
  const auto* values = rig.is_half() ? reinterpret_cast<const char*>(rig.joint_halves.data())
                                     : reinterpret_cast<const char*>(rig.joint_values.data());
  for (std::uint32_t c = work.column_begins[i]; c < work.column_begins[i + 1]; ++c) {
    const char* column = values + work.columns[c].offset * size;
    for (std::size_t at = 0; at < bytes; at += 64) simd::prefetch(column + at);
  }
}

}  // namespace

namespace detail {

void count_columns(const Rig& rig, std::uint32_t live, std::span<const std::uint16_t> active,
                   std::uint32_t* begins) noexcept {
  std::fill(begins, begins + live + 2, 0u);
  for (const std::uint16_t control : active) {
    for_columns(rig, control, live, [&](const JointColumn& column) { ++begins[column.group + 2]; });
  }
  for (std::uint32_t i = 2; i < live + 2; ++i) begins[i] += begins[i - 1];
}

// Extra pieces add to places that the first ones left at 0.
void place_rows(const Rig& rig, std::uint32_t lod, const float* rows, float* joints) noexcept {
  const std::size_t places = std::size_t{rig.joint_count} * rig.joint_stride,
                    whole = places / simd::kPlaces;
  const std::size_t blocks = (places + simd::kPlaces - 1) / simd::kPlaces;
  const simd::Piece* pieces = rig.joint_pieces.data() + lod * blocks;
  rig.kernels->place(pieces, whole, rows, joints);
  if (whole < blocks) {
    float last[simd::kPlaces];
    rig.kernels->place(pieces + whole, 1, rows, last);
    std::copy(last, last + places % simd::kPlaces, joints + whole * simd::kPlaces);
  }
  const std::uint32_t extra = rig.extra_begins[lod];
  rig.kernels->place_more(rig.extra_pieces.data() + extra, rig.extra_begins[lod + 1] - extra, rows,
                          joints);
}

void joint_groups(const Rig& rig, std::uint32_t lod, Workspace& work,
                  const PoseView& pose) noexcept {
  list_columns(rig, lod, work, pose.controls);
  for (std::size_t i = 0; i < kAhead; ++i) prefetch_columns(rig, lod, work, i);
  for (std::size_t i = 0; i < rig.live_groups[lod]; ++i) {
    prefetch_columns(rig, lod, work, i + kAhead);
    const std::uint32_t rows = rig.joint_group_lods[i * rig.lod_count + lod];
    if (rows == 0) continue;
    const simd::Column* columns = work.columns.data() + work.column_begins[i];
    const std::uint32_t count = work.column_begins[i + 1] - work.column_begins[i];
    float* out = work.rows.data() + rig.joint_groups[i].rows_begin;
    if (count == 0) {
      std::fill(out, out + rows, 0.0f);
    } else if (rig.is_half()) {
      rig.kernels->half_columns(rig.joint_halves.data(), columns, count, out, rows);
    } else {
      rig.kernels->columns(rig.joint_values.data(), columns, count, out, rows);
    }
  }
  place_rows(rig, lod, work.rows.data(), pose.joints);
}

}  // namespace detail

}  // namespace risorius::rig
