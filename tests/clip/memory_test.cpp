// SPDX-License-Identifier: MIT
// Tests that encoding and decoding a clip, and an open reader, take limited heap memory.
#include <gtest/gtest.h>

#include "clip/file/encoder.h"
#include "clip/file/reader.h"
#include "support/clips.h"
#include "support/heap.h"

namespace risorius::clip {
namespace {

using namespace testing_support;

// The size of a clip's content in bytes: values, times, names and events.
std::size_t size_of(const Clip& clip) {
  std::size_t size = 4 * clip.curves.size() + 8 * clip.times.size();
  for (const std::string& name : clip.head.names) size += name.size();
  for (const Event& e : clip.events) size += 18 + e.name.size() + e.value.size();
  return size;
}

// Limits of heap memory: kTimesTheClip times the clip's size for encoding and decoding, and
// kTimesTheFile times the file's size for an open reader (native/README.md documents both), plus
// kBeside bytes for the frames of a writer's block.
constexpr std::size_t kTimesTheClip = 4, kTimesTheFile = 16, kBeside = 64 * 1024;

TEST(ClipMemory, OfWritingGrowsWithTheClip) {
  for (const std::size_t frames : {20'000u, 40'000u}) {
    const Clip clip = make_full_clip(frames);
    const HeapCount heap;
    const auto bytes = encode(clip);
    ASSERT_TRUE(bytes.has_value());
    EXPECT_LE(heap.peak(), kTimesTheClip * size_of(clip) + kBeside);
  }
}

TEST(ClipMemory, OfReadingGrowsWithWhatIsRead) {
  for (const std::size_t frames : {20'000u, 40'000u}) {
    const Clip clip = make_full_clip(frames);
    const Bytes bytes = *encode(clip);
    const HeapCount heap;
    ASSERT_TRUE(decode(bytes).has_value());
    EXPECT_LE(heap.peak(), kTimesTheClip * size_of(clip) + kBeside);
  }
}

// Constant curves, and names that repeat the previous one, take only a few bytes of the file.
// Memory must grow with these bytes: an open reader stores the head, the index, and one block in
// encoded form.
TEST(ClipMemory, OfAnOpenReaderGrowsWithTheFile) {
  for (const std::size_t count : {5'000u, 10'000u}) {
    Clip clip = make_clip(count, 20);
    for (std::size_t i = 0; i < count; ++i) {
      clip.head.names[i] = std::string(1, static_cast<char>(1 + i / 100 % 100));
      clip.head.names[i] += static_cast<char>(1 + i % 100);
      clip.events.push_back({0.0, "", 0.0, ""});
    }
    const Bytes bytes = *encode(clip);
    const HeapCount heap;
    auto reader = Reader::open(std::make_unique<bytes::SpanSource>(bytes));
    ASSERT_TRUE(reader.has_value()) << reader.error().describe();
    std::vector<float> values(count);
    std::vector<std::uint32_t> moving;
    ASSERT_TRUE(reader->resting(0, values, moving).has_value());
    EXPECT_LE(heap.peak(), kTimesTheFile * bytes.size() + kBeside);
  }
}

}  // namespace
}  // namespace risorius::clip
