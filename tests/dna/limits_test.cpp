// SPDX-License-Identifier: MIT
// Limits stop only input that exceeds them. Text that is not JSON, or repeats a member, is refused
// with its place.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "dna/convert/lods.h"
#include "dna/file/json.h"
#include "dna/file/parse.h"
#include "dna/file/write.h"
#include "dna/index_map.h"
#include "support/full_face.h"

namespace risorius::dna {
namespace {

using core::ErrorCode;
using Bytes = std::vector<std::uint8_t>;

Bytes face(std::uint16_t minor) {
  std::vector<Warning> warnings;
  return *write(testing_support::make_full_face(), {minor, false}, warnings);
}

core::Result<Dna> parse_within(const Bytes& bytes, const Limits& limits) {
  ParseOptions options;
  options.limits = limits;
  bytes::SpanSource source(bytes);
  return parse(source, options);
}

// Expects that a file is read within the limits `enough`, and that with the limits `too_little` the
// error names the field `where` at which the limit was exceeded.
void expect_limit(const Bytes& bytes, const Limits& enough, const Limits& too_little,
                  const std::string& where) {
  const auto read = parse_within(bytes, enough);
  EXPECT_TRUE(read.has_value()) << read.error().describe();
  const auto stopped = parse_within(bytes, too_little);
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::kLimitExceeded);
  EXPECT_EQ(stopped.error().where, where);
  EXPECT_TRUE(stopped.error().offset.has_value());
}

TEST(DnaLimits, StopAFileOfTooManyBytes) {
  const Bytes bytes = face(8);
  Limits enough, too_little;
  enough.max_bytes = bytes.size();
  too_little.max_bytes = bytes.size() - 1;
  expect_limit(bytes, enough, too_little, "");
}

TEST(DnaLimits, StopAnIndexOfTooManyLayers) {
  Limits enough, too_little;
  enough.max_layers = 11;
  too_little.max_layers = 10;
  expect_limit(face(8), enough, too_little, "index");
}

TEST(DnaLimits, StopAListOfTooManyElements) {
  Limits enough, too_little;
  enough.max_count = 6;  // the values of the first joint group
  too_little.max_count = 5;
  expect_limit(face(1), enough, too_little, "behavior.joint_groups[0].values");
}

std::string face_as_json() {
  const Bytes bytes = face(8);
  bytes::SpanSource source(bytes);
  return *to_json(*parse(source));
}

void expect_json_limit(const Limits& enough, const Limits& too_little, const std::string& where) {
  const std::string text = face_as_json();
  const auto read = from_json(text, enough);
  EXPECT_TRUE(read.has_value()) << read.error().describe();
  const auto stopped = from_json(text, too_little);
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::kLimitExceeded);
  EXPECT_EQ(stopped.error().where, where);
}

TEST(DnaLimits, StopATextOfTooManyBytes) {
  Limits enough, too_little;
  enough.max_bytes = face_as_json().size();
  too_little.max_bytes = enough.max_bytes - 1;
  expect_json_limit(enough, too_little, "");
}

TEST(DnaLimits, StopAJsonListOfTooManyElements) {
  Limits enough, too_little;
  enough.max_count = 11;  // the entries of the index
  too_little.max_count = 10;
  expect_json_limit(enough, too_little, "index.entries");
}

TEST(DnaLimits, StopAJsonListOfTooManyNumbers) {
  const Dna dna = testing_support::make_full_face();  // its index is empty
  Limits limits;
  limits.max_count = 5;  // six values in the first joint group
  const auto stopped = from_json(*to_json(dna), limits);
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::kLimitExceeded);
  EXPECT_EQ(stopped.error().where, "bhvr1.1.joints.jointGroups[0].values");
}

TEST(DnaLimits, StopATextThatIsTooDeep) {
  // The eight nested levels of the deepest value: root, layer mlbe, its types, a type, operation
  // sets, a set, an operation, its parameters.
  Limits enough, too_little;
  enough.max_nesting = 8;
  too_little.max_nesting = 7;
  expect_json_limit(enough, too_little, "");
}

// ---- refused JSON

const std::string kBegin = R"({"version": {"generation": 2, "version": 8})";

core::Error error_of(const std::string& text) {
  const auto dna = from_json(text);
  EXPECT_FALSE(dna.has_value()) << text.substr(0, 80);
  return dna ? core::Error{} : dna.error();
}

void expect_not_json(const std::string& text, std::uint64_t offset) {
  const core::Error error = error_of(text);
  EXPECT_EQ(error.code, ErrorCode::kNotDna) << text.substr(0, 80);
  EXPECT_EQ(error.offset, offset) << text.substr(0, 80);
}

TEST(DnaJson, NeedsOnlyItsVersion) { EXPECT_TRUE(from_json(kBegin + "}").has_value()); }

TEST(DnaJson, RefusesWhatIsNotJsonWithTheByte) {
  expect_not_json("", 0);
  expect_not_json(kBegin, kBegin.size());
  expect_not_json(kBegin + "} x", kBegin.size() + 2);
  expect_not_json(kBegin + std::string("}\0{", 3), kBegin.size() + 1);
}

