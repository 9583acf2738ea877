// SPDX-License-Identifier: MIT
// Reads the fields of DNA layers from bytes. With a plan of the LODs to keep, it skips elements
// that no kept LOD uses.
#include "dna/file/layer_reader.h"

#include <algorithm>

namespace risorius::dna::detail {

using bytes::Field;
using core::Buffer;
using core::ErrorCode;
using core::List;
using core::PlanarArray;

// Reads a list of vectors, which is stored as two or three planes. The file has a count before each
// plane, and the counts must be equal.
template <std::size_t kPlanes>
PlanarArray<kPlanes> LayerReader::planes() {
  const std::uint64_t first = r_.position();
  const std::uint32_t n = r_.count(4);
  if (std::uint64_t{n} * 4 * kPlanes > r_.left()) {
    r_.fail_at(first, ErrorCode::kInvalidCount,
               std::to_string(n) + " vectors need more bytes than are left");
  }
  if (r_.failed()) return {};
  Buffer<float> values(std::size_t{n} * kPlanes);
  r_.read_f32(values.data(), n, &known.finite);
  for (std::size_t p = 1; p < kPlanes && !r_.failed(); ++p) {
    const std::uint64_t at = r_.position();
    const std::uint32_t m = r_.count(4);
    if (m != n && !r_.failed()) {
      r_.fail_at(at, ErrorCode::kInvalidLength,
                 "coordinate list " + std::to_string(p) + " has " + std::to_string(m) +
                     " values, the first has " + std::to_string(n));
    }
    if (!r_.failed()) r_.read_f32(values.data() + p * n, n, &known.finite);
  }
  if (r_.failed()) return {};
  return {std::move(values)};
}

template PlanarArray<2> LayerReader::planes<2>();
template PlanarArray<3> LayerReader::planes<3>();

std::vector<bool> LayerReader::wanted(const List<Mesh>*, const LodMapping*, std::size_t n) const {
  std::vector<bool> keep(n, true);
  if (plan == nullptr) return keep;
  for (std::size_t i = 0; i < n; ++i) keep[i] = plan->meshes.keeps(i);
  return keep;
}

template <class T>
std::vector<bool> LayerReader::wanted(const List<T>*, const LodMapping* mapping,
                                      std::size_t n) const {
  if (plan == nullptr) return std::vector<bool>(n, true);
  std::vector<bool> keep = needed(*plan, *mapping, n);
  if (operations != nullptr) add_networks_of_operations(*plan, *operations, keep);
  return keep;
}

// Reads a list whose elements begin with their size or end, and skips elements that no kept LOD
// uses. Skipped elements are empty in the list until apply() in lods.cpp removes them.
template <class T>
void LayerReader::sized(Name name, List<T>& v, const LodMapping* mapping) {
  const std::uint64_t layer_end = r_.end();
  std::vector<T> items;
  std::uint32_t n = 0;
  {
    Field field(r_, name.dna);
    note(r_.position());
    n = r_.count(4 + empty_size<T>());
  }
  items.resize(r_.failed() ? 0 : n);
  const std::vector<bool> keep = wanted(&v, mapping, items.size());
  for (std::uint32_t i = 0; i < items.size() && !r_.failed(); ++i) {
    Field item(r_, name.dna, i);
    const std::uint64_t at = r_.position();
    note(at);
    // If elements may be skipped, only the 4 bytes of the size are made available first; a
    // truncated file may have fewer.
    if (plan != nullptr) r_.enter(at, std::min<std::uint64_t>(4, r_.left()));
    const std::uint32_t mark = r_.u32();
    if (r_.failed()) break;
    const bool is_size = mesh_sizes || !std::is_same_v<T, Mesh>;
    const std::uint64_t end = is_size ? r_.position() + mark : mark;
    if (end < r_.position() || end > layer_end) {
      r_.fail_at(at, ErrorCode::kTruncated,
                 "the element claims to end at byte " + std::to_string(end) +
                     ", its layer ends at byte " + std::to_string(layer_end));
      break;
    }
    if (keep[i]) {
      r_.enter(r_.position(), end - r_.position());
      describe(*this, items[i]);
    }
    if (!r_.failed()) r_.enter(end, layer_end - end);
  }
  v = std::move(items);
}

template void LayerReader::sized(Name, List<Mesh>&, const LodMapping*);
template void LayerReader::sized(Name, List<NeuralNetwork>&, const LodMapping*);
template void LayerReader::sized(Name, List<RbfSolver>&, const LodMapping*);

void LayerReader::setups(Name name, List<TwistSwingSetup>& v, bool twist) {
  Field field(r_, name.dna);
  note(r_.position());
  std::vector<TwistSwingSetup> items(r_.count(empty_size<TwistSwingSetup>()));
  for (std::size_t i = 0; i < items.size() && !r_.failed(); ++i) {
    Field item(r_, "", static_cast<std::int64_t>(i));
    note(r_.position());
    describe_setup(*this, items[i], twist);
  }
  v = std::move(items);
}

void LayerReader::matrix(Name name, JointGroup& g) {
  Field field(r_, name.dna);
  note(r_.position(), 4);
  if (plan == nullptr) {
    g.values = r_.f32_list(&known.finite);
    return;
  }
  const std::uint64_t at = r_.position();
  const std::uint32_t n = r_.count(4);
  const std::size_t columns = g.input_indices.size(), rows = g.output_indices.size();
  if (n != rows * columns && !r_.failed()) {
    r_.fail_at(at, ErrorCode::kInvalidLength,
               std::to_string(n) + " values, but " + std::to_string(rows) + " rows of " +
                   std::to_string(columns));
  }
  if (r_.failed()) return;
  Buffer<float> values(cut_rows(*plan, g) * columns);
  r_.read_f32(values.data(), values.size(), &known.finite);
  r_.skip(std::uint64_t{4} * (n - values.size()));
  if (!r_.failed()) g.values = std::move(values);
}

namespace {

// Makes room for the `more` values of element i of n. If the memory is too small it grows to the
// size that n elements would need if all were like the first i + 1, but never beyond the bytes left
// in the file.
template <class T>
void extend(Buffer<T>& values, std::size_t more, std::uint32_t i, std::uint32_t n,
            std::uint64_t bytes_left) {
  const std::uint64_t size = values.size() + more;
  if (size > values.capacity()) {
    const std::uint64_t likely = std::max(size * n / (i + 1), size + size / 4);
    values.reserve(static_cast<std::size_t>(std::min(likely, size + bytes_left / sizeof(T))));
  }
  values.resize(static_cast<std::size_t>(size));
}

}  // namespace

// Reads the faces as one flat list of corners and offsets, which needs no allocation per face.
void LayerReader::faces(Mesh& m) {
  Field field(r_, "faces");
  note(r_.position());
  const std::uint32_t n = r_.count(4);
  if (n == 0) return;
  Buffer<std::uint32_t> offsets(std::size_t{n} + 1), layouts;
  offsets[0] = 0;
  for (std::uint32_t i = 0; i < n && !r_.failed(); ++i) {
    const std::uint32_t corners = r_.count(4);
    extend(layouts, corners, i, n, r_.left());
    r_.read_u32(layouts.data() + offsets[i], corners);
    offsets[i + 1] = offsets[i] + corners;
  }
  if (r_.failed()) return;
  m.face_offsets = std::move(offsets);
  m.face_layouts = std::move(layouts);
}

void LayerReader::skin(Mesh& m) {
  Field field(r_, "skin_weights");
  note(r_.position());
  const std::uint32_t n = r_.count(8);
  if (n == 0) return;
  Buffer<std::uint32_t> offsets(std::size_t{n} + 1);
  Buffer<float> weights;
  Buffer<std::uint16_t> joints;
  offsets[0] = 0;
  for (std::uint32_t i = 0; i < n && !r_.failed(); ++i) {
    const std::uint64_t at = r_.position();
    const std::uint32_t begin = offsets[i], influences = r_.count(4);
    extend(weights, influences, i, n, r_.left());
    r_.read_f32(weights.data() + begin, influences, &known.finite);
    const std::uint32_t joint_count = r_.count(2);
    if (influences != joint_count && !r_.failed()) {
      Field item(r_, "", i);
      r_.fail_at(at, ErrorCode::kInvalidLength,
                 std::to_string(influences) + " weights, but " + std::to_string(joint_count) +
                     " joint indices");
    }
    if (r_.failed()) return;
    extend(joints, influences, i, n, r_.left());
    r_.read_u16(joints.data() + begin, influences);
    std::size_t kept = influences;
    if (plan != nullptr) kept = cut_vertex(weights.data() + begin, joints.data() + begin, kept);
    weights.resize(begin + kept);
    joints.resize(begin + kept);
    offsets[i + 1] = static_cast<std::uint32_t>(begin + kept);
  }
  if (r_.failed()) return;
  m.skin_offsets = std::move(offsets);
  m.skin_weights = std::move(weights);
  m.skin_joint_indices = std::move(joints);
}

// Removes the influences of dropped joints from the vertex that was just read. A joint index that
// is out of range makes the byte reader fail. Out: number of influences left, 0 after a failure
std::size_t LayerReader::cut_vertex(float* weights, std::uint16_t* joints, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    if (joints[i] < plan->joints.size() || r_.failed()) continue;
    r_.fail_at(r_.position() - 2 * (n - i), ErrorCode::kInvalidIndex,
               "joint index " + std::to_string(joints[i]) + ", but there are " +
                   std::to_string(plan->joints.size()) + " joints");
  }
  return r_.failed() ? 0 : cut_influences(*plan, weights, joints, n, &known.finite);
}

