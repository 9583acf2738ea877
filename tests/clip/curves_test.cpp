// SPDX-License-Identifier: MIT
// Tests that the encoding of the curves of a block is lossless, and that smooth curves become
// small.
#include <gtest/gtest.h>

#include <cfenv>

#include "clip/codec/predict.h"
#include "support/clips.h"

namespace risorius::clip {
namespace {

using namespace testing_support;

Bytes encoded(const Clip& clip) {
  Bytes out;
  encode_curves({clip.curves.data(), clip.frame_count, clip.head.names.size(), clip.frame_count},
                out);
  return out;
}

void expect_back(const Clip& clip, const Bytes& bytes) {
  const auto curves = EncodedCurves::open(bytes, clip.head.names.size(), clip.frame_count);
  ASSERT_TRUE(curves.has_value()) << curves.error().describe();
  std::vector<std::uint32_t> all(clip.head.names.size());
  std::iota(all.begin(), all.end(), 0u);
  std::vector<float> out(clip.curves.size());
  ASSERT_TRUE(curves->decode(all, out.data(), clip.frame_count).has_value());
  EXPECT_TRUE(same_bits(out, clip.curves));
  for (const std::uint32_t i : all) {
    ASSERT_TRUE(curves->decode({&i, 1}, out.data(), clip.frame_count).has_value());
    EXPECT_TRUE(same_bits(std::span(out).first(clip.frame_count), clip.curve(i)))
        << "control " << i;
  }
}

class ClipCurvesOf : public testing::TestWithParam<std::size_t> {};

TEST_P(ClipCurvesOf, EveryKindComeBack) {
  const Clip clip = make_all_kinds(GetParam());
  expect_back(clip, encoded(clip));
}
INSTANTIATE_TEST_SUITE_P(Frames, ClipCurvesOf,
                         testing::Values(1, 2, 3, 5, 6, 7, 8, 63, 64, 511, 512, 4096));

TEST(ClipCurves, RestingControlsCostNextToNothing) {
  Clip clip = make_clip(260, 512);
  EXPECT_LE(encoded(clip).size(), 5u);
  std::fill(clip.curves.begin(), clip.curves.end(), -0.0f);
  EXPECT_LE(encoded(clip).size(), 9u);
}

TEST(ClipCurves, RepeatedControlsCostNextToNothing) {
  const Clip kinds = make_all_kinds(512);
  Clip one = make_clip(1, 512), many = make_clip(100, 512);
  for (std::size_t i = 0; i < 100; ++i) {
    const auto curve = kinds.curve(3);
    std::copy(curve.begin(), curve.end(), many.curves.data() + 512 * i);
    if (i == 0) std::copy(curve.begin(), curve.end(), one.curves.data());
  }
  EXPECT_LE(encoded(many).size(), encoded(one).size() + 99);
  expect_back(many, encoded(many));
}

TEST(ClipCurves, RandomBitsDoNotGrow) {
  for (const std::size_t frames : {1u, 2u, 100u, 512u}) {
    Clip clip = make_clip(9, frames);
    std::mt19937 random(3);
    for (float& value : clip.curves) {
      value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    }
    const Bytes bytes = encoded(clip);
    EXPECT_LE(bytes.size(), 1 + 4 * clip.curves.size());
    expect_back(clip, bytes);
  }
}

// A smooth curve takes at most a third of the size of its float32 values: predicting a polynomial
// of degree 4 leaves only rounding errors.
TEST(ClipCurves, SmoothOnesAreContinued) {
  const Clip clip = make_all_kinds(512);
  Clip smooth = make_clip(1, 512);
  std::copy_n(clip.curve(3).begin(), 512, smooth.curves.data());
  EXPECT_LE(encoded(smooth).size(), 512u * 4 / 3);
}

TEST(ClipCurves, AreTheSameHoweverTheProcessRounds) {
  const Clip clip = make_all_kinds(512);
  const Bytes bytes = encoded(clip);
  std::fesetround(FE_UPWARD);
  const Bytes upward = encoded(clip);
  expect_back(clip, bytes);
  const int after = std::fegetround();
  std::fesetround(FE_TONEAREST);
  EXPECT_EQ(upward, bytes);
  EXPECT_EQ(after, FE_UPWARD) << "the caller's rounding is to stay";
}

TEST(ClipCurves, OfAnotherLengthAreRefused) {
  const Clip clip = make_all_kinds(64);
  Clip smooth = make_clip(1, 64);
  std::copy_n(clip.curve(3).begin(), 64, smooth.curves.data());
  const Bytes bytes = encoded(smooth);
  // A length that differs by one frame is not tested: it may go unnoticed because of the bits that
  // pad the last byte.
  const std::uint32_t first = 0;
  for (const std::size_t frames : {1u, 32u, 64u, 200u}) {
    const auto curves = EncodedCurves::open(bytes, 1, frames);
    ASSERT_TRUE(curves.has_value());
    std::vector<float> out(frames);
    EXPECT_EQ(curves->decode({&first, 1}, out.data(), frames).has_value(), frames == 64) << frames;
  }
}

TEST(ClipCurves, OrderOfFloatsIsTheirOwn) {
  const float values[] = {-INFINITY, -2.0f, -1e-40f, -0.0f, 0.0f, 1e-40f, 1.0f, INFINITY};
  for (std::size_t i = 0; i + 1 < std::size(values); ++i) {
    const auto order = [&](std::size_t k) {
      return static_cast<std::int32_t>(in_order(std::bit_cast<std::uint32_t>(values[k])));
    };
    EXPECT_LT(order(i), order(i + 1)) << i;
    EXPECT_EQ(in_order(static_cast<std::uint32_t>(order(i))),
              std::bit_cast<std::uint32_t>(values[i]));
  }
}

TEST(ClipCurves, DamagedBytesAreRefusedOrGiveSomeCurves) {
  const Clip clip = make_all_kinds(64);
  const Bytes bytes = encoded(clip);
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (const int change : {1, 0x80, 0xFF}) {
      Bytes damaged = bytes;
      damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ change);
      EXPECT_EQ(reading_curves(damaged, 8, 64), "") << at;
    }
    EXPECT_FALSE(EncodedCurves::open(View(bytes).first(at), 8, 64).has_value()) << at;
  }
}

}  // namespace
}  // namespace risorius::clip
