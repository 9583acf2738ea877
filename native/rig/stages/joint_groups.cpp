// SPDX-License-Identifier: MIT
// The stage that takes most of the time: joint attributes as sums of the columns of active
// controls. A control is active if it is not 0, a column has its coefficients in a joint group, a
// group is active if it has a column of an active control, and a block is 16 consecutive joint
// attributes.
#include <algorithm>
#include <bit>

#include "rig/stages/stages.h"

namespace risorius::rig {

namespace {

// Number of bytes that are read and written to list one column: the column is read in the list of
// its control, the end of its group's list is read and written, the column is written to that list,
// and the kernel reads it again.
constexpr std::uint64_t kListed =
    sizeof(JointColumn) + 2 * sizeof(std::uint32_t) + 2 * sizeof(simd::Column);

// The numbers of columns and values of the joint groups that an evaluation reads for the active
// controls. Only `columns` is counted if the rig has no control_reads.
ControlReads count_active(const Rig& rig, std::uint32_t lod,
                          std::span<const std::uint16_t> active) noexcept {
  ControlReads sum;
  if (rig.control_reads.empty()) {
    for (const std::uint16_t control : active) {
      sum.columns += rig.joint_column_begins[control + std::size_t{1}];
      sum.columns -= rig.joint_column_begins[control];
    }
    return sum;
  }
  const ControlReads* reads = rig.control_reads.data() + lod * (std::size_t{rig.control_count} + 1);
  for (const std::uint16_t control : active) {
    sum.values += reads[control].values;
    sum.columns += reads[control].columns;
  }
  return sum;
}

// Whether reading all columns moves fewer bytes than listing the active columns and reading only
// these. The sums are the same: a column of a control at 0 adds 0 * k to sums that begin at +0,
// which changes no bit.
bool whole_costs_less(const Rig& rig, std::uint32_t lod, const ControlReads& active) noexcept {
  const std::size_t stride = std::size_t{rig.control_count} + 1;
  const ControlReads& all = rig.control_reads[lod * stride + rig.control_count];
  const std::uint64_t rest = all.values - active.values, size = rig.is_half() ? 2 : 4;
  return rest * size + all.columns * sizeof(simd::Column) <= active.columns * kListed;
}

// Number of active columns per group from which on they are listed if the frame before had the same
// active controls, because the list will probably serve later frames too. In captures of a real
// face, with AVX2, an evaluation that uses the list takes 0.75 of the time of an evaluation that
// adds the columns one by one if 32 to 60 controls are active, and 1.1 to 1.2 of that time with
// fewer columns.
constexpr std::uint32_t kFewOfMany = 6;

// Chooses how the columns are visited. Columns that are added in the order of memory need no list
// and no kernel call for each group, but a sum is read and written with each column.
//
// Time of adding divided by the time of listing, measured on two faces: with AVX2 0.7 to 1.0 for 4
// to 60 columns per group, 0.93 to 1.04 for 77 to 149 columns of 106 rows, and 0.8 to 1.0 for 138
// to 295 columns of 80 rows. With float16, which halves the bytes of columns but not of sums,
// listing is faster from 64 columns on. With AVX-512, which keeps the sums of a group in registers,
// the quotient is 0.86 for one or two columns per group, 1.0 for 5, and 1.1 to 1.3 for 13 to 50.
// In: seen  whether the same controls were active in the previous frame, which added columns
Traversal way_of(const Rig& rig, std::uint32_t lod, std::span<const std::uint16_t> active,
                 bool seen, const Workspace& work) noexcept {
  const bool may_read_all = !rig.control_reads.empty();
  if (work.traversal == Traversal::kWhole && !may_read_all) return Traversal::kListed;
  if (work.traversal != Traversal::kCounted) return work.traversal;
  const ControlReads sum = count_active(rig, lod, active);
  if (may_read_all && whole_costs_less(rig, lod, sum)) return Traversal::kWhole;
  std::uint32_t few = rig.is_half() ? rig.kernels->few.halves : rig.kernels->few.floats;
  if (seen) few = std::min(few, kFewOfMany);
  const bool adds =
      few == simd::FewColumns::kAny || sum.columns < std::uint64_t{few} * rig.live_groups[lod];
  return adds ? Traversal::kAdded : Traversal::kListed;
}

// Lists the columns of each group by ascending control, so that sums always have the same order.
void list_active(const Rig& rig, std::uint32_t live, std::span<const std::uint16_t> active,
                 Workspace& work) noexcept {
  std::uint32_t* ends = work.column_ends.data();
  simd::Column* columns = work.columns.data();
  const std::uint32_t* begins = rig.joint_column_begins.data();
  const JointColumn* of_controls = rig.joint_columns.data();
  for (std::uint32_t i = 0; i < live; ++i) ends[i] = rig.joint_groups[i].columns_begin;
  for (const std::uint16_t control : active) {
    const JointColumn *at = of_controls + begins[control],
                      *end = of_controls + begins[control + std::size_t{1}];
    for (; at < end && at->group < live; ++at) {
      columns[ends[at->group]++] = {at->offset, control};
    }
  }
}

// Adds the columns of each active control to work.sums, by ascending control, the order in which
// listed columns are added.
void add_active(const Rig& rig, std::uint32_t lod, Workspace& work,
                const float* controls) noexcept {
  std::fill(work.moves.begin(), work.moves.end(), std::uint8_t{0});
  const simd::Sums sums{work.group_rows.data() + lod * rig.joint_groups.size(),
                        rig.live_groups[lod], work.sums.data(), work.moves.data()};
  for (std::size_t a = 0; a < work.active_count; ++a) {
    const std::uint16_t control = work.active[a];
    const std::uint32_t begin = rig.joint_column_begins[control];
    const std::size_t n = rig.joint_column_begins[control + std::size_t{1}] - begin;
    const JointColumn* columns = rig.joint_columns.data() + begin;
    if (rig.is_half()) {
      rig.kernels->add_half_columns(rig.joint_halves.data(), columns, n, controls[control], sums);
    } else {
      rig.kernels->add_columns(rig.joint_values.data(), columns, n, controls[control], sums);
    }
  }
}

// Sets the sums of active groups to 0.
void clear_sums(const Rig& rig, std::uint32_t lod, Workspace& work) noexcept {
  const simd::Rows* rows = work.group_rows.data() + lod * rig.joint_groups.size();
  for (std::size_t n = 0; n < work.live_count; ++n) {
    const simd::Rows& run = rows[work.live[n]];
    std::fill_n(work.sums.begin() + run.begin, run.count, 0.0f);
  }
}

// Calls f(word, bits) for each 64-bit word that contains bits from begin up to end, with these bits
// set, until f returns false.
template <class F>
void for_words(std::uint32_t begin, std::uint32_t end, F f) noexcept {
  for (std::uint32_t at = begin; at < end;) {
    const std::uint32_t next = std::min(end, (at | 63) + 1);
    const std::uint64_t bits = (~std::uint64_t{0} >> (64 - (next - at))) << (at & 63);
    if (!f(at / 64, bits)) return;
    at = next;
  }
}

// Whether a group writes into a block that an active group also writes. The rows of such a group
// are also copied to joint attributes, and must be 0 if the group is not active.
bool shows(const JointGroup& g, const Workspace& work) noexcept {
  bool live = false;
  for_words(g.blocks_begin, g.blocks_end, [&](std::size_t word, std::uint64_t bits) {
    return !(live = (work.live_blocks[word] & bits) != 0);
  });
  return live;
}

// The first of `count` bits, from `at` on, whose value is not `value`; `count` if there is none.
// In: word(i)  the i-th 64 bits
template <class Word>
std::size_t find_other(std::size_t at, std::size_t count, bool value, Word word) noexcept {
  const std::uint64_t flip = value ? ~std::uint64_t{0} : 0;
  std::uint64_t past = ~std::uint64_t{0} << (at % 64);
  for (std::size_t w = at / 64; w * 64 < count; ++w, past = ~std::uint64_t{0}) {
    const std::uint64_t bits = (word(w) ^ flip) & past;
    if (bits != 0) return std::min(count, w * 64 + std::size_t(std::countr_zero(bits)));
  }
  return count;
}

// Calls f(first, end) for each run of set bits among the first `count` bits.
template <class Word, class F>
void for_runs(std::size_t count, Word word, F f) noexcept {
  for (std::size_t at = 0, end = 0; (at = find_other(end, count, false, word)) < count;) {
    end = find_other(at, count, true, word);
    f(at, end);
  }
}

// Marks the blocks that active groups write, and lists all groups that write into these blocks.
void mark_blocks(const Rig& rig, std::uint32_t lod, Workspace& work) noexcept {
  std::fill(work.live_blocks.begin(), work.live_blocks.end(), 0u);
  const std::uint32_t live = rig.live_groups[lod];
  for (std::uint32_t i = 0; i < live; ++i) {
    const JointGroup& g = rig.joint_groups[i];
    if (work.moves[i] == 0) continue;
    for_words(g.blocks_begin, g.blocks_end, [&](std::size_t word, std::uint64_t bits) {
      work.live_blocks[word] |= bits;
      return true;
    });
  }
  std::uint32_t n = 0;
  const std::uint32_t* rows = rig.joint_group_lods.data() + lod;
  for (std::uint32_t i = 0; i < live; ++i, rows += rig.lod_count) {
    const JointGroup& g = rig.joint_groups[i];
    const bool moves = work.moves[i] != 0 || shows(g, work);
    if (moves && *rows > 0) work.live[n++] = i;
  }
  work.live_count = n;
}

// Lists columns and marks blocks.
// In:  way   kListed or kWhole
// Out: work  column_ends, moves, columns and the marked blocks
void list(const Rig& rig, std::uint32_t lod, Traversal way, std::span<const std::uint16_t> active,
          Workspace& work) noexcept {
  const std::uint32_t live = rig.live_groups[lod];
  if (way == Traversal::kListed) {
    list_active(rig, live, active, work);
  } else {
    for (std::uint32_t i = 0; i < live; ++i) {
      work.column_ends[i] = rig.joint_groups[i].columns_begin + rig.joint_groups[i].column_count;
    }
  }
  for (std::uint32_t i = 0; i < live; ++i) {
    work.moves[i] = work.column_ends[i] != rig.joint_groups[i].columns_begin ? 1 : 0;
  }
  mark_blocks(rig, lod, work);
  work.listed = way;
  work.listed_for.keep(rig, lod, active);
}

// Chooses the traversal, and lists the columns of the active controls, unless the traversal is
// kAdded, which needs no list, or the lists of the frame before are still valid.
// In:  may_add  kAdded may be chosen
// Out: the chosen traversal; same  the frame before had the same active controls and traversal
Traversal prepare(const Rig& rig, std::uint32_t lod, std::span<const std::uint16_t> active,
                  bool may_add, Workspace& work, bool& same) noexcept {
  const bool kept = work.listed_for.are(rig, lod, active);
  const bool added = kept && work.listed == Traversal::kAdded;
  const bool asked = work.traversal == Traversal::kCounted || work.traversal == work.listed;
  same = kept && !added && asked;
  if (same) return work.listed;
  const Traversal way = way_of(rig, lod, active, added, work);
  same = added && way == Traversal::kAdded;
  if (way == Traversal::kAdded && may_add) return way;
  list(rig, lod, way == Traversal::kWhole ? way : Traversal::kListed, active, work);
  return work.listed;
}

const simd::Column* listed_columns(const Rig& rig, Workspace& work) noexcept {
  if (work.listed == Traversal::kListed) return work.columns.data();
  ++work.whole_frames;
  return rig.group_columns.data();
}

// Copies rows to runs of blocks of one LOD, for all frames. The runs must be in ascending order.
class Placer {
 public:
  Placer(const Rig& rig, std::uint32_t lod, const float* rows, float* joints, std::size_t frames)
      : rig_(rig),
        places_(std::size_t{rig.joint_count} * rig.joint_stride),
        frames_{rows, detail::rows_size(rig), joints, places_, frames},
        pieces_(rig.joint_pieces.data() + lod * blocks()),
        extra_(rig.extra_pieces.data() + rig.extra_begins[lod]),
        extra_end_(rig.extra_pieces.data() + rig.extra_begins[lod + 1]) {}