// A channel that does not exist counts as wanted, so that the check of indices reports it.
bool LayerReader::channel_is_wanted(std::uint16_t channel) const {
  const IndexMap& channels = plan->blend_shape_channels;
  return channel >= channels.size() || channels.keeps(channel);
}

// Reads ahead the channel index at the end of a blend shape target. It assumes first that all lists
// are as long as the first one. If the channel found there is not wanted, the lists are skipped one
// by one to the true end. Out: true: the reader is at the beginning of the target again; false: it
// is behind the target, or has failed
bool LayerReader::target_is_wanted() {
  const std::uint64_t begin = r_.position();
  const auto go_back = [&] { return r_.enter(begin, r_.end() - begin); };
  const std::uint64_t n = r_.count(4);
  const std::optional<std::uint16_t> likely = r_.peek_u16(begin + 16 + 16 * n);
  go_back();
  if (likely && channel_is_wanted(*likely)) return true;
  for (int l = 0; l < 4; ++l) r_.skip(std::uint64_t{4} * r_.count(4));
  const std::uint16_t channel = r_.u16();
  return !r_.failed() && channel_is_wanted(channel) && go_back();
}

void LayerReader::targets(Mesh& m) {
  if (!blend_shapes) return;
  Field field(r_, "blend_shape_targets");
  note(r_.position());
  const std::uint32_t n = r_.count(empty_size<BlendShapeTarget>());
  std::vector<BlendShapeTarget> targets;
  if (plan == nullptr) targets.reserve(n);
  for (std::uint32_t i = 0; i < n && !r_.failed(); ++i) {
    Field item(r_, "", i);
    if (plan != nullptr && !target_is_wanted()) continue;
    const std::uint64_t at = r_.position();
    note(at);
    BlendShapeTarget& t = targets.emplace_back();
    describe(*this, t);
    if (t.deltas.count() != t.vertex_indices.size() && !r_.failed()) {
      r_.fail_at(at, ErrorCode::kInvalidLength,
                 std::to_string(t.deltas.count()) + " deltas, but " +
                     std::to_string(t.vertex_indices.size()) + " vertex indices");
    }
    if (!t.vertex_indices.empty() && largest_ >= m.positions.count()) known.vertex_indices = false;
  }
  m.blend_shape_targets = std::move(targets);
}

void LayerReader::add_place(const Place& place) { places->note(r_.where(), place); }

std::optional<std::uint64_t> Places::find(std::string where) const {
  // Parts are cut from the end of `where` until a recorded place remains. If the last part cut was
  // a list index, such as "[3]", this is its number; otherwise it is empty.
  std::optional<std::size_t> index;
  while (!where.empty()) {
    if (const auto at = places_.find(where); at != places_.end()) {
      const Place& p = at->second;
      if (!index || p.element_size == 0) return p.offset;
      const std::uint64_t counts = p.plane == 0 ? 1 : 1 + *index / p.plane;
      return p.offset + 4 * counts + std::uint64_t{p.element_size} * *index;
    }
    const std::size_t cut = where.find_last_of(".[");
    if (cut == std::string::npos) return std::nullopt;
    index = where[cut] == '[' && cut + 1 < where.size()
                ? std::optional<std::size_t>(std::strtoull(where.c_str() + cut + 1, nullptr, 10))
                : std::nullopt;
    where.resize(cut);
  }
  return std::nullopt;
}

}  // namespace risorius::dna::detail
