// SPDX-License-Identifier: MIT
// Opens files of compiled faces, which anybody may have written or changed.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include "rig/rig_file.h"

#ifndef _WIN32
#include <sys/stat.h>
#include <unistd.h>
#endif

#include "rig/block.h"
#include "support/face.h"

namespace risorius::rig {
namespace {

using namespace testing_support;
using bytes::ReadBy;
using std::filesystem::path;
using Bytes = std::vector<std::uint8_t>;

constexpr Trust kTrusts[] = {Trust::kOwner, Trust::kNobody, Trust::kCaller};

class RigFile : public testing::Test {
 protected:
  RigFile() {
    folder_ = std::filesystem::temp_directory_path() /
              ("risorius-" + std::to_string(std::random_device{}()));
    std::filesystem::create_directories(folder_);
    dna::Dna dna = make_face(2, 1, 2);
    dna.behavior.psds.rows = {2, 2};
    dna.behavior.psds.columns = {0, 1};
    dna.behavior.psds.values = {1.0f, 1.0f};
    dna.behavior.joint_groups = std::vector{make_probe({0, 1, 2})};
    rig_ = std::make_unique<Rig>(must_compile(dna));
    bytes_.assign(rig_->block().begin(), rig_->block().end());
  }
  ~RigFile() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  path write(const Bytes& bytes) {
    const path file = folder_ / ("face" + std::to_string(++files_));
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    return file;
  }
  core::Result<Rig> open(const path& file, Trust trust, ReadBy by = ReadBy::kCopy) {
    return open_rig_file(file, trust, by, simd::scalar_kernels());
  }
  // Expects that a file of these bytes is rejected with an error for the field `where`, whose
  // message begins with the path of the file and contains `words`.
  void expect_refused(const Bytes& bytes, Trust trust, const std::string& where,
                      const std::string& words = "") {
    const path file = write(bytes);
    const auto rig = open(file, trust);
    ASSERT_FALSE(rig.has_value()) << where;
    EXPECT_EQ(rig.error().where, where);
    EXPECT_EQ(rig.error().message.rfind(file.string() + ": ", 0), 0u) << rig.error().message;
    EXPECT_NE(rig.error().message.find(words), std::string::npos) << rig.error().message;
  }
  Bytes changed(std::size_t at, std::uint8_t value) const {
    Bytes out = bytes_;
    out[at] = value;
    return out;
  }
  // The bytes of a face whose damage only the check of indices can find, because its hash is
  // corrected.
  Bytes with_wild_index() const {
    Bytes out = bytes_;
    const auto* factor = reinterpret_cast<const std::uint8_t*>(rig_->psd_factors.data());
    std::memset(out.data() + (factor - rig_->block().data()), 0xFF, 2);
    core::AlignedVector<std::uint8_t> aligned(out.begin(), out.end());
    seal_block(aligned);
    return {aligned.begin(), aligned.end()};
  }

  path folder_;
  std::unique_ptr<Rig> rig_;
  Bytes bytes_;
  int files_ = 0;
};

TEST_F(RigFile, EvaluatesAsTheRigThatItCameFrom) {
  const path file = folder_ / "face.rig";
  ASSERT_TRUE(save_rig(*rig_, file).has_value());
  for (const Trust trust : kTrusts) {
    for (const ReadBy by : {ReadBy::kCopy, ReadBy::kMap}) {
      const auto again = open_rig_file(file, trust, by, *rig_->kernels);
      ASSERT_TRUE(again.has_value()) << again.error().describe();
      EXPECT_TRUE(std::ranges::equal(again->block(), rig_->block()));
      const std::vector<float> raw{0.5f, 0.75f};
      EXPECT_EQ(evaluate_once(*again, raw).joints, evaluate_once(*rig_, raw).joints);
    }
  }
}

TEST_F(RigFile, PrefixesAndMoreBytesAreRefused) {
  const std::size_t header = static_cast<std::size_t>(
      reinterpret_cast<const std::uint8_t*>(rig_->text.data()) - rig_->block().data());
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{1}, header / 2, header, bytes_.size() / 2, bytes_.size() - 1}) {
    const Bytes cut(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(size));
    for (const Trust trust : kTrusts) expect_refused(cut, trust, "rig.size", "expected");
  }
  Bytes longer = bytes_;
  longer.push_back(0);
  for (const Trust trust : kTrusts) expect_refused(longer, trust, "rig.size", "expected");
}

// The fields of the header begin at these bytes: magic 0, version 7, byte order 8, header size 12,
// size 16, hash 24, the numbers of RigHeader 32.
TEST_F(RigFile, ABitOfEachFieldOfTheHeaderIsFound) {
  const auto flipped = [&](std::size_t at) { return static_cast<std::uint8_t>(bytes_[at] ^ 1); };
  for (const Trust trust : kTrusts) {
    expect_refused(changed(0, flipped(0)), trust, "rig.magic", "no compiled face");
    expect_refused(changed(8, flipped(8)), trust, "rig.byte_order");
    expect_refused(changed(12, flipped(12)), trust, "rig.header_size", "bytes");
    expect_refused(changed(16, flipped(16)), trust, "rig.size");
  }
  for (const Trust trust : {Trust::kOwner, Trust::kNobody}) {
    expect_refused(changed(24, flipped(24)), trust, "rig.hash");
    for (std::size_t at = 32; at < 64; ++at) {
      expect_refused(changed(at, flipped(at)), trust, "rig.hash");
    }
  }
}

