// SPDX-License-Identifier: MIT
// Tests which bytes of a file a partial load reads, and how often. The positions of layers, meshes
// and lists come from the file's index and the sizes in the format, not from the parser.
#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>

#include "support/full_face.h"
#include "support/head.h"

namespace risorius::dna {
namespace {

using namespace testing_support;

// kFirstRead: size in bytes of the reader's first read after a jump. kWindow: size of its largest
// read. After the last needed byte, the reader may read ahead at most as many bytes as it has read
// in sequence before, and never more than kWindow.
constexpr std::size_t kFirstRead = 512, kWindow = 64 * 1024;

struct Region {
  std::size_t begin = 0, end = 0;
  std::size_t size() const { return end - begin; }
};

class RecordingSource final : public bytes::Source {
 public:
  explicit RecordingSource(const Bytes& bytes) : bytes_(bytes), reads_(bytes.size(), 0) {}
  std::uint64_t size() const override { return bytes_.size(); }
  std::size_t read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    const auto begin = static_cast<std::size_t>(offset);
    const std::size_t n = std::min(out.size(), bytes_.size() - begin);
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(begin), n, out.begin());
    for (std::size_t i = 0; i < n; ++i) ++reads_[begin + i];
    total_ += n;
    return n;
  }
  std::size_t touched(const Region& r) const {
    std::size_t n = 0;
    for (std::size_t i = r.begin; i < r.end; ++i) n += reads_[i] > 0 ? 1 : 0;
    return n;
  }
  std::size_t total() const { return total_; }

 private:
  const Bytes& bytes_;
  std::vector<std::uint32_t> reads_;
  std::size_t total_ = 0;
};

Dna must_parse(bytes::Source& source, const ParseOptions& options = {}) {
  auto dna = parse(source, options);
  if (!dna) ADD_FAILURE() << dna.error().describe();
  return dna ? std::move(dna).value() : Dna{};
}

std::size_t u32_at(const Bytes& bytes, std::size_t at) {
  return std::size_t{bytes[at]} << 24 | std::size_t{bytes[at + 1]} << 16 |
         std::size_t{bytes[at + 2]} << 8 | bytes[at + 3];
}

// ---- positions in the file

struct File {
  Bytes bytes;
  bool sections = false;                 // 2.1
  std::map<std::string, Region> layers;  // by id; in 2.1 by the names of its sections
};

File describe_file(Bytes bytes) {
  File file;
  file.bytes = std::move(bytes);
  const Bytes& b = file.bytes;
  file.sections = b[6] == 1;
  if (file.sections) {
    const char* names[] = {"desc", "defn", "", "controls", "joints", "shapes", "maps", "geom"};
    for (std::size_t i = 0; i < 8; ++i) {
      const std::size_t end = i < 7 ? u32_at(b, 7 + 4 * (i + 1)) : b.size();
      file.layers[names[i]] = {u32_at(b, 7 + 4 * i), end};
    }
    file.layers.erase("");
    return file;
  }
  for (std::size_t i = 0; i < u32_at(b, 7); ++i) {
    const std::size_t entry = 11 + 16 * i, begin = u32_at(b, entry + 8);
    file.layers[std::string(b.begin() + static_cast<std::ptrdiff_t>(entry),
                            b.begin() + static_cast<std::ptrdiff_t>(entry) + 4)] = {
        begin, begin + u32_at(b, entry + 12)};
  }
  return file;
}

File head_file(std::uint16_t minor) { return describe_file(write_head(make_head(), minor)); }

File golden_file(const char* name) {
  std::ifstream in(std::string(RISORIUS_TEST_DATA "/golden/") + name, std::ios::binary);
  Bytes bytes{std::istreambuf_iterator<char>(in), {}};
  EXPECT_FALSE(bytes.empty()) << name;
  return describe_file(std::move(bytes));
}

std::size_t list(std::size_t n, std::size_t element) { return 4 + n * element; }
std::size_t target_bytes(const BlendShapeTarget& t) {
  return 4 * list(t.vertex_indices.size(), 4) + 2;
}

// The regions of the bodies of n elements, of which the first begins at offset `at`. In the file a
// body is preceded by its size or, in 2.1, by the offset of its end.
std::vector<Region> sized_elements(const File& file, std::size_t at, std::size_t n) {
  std::vector<Region> out;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t begin = at + 4, mark = u32_at(file.bytes, at);
    at = file.sections ? mark : begin + mark;
    out.push_back({begin, at});
  }
  return out;
}

std::vector<Region> meshes_of(const File& file) {
  const std::size_t at = file.layers.at("geom").begin;
  return sized_elements(file, at + 4, u32_at(file.bytes, at));
}

