// SPDX-License-Identifier: MIT
#include "core/file_write.h"

#include <cerrno>
#include <cstdio>
#include <random>
#include <string>
#include <system_error>

#include "core/path_text.h"

#ifdef _WIN32
#include <io.h>
#else
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

namespace risorius::core {

namespace {

std::FILE* create_new(const std::filesystem::path& path) {
#ifdef _WIN32
  std::FILE* file = nullptr;
  return _wfopen_s(&file, path.c_str(), L"wbx") == 0 ? file : nullptr;
#else
  return std::fopen(path.c_str(), "wbx");
#endif
}

bool flush_to_disk(std::FILE* file) {
  if (std::fflush(file) != 0) return false;
#ifdef _WIN32
  return _commit(_fileno(file)) == 0;
#else
  return fsync(fileno(file)) == 0;
#endif
}

std::filesystem::path temporary_name(const std::filesystem::path& path) {
  std::filesystem::path name = path;
  name += "." + std::to_string(std::random_device{}()) + ".tmp";
  return name;
}

Unexpected failure(const std::filesystem::path& path, int reason) {
  return fail(ErrorCode::kIoWrite, "",
              "cannot write " + utf8(path) + ": " + std::generic_category().message(reason) +
                  "; a file of that name from before is unchanged");
}

}  // namespace

Status write_file_atomically(const std::filesystem::path& path,
                             std::span<const std::uint8_t> bytes) {
  std::error_code error;
  std::filesystem::path target = path;
  if (std::filesystem::is_symlink(path, error)) {
    const auto resolved = std::filesystem::canonical(path, error);
    if (!error) target = resolved;
  }
  const std::filesystem::path temporary = temporary_name(target);
  errno = 0;
  std::FILE* file = create_new(temporary);
  if (file == nullptr) return failure(path, errno);
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  int reason = written ? 0 : errno;
  if (written && !flush_to_disk(file)) reason = errno;
  if (std::fclose(file) != 0 && reason == 0) reason = errno;
  if (reason == 0) {
    const auto old_status = std::filesystem::status(target, error);
    if (!error && std::filesystem::exists(old_status)) {
      std::filesystem::permissions(temporary, old_status.permissions(), error);
    }
    std::filesystem::rename(temporary, target, error);
    if (!error) return ok();
    reason = error.value();
  }
  std::filesystem::remove(temporary, error);
  return failure(path, reason);
}

}  // namespace risorius::core
