// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>

#include "rig/rig.h"

namespace risorius::rig {

namespace {

using core::ErrorCode;
using core::fail;
using core::Result;
using core::Status;

constexpr std::size_t kAlignment = 64, kArrays = 28;
constexpr char kMagic[8] = {'R', 'S', 'R', 'I', 'G', 0, 0, 1};  // the last one: the version
constexpr std::uint32_t kByteOrder = 0x01020304;

struct Place {
  std::uint64_t offset = 0, count = 0;
};

struct BlockHeader {
  char magic[8];
  std::uint32_t byte_order, header_size;
  std::uint64_t size, hash;  // the hash of everything behind it
  RigHeader rig;
  Place places[kArrays];
};

std::size_t aligned(std::size_t n) { return (n + kAlignment - 1) / kAlignment * kAlignment; }

// Four lanes of multiply and rotate, as fast as memory. Finds damage, not intent.
std::uint64_t hash(std::span<const std::uint8_t> bytes) {
  constexpr std::uint64_t kFactor = 0x9E3779B97F4A7C15u;
  std::uint64_t lanes[4] = {1, 2, 3, bytes.size()};
  std::size_t i = 0;
  for (; i + 32 <= bytes.size(); i += 32) {
    for (int l = 0; l < 4; ++l) {
      std::uint64_t word;
      std::memcpy(&word, bytes.data() + i + 8 * l, 8);
      lanes[l] = std::rotl((lanes[l] ^ word) * kFactor, 29);
    }
  }
  for (; i < bytes.size(); ++i) lanes[i % 4] = (lanes[i % 4] ^ bytes[i]) * kFactor;
  std::uint64_t all = 0;
  for (const std::uint64_t lane : lanes) all = std::rotl((all ^ lane) * kFactor, 31);
  return all ^ (all >> 32);
}

std::span<const std::uint8_t> hashed_part(std::span<const std::uint8_t> block) {
  return block.subspan(offsetof(BlockHeader, rig));
}

Status damaged(const std::string& where, const std::string& message) {
  return fail(ErrorCode::kInvalidValue, "rig." + where, message);
}

// Indices of one array against the size of another.
class IndexCheck {
 public:
  template <class T, class Get>
  void below(const char* where, const T& values, std::uint64_t limit, Get get) {
    std::uint64_t most = 0;
    for (const auto& v : values) most = std::max<std::uint64_t>(most, get(v));
    if (!values.empty() && most >= limit && where_ == nullptr) where_ = where;
  }
  void below(const char* where, View<std::uint16_t> values, std::uint64_t limit) {
    below(where, values, limit, [](std::uint16_t v) { return v; });
  }
  /// begins[0] = 0, never falling, the last one is the size of what it begins in.
  void begins(const char* where, View<std::uint32_t> values, std::size_t size) {
    demand(where, std::ranges::is_sorted(values) && (values.empty() || values.back() == size));
  }
  void demand(const char* where, bool holds) {
    if (!holds && where_ == nullptr) where_ = where;
  }
  Status status() const {
    if (where_ == nullptr) return core::ok();
    return fail(ErrorCode::kInvalidIndex, std::string("rig.") + where_,
                "a number in it points outside what it counts in");
  }

