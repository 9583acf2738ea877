// SPDX-License-Identifier: MIT
// Tests that reading a file, conversions to and from JSON, and the LOD filter take limited heap
// memory.
#include <cstdio>
#include <filesystem>

#include "dna/convert/lods.h"
#include "dna/file/json.h"
#include "dna/size.h"
#include "support/head.h"
#include "support/heap.h"

namespace risorius::dna {
namespace {

using namespace testing_support;

struct Load {
  const char* name;
  ParseOptions options;
};

std::vector<Load> loads() {
  ParseOptions behavior, plain_geometry, one_lod, coarse;
  behavior.geometry = behavior.machine_learned_behavior = behavior.rbf_behavior = false;
  behavior.joint_behavior_metadata = behavior.twist_swing_behavior = behavior.unknown_layers =
      false;
  plain_geometry = behavior;
  plain_geometry.behavior = plain_geometry.blend_shapes = false;
  plain_geometry.geometry = true;
  one_lod.lods.lods = {0};
  coarse.lods.lods = {1};
  return {{"full", {}},
          {"behavior", behavior},
          {"geometry without blend shapes", plain_geometry},
          {"LOD 0", one_lod},
          {"LOD 1", coarse}};
}

void expect_little_more_than_is_kept(bytes::Source& source, const ParseOptions& options) {
  const HeapCount heap;
  const auto dna = parse(source, options);
  const std::size_t peak = heap.peak(), kept = heap.kept();
  ASSERT_TRUE(dna.has_value()) << dna.error().describe();
  EXPECT_GT(kept, 500'000u);  // otherwise the reader's window would dominate
  EXPECT_LE(static_cast<double>(peak), 1.3 * static_cast<double>(kept));
}

TEST(Memory, TheCounterSeesTheHeap) {
  const HeapCount heap;
  {
    const std::vector<char> a(100'000), b(50'000);
    EXPECT_GE(heap.kept(), 150'000u);
  }
  EXPECT_GE(heap.peak(), 150'000u);
  EXPECT_LE(heap.peak(), 151'000u);
  EXPECT_LE(heap.kept(), 100u);
}

TEST(Memory, OfALoadIsLittleMoreThanWhatItKeeps) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / "risorius_memory_test.dna";
  for (const std::uint16_t minor : {std::uint16_t{8}, std::uint16_t{1}}) {
    const Bytes bytes = write_head(make_head({.vertices = 12000}), minor);
    {
      std::FILE* file = std::fopen(path.string().c_str(), "wb");
      ASSERT_NE(file, nullptr);
      EXPECT_EQ(std::fwrite(bytes.data(), 1, bytes.size(), file), bytes.size());
      std::fclose(file);
    }
    for (const Load& load : loads()) {
      SCOPED_TRACE(std::string(load.name) + ", 2." + std::to_string(minor));
      bytes::SpanSource memory(bytes);
      expect_little_more_than_is_kept(memory, load.options);
      auto file = bytes::open_file(path);
      ASSERT_TRUE(file.has_value());
      expect_little_more_than_is_kept(**file, load.options);
    }
  }
  std::filesystem::remove(path);
}

// Reading a file takes at most kTimesTheBytes times its size plus kBeside bytes of the heap. An
// empty element takes up to 11 times its bytes in the file (a twist setup; a list of lists takes
// 9). kBeside is for the text and the field of an error.
constexpr std::size_t kTimesTheBytes = 12, kBeside = 16 * 1024;

std::size_t peak_of(const Bytes& bytes, bool* good = nullptr) {
  bytes::SpanSource source(bytes);
  const HeapCount heap;
  const bool read = parse(source).has_value();
  if (good != nullptr) *good = read;
  return heap.peak();
}

void patch(Bytes& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i)
    bytes[at + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}

TEST(Memory, AFileThatAnnouncesMuchGetsLittle) {
  for (const std::uint16_t minor : {std::uint16_t{8}, std::uint16_t{1}}) {
    const Bytes good = write_head(make_head(tiny_head()), minor);
    ASSERT_LT(good.size(), 10'000u);
    std::size_t worst = 0, refused = 0;
    for (std::size_t at = 7; at + 4 <= good.size(); ++at) {
      for (const std::uint32_t value : {0x7FFFFFFFu, 0xFFFFu, 0xFFu}) {
        Bytes bytes = good;
        patch(bytes, at, value);
        bool read = false;
        worst = std::max(worst, peak_of(bytes, &read));
        refused += read ? 0 : 1;
      }
    }
    EXPECT_LE(worst, kTimesTheBytes * good.size() + kBeside);
    EXPECT_GT(refused, good.size());  // the patches did hit counts
  }
}

using Fill = void (*)(Dna&, std::size_t);

// Functions that fill a Dna with a list of n empty elements.
const Fill kFills[] = {
    [](Dna& d, std::size_t n) { d.definition.raw_control_names.resize(n); },
    [](Dna& d, std::size_t n) { d.descriptor.metadata.resize(n); },
    [](Dna& d, std::size_t n) { d.definition.lod_joint_mapping.rows.resize(n); },
    [](Dna& d, std::size_t n) { d.behavior.joint_groups = std::vector<JointGroup>(n); },
    [](Dna& d, std::size_t n) { d.geometry.meshes = std::vector<Mesh>(n); },
    [](Dna& d, std::size_t n) {
      d.definition.blend_shape_channel_names = {"shape"};
      d.definition.mesh_names = {"mesh"};
      d.geometry.meshes = std::vector<Mesh>(1);
      d.geometry.meshes[0].blend_shape_targets = std::vector<BlendShapeTarget>(n);
    },
    [](Dna& d, std::size_t n) {
      d.machine_learned_behavior.neural_networks = std::vector<NeuralNetwork>(n);
    },
    [](Dna& d, std::size_t n) {
      d.machine_learned_behavior.region_names.resize(n);
      d.machine_learned_behavior.region_network_indices.resize(n);
    },
    [](Dna& d, std::size_t n) {
      std::vector<MlType> types(1);
      types[0].lod_operation_mappings.resize(n);
      types[0].operations = std::vector<List<MlOperation>>(n);
      d.machine_learned_behavior_ext.types = std::move(types);
    },
    [](Dna& d, std::size_t n) { d.rbf_behavior.solvers = std::vector<RbfSolver>(n); },
    [](Dna& d, std::size_t n) { d.rbf_behavior_ext.poses = std::vector<RbfPoseControls>(n); },
    [](Dna& d, std::size_t n) { d.twist_swing_behavior.twists = std::vector<TwistSwingSetup>(n); }};

TEST(Memory, ManyEmptyElementsTakeAFewTimesTheirBytes) {
  for (const Fill& fill : kFills) {
    Dna dna;
    fill(dna, 5000);
    const Bytes bytes = write_head(dna, 8);
    bool read = false;
    const std::size_t peak = peak_of(bytes, &read);
    EXPECT_TRUE(read) << &fill - kFills;
    EXPECT_LE(peak, kTimesTheBytes * bytes.size() + kBeside) << &fill - kFills;
  }
}

// Numbers of elements just above a power of two: a list that doubles its capacity then has its old
// and its new buffer at the same time.
constexpr std::size_t kSizes[] = {4097, 8193};
// Heap memory in bytes in addition to the factors: windows of readers, messages, and the stack of
// open containers.
constexpr std::size_t kBesideOthers = 64 * 1024;
// Limits of the heap memory of to_json(), from_json() and filter_lods(), as factors of the size of
// the face (kTimesFromJson: of the JSON text); native/README.md documents them.
constexpr std::size_t kTimesToJson = 48, kTimesFromJson = 64, kTimesFiltered = 24;

std::size_t size_of(const Dna& dna) { return static_cast<std::size_t>(size_in_bytes(dna)); }

std::string compact(std::string json) {
  std::erase_if(json, [](char c) { return c == ' ' || c == '\n'; });
  return json;
}

class ManyElements : public testing::TestWithParam<std::size_t> {
 protected:
  static Dna make(std::size_t n) {
    Dna dna;
    dna.descriptor.lod_count = 2;
    kFills[GetParam()](dna, n);
    return dna;
  }
};

TEST_P(ManyElements, TakeAFewTimesTheirSizeOnTheWayToJson) {
  for (const std::size_t n : kSizes) {
    const Dna dna = make(n);
    const HeapCount heap;
    ASSERT_TRUE(to_json(dna).has_value());
    EXPECT_LE(heap.peak(), kTimesToJson * size_of(dna) + kBesideOthers) << n;
  }
}

TEST_P(ManyElements, TakeAFewTimesTheirTextOnTheWayFromJson) {
  for (const std::size_t n : kSizes) {
    const std::string text = compact(*to_json(make(n)));
    const HeapCount heap;
    ASSERT_TRUE(from_json(text).has_value());
    EXPECT_LE(heap.peak(), kTimesFromJson * text.size() + kBesideOthers) << n;
  }
}

TEST_P(ManyElements, TakeAFewTimesTheirSizeInTheLodFilter) {
  for (const std::size_t n : kSizes) {
    const Dna dna = make(n);
    const HeapCount heap;
    ASSERT_TRUE(filter_lods(dna, {{1}}).has_value());
    EXPECT_LE(heap.peak(), kTimesFiltered * size_of(dna) + kBesideOthers) << n;
  }
}

INSTANTIATE_TEST_SUITE_P(Every, ManyElements, testing::Range(std::size_t{0}, std::size(kFills)));

TEST(Memory, OfTheLodFilterOfAHeadIsAtMostTwiceTheHead) {
  for (const std::uint32_t vertices : {6000u, 12000u}) {
    const Dna dna = make_head({.vertices = vertices});
    const HeapCount heap;
    ASSERT_TRUE(filter_lods(dna, {{0}}).has_value());
    EXPECT_LE(heap.peak(), 2 * size_of(dna) + kBesideOthers) << vertices;
  }
}

// The face has numbers, a text and bytes that are longer in JSON than in the file.
TEST(Memory, OfJsonGrowsWithItsNumbersAndTexts) {
  for (const std::size_t n : {std::size_t{30'000}, std::size_t{60'000}}) {
    Dna dna;
    NeuralNetworkLayer layer;
    layer.activation_parameters = std::vector<float>(n, -1.17549435e-38f);
    NeuralNetwork network;
    network.layers = std::vector<NeuralNetworkLayer>{layer};
    dna.machine_learned_behavior.neural_networks = std::vector<NeuralNetwork>{network};
    dna.descriptor.name = std::string(n, '\x01');
    dna.behavior.blend_shape_channels.lods = std::vector<std::uint16_t>(n, 0);
    dna.unknown_layers = {{{'n', 'e', 'w', '!'}, 0x10000, std::vector<std::uint8_t>(n, 0xFF)}};
    const HeapCount writing;
    const auto text = to_json(dna);
    ASSERT_TRUE(text.has_value()) << text.error().describe();
    EXPECT_LE(writing.peak(), kTimesToJson * size_of(dna) + kBesideOthers) << n;
    const HeapCount reading;
    ASSERT_TRUE(from_json(*text).has_value());
    EXPECT_LE(reading.peak(), kTimesFromJson * text->size() + kBesideOthers) << n;
  }
}

TEST(Memory, OfJsonThatIsNoFaceGrowsWithTheText) {
  for (const char* element : {"0,", "{},", "[],", "\"\",", "[{}],", "[[]],", "{\"\":{}},"}) {
    for (const std::size_t n : {std::size_t{16'385}, std::size_t{32'769}}) {
      std::string text = "[";
      for (std::size_t i = 1; i < n; ++i) text += element;
      text += "0]";
      const HeapCount heap;
      EXPECT_FALSE(from_json(text).has_value());
      EXPECT_LE(heap.peak(), kTimesFromJson * text.size() + kBesideOthers) << element << n;
    }
  }
}

}  // namespace
}  // namespace risorius::dna