  std::size_t blocks() const { return (places_ + simd::kPlaces - 1) / simd::kPlaces; }
  // Copies the rows of blocks [first, end). Extra pieces fill attributes that the first pieces set
  // to 0.
  void place(std::size_t first, std::size_t end) noexcept {
    const std::size_t whole = std::min(end, places_ / simd::kPlaces);
    simd::PlacedFrames frames = frames_;
    frames.to += first * simd::kPlaces;
    rig_.kernels->place(pieces_ + first, whole - first, frames);
    const simd::Piece* from = extra_before(first);
    const simd::Piece* to = extra_before(whole);
    if (from < to) {
      rig_.kernels->place_more(from, static_cast<std::size_t>(to - from), frames_);
    }
    for (std::size_t f = 0; f < frames_.count && whole < end; ++f) place_last(whole, f);
  }
  void rest(std::size_t first, std::size_t end) noexcept {
    for (std::size_t f = 0; f < frames_.count; ++f) {
      float* joints = frames_.to + f * places_;
      std::fill(joints + first * simd::kPlaces, joints + std::min(places_, end * simd::kPlaces),
                0.0f);
    }
  }

 private:
  // The first extra piece whose block is not before `block`. The search begins at the result of the
  // last call, with steps that double.
  const simd::Piece* extra_before(std::size_t block) noexcept {
    std::ptrdiff_t step = 1;
    const simd::Piece* from = extra_;
    while (step < extra_end_ - from && from[step].block < block) {
      from += step;
      step *= 2;
    }
    extra_ = std::ranges::lower_bound(from, std::min(from + step + 1, extra_end_), block, {},
                                      &simd::Piece::block);
    return extra_;
  }
  // Copies the rows of the last block if it is incomplete, through a temporary block of full size,
  // because the memory after the block must not be written.
  void place_last(std::size_t block, std::size_t frame) noexcept {
    float last[simd::kPlaces];
    const simd::PlacedFrames one{frames_.from + frame * frames_.from_stride, 0, last, 0, 1};
    rig_.kernels->place(pieces_ + block, 1, one);
    for (const simd::Piece* extra = extra_; extra < extra_end_; ++extra) {
      const simd::Piece more{extra->from, extra->mask, 0};
      rig_.kernels->place_more(&more, 1, one);
    }
    std::copy_n(last, places_ % simd::kPlaces,
                frames_.to + frame * places_ + block * simd::kPlaces);
  }

