// SPDX-License-Identifier: MIT
// A clip that is recorded into a file.
#include "clip/file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "support/clips.h"
#include "support/files.h"

namespace risorius::clip {
namespace {

using namespace testing_support;
namespace fs = std::filesystem;

class ClipRecording : public testing::Test {
 protected:
  ClipRecording() {
    folder_ = fs::temp_directory_path() / ("risorius-" + std::to_string(std::random_device{}()));
    fs::create_directories(folder_);
  }
  ~ClipRecording() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  FileWriter create() {
    auto writer = FileWriter::create(path(), make_clip(2, 0).head, 10);
    EXPECT_TRUE(writer.has_value());
    return std::move(writer).value();
  }
  fs::path path() const { return folder_ / "take.rzc"; }

  fs::path folder_;
};

TEST_F(ClipRecording, GetsItsNameWhenItIsClosed) {
  FileWriter writer = create();
  for (int i = 0; i < 25; ++i) {
    const auto v = static_cast<float>(i);
    ASSERT_TRUE(writer.append(std::array{v, -v}, {}).has_value());
  }
  writer.add({0.1, "mark", 0.0, ""});
  EXPECT_FALSE(fs::exists(path()));
  const auto part = decode(read_file(writer.part()), Ends::kMayBeCut);
  ASSERT_TRUE(part.has_value());
  EXPECT_EQ(part->frame_count, 20u) << "whole blocks are in the file at once";
  ASSERT_TRUE(writer.close().has_value());
  EXPECT_FALSE(fs::exists(writer.part()));
  const auto read = decode(read_file(path()));
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->frame_count, 25u);
  EXPECT_EQ(read->curve(1)[24], -24.0f);
  EXPECT_EQ(read->events.size(), 1u);
  EXPECT_TRUE(writer.close().has_value());
  EXPECT_FALSE(writer.append(std::array{0.0f, 0.0f}, {}).has_value());
}

TEST_F(ClipRecording, LeavesEarlierOnesAlone) {
  std::ofstream(path()) << "old";
  fs::path left;
  {
    FileWriter lost = create();
    left = lost.part();
  }
  EXPECT_TRUE(fs::exists(left));
  FileWriter writer = create();
  EXPECT_NE(writer.part(), left);
  EXPECT_EQ(read_file(path()).size(), 3u);
  ASSERT_TRUE(writer.close().has_value());
  EXPECT_GT(read_file(path()).size(), 3u);
  EXPECT_TRUE(fs::exists(left));
}

TEST_F(ClipRecording, WithoutAFolderIsRefused) {
  const auto writer = FileWriter::create(folder_ / "none" / "take.rzc", {}, 10);
  ASSERT_FALSE(writer.has_value());
  EXPECT_EQ(writer.error().code, core::ErrorCode::kIoWrite);
  EXPECT_NE(writer.error().message.find("No such file"), std::string::npos);
}

}  // namespace
}  // namespace risorius::clip