 private:
  const char* where_ = nullptr;
};

void check_sizes(const Rig& r, IndexCheck& c) {
  const std::uint64_t lods = r.lod_count;
  c.demand("header", std::uint64_t{r.raw_count} + r.psd_count <= r.control_count &&
                         r.control_count <= 65536 && r.joint_count <= 65536 &&
                         r.blend_shape_count <= 65536 && r.animated_map_count <= 65536);
  c.demand("text_ends", r.text_ends.size() >= std::uint64_t{r.raw_count} + r.gui_count);
  c.begins("text_ends", r.text_ends, r.text.size());
  c.demand("neutral_joints", r.neutral_joints.size() == std::uint64_t{r.joint_count} * 9);
  c.demand("psds", r.psds.size() <= 65536);
  c.demand("watch_begins", r.watch_begins.size() == lods * (r.control_count + 1));
  c.demand("chained_begins", r.chained_begins.size() == lods + 1);
  c.demand("joint_group_lods", r.joint_group_lods.size() == lods * r.joint_groups.size());
  c.demand("joint_values", r.joint_values.empty() || r.joint_halves.empty());
  c.demand("joint_column_begins", r.joint_column_begins.size() == r.control_count + std::size_t{1});
  c.demand("shape_outputs", r.shape_outputs.size() == r.shape_inputs.size());
  c.demand("shape_lods", r.shape_lods.empty() || r.shape_lods.size() == lods);
  c.demand("map_lods", r.map_lods.empty() || r.map_lods.size() == lods);
  for (const std::uint8_t axis : r.euler.order) c.demand("header", axis < 3);
}

void check_correctives(const Rig& r, IndexCheck& c) {
  c.below("psd_factors", r.psd_factors, r.control_count);
  c.below("watched", r.watched, r.psds.size(), [](const Watch& w) { return w.psd; });
  c.below("watched", r.watched, r.control_count, [](const Watch& w) { return w.other; });
  c.below("chained", r.chained, r.psds.size());
  c.begins("watch_begins", r.watch_begins, r.watched.size());
  c.begins("chained_begins", r.chained_begins, r.chained.size());
  for (const Psd& p : r.psds) {
    c.demand("psds", p.output >= r.raw_count && p.output < r.raw_count + r.psd_count &&
                         std::uint64_t{p.factors_begin} + p.factor_count <= r.psd_factors.size());
  }
}

void check_groups(const Rig& r, IndexCheck& c) {
  const std::uint64_t values = r.is_half() ? r.joint_halves.size() : r.joint_values.size();
  c.below("joint_outputs", r.joint_outputs, std::uint64_t{r.joint_count} * 9);
  c.below("joints_written", r.joints_written, r.joint_count);
  c.begins("joint_column_begins", r.joint_column_begins, r.joint_columns.size());
  std::vector<std::uint32_t> columns(r.joint_groups.size());
  for (const JointColumn& column : r.joint_columns) {
    if (column.group >= columns.size()) return c.demand("joint_columns", false);
    ++columns[column.group];
    const std::uint64_t end =
        column.offset + simd::rounded_up(r.joint_groups[column.group].row_count);
    c.demand("joint_columns", end <= values);
  }
  std::uint64_t lists = 0;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const JointGroup& g = r.joint_groups[i];
    c.demand("joint_groups",
             g.columns_begin == lists && columns[i] == g.column_count &&
                 std::uint64_t{g.rows_begin} + g.row_count <= r.joint_outputs.size());
    lists += g.column_count;
    for (std::uint32_t l = 0; l < r.lod_count; ++l) {
      c.demand("joint_group_lods", r.joint_group_lods[i * r.lod_count + l] <= g.row_count);
    }
  }
  c.demand("header", lists == r.list_count);
}

void check_pieces(const Rig& r, IndexCheck& c) {
  const std::uint64_t places = std::uint64_t{r.joint_count} * 9;
  const std::uint64_t blocks = (places + simd::kPlaces - 1) / simd::kPlaces;
  const std::uint32_t last = places % simd::kPlaces == 0 ? 0xFFFFu : (1u << (places % 16)) - 1u;
  c.demand("joint_pieces", r.joint_pieces.size() == blocks * r.lod_count);
  c.demand("extra_begins", r.extra_begins.size() == r.lod_count + std::size_t{1});
  c.begins("extra_begins", r.extra_begins, r.extra_pieces.size());
  for (const auto& [where, pieces] :
       {std::pair{"joint_pieces", r.joint_pieces}, std::pair{"extra_pieces", r.extra_pieces}}) {
    for (const simd::Piece& p : pieces) {
      const auto taken = static_cast<std::uint64_t>(std::popcount(p.mask));
      c.demand(where, p.from + taken <= r.joint_outputs.size());
    }
  }
  for (const simd::Piece& p : r.extra_pieces) {
    c.demand("extra_pieces", p.block < blocks && (p.block + 1u < blocks || (p.mask & ~last) == 0));
  }
}

void check_quaternions(const Rig& r, IndexCheck& c) {
  c.below("quaternion_terms", r.quaternion_terms, r.control_count,
          [](const QuaternionTerm& t) { return t.control; });
  for (const QuaternionJoint& q : r.quaternion_joints) {
    c.demand("quaternion_joints", q.joint < r.joint_count && q.group < r.joint_groups.size() &&
                                      q.terms_begin <= q.terms_end &&
                                      q.terms_end <= r.quaternion_terms.size());
  }
}

void check_table(const char* where, View<ConditionalRow> rows, std::uint64_t inputs,
                 std::uint64_t outputs, IndexCheck& c) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    c.demand(where, rows[i].input < inputs && rows[i].output < outputs && rows[i].run_end > i &&
                        rows[i].run_end <= rows.size());
  }
}

