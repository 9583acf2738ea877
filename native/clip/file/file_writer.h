// SPDX-License-Identifier: MIT
// Writes a clip during its recording.
#pragma once

#include <filesystem>
#include <optional>
#include <span>

#include "bytes/file_write.h"
#include "clip/file/encoder.h"

namespace risorius::clip {

/// Writes each block of frames to PATH.part as soon as the block is full, or to PATH.2.part and so
/// on if this file exists. close() renames this file to PATH when its bytes are on the disk. A
/// writer that is not closed leaves the .part file, which Reader opens with Ends::kMayBeCut.
class FileWriter {
 public:
  /// Opens the .part file and writes the clip's head to it.
  /// In: block_frames  1 to 4096: frames that are compressed and written together
  /// Fails: kInvalidArgument with the field (such as a repeated name or a rate that is not above
  ///        0); kIoWrite with the system's reason.
  static core::Result<FileWriter> create(
      const std::filesystem::path& path, Head head, std::size_t block_frames = kDefaultBlockFrames,
      const bytes::FileCalls& calls = bytes::system_file_calls());

  /// Appends frames; each block that becomes full is written to the .part file.
  /// In: frames [n, controls]; times [n] if the clip has them, else empty: seconds, finite, each
  ///     after the one before
  /// Fails: kInvalidArgument (nothing is appended; also after close()), kIoWrite
  core::Status append(std::span<const float> frames, std::span<const double> times);
  void add(Event event) { encoder_.add(std::move(event)); }
  /// Writes the remaining frames and the index, and renames the file to PATH, replacing an existing
  /// file. Fails: kIoWrite. After a failed write, here or in append, PATH is unchanged, the written
  /// bytes remain in part(), and every later call fails with the same error.
  core::Status close();

  bool is_open() const { return file_.has_value(); }
  const Head& head() const { return encoder_.head(); }
  std::uint64_t frame_count() const { return encoder_.frame_count(); }
  /// The file that holds the frames while the writer is open.
  const std::filesystem::path& part() const { return part_; }

 private:
  explicit FileWriter(Encoder encoder) : encoder_(std::move(encoder)) {}
  std::error_code open_part(const bytes::FileCalls& calls);
  core::Status write_ready();

  Encoder encoder_;
  std::filesystem::path path_, part_;
  std::optional<bytes::NewFile> file_;
  // The error of the first failed write, which every later call returns: bytes are missing from the
  // file, so that further bytes would not make a valid clip.
  core::Status trouble_ = core::ok();
};

}  // namespace risorius::clip
