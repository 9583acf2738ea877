// SPDX-License-Identifier: MIT
// Tests of FileWriter, which records a clip into a file.
#include <gtest/gtest.h>

#include <cerrno>
#include <fstream>
#include <random>

#include "clip/file/file_writer.h"
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
  EXPECT_NE(writer.error().message.find("its folder is not there"), std::string::npos);
  const auto folder = FileWriter::create(folder_, {}, 10);
  ASSERT_FALSE(folder.has_value()) << "known before an hour is recorded";
  EXPECT_NE(folder.error().message.find("Is a directory"), std::string::npos);
}

// The system calls during FileWriter::close(), one letter each: s sync, c close, r rename. The call
// whose letter is `failing` fails.
std::string asked;
char failing = 0;

int sync(int file) {
  asked += 's';
  if (failing != 's') return bytes::system_file_calls().sync(file);
  errno = EIO;
  return -1;
}
int close(int file) {
  asked += 'c';
  const int done = bytes::system_file_calls().close(file);
  errno = EIO;
  return failing == 'c' ? -1 : done;
}
int rename(const fs::path& from, const fs::path& to) {
  asked += 'r';
  errno = EIO;
  return failing == 'r' ? -1 : bytes::system_file_calls().rename(from, to);
}

TEST_F(ClipRecording, IsOnTheDiskBeforeItTakesItsNameAndStaysInPartIfThatFails) {
  bytes::FileCalls calls = bytes::system_file_calls();
  calls.sync = sync;
  calls.close = close;
  calls.rename = rename;
  for (const char call : {'s', 'c', 'r', '\0'}) {
    std::ofstream(path()) << "old";
    failing = call;
    asked.clear();
    auto writer = FileWriter::create(path(), make_clip(2, 0).head, 10, calls);
    ASSERT_TRUE(writer.has_value());
    ASSERT_TRUE(writer->append(std::array{1.0f, 2.0f}, {}).has_value());
    const auto closed = writer->close();
    EXPECT_EQ(closed.has_value(), call == '\0') << call;
    if (call == '\0') continue;
    EXPECT_EQ(writer->close().error().message,
              "cannot write " + path().string() + ": Input/output error");
    EXPECT_EQ(read_file(path()).size(), 3u) << call;
    EXPECT_TRUE(decode(read_file(writer->part())).has_value()) << call;
  }
  EXPECT_EQ(asked, "scr");
  EXPECT_GT(read_file(path()).size(), 3u);
}

#ifndef _WIN32

TEST_F(ClipRecording, FollowsALinkAndTakesLongNames) {
  fs::create_symlink("other.rzc", path());
  FileWriter writer = create();
  ASSERT_TRUE(writer.close().has_value());
  EXPECT_TRUE(fs::is_symlink(path()));
  EXPECT_TRUE(decode(read_file(folder_ / "other.rzc")).has_value());
  std::string long_name;
  for (int i = 0; i < 125; ++i) long_name += "\u00e9";
  for (const std::string& name : {long_name, std::string(255, 'n')}) {
    auto taken = FileWriter::create(folder_ / name, make_clip(2, 0).head, 10);
    ASSERT_TRUE(taken.has_value()) << name.size();
    EXPECT_TRUE(fs::exists(taken->part()));
    ASSERT_TRUE(taken->close().has_value());
    EXPECT_TRUE(decode(read_file(folder_ / name)).has_value());
  }
}

#endif

}  // namespace
}  // namespace risorius::clip