Status check_everything(const Rig& r) {
  IndexCheck c;
  check_sizes(r, c);
  if (Status sizes = c.status(); !sizes) return sizes;
  check_correctives(r, c);
  check_groups(r, c);
  check_pieces(r, c);
  check_quaternions(r, c);
  c.below("shape_inputs", r.shape_inputs, r.control_count);
  c.below("shape_outputs", r.shape_outputs, r.blend_shape_count);
  const auto most = [](std::uint32_t v) { return v; };
  c.below("shape_lods", r.shape_lods, r.shape_inputs.size() + 1, most);
  c.below("map_lods", r.map_lods, r.map_rows.size() + 1, most);
  check_table("gui_rows", r.gui_rows, r.gui_count, r.raw_count, c);
  check_table("map_rows", r.map_rows, r.control_count, r.animated_map_count, c);
  return c.status();
}

Status check_header(std::span<const std::uint8_t> bytes, const BlockHeader& h) {
  if (std::memcmp(h.magic, kMagic, sizeof(kMagic)) != 0) {
    return damaged("magic", "these bytes are no compiled face of this version");
  }
  if (h.byte_order != kByteOrder || h.header_size != sizeof(BlockHeader)) {
    return damaged("byte_order", "compiled on a machine of another kind");
  }
  if (h.size != bytes.size()) {
    return damaged("size", std::to_string(h.size) + " bytes were expected, there are " +
                               std::to_string(bytes.size()));
  }
  return core::ok();
}

}  // namespace

struct BlockReader {
  static Result<Rig> read(std::span<const std::uint8_t> bytes, std::shared_ptr<const void> owner) {
    BlockHeader h;
    if (bytes.size() < sizeof(h)) return fail(ErrorCode::kInvalidValue, "rig.size", "no header");
    std::memcpy(&h, bytes.data(), sizeof(h));
    if (Status s = check_header(bytes, h); !s) return std::move(s).propagate();
    Rig rig;
    static_cast<RigHeader&>(rig) = h.rig;
    std::size_t i = 0;
    bool inside = true;
    for_each_array(rig, [&](auto& view) {
      using T = std::remove_const_t<typename std::remove_reference_t<decltype(view)>::element_type>;
      const Place p = h.places[i++];
      const bool fits = p.offset % kAlignment == 0 && p.offset <= bytes.size() &&
                        p.count <= (bytes.size() - p.offset) / sizeof(T);
      inside = inside && fits;
      if (fits) view = {reinterpret_cast<const T*>(bytes.data() + p.offset), p.count};
    });
    if (!inside) return fail(ErrorCode::kInvalidIndex, "rig.places", "an array outside the block");
    rig.block_ = bytes;
    rig.owner_ = std::move(owner);
    return rig;
  }
};

Result<Rig> open_rig(std::span<const std::uint8_t> bytes, std::shared_ptr<const void> owner,
                     BlockCheck check, const simd::Kernels& kernels) {
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % kAlignment != 0) {
    return fail(ErrorCode::kInvalidArgument, "rig", "the bytes must be aligned to 64");
  }
  auto rig = BlockReader::read(bytes, std::move(owner));
  if (!rig) return rig;
  rig->kernels = &kernels;
  if (check == BlockCheck::kHeader) return rig;
  BlockHeader h;
  std::memcpy(&h, bytes.data(), sizeof(h));
  if (h.hash != hash(hashed_part(bytes))) {
    return fail(ErrorCode::kInvalidValue, "rig.hash", "the bytes were changed or cut");
  }
  if (Status s = check_everything(*rig); !s) return std::move(s).propagate();
  return rig;
}

void seal_block(std::span<std::uint8_t> bytes) {
  const std::uint64_t value = hash(hashed_part(bytes));
  std::memcpy(bytes.data() + offsetof(BlockHeader, hash), &value, sizeof(value));
}

Result<Rig> make_rig(const RigData& data, const simd::Kernels& kernels) {
  BlockHeader h{};
  std::copy(std::begin(kMagic), std::end(kMagic), h.magic);
  h.byte_order = kByteOrder;
  h.header_size = sizeof(BlockHeader);
  h.rig = data;
  std::size_t size = aligned(sizeof(BlockHeader)), i = 0;
  for_each_array(data, [&](const auto& array) {
    h.places[i++] = {size, array.size()};
    size = aligned(size + array.size() * sizeof(array[0]));
  });
  h.size = size;
  const std::shared_ptr<std::uint8_t> block = core::allocate_pages(size);
  if (block == nullptr) return fail(ErrorCode::kLimitExceeded, "rig", "no memory");
  const std::span<std::uint8_t> bytes(block.get(), size);
  i = 0;
  for_each_array(data, [&](const auto& array) {
    const std::size_t length = array.size() * sizeof(array[0]);
    if (length > 0) std::memcpy(bytes.data() + h.places[i].offset, array.data(), length);
    ++i;
  });
  std::memcpy(bytes.data(), &h, sizeof(h));
  seal_block(bytes);
  return open_rig(bytes, block, BlockCheck::kHeader, kernels);
}

}  // namespace risorius::rig
