// SPDX-License-Identifier: MIT
// Tests whole .rzc files: writing and reading is lossless, also if only some frames and controls
// are read. Files that are cut, damaged or too large are refused.
#include <gtest/gtest.h>

#include <numeric>

#include "clip/file/encoder.h"
#include "clip/file/player.h"
#include "clip/file/reader.h"
#include "support/clips.h"
#include "support/files.h"
#include "support/stride.h"

namespace risorius::clip {
namespace {

using namespace testing_support;

Bytes must_encode(const Clip& clip, std::size_t block_frames = 100) {
  auto bytes = encode(clip, block_frames);
  EXPECT_TRUE(bytes.has_value());
  return std::move(bytes).value();
}

Reader must_open(const Bytes& bytes, Ends ends = Ends::kMustBeWhole) {
  auto reader = Reader::open(std::make_unique<bytes::SpanSource>(bytes), ends);
  EXPECT_TRUE(reader.has_value()) << reader.error().describe();
  return std::move(reader).value();
}

void expect_same(const Clip& a, const Clip& b) {
  EXPECT_EQ(a.head, b.head);
  EXPECT_EQ(a.frame_count, b.frame_count);
  EXPECT_EQ(a.times, b.times);
  EXPECT_EQ(a.events, b.events);
  EXPECT_TRUE(same_bits(a.curves, b.curves));
}

class ClipFileOf : public testing::TestWithParam<std::size_t> {};

TEST_P(ClipFileOf, FramesComesBack) {
  const Clip clip = make_full_clip(GetParam());
  const auto read = decode(must_encode(clip));
  ASSERT_TRUE(read.has_value()) << read.error().describe();
  expect_same(*read, clip);
}
INSTANTIATE_TEST_SUITE_P(Frames, ClipFileOf, testing::Values(0, 1, 2, 99, 100, 101, 250));

TEST(ClipFile, WithoutControlsOrTimesComesBack) {
  Clip clip = make_clip(0, 7);
  expect_same(*decode(must_encode(clip)), clip);
  clip = make_clip(3, 300);
  clip.head.start = 2.0;
  expect_same(*decode(must_encode(clip)), clip);
}

TEST(ClipFile, AnyFramesOfAnyControlsAreThoseOfTheWhole) {
  const Clip clip = make_full_clip(250);
  const Bytes bytes = must_encode(clip);
  Reader reader = must_open(bytes);
  EXPECT_EQ(reader.block_starts(), (std::vector<std::uint64_t>{0, 100, 200, 250}));
  const std::vector<std::uint32_t> controls{7, 2, 2, 0, 5};
  for (const auto& [begin, end] : std::vector<std::pair<std::size_t, std::size_t>>{
           {0, 250}, {0, 0}, {250, 250}, {99, 101}, {100, 200}, {249, 250}, {7, 233}}) {
    std::vector<float> out(controls.size() * (end - begin));
    std::vector<double> times(end - begin);
    ASSERT_TRUE(reader.read(begin, end, controls, out.data(), times.data()).has_value());
    for (std::size_t i = 0; i < controls.size(); ++i) {
      EXPECT_TRUE(same_bits(std::span(out).subspan(i * (end - begin), end - begin),
                            clip.curve(controls[i]).subspan(begin, end - begin)));
    }
    EXPECT_TRUE(std::equal(times.begin(), times.end(),
                           clip.times.begin() + static_cast<std::ptrdiff_t>(begin)));
  }
}

TEST(ClipPlayer, GivesTheFramesOfTheClip) {
  const Clip clip = make_full_clip(250);
  const Bytes bytes = must_encode(clip);
  Player player(must_open(bytes));
  for (const std::size_t at : {0u, 1u, 99u, 100u, 249u, 5u, 200u}) {
    const auto frame = player.frame(at);
    ASSERT_TRUE(frame.has_value());
    for (std::size_t k = 0; k < 8; ++k) {
      EXPECT_TRUE(same_bits((*frame).subspan(k, 1), clip.curve(k).subspan(at, 1))) << at;
    }
  }
  EXPECT_EQ(player.frame(250).error().where, "frames");
  EXPECT_EQ(player.frame(UINT64_MAX).error().where, "frames");
  EXPECT_TRUE(player.frame(7).has_value());
}

TEST(ClipFile, FramesThatAreNotThereAreRefused) {
  const Bytes bytes = must_encode(make_full_clip(50));
  Reader reader = must_open(bytes);
  const std::vector<std::uint32_t> one{0}, none{8};
  EXPECT_EQ(reader.may_read(0, 51, one).error().where, "frames");
  EXPECT_EQ(reader.may_read(9, 8, one).error().where, "frames");
  EXPECT_EQ(reader.may_read(0, 50, none).error().where, "controls");
  Limits limits;
  limits.values = 399;
  EXPECT_EQ(decode(bytes, Ends::kMustBeWhole, limits).error().code,
            core::ErrorCode::kLimitExceeded);
  limits = {};
  limits.controls = 7;
  EXPECT_EQ(decode(bytes, Ends::kMustBeWhole, limits).error().where, "head.names");
  limits = {};
  limits.frames = 49;
  const auto long_one = decode(bytes, Ends::kMustBeWhole, limits);
  EXPECT_EQ(long_one.error().code, core::ErrorCode::kLimitExceeded);
  EXPECT_EQ(long_one.error().where, "index");
  limits.frames = 50;
  EXPECT_TRUE(decode(bytes, Ends::kMustBeWhole, limits).has_value());
}

TEST(ClipFile, PairsOfMetadataAreLimited) {
  Clip clip = make_full_clip(3);
  clip.head.metadata = {{"a", "1"}, {"b", "2"}, {"c", "3"}};
  const Bytes bytes = must_encode(clip);
  Limits limits;
  limits.metadata = 3;
  EXPECT_TRUE(decode(bytes, Ends::kMustBeWhole, limits).has_value());
  limits.metadata = 2;
  const auto read = decode(bytes, Ends::kMustBeWhole, limits);
  EXPECT_EQ(read.error().code, core::ErrorCode::kLimitExceeded);
  EXPECT_EQ(read.error().where, "head.metadata");
}

// Each name repeats the previous one and adds a letter, which takes only 3 bytes of the file.
// The names together have 4.5 MB, more than the limit of 1 MB.
TEST(ClipFile, NamesThatGrowOutOfFewBytesAreLimited) {
  Clip clip;
  std::string name;
  for (int i = 0; i < 3000; ++i) clip.head.names.push_back(name += 'x');
  const Bytes bytes = must_encode(clip);
  EXPECT_LT(bytes.size(), 20000u);
  EXPECT_TRUE(decode(bytes).has_value());
  Limits limits;
  limits.head_bytes = 1u << 20;
  const auto read = decode(bytes, Ends::kMustBeWhole, limits);
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().where, "head.names");
}

// The encoder gets the frames in pieces of growing size. It must give the same bytes as encode(),
// which gets the whole clip.
TEST(ClipEncoder, TakesFramesAsTheyCome) {
  Clip clip = make_full_clip(250);
  clip.events.clear();
  auto encoder = Encoder::create(clip.head, 100);
  ASSERT_TRUE(encoder.has_value());
  Bytes bytes;
  std::size_t pieces = 0;
  for (std::size_t begin = 0, count = 0; begin < 250; begin += count) {
    count = std::min<std::size_t>(++pieces * 3, 250 - begin);
    std::vector<float> frames;
    for (std::size_t i = begin; i < begin + count; ++i) {
      for (std::size_t k = 0; k < 8; ++k) frames.push_back(clip.curves[k * 250 + i]);
    }
    ASSERT_TRUE(encoder->append(frames, std::span(clip.times).subspan(begin, count)).has_value());
    const Bytes ready = encoder->take();
    bytes.insert(bytes.end(), ready.begin(), ready.end());
  }
  encoder->finish();
  const Bytes rest = encoder->take();
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  EXPECT_EQ(bytes, must_encode(clip, 100));
}

TEST(ClipEncoder, RefusesWhatIsNoClip) {
  Clip clip = make_full_clip(4);
  Clip bad = clip;
  bad.head.names[3] = bad.head.names[1];
  EXPECT_EQ(encode(bad).error().where, "names[3]");
  bad = clip;
  bad.head.rate = 0.0;
  EXPECT_EQ(encode(bad).error().where, "rate");
  bad = clip;
  bad.times[2] = bad.times[1];
  EXPECT_EQ(encode(bad).error().where, "times[2]");
  bad = clip;
  bad.curves.pop_back();
  EXPECT_EQ(encode(bad).error().where, "curves");
  EXPECT_EQ(encode(clip, 0).error().where, "block_frames");
  EXPECT_EQ(encode(clip, 4097).error().where, "block_frames");
  auto encoder = Encoder::create(clip.head);
  EXPECT_EQ(encoder->append(std::vector<float>(9), std::vector{1.0}).error().where, "frames");
  EXPECT_TRUE(encoder->append(std::vector<float>(8), std::vector{1.0}).has_value());
  EXPECT_EQ(encoder->append(std::vector<float>(8), std::vector{1.0}).error().where, "times[1]");
}

TEST(ClipFile, EveryPrefixIsRefusedAndReadUpToItsLastBlock) {
  const Clip clip = make_full_clip(90);
  const Bytes bytes = must_encode(clip, 30);
  std::uint64_t most = 0;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const View prefix = View(bytes).first(size);
    EXPECT_EQ(reading_clip(prefix, Ends::kMustBeWhole), "");
    const auto whole = decode(prefix);
    ASSERT_FALSE(whole.has_value()) << size;
    EXPECT_FALSE(whole.error().where.empty());
    const auto cut = decode(prefix, Ends::kMayBeCut);
    if (!cut) {
      EXPECT_EQ(cut.error().where.rfind("head", 0), 0u) << cut.error().where;
      continue;
    }
    const std::size_t frames = cut->frame_count;
    EXPECT_EQ(frames % 30, 0u);
    ASSERT_GE(frames, most);
    most = frames;
    for (std::size_t k = 0; k < 8; ++k) {
      EXPECT_TRUE(same_bits(cut->curve(k), clip.curve(k).first(frames)));
    }
    EXPECT_EQ(cut->events.size(), frames > 0 ? 2u : 0u);
  }
  EXPECT_EQ(most, 90u);
}