// One bit is flipped at a time, in every 13th byte. Arrays begin on multiples of 64 bytes, so at
// least four flipped bits are in each array or in the gap after it.
TEST_F(RigFile, AFlippedBitOfOnesOwnFileIsFound) {
  const path file = folder_ / "face.rig";
  for (std::size_t at = 0; at < bytes_.size(); at += 13) {
    const auto bit = static_cast<std::uint8_t>(1u << (at % 8));
    const Bytes flipped = changed(at, bytes_[at] ^ bit);
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(flipped.data()),
               static_cast<std::streamsize>(flipped.size()));
    const ReadBy by = at % 2 == 0 ? ReadBy::kCopy : ReadBy::kMap;
    EXPECT_FALSE(open(file, Trust::kOwner, by).has_value()) << at;
  }
}

TEST_F(RigFile, AnotherVersionIsNamed) {
  const std::string version = std::to_string(block_version());
  expect_refused(changed(7, 1), Trust::kCaller, "rig.magic",
                 "of version 1, version " + version + " was expected");
}

TEST_F(RigFile, AnotherByteOrderIsNamed) {
  Bytes turned = bytes_;
  std::reverse(turned.begin() + 8, turned.begin() + 12);
  expect_refused(turned, Trust::kCaller, "rig.byte_order", "byte order");
}

TEST_F(RigFile, AnIndexOutsideItsSpaceUnderARightHashIsRefusedByTheFullCheck) {
  const Bytes wild = with_wild_index();
  expect_refused(wild, Trust::kNobody, "rig.psd_factors");
  EXPECT_TRUE(open(write(wild), Trust::kCaller).has_value());
}

TEST_F(RigFile, AFolderAndNothingAreRefused) {
  const auto folder = open(folder_, Trust::kCaller);
  ASSERT_FALSE(folder.has_value());
  EXPECT_EQ(folder.error().code, core::ErrorCode::kIoOpen);
  EXPECT_NE(folder.error().message.find(folder_.string() + " is a folder"), std::string::npos);
  const auto absent = open(folder_ / "absent", Trust::kOwner, ReadBy::kMap);
  ASSERT_FALSE(absent.has_value());
  EXPECT_EQ(absent.error().code, core::ErrorCode::kIoOpen);
  EXPECT_NE(absent.error().message.find("absent"), std::string::npos);
}

TEST_F(RigFile, AFolderThatIsNotThereCannotBeWritten) {
  const auto status = save_rig(*rig_, folder_ / "absent" / "face.rig");
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().code, core::ErrorCode::kIoWrite);
}

#ifndef _WIN32

constexpr uid_t kNobody = 65534;

// The file contains a wrong index, which only the full check finds. With Trust::kOwner the full
// check is made only if other users may write the file.
TEST_F(RigFile, AFileThatOthersMayWriteGetsTheFullCheck) {
  const path file = write(with_wild_index());
  for (const ReadBy by : {ReadBy::kCopy, ReadBy::kMap}) {
    ::chmod(file.c_str(), 0644);
    EXPECT_TRUE(open(file, Trust::kOwner, by).has_value());
    for (const mode_t mode : {0664, 0646}) {
      ::chmod(file.c_str(), mode);
      EXPECT_FALSE(open(file, Trust::kOwner, by).has_value()) << mode;
      EXPECT_TRUE(open(file, Trust::kCaller, by).has_value()) << mode;
    }
  }
}

TEST_F(RigFile, AFileOfAnotherUserGetsTheFullCheck) {
  const path file = write(with_wild_index());
  ::chmod(file.c_str(), 0644);
  if (::chown(file.c_str(), kNobody, static_cast<gid_t>(-1)) == 0) {
    EXPECT_FALSE(open(file, Trust::kOwner).has_value());
  } else {
    // Only root may give a file to another user. Without that right, a system file serves as a file
    // of another user.
    const auto other = bytes::read_file("/etc/passwd");
    ASSERT_TRUE(other.has_value());
    EXPECT_FALSE(other->is_own);
  }
}

TEST_F(RigFile, AFileThatMayNotBeReadIsRefused) {
  const path file = write(bytes_);
  ::chmod(file.c_str(), 0);
  const bool root = ::geteuid() == 0;
  if (root) {  // root may do everything
    ASSERT_EQ(::seteuid(kNobody), 0);
  }
  const auto rig = open(file, Trust::kCaller);
  if (root) {
    ASSERT_EQ(::seteuid(0), 0);
  }
  ASSERT_FALSE(rig.has_value());
  EXPECT_EQ(rig.error().code, core::ErrorCode::kIoOpen);
  EXPECT_NE(rig.error().message.find(file.string()), std::string::npos);
}

TEST_F(RigFile, APipeIsRefusedAndNotWaitedFor) {
  const path pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const auto rig = open(pipe, Trust::kOwner);
  ASSERT_FALSE(rig.has_value());
  EXPECT_NE(rig.error().message.find("no plain file"), std::string::npos);
}

#endif

TEST_F(RigFile, AMappedRigOutlivesTheReplacementOfItsFile) {
  const path file = folder_ / "face.rig";
  ASSERT_TRUE(save_rig(*rig_, file).has_value());
  const auto mapped = open_rig_file(file, Trust::kCaller, ReadBy::kMap, *rig_->kernels);
  ASSERT_TRUE(mapped.has_value());
  ASSERT_TRUE(save_rig(must_compile(make_face(5, 0, 3)), file).has_value());
  const std::vector<float> raw{0.5f, 0.75f};
  EXPECT_EQ(evaluate_once(*mapped, raw).joints, evaluate_once(*rig_, raw).joints);
  std::filesystem::remove(file);
  EXPECT_TRUE(std::ranges::equal(mapped->block(), rig_->block()));
}

}  // namespace
}  // namespace risorius::rig
