// SPDX-License-Identifier: MIT
#include "clip/file.h"

#include <cerrno>
#include <string>
#include <system_error>

#include "core/path_text.h"

namespace risorius::clip {

namespace {

using core::ErrorCode;
using core::fail;

std::FILE* create_new(const std::filesystem::path& path) {
#ifdef _WIN32
  std::FILE* file = nullptr;
  const int reason = _wfopen_s(&file, path.c_str(), L"wbx");
  if (reason != 0) errno = reason;
  return file;
#else
  return std::fopen(path.c_str(), "wbx");
#endif
}

core::Unexpected failure(const std::filesystem::path& path, const std::string& reason) {
  return fail(ErrorCode::kIoWrite, "", "cannot write " + core::utf8(path) + ": " + reason);
}

core::Unexpected failure(const std::filesystem::path& path, int reason) {
  return failure(path, std::generic_category().message(reason));
}

}  // namespace

core::Result<FileWriter> FileWriter::create(const std::filesystem::path& path, Head head,
                                            std::size_t block_frames) {
  auto encoder = Encoder::create(std::move(head), block_frames);
  if (!encoder) return std::move(encoder).propagate();
  FileWriter writer(std::move(encoder).value());
  writer.path_ = path;
  // What an earlier recording left when it ended badly is never written over.
  for (int i = 1; i <= 100 && !writer.file_; ++i) {
    writer.part_ = path;
    writer.part_ += i == 1 ? ".part" : "." + std::to_string(i) + ".part";
    errno = 0;
    writer.file_.reset(create_new(writer.part_));
    if (!writer.file_ && errno != EEXIST) break;
  }
  if (!writer.file_) return failure(writer.part_, errno);
  if (auto written = writer.write_ready(); !written) return std::move(written).propagate();
  return writer;
}

// What is written reaches the system, so that it outlives this process.
core::Status FileWriter::write_ready() {
  const Bytes bytes = encoder_.take();
  if (bytes.empty()) return core::ok();
  errno = 0;
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) == bytes.size() &&
                       std::fflush(file_.get()) == 0;
  if (!written) return failure(part_, errno);
  return core::ok();
}

core::Status FileWriter::append(std::span<const float> frames, std::span<const double> times) {
  if (!trouble_) return trouble_;
  if (!is_open()) return fail(ErrorCode::kInvalidArgument, "", "the clip has been closed");
  if (auto taken = encoder_.append(frames, times); !taken) return taken;
  return trouble_ = write_ready();
}

core::Status FileWriter::close() {
  if (!trouble_) file_.reset();
  if (!is_open()) return trouble_;
  encoder_.finish();
  trouble_ = write_ready();
  errno = 0;
  if (std::fclose(file_.release()) != 0 && trouble_) trouble_ = failure(part_, errno);
  if (!trouble_) return trouble_;
  std::error_code error;
  std::filesystem::rename(part_, path_, error);
  if (error) trouble_ = failure(path_, error.message());
  return trouble_;
}

}  // namespace risorius::clip
