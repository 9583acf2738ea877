// SPDX-License-Identifier: MIT
// ByteReader gives the same values from bytes in memory and from a file, of which it reads one
// window at a time, even if a window ends within a number. After a failure it gives only zeros.
#include "bytes/byte_reader.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "bytes/byte_writer.h"

namespace risorius::bytes {
namespace {

using Bytes = std::vector<std::uint8_t>;

// A source that has no bytes in memory, like a file. It may have fewer bytes than its size, like a
// file that is cut during reading.
class Pieces final : public Source {
 public:
  explicit Pieces(Bytes bytes, std::size_t missing = 0)
      : size_(bytes.size()), bytes_(std::move(bytes)) {
    bytes_.resize(bytes_.size() - missing);
  }
  std::uint64_t size() const override { return size_; }
  std::size_t read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    read_ += out.size();
    return SpanSource(bytes_).read(offset, out);
  }
  std::size_t read_so_far() const { return read_; }

 private:
  std::size_t size_, read_ = 0;
  Bytes bytes_;
};

// Each test of this class runs once with a source in memory and once with a source that is read in
// pieces.
class ByteReaderOf : public testing::TestWithParam<bool> {
 protected:
  ByteReader& open(Bytes bytes) {
    bytes_ = std::move(bytes);
    if (GetParam()) {
      source_ = std::make_unique<Pieces>(bytes_);
    } else {
      source_ = std::make_unique<SpanSource>(bytes_);
    }
    reader_ = std::make_unique<ByteReader>(*source_);
    return *reader_;
  }

 private:
  Bytes bytes_;
  std::unique_ptr<Source> source_;
  std::unique_ptr<ByteReader> reader_;
};
INSTANTIATE_TEST_SUITE_P(Source, ByteReaderOf, testing::Bool(),
                         [](const auto& about) { return about.param ? "Pieces" : "Memory"; });

TEST_P(ByteReaderOf, NumbersTextsAndListsComeBack) {
  ByteWriter writer;
  writer.u8(0xFE);
  writer.u16(0x8001);
  writer.u32(0xDEADBEEF);
  writer.f32(-0.15625f);
  writer.str("joint");
  writer.list<std::uint16_t>(std::array<std::uint16_t, 2>{1, 0xFFFF});
  writer.list<std::uint32_t>(std::array<std::uint32_t, 3>{5, 0xFFFFFFFF, 6});
  writer.list<float>(std::array{0.5f, -3.0f});
  ByteReader& reader = open(writer.take());
  EXPECT_EQ(reader.u8(), 0xFE);
  EXPECT_EQ(reader.u16(), 0x8001);
  EXPECT_EQ(reader.u32(), 0xDEADBEEF);
  EXPECT_EQ(reader.f32(), -0.15625f);
  EXPECT_EQ(reader.str(), "joint");
  EXPECT_EQ(reader.u16_list(), (core::Array<std::uint16_t>{1, 0xFFFF}));
  std::uint32_t largest = 7;
  EXPECT_EQ(reader.u32_list(&largest), (core::Array<std::uint32_t>{5, 0xFFFFFFFF, 6}));
  EXPECT_EQ(largest, 0xFFFFFFFFu);
  EXPECT_EQ(reader.f32_list(), (core::Array<float>{0.5f, -3.0f}));
  EXPECT_FALSE(reader.failed());
  EXPECT_EQ(reader.left(), 0u);
}

// Lists that are longer than the reader's window are read correctly at every offset within a number
// and within an AVX2 register.
TEST_P(ByteReaderOf, LongListsAreTheSameHoweverTheyLie) {
  for (std::size_t before = 0; before < 33; ++before) {
    for (const std::size_t n : {0u, 1u, 7u, 8u, 9u, 127u, 20000u}) {
      std::vector<std::uint32_t> wanted(n);
      std::iota(wanted.begin(), wanted.end(), 0x00FFFFF0u);
      ByteWriter writer;
      for (std::size_t i = 0; i < before; ++i) writer.u8(0xEE);
      writer.list<std::uint32_t>(wanted);
      writer.u8(0x77);
      ByteReader& reader = open(writer.take());
      reader.skip(before);
      std::uint32_t largest = 0;
      ASSERT_EQ(reader.u32_list(&largest), core::Array<std::uint32_t>(wanted))
          << before << " " << n;
      ASSERT_EQ(largest, n == 0 ? 0 : wanted.back());
      ASSERT_EQ(reader.u8(), 0x77);
    }
  }
}

TEST_P(ByteReaderOf, OneNumberThatIsNotFiniteIsSeenWhereverItLies) {
  for (const float odd : {std::numeric_limits<float>::infinity(), -INFINITY, NAN, -NAN}) {
    for (std::size_t at = 0; at < 40; ++at) {
      std::vector<float> values(40, std::numeric_limits<float>::max());
      values[39 - at] = std::numeric_limits<float>::denorm_min();
      bool finite = true;
      ByteWriter writer;
      writer.list<float>(values);
      values[at] = odd;
      writer.list<float>(values);
      ByteReader& reader = open(writer.take());
      (void)reader.f32_list(&finite);
      ASSERT_TRUE(finite);
      (void)reader.f32_list(&finite);
      ASSERT_FALSE(finite) << at;
    }
  }
}

TEST_P(ByteReaderOf, AFileThatIsCutAnywhereGivesZerosAndOneError) {
  ByteWriter writer;
  writer.u16(0x0101);
  writer.u32(0x01010101);
  writer.str("text");
  writer.list<float>(std::array{1.0f, 2.0f});
  const Bytes whole = writer.take();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    ByteReader& reader =
        open(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)));
    (void)reader.u16();
    (void)reader.u32();
    (void)reader.str();
    (void)reader.f32_list();
    ASSERT_TRUE(reader.failed()) << size;
    const core::Error first = reader.error();
    EXPECT_TRUE(first.code == core::ErrorCode::kTruncated ||
                first.code == core::ErrorCode::kInvalidCount);
    EXPECT_LE(*first.offset, size);
    EXPECT_EQ(reader.u32(), 0u);
    EXPECT_EQ(reader.str(), "");
    EXPECT_TRUE(reader.f32_list().empty());
    EXPECT_TRUE(reader.bytes(0).empty());
    EXPECT_EQ(reader.error().message, first.message) << "the first error stays";
  }
}

