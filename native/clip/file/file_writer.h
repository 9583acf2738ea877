// SPDX-License-Identifier: MIT
// A clip that is written while it is recorded.
#pragma once

#include <filesystem>
#include <optional>
#include <span>

#include "bytes/file_write.h"
#include "clip/file/encoder.h"

namespace risorius::clip {

/// Writes frames to PATH.part as they come, each full block at once, and makes PATH of it when it
/// is closed and on the disk. One that is not closed stays: Reader takes it with Ends::kMayBeCut.
class FileWriter {
 public:
  /// Fails: kInvalidArgument as Encoder; kIoWrite with the system's reason.
  static core::Result<FileWriter> create(
      const std::filesystem::path& path, Head head, std::size_t block_frames = kDefaultBlockFrames,
      const bytes::FileCalls& calls = bytes::system_file_calls());

  /// As Encoder. Fails also: kIoWrite.
  core::Status append(std::span<const float> frames, std::span<const double> times);
  void add(Event event) { encoder_.add(std::move(event)); }
  /// Writes what is left and the index, and gives the file its name; a file of that name from
  /// before is replaced. Fails: kIoWrite; then, and after an append that could not write, PATH is
  /// left as it was, what was written stays in part(), and every later call fails with the same.
  core::Status close();

  bool is_open() const { return file_.has_value(); }
  const Head& head() const { return encoder_.head(); }
  std::uint64_t frame_count() const { return encoder_.frame_count(); }
  /// Where the frames are while the file is open.
  const std::filesystem::path& part() const { return part_; }

 private:
  explicit FileWriter(Encoder encoder) : encoder_(std::move(encoder)) {}
  std::error_code open_part(const bytes::FileCalls& calls);
  core::Status write_ready();

  Encoder encoder_;
  std::filesystem::path path_, part_;
  std::optional<bytes::NewFile> file_;
  core::Status trouble_ = core::ok();  // bytes are missing, so what would follow is no clip
};

}  // namespace risorius::clip
