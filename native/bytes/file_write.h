// SPDX-License-Identifier: MIT
// Writes a file so that the old file stays complete until the new file is complete and replaces it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <system_error>

#include "core/result.h"

namespace risorius::bytes {

/// The system calls of a file writer. Tests replace them with failing calls, because a power cut
/// and most kinds of full disks cannot be produced otherwise. A call that fails returns a negative
/// number and sets errno. A call that succeeds returns 0, except that `create` returns a descriptor
/// and `write` the number of bytes that it has written.
struct FileCalls {
  /// Makes a file, which must not exist. If `is_private`, only its owner may read it; otherwise,
  /// and always on Windows, the system's default for new files applies.
  int (*create)(const std::filesystem::path& path, bool is_private);
  std::ptrdiff_t (*write)(int file, const std::uint8_t* bytes, std::size_t count);
  int (*sync)(int file);
  int (*close)(int file);
  int (*rename)(const std::filesystem::path& from, const std::filesystem::path& to);
  int (*sync_folder)(const std::filesystem::path& folder);
};
const FileCalls& system_file_calls();

/// A new file that gets its final name when it is complete.
class NewFile {
 public:
  /// Whether the destructor removes or keeps a file that never got its final name.
  enum class Leftover { kRemove, kKeep };

  /// Makes an empty file. Out: nullopt if it fails, with the system's reason in `error`, which is
  /// std::errc::file_exists if a file with this name exists.
  static std::optional<NewFile> create(const std::filesystem::path& path, Leftover leftover,
                                       std::error_code& error,
                                       const FileCalls& calls = system_file_calls());
  /// Makes a file in the folder of `target` under a hidden name, whose length does not depend on
  /// the name of `target`. If `target` exists, only the owner can read the new file until
  /// take_place_of gives it the rights of `target` (not on Windows). The destructor removes the
  /// file if take_place_of has not renamed it. Out: nullopt if it fails, with the reason in
  /// `error`: is_a_directory if `target` is a folder, not_a_directory if its folder is a file,
  /// otherwise the system's reason.
  static std::optional<NewFile> beside(const std::filesystem::path& target, std::error_code& error,
                                       const FileCalls& calls = system_file_calls());

  /// Opens a complete file that another program has written, on the file system of its final place.
  /// The file keeps its name until take_place_of, and the destructor does not remove it. Out:
  /// nullopt if it fails, with the system's reason in `error`.
  static std::optional<NewFile> adopt(const std::filesystem::path& path, std::error_code& error,
                                      const FileCalls& calls = system_file_calls());

  NewFile(NewFile&& other) noexcept;
  NewFile& operator=(NewFile&& other) noexcept;
  ~NewFile();

  const std::filesystem::path& path() const { return path_; }
  /// Writes bytes after all bytes that this object wrote before; the first call writes from the
  /// beginning of the file. Out: the system's reason if it fails; some of the bytes may then have
  /// been written.
  std::error_code write(std::span<const std::uint8_t> bytes);
  /// Flushes the file to disk, closes it, gives it the rights of an old `target` if the system
  /// allows it (not on Windows), and replaces `target` with it. Other descriptors of the file must
  /// be closed before. Call it only once. Out: the system's reason if it fails; `target` is then
  /// unchanged.
  std::error_code take_place_of(const std::filesystem::path& target);

 private:
  NewFile(std::filesystem::path path, Leftover leftover, int file, const FileCalls& calls);
  static std::optional<NewFile> create(const std::filesystem::path& path, Leftover leftover,
                                       std::error_code& error, const FileCalls& calls,
                                       bool is_private);
  std::error_code close();
  void drop();

  std::filesystem::path path_;
  const FileCalls* calls_;
  Leftover leftover_;
  int file_;  // -1: closed
};

/// The file that `path` refers to: `path` itself, or, if it is a symbolic link, the end of the
/// chain of links (40 at most), which need not exist. `path` itself if a link cannot be read.
std::filesystem::path linked_file(const std::filesystem::path& path);

/// Makes a hidden folder in the folder of `target`, named like the files of NewFile::beside, for
/// several files that are not in their final places yet. Out: the folder's path; empty if the call
/// fails, with the reason in `error`: is_a_directory if `target` is a folder, not_a_directory if
/// its folder is a file, otherwise the system's reason.
std::filesystem::path make_hidden_folder(const std::filesystem::path& target,
                                         std::error_code& error);

/// Removes the hidden files and folders that NewFile::beside and make_hidden_folder made in
/// `folder` for processes of this machine that have ended. Leftovers that cannot be read or removed
/// are skipped without an error.
void remove_leftovers(const std::filesystem::path& folder);

/// The reason why a file could not be written, as a text: for some reasons a clearer text than the
/// system's, otherwise the system's.
std::string write_trouble(const std::error_code& reason);

/// Writes bytes to a new file beside path, flushes it to disk and replaces path with it; a link
/// stays a link. Removes the leftovers of ended processes in the folder.
/// Fails: kIoWrite with the system's reason; an old file is untouched and nothing is left behind.
core::Status write_file_atomically(const std::filesystem::path& path,
                                   std::span<const std::uint8_t> bytes,
                                   const FileCalls& calls = system_file_calls());

}  // namespace risorius::bytes