TEST(ClipFile, EveryDamagedByteIsNoticed) {
  const Bytes bytes = must_encode(make_full_clip(40), 30);
  for (std::size_t at = 0; at < bytes.size(); at += kStride) {
    for (const int change : {1, 0x80, 0xFF}) {
      Bytes damaged = bytes;
      damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ change);
      EXPECT_FALSE(decode(damaged).has_value()) << at;
      EXPECT_EQ(reading_clip(damaged, Ends::kMayBeCut), "") << at;
    }
  }
}

// Bytes are changed and the checksums corrected, as an attacker would do. Reading must either fail
// with an error or give a valid clip.
TEST(ClipFile, DamageUnderAGoodChecksumDoesNoHarm) {
  const Bytes bytes = must_encode(make_full_clip(40), 30);
  Bytes same = bytes;
  seal(same);
  ASSERT_EQ(same, bytes);
  int accepted = 0;
  for (std::size_t at = 0; at < bytes.size(); at += kStride) {
    for (const int change : {1, 0x80, 0xFF}) {
      Bytes damaged = bytes;
      damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ change);
      seal(damaged);
      EXPECT_EQ(reading_clip(damaged, Ends::kMustBeWhole), "") << at;
      EXPECT_EQ(reading_clip(damaged, Ends::kMayBeCut), "") << at;
      accepted += decode(damaged).has_value();
    }
  }
  EXPECT_GT(accepted, 0) << "the checksums were not put right";
}