TEST(DnaJson, RefusesTextThatIsNotUtf8) {
  const std::string begin = kBegin + R"(, "x": ")";
  for (const char* text : {"\xff", "\xc0\x80", "\xed\xa0\x80", "\xe2\x82", "\xf5\x80\x80\x80"}) {
    const core::Error error = error_of(begin + text + "\"}");
    EXPECT_EQ(error.code, ErrorCode::kNotDna);
    EXPECT_GE(error.offset.value_or(0), begin.size());
  }
  EXPECT_EQ(error_of(begin + "\\ud800\"}").code, ErrorCode::kNotDna);
}

TEST(DnaJson, RefusesAMemberThatIsThereTwice) {
  const core::Error error = error_of(kBegin + R"(, "version": {"generation": 2, "version": 1}})");
  EXPECT_EQ(error.code, ErrorCode::kInvalidValue);
  EXPECT_EQ(error.where, "version");
  EXPECT_EQ(error_of(kBegin + R"(, "": 1, "": 2})").where, "\"\"");
}

TEST(DnaJson, RefusesTextsOfAnyDepthBeforeItBuildsThem) {
  for (const char* open : {"[", "{\"a\":"}) {
    std::string deep;
    for (int i = 0; i < 1000000; ++i) deep += open;
    const core::Error error = error_of(deep);
    EXPECT_EQ(error.code, ErrorCode::kLimitExceeded);
    EXPECT_EQ(error.offset, 32 * std::string(open).size());
  }
}

// The face as JSON, with another text in the place of its lodCount.
std::string with_lod_count(const std::string& number) {
  std::string text = face_as_json();
  const std::string before = "\"lodCount\": 2";
  const std::size_t at = text.find(before);
  EXPECT_NE(at, std::string::npos);
  return text.replace(at, before.size(), "\"lodCount\": " + number);
}

TEST(DnaJson, RefusesNumbersThatDoNotFitTheirField) {
  for (const char* number :
       {"-1", "65536", "1.5", "2.0", "18446744073709551616", "\"2\"", "null", "true", "[2]"}) {
    const core::Error error = error_of(with_lod_count(number));
    EXPECT_EQ(error.code, ErrorCode::kInvalidValue) << number;
    EXPECT_EQ(error.where, "desc1.1.lodCount") << number;
  }
}

TEST(DnaJson, RefusesNumbersBeyondEveryFloatWithTheByte) {
  for (const char* number : {"1e39", "-1e999", "1e999999999999"}) {
    const std::string text = with_lod_count(number);
    const core::Error error = error_of(text);
    EXPECT_EQ(error.code, ErrorCode::kInvalidValue) << number;
    EXPECT_EQ(error.offset, text.find(number)) << number;
  }
}

TEST(DnaJson, KeepsTheSmallestAndLargestFloats) {
  Dna dna = testing_support::make_full_face();
  const std::vector<float> values{1e-45f,          -3.4028235e38f, 16777216.0f,
                                  1.17549435e-38f, -0.0f,          1e20f};
  dna.behavior.joint_groups[0].values = values;
  const auto again = from_json(*to_json(dna));
  ASSERT_TRUE(again.has_value()) << again.error().describe();
  EXPECT_TRUE(again->behavior.joint_groups[0].values == core::Array<float>(values));
}

// ---- steps

// A list that says of each row whether it is kept: every third row is dropped. Counts its queries.
class CountingRows {
 public:
  explicit CountingRows(std::size_t size) : size_(size) {}
  std::size_t size() const { return size_; }
  bool operator[](std::size_t row) const {
    ++asked_;
    return row % 3 != 1;
  }
  std::size_t asked() const { return asked_; }

 private:
  std::size_t size_;
  mutable std::size_t asked_ = 0;
};

// The list with the number of rows of each LOD is long, and each LOD has all rows. Nevertheless
// drop_rows() may query each row at most once.
TEST(DnaSteps, OfDroppingRowsDoNotGrowWithTheListOfLods) {
  constexpr std::uint16_t kMost = 65535;
  for (const std::size_t entries : {1u, 5000u}) {
    for (const std::uint16_t rows : {std::uint16_t{7}, std::uint16_t{2000}, kMost}) {
      const CountingRows keep(rows);
      core::Array<std::uint16_t> lods = std::vector<std::uint16_t>(entries, kMost);
      detail::drop_rows(keep, lods);
      EXPECT_LE(keep.asked(), rows);
      ASSERT_EQ(lods.size(), entries);
      EXPECT_EQ(lods[entries - 1], rows - (rows + 1) / 3) << rows;
    }
  }
}

TEST(DnaSteps, OfDroppingRowsLeaveTheCountsOfTheKept) {
  core::Array<std::uint16_t> lods = {5, 4, 3, 2, 1, 0, 9};
  detail::drop_rows(std::vector<bool>{true, false, true, false, true}, lods);
  EXPECT_TRUE(lods == (core::Array<std::uint16_t>{3, 2, 2, 1, 1, 0, 3}));
  detail::drop_rows(std::vector<bool>{}, lods);
  EXPECT_TRUE(lods == (core::Array<std::uint16_t>{0, 0, 0, 0, 0, 0, 0}));
}

}  // namespace
}  // namespace risorius::dna