// The region of the blend shape targets, which are the end of a mesh.
Region targets_of(const Region& mesh, const Mesh& m) {
  std::size_t bytes = 4;
  for (const BlendShapeTarget& t : m.blend_shape_targets) bytes += target_bytes(t);
  return {mesh.end - bytes, mesh.end};
}

// The region of the values of each joint group's matrix, without their count.
std::vector<Region> matrices_of(const File& file, const Behavior& b) {
  std::size_t at = 0;
  if (file.sections) {
    at = file.layers.at("joints").begin;
  } else {
    const std::size_t rows = b.gui_to_raw.input_indices.size(), psds = b.psds.rows.size();
    at = file.layers.at("bhvr").begin + 2 + 2 * list(rows, 2) + 4 * list(rows, 4) +
         2 * list(psds, 2) + list(psds, 4);
  }
  at += 2 + 2 + 4;
  std::vector<Region> out;
  for (const JointGroup& g : b.joint_groups) {
    at += list(g.lods.size(), 2) + list(g.input_indices.size(), 2) +
          list(g.output_indices.size(), 2) + 4;
    out.push_back({at, at + 4 * g.values.size()});
    at = out.back().end + list(g.joint_indices.size(), 2);
  }
  return out;
}

// ---- by layer

ParseOptions nothing() {
  ParseOptions o;
  o.definition = o.behavior = o.geometry = o.blend_shapes = o.machine_learned_behavior = false;
  o.rbf_behavior = o.joint_behavior_metadata = o.twist_swing_behavior = o.unknown_layers = false;
  return o;
}

struct Load {
  const char* name;
  ParseOptions options;
  std::vector<std::string> asked;  // in addition to the descriptor
};

std::vector<Load> loads_by_layer() {
  std::vector<Load> loads{{"descriptor", nothing(), {}}};
  const auto add = [&](const char* name, bool ParseOptions::* flag,
                       std::vector<std::string> asked) {
    ParseOptions o = nothing();
    o.definition = true;
    o.*flag = true;
    asked.push_back("defn");
    loads.push_back({name, o, std::move(asked)});
  };
  add("definition", &ParseOptions::definition, {});
  add("behavior", &ParseOptions::behavior, {"bhvr", "controls", "joints", "shapes", "maps"});
  add("geometry", &ParseOptions::geometry, {"geom"});
  loads.back().options.blend_shapes = true;
  add("networks", &ParseOptions::machine_learned_behavior, {"mlbh", "mlbe"});
  add("rbf", &ParseOptions::rbf_behavior, {"rbfb", "rbfe"});
  add("metadata", &ParseOptions::joint_behavior_metadata, {"jbmd"});
  add("twists", &ParseOptions::twist_swing_behavior, {"twsw"});
  add("unknown", &ParseOptions::unknown_layers, {"xtra"});
  return loads;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

// Whether a layer contains a number of controls, which is read whenever the definition is loaded.
// If the layer rbfe (outputs of RBF poses) is empty, each pose of the layer rbfb (RBF solvers) is a
// control, and the number of poses is stored after the solvers.
bool counts_controls(const File& file, const std::string& layer) {
  const bool in_rbfb = layer == "rbfb" && file.layers.at("rbfe").size() == 8;
  return layer == "bhvr" || layer == "controls" || layer == "mlbh" || layer == "rbfe" || in_rbfb;
}

void expect_only_asked_layers(const File& file, const Load& load) {
  SCOPED_TRACE(load.name);
  RecordingSource source(file.bytes);
  must_parse(source, load.options);
  for (const auto& [name, region] : file.layers) {
    SCOPED_TRACE(name);
    if (name == "desc" || name == "dsce" || contains(load.asked, name)) {
      EXPECT_EQ(source.touched(region), region.size());
      // Layers near the begin of the file are not compared, because they are read together with the
      // header.
    } else if (region.begin >= kFirstRead) {
      const bool counted = load.options.definition && counts_controls(file, name);
      EXPECT_LE(source.touched(region), counted ? (name == "rbfb" ? kFirstRead : 4) : 0);
    }
  }
}

TEST(PartialLoad, ReadsTheLayersAskedForAndNoOther) {
  const File files[] = {head_file(8), golden_file("medium.dna"), golden_file("tiny_v28.dna")};
  ASSERT_TRUE(files[0].layers.contains("xtra"));
  for (const File& file : files) {
    SCOPED_TRACE(file.bytes.size());
    for (const Load& load : loads_by_layer()) expect_only_asked_layers(file, load);
  }
}

TEST(PartialLoad, ReadsTheSectionsAskedForAndNoOther) {
  const File files[] = {head_file(1), golden_file("tiny_v21.dna")};
  for (const File& file : files) {
    ASSERT_TRUE(file.sections);
    SCOPED_TRACE(file.bytes.size());
    for (const Load& load : loads_by_layer()) expect_only_asked_layers(file, load);
  }
}

TEST(PartialLoad, AFullLoadReadsEveryByteOnce) {
  for (const std::uint16_t minor : {std::uint16_t{8}, std::uint16_t{1}}) {
    const File file = head_file(minor);
    RecordingSource source(file.bytes);
    must_parse(source);
    EXPECT_EQ(source.touched({0, file.bytes.size()}), file.bytes.size());
    EXPECT_LE(source.total(), file.bytes.size() + kFirstRead);
  }
}

TEST(PartialLoad, AMeshWithoutBlendShapesIsReadUpToThem) {
  const Dna head = make_head();
  for (const std::uint16_t minor : {std::uint16_t{8}, std::uint16_t{1}}) {
    const File file = head_file(minor);
    RecordingSource source(file.bytes);
    ParseOptions options = nothing();
    options.definition = options.geometry = true;
    must_parse(source, options);
    const std::vector<Region> meshes = meshes_of(file);
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      const Region targets = targets_of(meshes[i], head.geometry.meshes[i]);
      const Region before{meshes[i].begin, targets.begin};
      EXPECT_EQ(source.touched(before), before.size());
      EXPECT_LE(source.touched(targets), std::min(kWindow, before.size() + kFirstRead));
    }
    EXPECT_GT(targets_of(meshes[0], head.geometry.meshes[0]).size(), 10 * kWindow);
  }
}

