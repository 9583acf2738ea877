// SPDX-License-Identifier: MIT
// If a system call fails while a file is written, the file is complete or unchanged afterwards.
#include "bytes/file_write.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <fstream>
#include <random>
#include <set>

#include "support/files.h"

#ifndef _WIN32
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

namespace risorius::bytes {
namespace {

using testing_support::read_file;
using Bytes = std::vector<std::uint8_t>;
namespace fs = std::filesystem;

// The system calls so far, one letter each: o create, w write, s sync, c close, r rename, f sync of
// the folder. The call whose letter is `failing` fails with the error `reason`. With `in_halves`
// each write stores only the first half of its bytes.
std::string asked;
char failing = 0;
int reason = 0;
bool in_halves = false;

bool fails(char call) {
  asked += call;
  if (call == failing) errno = reason;
  return call == failing;
}
int create(const fs::path& path, bool is_private) {
  return fails('o') ? -1 : system_file_calls().create(path, is_private);
}
std::ptrdiff_t write(int file, const std::uint8_t* bytes, std::size_t count) {
  if (fails('w')) return -1;
  return system_file_calls().write(file, bytes, in_halves ? (count + 1) / 2 : count);
}
int sync(int file) { return fails('s') ? -1 : system_file_calls().sync(file); }
int close(int file) {
  const int done = system_file_calls().close(file);
  return fails('c') ? -1 : done;
}
int rename(const fs::path& from, const fs::path& to) {
  return fails('r') ? -1 : system_file_calls().rename(from, to);
}
int sync_folder(const fs::path& folder) {
  return fails('f') ? -1 : system_file_calls().sync_folder(folder);
}
constexpr FileCalls kCalls = {create, write, sync, close, rename, sync_folder};

class FileWrite : public testing::Test {
 protected:
  FileWrite() {
    folder_ = fs::temp_directory_path() / ("risorius-" + std::to_string(std::random_device{}()));
    fs::create_directories(folder_);
    asked.clear();
    failing = 0;
    in_halves = false;
  }
  ~FileWrite() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  std::size_t file_count() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_;
  const Bytes old_{'o', 'l', 'd'}, new_{'n', 'e', 'w', 'e', 'r'};
};

TEST_F(FileWrite, IsOnTheDiskBeforeItHasItsNameAndTheNameAfterwards) {
  ASSERT_TRUE(write_file_atomically(folder_ / "a", new_, kCalls).has_value());
  EXPECT_EQ(asked, "owscrf");
  EXPECT_EQ(read_file(folder_ / "a"), new_);
}

TEST_F(FileWrite, WhateverFailsTheOldFileStaysAndNothingElse) {
  for (const char call : {'o', 'w', 's', 'c', 'r'}) {
    std::ofstream(folder_ / "a") << "old";
    failing = call;
    reason = ENOSPC;
    const auto status = write_file_atomically(folder_ / "a", new_, kCalls);
    ASSERT_FALSE(status.has_value()) << call;
    EXPECT_EQ(status.error().code, core::ErrorCode::kIoWrite);
    EXPECT_EQ(status.error().message, "cannot write " + (folder_ / "a").string() +
                                          ": No space left on device; the file of that name from "
                                          "before is unchanged")
        << call;
    EXPECT_EQ(read_file(folder_ / "a"), old_) << call;
    EXPECT_EQ(file_count(), 1u) << call;
  }
}

TEST_F(FileWrite, AFolderThatCannotBeSyncedIsNoFailure) {
  failing = 'f';
  reason = EINVAL;
  EXPECT_TRUE(write_file_atomically(folder_ / "a", new_, kCalls).has_value());
}

TEST_F(FileWrite, GoesOnAfterPartsOfWhatWasAsked) {
  in_halves = true;
  ASSERT_TRUE(write_file_atomically(folder_ / "a", new_, kCalls).has_value());
  EXPECT_EQ(asked, "owwwscrf");
  EXPECT_EQ(read_file(folder_ / "a"), new_);
}

TEST_F(FileWrite, OfNoFileFromBeforeAndOfAFolderThatIsNotThereItSaysSo) {
  const fs::path path = folder_ / "none" / "a";
  const auto status = write_file_atomically(path, new_);
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().message, "cannot write " + path.string() + ": its folder is not there");
  const auto folder = write_file_atomically(folder_, new_);
  ASSERT_FALSE(folder.has_value());
  EXPECT_EQ(folder.error().message, "cannot write " + folder_.string() + ": Is a directory");
}

// Windows gives the same error if a folder is missing and if a file has the folder's name. The
// messages of these cases must differ.
TEST_F(FileWrite, AFileInPlaceOfTheFolderIsToldFromNoFolderWhateverTheSystemSays) {
  std::ofstream(folder_ / "file") << "x";
  failing = 'o', reason = ENOENT;
  for (const auto& [name, said] : {std::pair{"file", "a file stands where its folder should be"},
                                   std::pair{"none", "its folder is not there"}}) {
    const core::Status written = write_file_atomically(folder_ / name / "a", Bytes{1}, kCalls);
    ASSERT_FALSE(written);
    EXPECT_NE(written.error().describe().find(said), std::string::npos)
        << written.error().describe();
  }
}

TEST_F(FileWrite, TakesNamesAsLongAsTheSystemDoes) {
  for (const std::size_t length : {244u, 250u, 255u}) {
    const fs::path path = folder_ / std::string(length, 'n');
    ASSERT_TRUE(write_file_atomically(path, new_).has_value()) << length;
    EXPECT_EQ(read_file(path), new_);
  }
}

TEST_F(FileWrite, FilesThatLookLikeTemporaryOnesStay) {
  const std::vector<std::string> names = {"a.part", "a.1.tmp", ".risorius-", ".risorius-x-1-0.part",
                                          ".risorius-elsewhere-99999999-01234567.part"};
  for (const std::string& name : names) std::ofstream(folder_ / name) << name;
  ASSERT_TRUE(write_file_atomically(folder_ / "a", new_).has_value());
  for (const std::string& name : names) EXPECT_TRUE(fs::exists(folder_ / name)) << name;
}

#ifndef _WIN32

std::vector<std::string> hidden_files(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(".")) names.push_back(name);
  }
  return names;
}

