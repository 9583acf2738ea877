// SPDX-License-Identifier: MIT
// The stage that most of the time goes to: joint attributes as sums of the columns of active
// controls.
#include <algorithm>
#include <cstring>

#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

// What listing a column moves: it is read at its control, the end of its group's list is read and
// written, it is written there and read again by the kernel.
constexpr std::uint64_t kListed =
    sizeof(JointColumn) + 2 * sizeof(std::uint32_t) + 2 * sizeof(simd::Column);

// By counted bytes: all columns, those at rest included, or the active ones and their listing. A
// column at rest adds 0 * k to sums that begin at +0, which changes no bit.
bool reads_whole(const Rig& rig, std::uint32_t lod, std::span<const std::uint16_t> active,
                 const Workspace& work) noexcept {
  if (work.traversal == Traversal::kListed || rig.control_reads.empty()) return false;
  if (work.traversal == Traversal::kWhole) return true;
  const ControlReads* reads = rig.control_reads.data() + lod * (std::size_t{rig.control_count} + 1);
  const ControlReads& all = reads[rig.control_count];
  std::uint64_t values = 0, columns = 0;
  for (const std::uint16_t control : active) {
    values += reads[control].values;
    columns += reads[control].columns;
  }
  const std::uint64_t size = rig.is_half() ? 2 : 4;
  const std::uint64_t whole = (all.values - values) * size + all.columns * sizeof(simd::Column);
  return whole <= columns * kListed;
}

// By ascending control, so that sums have one order.
void list_active(const Rig& rig, std::uint32_t live, std::span<const std::uint16_t> active,
                 Workspace& work) noexcept {
  std::uint32_t* ends = work.column_ends.data();
  simd::Column* columns = work.columns.data();
  for (std::uint32_t i = 0; i < live; ++i) ends[i] = rig.joint_groups[i].columns_begin;
  for (const std::uint16_t control : active) {
    detail::for_columns(rig, control, live, [&](const JointColumn& column) {
      columns[ends[column.group]++] = {column.offset, control};
    });
  }
}

void mark_blocks(const Rig& rig, std::uint32_t lod, Workspace& work) noexcept {
  std::fill(work.live_blocks.begin(), work.live_blocks.end(), std::uint8_t{0});
  for (std::size_t i = 0; i < rig.live_groups[lod]; ++i) {
    const JointGroup& g = rig.joint_groups[i];
    if (work.column_ends[i] == g.columns_begin) continue;
    std::fill(work.live_blocks.begin() + g.blocks_begin, work.live_blocks.begin() + g.blocks_end,
              std::uint8_t{1});
  }
}

constexpr std::size_t kAhead = 2;

// Asks for the columns of a group while the group before is summed: listed ones lie all over the
// matrices, where the hardware does not see them coming.
void prefetch_columns(const Rig& rig, std::uint32_t lod, const Workspace& work,
                      std::size_t i) noexcept {
  if (i >= rig.live_groups[lod]) return;
  const std::size_t size = rig.is_half() ? 2 : 4;
  const std::size_t bytes = rig.joint_group_lods[i * rig.lod_count + lod] * size;
  const auto* values = rig.is_half() ? reinterpret_cast<const char*>(rig.joint_halves.data())
                                     : reinterpret_cast<const char*>(rig.joint_values.data());
  for (std::uint32_t c = rig.joint_groups[i].columns_begin; c < work.column_ends[i]; ++c) {
    const char* column = values + work.columns[c].offset * size;
    for (std::size_t at = 0; at < bytes; at += 64) simd::prefetch(column + at);
  }
}

