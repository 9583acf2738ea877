// SPDX-License-Identifier: MIT
// The C API refuses malformed files and calls with invalid arguments.
#include <cmath>
#include <cstring>
#include <limits>

#include "api/opened.h"

namespace risorius {
namespace {

using namespace testing_support;

using Bytes = std::vector<std::uint8_t>;

// Expects that the bytes are either opened and evaluated at every LOD, or rejected as a bad or too
// large file, with a message and an offset that is not after the last byte.
void expect_sound(const Bytes& bytes) {
  risorius_options options{};
  options.flags = RISORIUS_GEOMETRY | RISORIUS_TARGETS;
  risorius_face* opened = nullptr;
  const risorius_status status =
      risorius_open_memory(bytes.data(), bytes.size(), &options, &opened);
  const FacePtr face(opened, risorius_close);
  if (status != RISORIUS_OK) {
    const risorius_error& error = *risorius_last_error();
    EXPECT_EQ(opened, nullptr);
    EXPECT_EQ(error.status, status);
    EXPECT_TRUE(status == RISORIUS_BAD_FILE || status == RISORIUS_TOO_LARGE) << error.message;
    EXPECT_GT(std::strlen(error.message), 10u);
    EXPECT_STREQ(error.file, "");
    EXPECT_LE(error.offset, static_cast<std::int64_t>(bytes.size()));
    return;
  }
  const InstancePtr instance = make_instance(face);
  for (std::uint32_t lod = 0; lod < risorius_count(face.get(), RISORIUS_LODS); ++lod) {
    EXPECT_EQ(risorius_set_lod(instance.get(), lod), RISORIUS_OK);
    EXPECT_EQ(risorius_evaluate(instance.get()), RISORIUS_OK);
  }
}

TEST(ApiHostile, CutBytesAreRefusedOrEvaluated) {
  const Bytes whole = read_file(golden_path("tiny_v28"));
  ASSERT_GT(whole.size(), 1000u);
  for (std::size_t size = 0; size < whole.size(); size += 41) {
    expect_sound(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)));
  }
}

TEST(ApiHostile, PatchedBytesAreRefusedOrEvaluated) {
  const Bytes whole = read_file(golden_path("tiny_v28"));
  for (std::size_t at = 0; at < whole.size(); at += 29) {
    Bytes bytes = whole;
    bytes[at] = static_cast<std::uint8_t>(at % 2 == 0 ? 0xFF : bytes[at] ^ 0x80);
    expect_sound(bytes);
  }
}

TEST(ApiHostile, AnErrorNamesTheFileTheFieldAndTheByte) {
  const std::string path =
      (data_folder() / "malformed" / "not_there" / "Gesicht \xC3\xA4.dna").string();
  risorius_face* face = nullptr;
  EXPECT_EQ(risorius_open_file(path.c_str(), nullptr, &face), RISORIUS_NOT_READABLE);
  EXPECT_EQ(path, risorius_last_error()->file);
  EXPECT_STREQ(risorius_last_error()->code, "io_open");
  Bytes bytes = read_file(golden_path("tiny_v28"));
  bytes.resize(bytes.size() / 2);
  EXPECT_EQ(risorius_open_memory(bytes.data(), bytes.size(), nullptr, &face), RISORIUS_BAD_FILE);
  EXPECT_STRNE(risorius_last_error()->field, "");
  EXPECT_GE(risorius_last_error()->offset, 0);
  EXPECT_STREQ(risorius_last_error()->file, "");
  EXPECT_EQ(face, nullptr);
}

void expect_refused(risorius_status status, const std::string& field) {
  EXPECT_EQ(status, RISORIUS_BAD_ARGUMENT);
  EXPECT_EQ(risorius_last_error()->status, RISORIUS_BAD_ARGUMENT);
  EXPECT_EQ(risorius_last_error()->field, field);
}

TEST(ApiHostile, NullIsRefused) {
  const FacePtr face = open_golden("core");
  const InstancePtr instance = make_instance(face);
  risorius_face* opened = nullptr;
  risorius_instance* made = nullptr;
  risorius_mesh mesh{};
  risorius_target target{};
  risorius_skeleton skeleton{};
  const std::uint16_t* items = nullptr;
  std::uint32_t count = 0;
  const risorius_list joints = RISORIUS_JOINTS, raw = RISORIUS_RAW_CONTROLS;
  expect_refused(risorius_open_file(nullptr, nullptr, &opened), "path");
  expect_refused(risorius_open_file("x", nullptr, nullptr), "face");
  expect_refused(risorius_open_memory(nullptr, 3, nullptr, &opened), "bytes");
  expect_refused(risorius_open_memory("abc", 3, nullptr, nullptr), "face");
  expect_refused(risorius_lod_items(nullptr, joints, 0, &items, &count), "face");
  expect_refused(risorius_lod_items(face.get(), joints, 0, nullptr, &count), "items");
  expect_refused(risorius_lod_items(face.get(), joints, 0, &items, nullptr), "count");
  expect_refused(risorius_get_skeleton(nullptr, &skeleton), "face");
  expect_refused(risorius_get_skeleton(face.get(), nullptr), "skeleton");
  expect_refused(risorius_get_mesh(nullptr, 0, &mesh), "face");
  expect_refused(risorius_get_mesh(face.get(), 0, nullptr), "out");
  expect_refused(risorius_get_target(nullptr, 0, 0, &target), "face");
  expect_refused(risorius_get_target(face.get(), 0, 0, nullptr), "out");
  expect_refused(risorius_create(nullptr, RISORIUS_SETTLED, &made), "face");
  expect_refused(risorius_create(face.get(), RISORIUS_SETTLED, nullptr), "instance");
  expect_refused(risorius_set(nullptr, raw, 0, 0, nullptr), "instance");
  expect_refused(risorius_set(instance.get(), raw, 0, 1, nullptr), "values");
  expect_refused(risorius_set_lod(nullptr, 0), "instance");
  expect_refused(risorius_evaluate(nullptr), "instance");
  EXPECT_EQ(risorius_values(nullptr, joints, &count), nullptr);
  EXPECT_EQ(risorius_name(nullptr, joints, 0), nullptr);
  EXPECT_EQ(risorius_count(nullptr, joints), 0u);
  risorius_close(nullptr);
  risorius_destroy(nullptr);
}