  const Rig& rig_;
  std::size_t places_;
  simd::PlacedFrames frames_;
  const simd::Piece* pieces_;
  const simd::Piece *extra_, *extra_end_;
};

}  // namespace

namespace detail {

const simd::Column* list_columns(const Rig& rig, std::uint32_t lod,
                                 std::span<const std::uint16_t> active, Workspace& work) noexcept {
  bool same = false;
  prepare(rig, lod, active, false, work, same);
  return listed_columns(rig, work);
}

void place_rows(const Rig& rig, std::uint32_t lod, Workspace& work, const float* rows,
                float* joints, std::size_t frames) noexcept {
  Placer placer(rig, lod, rows, joints, frames);
  const std::size_t blocks = placer.blocks();
  const auto live = [&](std::size_t w) { return work.live_blocks[w]; };
  for_runs(blocks, live, [&](std::size_t first, std::size_t end) { placer.place(first, end); });
  const auto rest = [&](std::size_t first, std::size_t end) { placer.rest(first, end); };
  if (work.shown_blocks.empty()) {
    for_runs(blocks, [&](std::size_t w) { return ~live(w); }, rest);
  } else {
    for_runs(blocks, [&](std::size_t w) { return work.shown_blocks[w] & ~live(w); }, rest);
    std::ranges::copy(work.live_blocks, work.shown_blocks.begin());
  }
}

namespace {

// Sums the listed columns of each group. Out: work.rows
void sum_listed(const Rig& rig, std::uint32_t lod, Workspace& work,
                const float* controls) noexcept {
  const simd::Column* columns = listed_columns(rig, work);
  for (std::size_t n = 0; n < work.live_count; ++n) {
    const std::uint32_t i = work.live[n];
    const JointGroup& g = rig.joint_groups[i];
    const std::uint32_t rows = rig.joint_group_lods[i * std::size_t{rig.lod_count} + lod];
    const std::size_t count = work.column_ends[i] - g.columns_begin;
    float* out = work.rows.data() + g.rows_begin;
    if (count == 0) {
      std::fill(out, out + rows, 0.0f);
    } else if (rig.is_half()) {
      rig.kernels->half_columns(rig.joint_halves.data(), columns + g.columns_begin, count, controls,
                                out, rows);
    } else {
      rig.kernels->columns(rig.joint_values.data(), columns + g.columns_begin, count, controls, out,
                           rows);
    }
  }
}

}  // namespace

void joint_groups(const Rig& rig, std::uint32_t lod, Workspace& work,
                  const PoseView& pose) noexcept {
  const std::span<const std::uint16_t> active(work.active.data(), work.active_count);
  bool same = false;
  if (prepare(rig, lod, active, true, work, same) == Traversal::kAdded) {
    ++work.added_frames;
    add_active(rig, lod, work, pose.controls);
    if (!same) {
      mark_blocks(rig, lod, work);
      work.listed = Traversal::kAdded;
      work.listed_for.keep(rig, lod, active);
    }
    place_rows(rig, lod, work, work.sums.data(), pose.joints, 1);
    clear_sums(rig, lod, work);
  } else {
    sum_listed(rig, lod, work, pose.controls);
    place_rows(rig, lod, work, work.rows.data(), pose.joints, 1);
  }
}

}  // namespace detail

}  // namespace risorius::rig