// ---- by LOD

struct Selection {
  LodSelection selection;
  std::vector<std::uint16_t> kept;
};

std::vector<Selection> selections() {
  std::vector<Selection> out;
  const std::vector<std::uint16_t> lists[] = {{0}, {1}, {3}, {0, 2}};
  for (const std::vector<std::uint16_t>& lods : lists) {
    Selection& s = out.emplace_back();
    s.selection.lods = s.kept = lods;
  }
  Selection& coarse = out.emplace_back();
  coarse.selection.max_lod = 2;
  coarse.kept = {2, 3};
  return out;
}

ParseOptions by_lod(const Selection& s) {
  ParseOptions options;
  options.lods = s.selection;
  return options;
}

bool keeps(const Selection& s, std::size_t lod) {
  return std::ranges::find(s.kept, lod) != s.kept.end();
}

// Expects that a kept element is read completely, and at most `slack` bytes of a dropped element.
// In: slack  more than 0 for the first element of a list, of which bytes are read together with the
//            number of elements before it
void expect_whole_or_untouched(const RecordingSource& source, const Region& element, bool kept,
                               std::size_t slack) {
  if (kept) {
    EXPECT_EQ(source.touched(element), element.size());
  } else {
    EXPECT_LE(source.touched(element), slack);
  }
}

TEST(PartialLoad, ReadsNothingOfADroppedMesh) {
  for (const std::uint16_t minor : {std::uint16_t{8}, std::uint16_t{1}}) {
    const File file = head_file(minor);
    const std::vector<Region> meshes = meshes_of(file);
    ASSERT_EQ(meshes.size(), 5u);
    for (const Selection& s : selections()) {
      RecordingSource source(file.bytes);
      must_parse(source, by_lod(s));
      for (std::size_t i = 0; i < 4; ++i) {
        expect_whole_or_untouched(source, meshes[i], keeps(s, i), i == 0 ? kFirstRead : 0);
      }
    }
  }
}

// The fifth mesh belongs to all LODs and is kept. Of its dropped targets only four small reads each
// are allowed, which find the end of the target, and one window that is read ahead.
TEST(PartialLoad, PassesOverDroppedTargetsOfAKeptMesh) {
  const Mesh mesh = make_head().geometry.meshes[4];
  for (const std::uint16_t minor : {std::uint16_t{8}, std::uint16_t{1}}) {
    const File file = head_file(minor);
    const Region targets = targets_of(meshes_of(file)[4], mesh);
    for (const Selection& s : selections()) {
      RecordingSource source(file.bytes);
      must_parse(source, by_lod(s));
      const std::size_t channels = std::size_t{32} >> s.kept[0];
      Region kept{targets.begin, targets.begin + 4};
      for (std::size_t c = 0; c < channels; ++c)
        kept.end += target_bytes(mesh.blend_shape_targets[c]);
      const Region dropped{kept.end, targets.end};
      EXPECT_EQ(source.touched(kept), kept.size());
      EXPECT_LE(source.touched(dropped),
                channels == 32 ? 0 : kWindow + (32 - channels) * 4 * kFirstRead);
    }
  }
}

