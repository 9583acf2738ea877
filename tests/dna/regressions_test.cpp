// SPDX-License-Identifier: MIT
// Findings of the fuzz targets (tests/data/fuzz, by number) and the fault behind each.
#include <gtest/gtest.h>

#include <algorithm>

#include "compile/compile.h"
#include "dna/file/json.h"
#include "support/files.h"
#include "support/promises.h"

namespace risorius {
namespace {

using promises::Bytes;

Bytes find(const std::string& name) {
  const Bytes bytes = testing_support::read_file(testing_support::data_folder() / "fuzz" / name);
  EXPECT_FALSE(bytes.empty()) << name;
  return bytes;
}

std::vector<dna::Finding> checked(const Bytes& bytes) {
  bytes::SpanSource source(bytes);
  return dna::check(source);
}

// Number of findings about a field that have an offset within the file.
std::size_t placed(const std::vector<dna::Finding>& findings, const std::string& where,
                   std::size_t file_size) {
  return static_cast<std::size_t>(std::ranges::count_if(findings, [&](const dna::Finding& f) {
    return f.error.where == where && f.error.offset.value_or(file_size + 1) <= file_size;
  }));
}

core::Error json_error(const std::string& name) {
  const Bytes text = find(name);
  const auto dna = dna::from_json({reinterpret_cast<const char*>(text.data()), text.size()});
  EXPECT_FALSE(dna.has_value());
  return dna ? core::Error{} : dna.error();
}

// The fault: a 2.1 load without the behavior did not count its correctives among the controls.
TEST(FuzzFind001, CountsTheCorrectivesThatA21LoadLeavesOut) {
  dna::ParseOptions options;
  options.behavior = false;
  const auto dna = promises::parse(find("001-correctives-not-loaded.dna"), options);
  ASSERT_TRUE(dna.has_value()) << dna.error().describe();
  EXPECT_EQ(dna->unread_controls.psd, 1u);
}

// The fault: the error's offset was the offset in the index, which lies beyond the file's end.
TEST(FuzzFind002, PlacesALayerBeyondTheEndInTheFile) {
  const Bytes bytes = find("002-layer-beyond-the-end.dna");
  EXPECT_EQ(placed(checked(bytes), "rbf_behavior", bytes.size()), 1u);
}

// The fault: findings about a whole list had no offset.
TEST(FuzzFind003, PlacesAListAsAWhole) {
  const Bytes bytes = find("003-joint-metadata-too-short.dna");
  const std::string where = "joint_behavior_metadata.joint_representations";
  EXPECT_EQ(placed(checked(bytes), where, bytes.size()), 1u);
}

// The fault: findings about a missing layer had no offset. Their place is the index that does not
// list the layer.
TEST(FuzzFind004, PlacesAMissingLayerInTheIndex) {
  const auto findings = checked(find("004-no-descriptor.dna"));
  const auto axes = std::ranges::find_if(findings, [](const dna::Finding& f) {
    return f.error.where == "descriptor.coordinate_system";
  });
  ASSERT_NE(axes, findings.end());
  EXPECT_EQ(axes->error.offset, 7u);
}

TEST(FuzzFind005, PlacesALayerThatCouldNotBeReadInTheFile) {
  const Bytes bytes = find("005-descriptor-beyond-the-end.dna");
  const auto findings = checked(bytes);
  EXPECT_EQ(placed(findings, "descriptor.coordinate_system", bytes.size()), 1u);
  EXPECT_EQ(promises::checking(bytes, promises::parse(bytes).has_value()), "");
}

// The fault: the error had neither field nor offset.
TEST(FuzzFind006, NamesAnUnknownMemberAtTheRoot) {
  EXPECT_EQ(json_error("006-unknown-member-at-the-root.json").where, "mleh1.0");
}

// The fault: the second member replaced the first without an error. After a first repair there was
// an error, but it had neither field nor offset.
TEST(FuzzFind007, RefusesAMemberWithoutANameTwice) {
  const core::Error error = json_error("007-member-without-a-name-twice.json");
  EXPECT_EQ(error.code, core::ErrorCode::kInvalidValue);
  EXPECT_EQ(error.where, "\"\"");
}

// The fault: text after the zero byte was ignored.
TEST(FuzzFind008, RefusesATextWithAZeroByte) {
  const core::Error error = json_error("008-zero-byte.json");
  EXPECT_EQ(error.code, core::ErrorCode::kNotDna);
  EXPECT_EQ(error.offset, 44u);
  EXPECT_NE(error.message.find("zero byte"), std::string::npos);
}

// The fault: for rows in which no column has a value, a batch advanced a null pointer, though it
// read nothing from it.
TEST(FuzzFind009, EvaluatesRowsWithoutColumnsInBatches) {
  const auto dna = promises::parse(find("009-no-column-with-a-value.dna"));
  ASSERT_TRUE(dna.has_value()) << dna.error().describe();
  for (std::uint32_t seed = 0; seed < 32; ++seed) EXPECT_EQ(promises::evaluation(*dna, seed), "");
}

TEST(FuzzFind010, RefusesToCompileMoreControlsThanIndicesReach) {
  const auto dna = promises::parse(find("010-more-controls-than-indices.dna"));
  ASSERT_TRUE(dna.has_value()) << dna.error().describe();
  const auto rig = compile::compile(*dna);
  ASSERT_FALSE(rig.has_value());
  EXPECT_EQ(rig.error().code, core::ErrorCode::kLimitExceeded);
  EXPECT_EQ(promises::evaluation(*dna, 0), "");
}

// The fault: there was one finding for each LOD whose number of rows exceeds the table. Together
// the findings took many times the file's size in memory.
TEST(FuzzFind011, SaysOnceWhatIsWrongWithTheLevelsOfATable) {
  const auto findings = checked(find("011-rows-of-levels-beyond-the-table.dna"));
  const auto of_levels = [](const dna::Finding& f) {
    return f.error.where.find("blend_shape_channels.lods") != std::string::npos;
  };
  EXPECT_LE(std::ranges::count_if(findings, of_levels), 3);
  EXPECT_TRUE(std::ranges::any_of(findings, [&](const dna::Finding& f) {
    return of_levels(f) && f.error.message.find("more in this list") != std::string::npos;
  }));
}

TEST(FuzzFinds, KeepEveryPromise) {
  std::size_t turn = 0;
  for (const auto& path : testing_support::dna_files(testing_support::data_folder() / "fuzz")) {
    EXPECT_EQ(promises::everything(testing_support::read_file(path), turn++), "")
        << path.filename();
  }
  EXPECT_GE(turn, 6u);
}

}  // namespace
}  // namespace risorius