// Blocks first up to end; the last one may be cut short. Extra pieces add to places that the first
// ones left at 0.
void place_blocks(const Rig& rig, std::uint32_t lod, std::size_t first, std::size_t end,
                  const float* rows, float* joints) noexcept {
  const std::size_t places = std::size_t{rig.joint_count} * rig.joint_stride,
                    whole = std::min(end, places / simd::kPlaces),
                    blocks = (places + simd::kPlaces - 1) / simd::kPlaces;
  const simd::Piece* pieces = rig.joint_pieces.data() + lod * blocks;
  rig.kernels->place(pieces + first, whole - first, rows, joints + first * simd::kPlaces);
  if (whole < end) {
    float last[simd::kPlaces];
    rig.kernels->place(pieces + whole, 1, rows, last);
    std::copy(last, last + places % simd::kPlaces, joints + whole * simd::kPlaces);
  }
  const auto extra = rig.extra_pieces.subspan(rig.extra_begins[lod],
                                              rig.extra_begins[lod + 1] - rig.extra_begins[lod]);
  const auto from = std::ranges::lower_bound(extra, first, {}, &simd::Piece::block);
  const auto to = std::ranges::lower_bound(extra, end, {}, &simd::Piece::block);
  if (from < to) {
    rig.kernels->place_more(&*from, static_cast<std::size_t>(to - from), rows, joints);
  }
}

}  // namespace

namespace detail {

const simd::Column* list_columns(const Rig& rig, std::uint32_t lod,
                                 std::span<const std::uint16_t> active, Workspace& work) noexcept {
  const std::uint32_t live = rig.live_groups[lod];
  const bool whole = reads_whole(rig, lod, active, work);
  if (whole) {
    ++work.whole_frames;
    for (std::uint32_t i = 0; i < live; ++i) {
      work.column_ends[i] = rig.joint_groups[i].columns_begin + rig.joint_groups[i].column_count;
    }
  } else {
    list_active(rig, live, active, work);
  }
  mark_blocks(rig, lod, work);
  return whole ? rig.group_columns.data() : work.columns.data();
}

bool shows(const JointGroup& g, const Workspace& work) noexcept {
  return g.blocks_begin < g.blocks_end && std::memchr(work.live_blocks.data() + g.blocks_begin, 1,
                                                      g.blocks_end - g.blocks_begin) != nullptr;
}

void place_rows(const Rig& rig, std::uint32_t lod, const Workspace& work, const float* rows,
                float* joints) noexcept {
  const auto begin = work.live_blocks.begin(), last = work.live_blocks.end();
  const std::size_t places = std::size_t{rig.joint_count} * rig.joint_stride;
  for (auto at = begin; at < last;) {
    const auto end = std::find(at, last, static_cast<std::uint8_t>(1 - *at));
    const auto from = static_cast<std::size_t>(at - begin),
               to = static_cast<std::size_t>(end - begin);
    if (*at == 0) {
      std::fill(joints + from * simd::kPlaces, joints + std::min(places, to * simd::kPlaces), 0.0f);
    } else {
      place_blocks(rig, lod, from, to, rows, joints);
    }
    at = end;
  }
}

void joint_groups(const Rig& rig, std::uint32_t lod, Workspace& work,
                  const PoseView& pose) noexcept {
  const simd::Column* columns =
      list_columns(rig, lod, {work.active.data(), work.active_count}, work);
  const bool scattered = columns == work.columns.data();
  for (std::size_t i = 0; scattered && i < kAhead; ++i) prefetch_columns(rig, lod, work, i);
  for (std::size_t i = 0; i < rig.live_groups[lod]; ++i) {
    if (scattered) prefetch_columns(rig, lod, work, i + kAhead);
    const JointGroup& g = rig.joint_groups[i];
    const std::uint32_t rows = rig.joint_group_lods[i * rig.lod_count + lod];
    if (rows == 0) continue;
    const std::size_t count = work.column_ends[i] - g.columns_begin;
    float* out = work.rows.data() + g.rows_begin;
    if (count == 0) {
      if (shows(g, work)) std::fill(out, out + rows, 0.0f);
    } else if (rig.is_half()) {
      rig.kernels->half_columns(rig.joint_halves.data(), columns + g.columns_begin, count,
                                pose.controls, out, rows);
    } else {
      rig.kernels->columns(rig.joint_values.data(), columns + g.columns_begin, count, pose.controls,
                           out, rows);
    }
  }
  place_rows(rig, lod, work, work.rows.data(), pose.joints);
}

}  // namespace detail

}  // namespace risorius::rig
