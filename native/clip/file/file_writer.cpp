// SPDX-License-Identifier: MIT
// Writes a clip during its recording to PATH.part, which becomes PATH at the end.
#include "clip/file/file_writer.h"

#include <algorithm>
#include <string>
#include <system_error>

#include "bytes/path_text.h"

namespace risorius::clip {

namespace {

using core::ErrorCode;
using core::fail;

// The path with the last 12 bytes of the file's name removed, to make room for a suffix. No UTF-8
// character is cut.
std::filesystem::path shortened(const std::filesystem::path& path) {
  constexpr std::size_t kRoom = 12;
  std::u8string name = path.filename().u8string();
  std::size_t length = name.size() - std::min(name.size(), kRoom);
  while (length > 0 && (name[length] & 0xC0) == 0x80) --length;
  return path.parent_path() / name.substr(0, length);
}

core::Unexpected failure(const std::filesystem::path& path, const std::error_code& reason) {
  return fail(ErrorCode::kIoWrite, "",
              "cannot write " + bytes::utf8(path) + ": " + bytes::write_trouble(reason));
}

}  // namespace

core::Result<FileWriter> FileWriter::create(const std::filesystem::path& path, Head head,
                                            std::size_t block_frames,
                                            const bytes::FileCalls& calls) {
  auto encoder = Encoder::create(std::move(head), block_frames);
  if (!encoder) return std::move(encoder).propagate();
  FileWriter writer(std::move(encoder).value());
  writer.path_ = bytes::linked_file(path);
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    return failure(path, std::make_error_code(std::errc::is_a_directory));
  }
  if (const std::error_code error = writer.open_part(calls)) return failure(path, error);
  RISORIUS_TRY(writer.write_ready());
  return writer;
}

// Opens PATH.part. If this file exists, it may be the rest of an interrupted recording, so
// PATH.2.part and so on is opened instead.
std::error_code FileWriter::open_part(const bytes::FileCalls& calls) {
  constexpr int kMostParts = 100;
  std::filesystem::path base = path_;
  std::error_code error;
  for (int i = 1; i <= kMostParts && !file_; ++i) {
    part_ = base;
    part_ += i == 1 ? ".part" : "." + std::to_string(i) + ".part";
    file_ = bytes::NewFile::create(part_, bytes::NewFile::Leftover::kKeep, error, calls);
    if (error == std::errc::filename_too_long && base == path_) {
      base = shortened(path_);
      i = 0;
    } else if (error && error != std::errc::file_exists) {
      break;
    }
  }
  return error;
}

// Writes the finished bytes to the file, so that they are not lost if this process ends.
core::Status FileWriter::write_ready() {
  const Bytes bytes = encoder_.take();
  if (const std::error_code error = file_->write(bytes)) return failure(part_, error);
  return core::ok();
}

core::Status FileWriter::append(std::span<const float> frames, std::span<const double> times) {
  if (!trouble_) return trouble_;
  if (!is_open()) return fail(ErrorCode::kInvalidArgument, "", "the clip has been closed");
  RISORIUS_TRY(encoder_.append(frames, times));
  return trouble_ = write_ready();
}

core::Status FileWriter::close() {
  if (is_open() && trouble_.has_value()) {
    encoder_.finish();
    trouble_ = write_ready();
    const std::error_code error =
        trouble_.has_value() ? file_->take_place_of(path_) : std::error_code();
    if (error) trouble_ = failure(path_, error);
  }
  file_.reset();
  return trouble_;
}

}  // namespace risorius::clip
