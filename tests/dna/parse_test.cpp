// SPDX-License-Identifier: MIT
// Compares the parser and the writer with bytes that were worked out by hand from the format, so
// that they do not only confirm each other. Also checks promises about hostile input that only
// native code can check.
#include "dna/file/parse.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "dna/file/write.h"
#include "dna/validate.h"

namespace risorius::dna {
namespace {

using Bytes = std::vector<std::uint8_t>;

core::Result<Dna> parse_bytes(const Bytes& bytes, const ParseOptions& options = {}) {
  bytes::SpanSource source(bytes);
  return parse(source, options);
}

Bytes write_bytes(const Dna& dna, std::uint16_t minor = 8) {
  std::vector<Warning> warnings;
  core::Result<Bytes> bytes = write(dna, {minor, true}, warnings);
  EXPECT_TRUE(bytes.has_value());
  return bytes ? *bytes : Bytes{};
}

// A file of version 2.2 with one layer, the descriptor: name "Ab", caucasian, female, age 40, one
// pair of metadata, metres, radians, axes right up front, 3 LODs, max_lod 1, complexity "",
// database name "d".
const Bytes kDescriptorFile = {
    'D', 'N', 'A', 0,   2,   0,   2,      // signature, generation, version
    0,   0,   0,   1,                     // one layer
    'd', 'e', 's', 'c', 0,   1,   0, 1,   // id, version 1.1
    0,   0,   0,   27,  0,   0,   0, 51,  // offset 7 + 4 + 16, size
    0,   0,   0,   2,   'A', 'b',         // name
    0,   2,   0,   1,   0,   40,          // archetype, gender, age
    0,   0,   0,   1,                     // metadata
    0,   0,   0,   1,   'k', 0,   0, 0,  2,   'v', 'w', 0, 1, 0, 1,  // metres, radians
    0,   1,   0,   2,   0,   4,                                      // axes
    0,   3,   0,   1,                                                // LOD count, first LOD
    0,   0,   0,   0,   0,   0,   0, 1,  'd', 0};  // complexity, database; one unknown byte

TEST(DnaParse, ReadsADescriptorWorkedOutByHand) {
  core::Result<Dna> dna = parse_bytes(kDescriptorFile);
  ASSERT_TRUE(dna.has_value()) << dna.error().describe();
  const Descriptor& d = dna->descriptor;
  EXPECT_EQ(d.name, "Ab");
  EXPECT_EQ(d.archetype, 2);
  EXPECT_EQ(d.gender, 1);
  EXPECT_EQ(d.age, 40);
  ASSERT_EQ(d.metadata.size(), 1u);
  EXPECT_EQ(d.metadata[0], std::make_pair(std::string("k"), std::string("vw")));
  EXPECT_EQ(d.translation_unit, 1);
  EXPECT_EQ(d.coordinate_system, (CoordinateSystem{1, 2, 4}));
  EXPECT_EQ(d.lod_count, 3);
  EXPECT_EQ(d.max_lod, 1);
  EXPECT_EQ(d.db_name, "d");
  ASSERT_EQ(dna->warnings.size(), 1u);  // one warning, for the extra byte
  EXPECT_EQ(dna->warnings[0].where, "descriptor");
  EXPECT_EQ(dna->warnings[0].offset, 77u);
}

TEST(DnaWrite, PutsTheDescriptorWhereAHandWould) {
  core::Result<Dna> dna = parse_bytes(kDescriptorFile);
  ASSERT_TRUE(dna.has_value());
  const Bytes written = write_bytes(*dna, 2);
  // The written file has four layers, so that the descriptor begins after a table of 4 * 16 bytes.
  // The unknown byte at its end is not written.
  const std::size_t body = 7 + 4 + 4 * 16;
  ASSERT_GT(written.size(), body + 50);
  EXPECT_EQ(std::memcmp(written.data() + body, kDescriptorFile.data() + 27, 50), 0);
  EXPECT_EQ(written[7 + 3], 4);
  EXPECT_EQ(written[7 + 4 + 15], 50);
}

TEST(DnaWrite, AnEmptyFileHasTheSizesOfTheFormat) {
  EXPECT_EQ(write_bytes(Dna{}, 8).size(), 502u);
  EXPECT_EQ(write_bytes(Dna{}, 1).size(), 260u);
  EXPECT_EQ(write_bytes(Dna{}, 2).size(), 293u);
}

TEST(DnaParse, PlacesErrorsInTheFileAndTheFormat) {
  Bytes bytes = kDescriptorFile;
  bytes[27 + 15] = 200;  // the count of metadata
  bytes[27 + 12] = 1;
  core::Result<Dna> dna = parse_bytes(bytes);
  ASSERT_FALSE(dna.has_value());
  EXPECT_EQ(dna.error().code, core::ErrorCode::kInvalidCount);
  EXPECT_EQ(dna.error().where, "descriptor.metadata");
  EXPECT_EQ(dna.error().offset, 39u);
}

TEST(DnaParse, ReadsTheDescriptorSizeOf27And28) {
  Dna dna;
  dna.descriptor_ext = {3, {1, -1, 1}, 1};
  for (const std::uint16_t minor : {std::uint16_t{7}, std::uint16_t{8}}) {
    core::Result<Dna> again = parse_bytes(write_bytes(dna, minor));
    ASSERT_TRUE(again.has_value());
    EXPECT_EQ(again->descriptor_ext.rotation_sequence, 3u);
    EXPECT_EQ(again->descriptor_ext.rotation_sign[1], -1);
    EXPECT_EQ(again->descriptor_ext.face_winding_order, minor == 8 ? 1 : 0);
  }
}

TEST(DnaParse, RefusesLayersOutsideTheFile) {
  Bytes bytes = kDescriptorFile;
  bytes[19] = 0xFF;  // the offset's first byte
  core::Result<Dna> dna = parse_bytes(bytes);
  ASSERT_FALSE(dna.has_value());
  EXPECT_EQ(dna.error().code, core::ErrorCode::kTruncated);
}

TEST(DnaParse, KeepsUnknownLayersInTheirPlace) {
  Bytes bytes = kDescriptorFile;
  bytes[11] = 'x';  // an unknown id
  core::Result<Dna> dna = parse_bytes(bytes);
  ASSERT_TRUE(dna.has_value());
  ASSERT_EQ(dna->unknown_layers.size(), 1u);
  EXPECT_EQ(dna->unknown_layers[0].bytes.size(), 51u);
  ParseOptions options;
  options.unknown_layers = false;
  EXPECT_TRUE(parse_bytes(bytes, options)->unknown_layers.empty());
}

TEST(DnaValidate, FindsACycleOfAnyLength) {
  for (const std::uint16_t n : {std::uint16_t{2}, std::uint16_t{3}, std::uint16_t{1000}}) {
    Dna dna;
    std::vector<std::uint16_t> parents(n);
    for (std::uint16_t j = 0; j < n; ++j) parents[j] = static_cast<std::uint16_t>((j + 1) % n);
    dna.definition.joint_names.resize(n);
    dna.definition.joint_parents = parents;
    dna.definition.neutral_joint_translations.values = std::vector<float>(n * 3u);
    dna.definition.neutral_joint_rotations.values = std::vector<float>(n * 3u);
    std::vector<Warning> warnings;
    core::Status status = validate(dna, warnings);
    ASSERT_FALSE(status.has_value());
    EXPECT_NE(status.error().message.find("cycle"), std::string::npos);
  }
}

TEST(DnaValidate, WarnsOfNumbersThatAreNone) {
  Dna dna;
  dna.definition.joint_names = {"root"};
  dna.definition.joint_parents = {0};
  dna.definition.neutral_joint_rotations.values = std::vector<float>(3);
  dna.definition.neutral_joint_translations.values =
      std::vector<float>{0, std::numeric_limits<float>::quiet_NaN(), 0};
  std::vector<Warning> warnings;
  EXPECT_TRUE(validate(dna, warnings).has_value());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].where, "definition.neutral_joint_translations[1]");
}

}  // namespace
}  // namespace risorius::dna