TEST(PartialLoad, ReadsTheRowsThatTheFinestKeptLodUses) {
  const Behavior behavior = make_head().behavior;
  for (const std::uint16_t minor : {std::uint16_t{8}, std::uint16_t{1}}) {
    const File file = head_file(minor);
    const std::vector<Region> matrices = matrices_of(file, behavior);
    for (const Selection& s : selections()) {
      RecordingSource source(file.bytes);
      must_parse(source, by_lod(s));
      for (std::size_t g = 0; g < matrices.size(); ++g) {
        const JointGroup& group = behavior.joint_groups[g];
        const std::size_t row = 4 * group.input_indices.size();
        const Region kept{matrices[g].begin, matrices[g].begin + group.lods[s.kept[0]] * row};
        EXPECT_EQ(source.touched(kept), kept.size());
        EXPECT_EQ(source.touched({kept.end, matrices[g].end}), 0u) << g;
      }
    }
  }
}

TEST(PartialLoad, ReadsNothingOfDroppedNetworksAndSolvers) {
  const File file = head_file(8);
  const HeadSizes sizes;
  const std::size_t network = list(sizes.network_inputs, 2) + list(sizes.network_outputs, 2) + 4 +
                              list(sizes.network_outputs, 4) +
                              list(std::size_t{sizes.network_inputs} * sizes.network_outputs, 4) +
                              2 + list(1, 4);
  const std::size_t solver = list(6, 1) + list(4, 2) + list(sizes.solver_poses, 2) +
                             list(std::size_t{4} * sizes.solver_poses, 4) + 8 + 12;
  const std::size_t poses = 4 + sizes.solver_poses * (list(4, 1) + 4);
  const std::vector<Region> networks =
      sized_elements(file, file.layers.at("mlbh").end - 4 * (4 + network), 4);
  const std::vector<Region> solvers =
      sized_elements(file, file.layers.at("rbfb").end - poses - 4 * (4 + solver), 4);
  for (const Selection& s : selections()) {
    RecordingSource source(file.bytes);
    must_parse(source, by_lod(s));
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(networks[i].size(), network);
      EXPECT_EQ(solvers[i].size(), solver);
      const auto slack = [&](const char* layer, const Region& first) {
        return i > 0 ? 0 : first.begin - file.layers.at(layer).begin + kFirstRead;
      };
      expect_whole_or_untouched(source, networks[i], keeps(s, i), slack("mlbh", networks[0]));
      expect_whole_or_untouched(source, solvers[i], keeps(s, i), slack("rbfb", solvers[0]));
    }
  }
}

TEST(PartialLoad, ByLodIsTheWholeFilteredByLod) {
  for (const std::uint16_t minor : {std::uint16_t{8}, std::uint16_t{1}}) {
    const File file = head_file(minor);
    for (const Selection& s : selections()) {
      RecordingSource source(file.bytes), whole(file.bytes);
      const Dna dna = must_parse(source, by_lod(s));
      auto filtered = filter_lods(must_parse(whole), s.selection);
      ASSERT_TRUE(filtered.has_value());
      EXPECT_EQ(dna.descriptor, filtered->descriptor);
      EXPECT_EQ(dna.definition, filtered->definition);
      EXPECT_EQ(dna.behavior, filtered->behavior);
      EXPECT_EQ(dna.geometry, filtered->geometry);
      EXPECT_EQ(dna.machine_learned_behavior, filtered->machine_learned_behavior);
      EXPECT_EQ(dna.machine_learned_behavior_ext, filtered->machine_learned_behavior_ext);
      EXPECT_EQ(dna.rbf_behavior, filtered->rbf_behavior);
      EXPECT_EQ(dna.twist_swing_behavior, filtered->twist_swing_behavior);
      EXPECT_EQ(dna.geometry.meshes.size(), s.kept.size() + 1);
    }
  }
}