TEST(ClipFile, BytesBehindTheEndAreRefused) {
  Bytes bytes = must_encode(make_full_clip(40), 30);
  bytes.push_back(0);
  EXPECT_FALSE(decode(bytes).has_value());
}

TEST(ClipFile, AnotherVersionIsNamed) {
  Bytes bytes = must_encode(make_full_clip(4));
  bytes[4] = 9;
  seal(bytes);
  const auto read = decode(bytes);
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, core::ErrorCode::kUnsupportedGeneration);
  EXPECT_NE(read.error().message.find("version 9"), std::string::npos);
}

// The committed file of format version 1 must remain readable, on every processor.
TEST(ClipFile, CommittedFileGivesItsCurves) {
  const Bytes bytes = read_file(data_folder() / "clip" / "version1.rzc");
  ASSERT_FALSE(bytes.empty());
  const auto read = decode(bytes);
  ASSERT_TRUE(read.has_value()) << read.error().describe();
  expect_same(*read, make_full_clip(250));
}

TEST(ClipPromises, SeeBrokenOnes) {
  const Bytes bytes = must_encode(make_full_clip(40));
  EXPECT_EQ(reading_clip(bytes, Ends::kMustBeWhole), "");
  EXPECT_EQ(keeping_bits(bytes, 3), "");
}

}  // namespace
}  // namespace risorius::clip