TEST(ApiHostile, IndicesOutOfRangeAreRefused) {
  const FacePtr face = open_golden("core");
  const InstancePtr instance = make_instance(face);
  const std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
  risorius_mesh mesh{};
  risorius_target target{};
  const std::uint16_t* items = nullptr;
  std::uint32_t count = 0;
  risorius_instance* made = nullptr;
  const risorius_list odd = 7;
  const float values[4] = {0, 0, 0, 0};
  const std::uint32_t raw = risorius_count(face.get(), RISORIUS_RAW_CONTROLS);
  ASSERT_EQ(raw, 4u);
  EXPECT_EQ(risorius_count(face.get(), odd), 0u);
  EXPECT_EQ(risorius_name(face.get(), odd, 0), nullptr);
  EXPECT_EQ(risorius_name(face.get(), RISORIUS_LODS, 0), nullptr);
  EXPECT_EQ(risorius_name(face.get(), RISORIUS_RAW_CONTROLS, raw), nullptr);
  EXPECT_EQ(risorius_values(instance.get(), RISORIUS_MESHES, &count), nullptr);
  expect_refused(risorius_lod_items(face.get(), RISORIUS_JOINTS, 2, &items, &count), "lod");
  expect_refused(risorius_lod_items(face.get(), RISORIUS_LODS, 0, &items, &count), "list");
  expect_refused(risorius_get_mesh(face.get(), most, &mesh), "mesh");
  expect_refused(risorius_get_target(face.get(), 0, most, &target), "target");
  expect_refused(risorius_create(face.get(), 2, &made), "timing");
  expect_refused(risorius_set(instance.get(), RISORIUS_JOINTS, 0, 1, values), "list");
  expect_refused(risorius_set(instance.get(), RISORIUS_RAW_CONTROLS, 1, 4, values), "first, count");
  expect_refused(risorius_set(instance.get(), RISORIUS_RAW_CONTROLS, most, 2, values),
                 "first, count");
  expect_refused(risorius_set(instance.get(), RISORIUS_RAW_CONTROLS, 2, most, values),
                 "first, count");
  expect_refused(risorius_set_lod(instance.get(), 2), "lod");
}

TEST(ApiHostile, NumbersThatAreNotFiniteAreRefusedAndNothingIsSet) {
  const FacePtr face = open_golden("core");
  const InstancePtr instance = make_instance(face);
  const std::vector<float> before = values(instance, RISORIUS_RAW_CONTROLS);
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    const float given[] = {0.5f, 0.25f, bad, 1.0f};
    expect_refused(risorius_set(instance.get(), RISORIUS_RAW_CONTROLS, 0, 4, given), "values[2]");
  }
  EXPECT_EQ(values(instance, RISORIUS_RAW_CONTROLS), before);
}

TEST(ApiHostile, OptionsThatMakeNoSenseAreRefused) {
  const std::string path = golden_path("medium");
  const auto refused = [&](risorius_options options, const std::string& field) {
    risorius_face* face = nullptr;
    expect_refused(risorius_open_file(path.c_str(), &options, &face), field);
    EXPECT_EQ(face, nullptr);
  };
  const char* names[] = {"no such mesh", nullptr};
  risorius_options options{};
  options.flags = 64;
  refused(options, "options.flags");
  options.flags = RISORIUS_TARGETS;
  refused(options, "options.flags");
  options.flags = 0;
  options.lod_count = 1;
  refused(options, "options.lods");
  const std::uint16_t there[] = {0, 1}, beyond[] = {0, 65535, 900}, twice[] = {1, 0, 1};
  options.lods = beyond;
  for (options.lod_count = 2; options.lod_count <= 3; ++options.lod_count) {
    refused(options, "options.lods");
  }
  options.lods = twice;
  refused(options, "options.lods");
  const std::vector<std::uint16_t> million(1'000'000, 0);
  options.lods = million.data();
  options.lod_count = 1'000'000;
  refused(options, "options.lods");
  options.lods = there;
  options.lod_count = 2;
  EXPECT_EQ(risorius_count(open_golden("medium", options).get(), RISORIUS_LODS), 2u);
  options = {};
  options.mesh_count = 1;
  options.meshes = names;
  refused(options, "options.meshes");
  options.flags = RISORIUS_GEOMETRY;
  refused(options, "options.meshes");
  options.meshes = names + 1;
  refused(options, "options.meshes");
  options.meshes = nullptr;
  refused(options, "options.meshes");
}

}  // namespace
}  // namespace risorius