// The first vertex of the mesh has three joints, of which LOD 1 has the first two.
TEST(PartialLoad, LeavesAVertexTheSumOfItsWeights) {
  Dna head = make_head(tiny_head());
  Mesh& mesh = head.geometry.meshes[2];
  mesh.skin_offsets = {0, 3, 4, 5, 6};
  mesh.skin_weights = {0.5f, 0.25f, 0.25f, 1.0f, 1.0f, 1.0f};
  mesh.skin_joint_indices = {0, 1, 2, 2, 1, 0};
  head.definition.lod_joint_mapping.rows[1] = {0, 1};
  const Bytes bytes = write_head(head, 8);
  bytes::SpanSource source(bytes);
  ParseOptions options;
  options.lods.lods = {1};
  const Dna dna = must_parse(source, options);
  ASSERT_EQ(dna.geometry.meshes.size(), 2u);
  const Mesh& cut = dna.geometry.meshes[1];
  EXPECT_EQ(cut.skin_offsets, (Array<std::uint32_t>{0, 2, 3, 4, 5}));
  // The weights 0.5 and 0.25 grow by 1 / 0.75. A vertex without remaining joints is attached to the
  // root.
  const float grow = 1.0f / 0.75f;
  EXPECT_EQ(cut.skin_weights, (Array<float>{0.5f * grow, 0.25f * grow, 1.0f, 1.0f, 1.0f}));
  EXPECT_EQ(cut.skin_joint_indices, (Array<std::uint16_t>{0, 1, 0, 1, 0}));
}

// The first entry of the blend shape channels of make_full_face() gets one control after the other
// as its input: the last raw control, the corrective, both controls of networks, and the control of
// the RBF pose. The channel is dropped if the layer that computes its control is not loaded.
TEST(PartialLoad, LeavesOutChannelsOfControlsThatAreNotLoaded) {
  for (std::uint16_t control = 4; control <= 8; ++control) {
    Dna face = make_full_face();
    face.behavior.blend_shape_channels.input_indices = {control, 0};
    const Bytes bytes = write_head(face, 8);
    for (const unsigned layers : {0u, 1u, 2u, 3u}) {
      ParseOptions options;
      options.unreferenced_blend_shapes = false;
      options.machine_learned_behavior = (layers & 1) != 0;
      options.rbf_behavior = (layers & 2) != 0;
      bytes::SpanSource source(bytes);
      const Dna dna = must_parse(source, options);
      const bool is_computed =
          control < 6 || (control < 8 ? options.machine_learned_behavior : options.rbf_behavior);
      const auto& inputs = dna.behavior.blend_shape_channels.input_indices;
      EXPECT_EQ(inputs.size(), is_computed ? 2u : 1u) << control << ", layers " << layers;
      // The first channel, "wide", has targets in two meshes; "open" has a target in one.
      std::size_t targets = 0;
      for (const Mesh& m : dna.geometry.meshes) targets += m.blend_shape_targets.size();
      EXPECT_EQ(targets, is_computed ? 3u : 1u) << control << ", layers " << layers;
    }
  }
}

// In a file without layer rbfe, as before 2.5, the number of pose controls is the number of poses
// in layer rbfb, which must be read. An error in rbfb names its field and its offset.
TEST(PartialLoad, SaysWherePosesCannotBeCounted) {
  Dna face = make_full_face();
  face.rbf_behavior_ext = {};
  File file = describe_file(write_head(face, 4));
  const std::size_t at = file.layers.at("rbfb").begin;
  std::fill_n(file.bytes.begin() + static_cast<std::ptrdiff_t>(at), 4, std::uint8_t{0xff});
  ParseOptions options;
  options.rbf_behavior = false;
  bytes::SpanSource source(file.bytes);
  const auto dna = parse(source, options);
  ASSERT_FALSE(dna.has_value());
  EXPECT_EQ(dna.error().code, core::ErrorCode::kInvalidCount);
  EXPECT_EQ(dna.error().offset, at);
  EXPECT_EQ(dna.error().where, "rbf_behavior.lod_solver_mapping.lods");
}

TEST(PartialLoad, SaysWhereAJointIndexIsTooLarge) {
  const Dna head = make_head(tiny_head());
  Bytes bytes = write_head(head, 8);
  const Region mesh = meshes_of(describe_file(bytes))[0];
  // The joint index of the last vertex is stored just before the targets.
  const std::size_t at = targets_of(mesh, head.geometry.meshes[0]).begin - 2;
  bytes[at + 1] = 77;
  for (const bool one_lod : {true, false}) {
    ParseOptions options;
    if (one_lod) options.lods.lods = {0};
    bytes::SpanSource source(bytes);
    const auto dna = parse(source, options);
    ASSERT_FALSE(dna.has_value());
    EXPECT_EQ(dna.error().code, core::ErrorCode::kInvalidIndex);
    EXPECT_TRUE(dna.error().where.starts_with("geometry.meshes[0].skin_")) << dna.error().where;
    EXPECT_TRUE(!one_lod || dna.error().offset == at) << dna.error().describe();
  }
}

}  // namespace
}  // namespace risorius::dna
