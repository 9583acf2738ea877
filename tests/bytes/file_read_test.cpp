// SPDX-License-Identifier: MIT
// Reads whole files and parts of files, and refuses paths that are not plain files.
#include "bytes/file_read.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "bytes/source.h"

#ifndef _WIN32
#include <sys/stat.h>
#endif

namespace risorius::bytes {
namespace {

namespace fs = std::filesystem;
constexpr ReadBy kBoth[] = {ReadBy::kCopy, ReadBy::kMap};

class FileRead : public testing::Test {
 protected:
  FileRead() {
    folder_ = fs::temp_directory_path() / ("risorius-" + std::to_string(std::random_device{}()));
    fs::create_directories(folder_);
  }
  ~FileRead() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  fs::path file_of(const std::string& text) const {
    std::ofstream(folder_ / "a", std::ios::binary) << text;
    return folder_ / "a";
  }

  fs::path folder_;
};

TEST_F(FileRead, AllBytesCopiedOrMapped) {
  std::string text(100'003, 'x');
  for (std::size_t i = 0; i < text.size(); ++i) text[i] = static_cast<char>(i * 7);
  for (const std::string& wanted : {text, std::string("one"), std::string()}) {
    for (const ReadBy by : kBoth) {
      const auto file = read_file(file_of(wanted), by);
      ASSERT_TRUE(file.has_value());
      EXPECT_EQ(std::string(file->bytes.begin(), file->bytes.end()), wanted);
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(file->bytes.data()) % 64, 0u);
    }
  }
}

TEST_F(FileRead, WhatIsNotThereOrNoFileIsSaid) {
  for (const ReadBy by : kBoth) {
    const auto gone = read_file(folder_ / "gone", by);
    ASSERT_FALSE(gone.has_value());
    EXPECT_EQ(gone.error().code, core::ErrorCode::kIoOpen);
    EXPECT_NE(gone.error().message.find("No such file"), std::string::npos);
    const auto folder = read_file(folder_, by);
    ASSERT_FALSE(folder.has_value());
    EXPECT_EQ(folder.error().code, core::ErrorCode::kIoOpen);
    EXPECT_NE(folder.error().message.find("is a folder, a file was expected"), std::string::npos);
  }
}

TEST_F(FileRead, ASourceReadsFromAnywhereAndStopsAtTheEnd) {
  const auto source = open_file(file_of("0123456789"));
  ASSERT_TRUE(source.has_value());
  EXPECT_EQ((*source)->size(), 10u);
  EXPECT_TRUE((*source)->view().empty());
  std::uint8_t out[4] = {};
  EXPECT_EQ((*source)->read(8, out), 2u);
  EXPECT_EQ(out[0], '8');
  EXPECT_EQ((*source)->read(2, out), 4u);
  EXPECT_EQ(out[3], '5');
  EXPECT_EQ((*source)->read(10, out), 0u);
  EXPECT_FALSE(open_file(folder_).has_value());
  EXPECT_FALSE(open_file(folder_ / "gone").has_value());
}

#ifndef _WIN32
TEST_F(FileRead, AFileIsOnesOwnUnlessOthersMayWriteIt) {
  const fs::path path = file_of("x");
  for (const auto& [mode, own] :
       {std::pair{0600u, true}, {0644u, true}, {0660u, false}, {0602u, false}}) {
    ASSERT_EQ(::chmod(path.c_str(), mode), 0);
    for (const ReadBy by : kBoth) {
      const auto file = read_file(path, by);
      ASSERT_TRUE(file.has_value());
      EXPECT_EQ(file->is_own, own) << std::oct << mode;
    }
  }
}

TEST_F(FileRead, APipeIsNoPlainFileAndNobodyWaitsForIt) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  const auto file = read_file(folder_ / "pipe");
  ASSERT_FALSE(file.has_value());
  EXPECT_NE(file.error().message.find("is no plain file"), std::string::npos);
}
#endif

}  // namespace
}  // namespace risorius::bytes