TEST_F(FileWrite, WhatADeadWriterLeftGoesAndWhatALiveOneWritesStays) {
  std::error_code error;
  const auto live = NewFile::beside(folder_ / "live", error);
  ASSERT_TRUE(live.has_value());
  const pid_t child = ::fork();
  if (child == 0) {  // dies during a write, as by kill -9
    std::error_code why;
    auto file = NewFile::beside(folder_ / "dead", why);
    ::_exit(file ? 0 : 1);
  }
  int end = 1;
  ASSERT_EQ(::waitpid(child, &end, 0), child);
  ASSERT_EQ(end, 0);
  std::vector<std::string> left = hidden_files(folder_);
  ASSERT_EQ(left.size(), 2u);
  std::erase(left, live->path().filename().string());
  // A leftover of another machine must not be removed: its process may be running there.
  std::string foreign = left.at(0);
  foreign[std::string(".risorius-").size()] ^= 1;
  std::ofstream(folder_ / foreign) << "half";
  ASSERT_TRUE(write_file_atomically(folder_ / "a", new_).has_value());
  const std::set<std::string> stay{live->path().filename().string(), foreign};
  const std::vector<std::string> found = hidden_files(folder_);
  EXPECT_EQ(std::set<std::string>(found.begin(), found.end()), stay);
}

TEST_F(FileWrite, AFileOfAnotherWriterTakesItsPlaceWholeOrStaysWhereItIs) {
  const fs::path target = folder_ / "a";
  std::ofstream(target) << "old";
  std::error_code error;
  const fs::path hidden = make_hidden_folder(target, error);
  ASSERT_FALSE(error);
  EXPECT_EQ(hidden.parent_path(), folder_);
  std::ofstream(hidden / "a") << "new";
  for (const char call : {'s', 'c', 'r'}) {
    failing = call;
    reason = ENOSPC;
    auto file = NewFile::adopt(hidden / "a", error, kCalls);
    ASSERT_TRUE(file);
    EXPECT_EQ(file->take_place_of(target), std::errc::no_space_on_device);
    EXPECT_EQ(read_file(target).size(), 3U);
    EXPECT_TRUE(fs::exists(hidden / "a"));
  }
  failing = 0;
  asked.clear();
  auto file = NewFile::adopt(hidden / "a", error, kCalls);
  ASSERT_TRUE(file);
  EXPECT_FALSE(file->take_place_of(target));
  EXPECT_EQ(asked, "scrf");
  EXPECT_FALSE(fs::exists(hidden / "a"));
  EXPECT_FALSE(NewFile::adopt(hidden / "a", error));
  EXPECT_EQ(error, std::errc::no_such_file_or_directory);
  EXPECT_TRUE(make_hidden_folder(folder_, error).empty());
  EXPECT_EQ(error, std::errc::is_a_directory);
  EXPECT_TRUE(make_hidden_folder(folder_ / "none" / "a", error).empty());
  EXPECT_EQ(error, std::errc::no_such_file_or_directory);
  remove_leftovers(folder_);
  EXPECT_TRUE(fs::exists(hidden));  // this process is alive
}

TEST_F(FileWrite, LinksAreFollowedAlsoToWhereNothingIsYet) {
  fs::create_directory(folder_ / "far");
  fs::create_symlink("far/a", folder_ / "b");
  fs::create_symlink(folder_ / "b", folder_ / "c");
  for (const Bytes& bytes : {old_, new_}) {
    ASSERT_TRUE(write_file_atomically(folder_ / "c", bytes).has_value());
    EXPECT_TRUE(fs::is_symlink(folder_ / "c"));
    EXPECT_TRUE(fs::is_symlink(folder_ / "b"));
    EXPECT_EQ(read_file(folder_ / "far" / "a"), bytes);
  }
  EXPECT_TRUE(hidden_files(folder_ / "far").empty());
}

mode_t rights_of(const fs::path& path) {
  struct stat about = {};
  return ::stat(path.c_str(), &about) == 0 ? about.st_mode & 0777 : 0;
}

mode_t rights_while_written;
std::ptrdiff_t look_and_write(int file, const std::uint8_t* bytes, std::size_t count) {
  struct stat about = {};
  rights_while_written = ::fstat(file, &about) == 0 ? about.st_mode & 0777 : 0;
  return system_file_calls().write(file, bytes, count);
}

TEST_F(FileWrite, ANewFileHasTheUsualRightsAnOldOneItsOwnAndASecretIsNeverOpen) {
  const mode_t mask = ::umask(027);
  FileCalls calls = system_file_calls();
  calls.write = look_and_write;
  EXPECT_TRUE(write_file_atomically(folder_ / "a", new_, calls).has_value());
  EXPECT_EQ(rights_of(folder_ / "a"), 0640u);
  for (const mode_t mode : {0600, 0666, 0400}) {
    ::chmod((folder_ / "a").c_str(), mode);
    EXPECT_TRUE(write_file_atomically(folder_ / "a", new_, calls).has_value());
    EXPECT_EQ(rights_of(folder_ / "a"), mode);
    EXPECT_EQ(rights_while_written, 0600u);
  }
  EXPECT_EQ(::umask(mask), 027u) << "the process's mask is nobody's to change";
}

#endif

}  // namespace
}  // namespace risorius::bytes