TEST_P(ByteReaderOf, ACountIsBelievedOnlyIfItsElementsFit) {
  ByteWriter writer;
  writer.u32(3);
  for (int i = 0; i < 12; ++i) writer.u8(0);
  const Bytes bytes = writer.take();
  EXPECT_EQ(open(bytes).count(4), 3u);
  ByteReader& reader = open(bytes);
  EXPECT_EQ(reader.count(5), 0u);
  ASSERT_TRUE(reader.failed());
  EXPECT_EQ(reader.error().code, core::ErrorCode::kInvalidCount);
  EXPECT_EQ(*reader.error().offset, 0u);
  EXPECT_EQ(reader.error().message, "a count of 3 needs at least 15 bytes, only 12 are left");
  ByteReader& huge = open({0xFF, 0xFF, 0xFF, 0xFF, 0, 0});
  EXPECT_EQ(huge.count(0xFFFFFFFF), 0u) << "the product needs 64 bits";
  EXPECT_TRUE(huge.failed());
}

TEST_P(ByteReaderOf, ACountBeyondTheCallersLimitIsRefused) {
  ByteReader& reader = open({0, 0, 0, 2, 1, 1, 0, 0, 0, 3, 1, 1, 1});
  reader.set_max_count(2);
  EXPECT_EQ(reader.str(), "\x01\x01");
  EXPECT_EQ(reader.str(), "");
  ASSERT_TRUE(reader.failed());
  EXPECT_EQ(reader.error().code, core::ErrorCode::kLimitExceeded);
  EXPECT_EQ(*reader.error().offset, 6u);
  ByteReader& counted = open({0, 0, 0, 3, 1, 1, 1});
  counted.set_max_count(2);
  EXPECT_EQ(counted.count(1), 0u) << "what failed must not be counted on";
}

