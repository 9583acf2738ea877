// SPDX-License-Identifier: MIT
// Writing a file so that the old one is whole until the new one is.
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

/// What writing a file asks of the system. Tests put failing calls in their place: a power cut and
/// most kinds of full disks cannot be had otherwise. All but create return 0 or more for success,
/// and set errno.
struct FileCalls {
  /// A new file's descriptor, readable by its owner alone if `is_private`, else by whom the
  /// system's default for new files lets.
  int (*create)(const std::filesystem::path& path, bool is_private);
  std::ptrdiff_t (*write)(int file, const std::uint8_t* bytes, std::size_t count);
  int (*sync)(int file);
  int (*close)(int file);
  int (*rename)(const std::filesystem::path& from, const std::filesystem::path& to);
  int (*sync_folder)(const std::filesystem::path& folder);
};
const FileCalls& system_file_calls();

/// A file that was created here and takes another name when it is whole.
class NewFile {
 public:
  /// What becomes of a file that has not taken its name.
  enum class Leftover { kRemove, kKeep };

  /// Fails: the system's reason in `error`; std::errc::file_exists where the name is taken.
  static std::optional<NewFile> create(const std::filesystem::path& path, Leftover leftover,
                                       std::error_code& error,
                                       const FileCalls& calls = system_file_calls());
  /// A file in the folder of `target` under a hidden name of its own, as short for a long name as
  /// for a short one, and readable by others only once it has the rights of an old `target`.
  /// Fails: as create; is_a_directory where `target` is one.
  static std::optional<NewFile> beside(const std::filesystem::path& target, std::error_code& error,
                                       const FileCalls& calls = system_file_calls());

  /// A file that another writer has made on the file system of its future place; it stays where it
  /// is until it takes that place. Fails: the system's reason.
  static std::optional<NewFile> adopt(const std::filesystem::path& path, std::error_code& error,
                                      const FileCalls& calls = system_file_calls());

  NewFile(NewFile&& other) noexcept;
  NewFile& operator=(NewFile&& other) noexcept;
  ~NewFile();

  const std::filesystem::path& path() const { return path_; }
  /// Fails: the system's reason; some of the bytes may have been written.
  std::error_code write(std::span<const std::uint8_t> bytes);
  /// Brings the file to the disk, closes it, gives it the rights of an old `target` and puts it in
  /// that one's place. Other descriptors of the file must be closed by now. Once only.
  /// Fails: the system's reason; `target` is as it was.
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
  int file_;  // -1 when it is closed
};

/// The file that `path` means: itself, or what it links to.
std::filesystem::path linked_file(const std::filesystem::path& path);

/// Makes a folder in the folder of `target` under a hidden name as NewFile::beside gives them, for
/// what several files are before they have their places. Fails: as NewFile::beside; then no path.
std::filesystem::path make_hidden_folder(const std::filesystem::path& target,
                                         std::error_code& error);

/// Removes what processes of this machine that have ended left in a folder: files and folders with
/// names as NewFile::beside gives them. Of what cannot be read or removed nothing is said.
void remove_leftovers(const std::filesystem::path& folder);

/// Why a file could not be written, in the system's words or better ones.
std::string write_trouble(const std::error_code& reason);

/// Writes bytes to a new file beside path, brings it to the disk and puts it in path's place; a
/// link stays one. Removes what dead writers left in the folder.
/// Fails: kIoWrite with the system's reason; an old file is untouched and nothing is left behind.
core::Status write_file_atomically(const std::filesystem::path& path,
                                   std::span<const std::uint8_t> bytes,
                                   const FileCalls& calls = system_file_calls());

}  // namespace risorius::bytes