TEST_P(ByteReaderOf, NothingIsReadBeyondARegion) {
  Bytes bytes(1000);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  ByteReader& reader = open(bytes);
  ASSERT_TRUE(reader.enter(10, 4));
  EXPECT_EQ(reader.u16(), 0x0A0B);
  EXPECT_EQ(reader.left(), 2u);
  EXPECT_EQ(reader.u32(), 0u);
  ASSERT_TRUE(reader.failed());
  EXPECT_EQ(reader.error().code, core::ErrorCode::kTruncated);
  EXPECT_FALSE(reader.enter(0, 1)) << "not before the error is cleared";
  reader.clear_error();
  ASSERT_TRUE(reader.enter(900, 100));
  EXPECT_EQ(reader.u8(), 900 % 256);
  ASSERT_TRUE(reader.enter(11, 1));
  EXPECT_EQ(reader.u8(), 11);
  EXPECT_FALSE(reader.enter(1000, 1));
  EXPECT_EQ(reader.error().code, core::ErrorCode::kTruncated);
  reader.clear_error();
  EXPECT_FALSE(reader.enter(1, std::numeric_limits<std::uint64_t>::max())) << "the sum wraps";
}

TEST_P(ByteReaderOf, LookingAheadMovesNothing) {
  ByteReader& reader = open({0, 1, 2, 3, 4, 5});
  EXPECT_EQ(reader.u8(), 0);
  EXPECT_EQ(reader.peek_u16(4), 0x0405);
  EXPECT_EQ(reader.peek_u16(5), std::nullopt) << "one byte is left there";
  EXPECT_EQ(reader.peek_u16(0), std::nullopt) << "behind the reader";
  EXPECT_EQ(reader.peek_u16(std::numeric_limits<std::uint64_t>::max()), std::nullopt);
  EXPECT_EQ(reader.u8(), 1);
}

TEST_P(ByteReaderOf, BytesAndSkipsStayInside) {
  ByteReader& reader = open({1, 2, 3, 4});
  reader.skip(1);
  EXPECT_EQ(reader.bytes(2), (Bytes{2, 3}));
  EXPECT_EQ(reader.position(), 3u);
  EXPECT_TRUE(reader.bytes(2).empty());
  EXPECT_EQ(reader.error().message, "2 bytes were expected, only 1 are left");
  reader.clear_error();
  ASSERT_TRUE(reader.enter(0, 4));
  reader.skip(5);
  EXPECT_EQ(reader.error().code, core::ErrorCode::kTruncated);
}

TEST_P(ByteReaderOf, AnErrorNamesTheField) {
  ByteReader& reader = open({1});
  const Field groups(reader, "groups", 3);
  {
    const Field passed(reader, "passed");
    (void)reader.u8();
  }
  const Field values(reader, "values");
  EXPECT_EQ(reader.where(), "groups[3].values");
  (void)reader.u8();
  EXPECT_EQ(reader.error().where, "groups[3].values");
}

TEST(ByteReader, AFileThatIsCutWhileItIsReadIsAnError) {
  Pieces source(Bytes(5000, 1), 100);
  ByteReader reader(source);
  EXPECT_TRUE(reader.bytes(5000).empty());
  ASSERT_TRUE(reader.failed());
  EXPECT_EQ(reader.error().code, core::ErrorCode::kIoRead);
}

TEST(ByteReader, LittleIsReadOfWhatIsSkipped) {
  Pieces source(Bytes(10'000'000, 1));
  ByteReader reader(source);
  EXPECT_EQ(reader.u8(), 1);
  reader.skip(9'000'000);
  EXPECT_EQ(reader.u16(), 0x0101);
  EXPECT_LT(source.read_so_far(), 4096u);
}

}  // namespace
}  // namespace risorius::bytes
