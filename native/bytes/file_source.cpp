// SPDX-License-Identifier: MIT
// A file as a source of bytes: the file stays open, and each read gives the offset of its bytes. A
// Handle is a file descriptor, on Windows a C stream.
#include <cerrno>
#include <cstdio>
#include <system_error>

#include "bytes/path_text.h"
#include "bytes/read_at.h"
#include "bytes/source.h"

#ifdef _WIN32
#define NOMINMAX
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
// Headers that must be included after windows.h.
#include <fcntl.h>
#include <io.h>
#else
#include <fcntl.h>
#include <unistd.h>
#endif

namespace risorius::bytes {

namespace {

#ifdef _WIN32

using Handle = std::FILE*;

Handle open_for_reading(const std::filesystem::path& path) {
  // As on POSIX, other programs may write into the file, rename it or replace it while it is open.
  const HANDLE handle = CreateFileW(path.c_str(), GENERIC_READ,
                                    FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, nullptr,
                                    OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, nullptr);
  if (handle == INVALID_HANDLE_VALUE) {
    const std::error_code error(static_cast<int>(GetLastError()), std::system_category());
    errno = error.default_error_condition().value();
    return nullptr;
  }
  const int number =
      _open_osfhandle(reinterpret_cast<std::intptr_t>(handle), _O_RDONLY | _O_BINARY);
  std::FILE* const file = number < 0 ? nullptr : _fdopen(number, "rb");
  if (file == nullptr) {
    number < 0 ? static_cast<void>(CloseHandle(handle)) : static_cast<void>(_close(number));
    return nullptr;
  }
  // ByteReader has a window of its own; a second buffer would only add a copy.
  std::setvbuf(file, nullptr, _IONBF, 0);
  return file;
}
bool is_open(Handle file) { return file != nullptr; }
void close_handle(Handle file) { std::fclose(file); }

std::size_t read_at(Handle file, std::uint64_t offset, std::span<std::uint8_t> out) {
  if (_fseeki64(file, static_cast<long long>(offset), SEEK_SET) != 0) return 0;
  return std::fread(out.data(), 1, out.size(), file);
}

#else

using Handle = int;

Handle open_for_reading(const std::filesystem::path& path) {
  return ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
}
bool is_open(Handle file) { return file >= 0; }
void close_handle(Handle file) { ::close(file); }

using detail::read_at;

#endif

class FileSource final : public Source {
 public:
  FileSource(Handle file, std::uint64_t size) : file_(file), size_(size) {}
  ~FileSource() override { close_handle(file_); }
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;
  std::uint64_t size() const override { return size_; }
  std::size_t read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    return read_at(file_, offset, out);
  }

 private:
  Handle file_;
  std::uint64_t size_;
};

}  // namespace

core::Result<std::unique_ptr<Source>> open_file(const std::filesystem::path& path) {
  const std::string name = utf8(path);
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    return core::fail(core::ErrorCode::kIoOpen, "", name + " is a folder, a file was expected");
  }
  const Handle file = open_for_reading(path);
  if (!is_open(file)) {
    return core::fail(core::ErrorCode::kIoOpen, "",
                      "cannot open " + name + ": " + std::generic_category().message(errno));
  }
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) {
    close_handle(file);
    return core::fail(core::ErrorCode::kIoRead, "",
                      "cannot read the size of " + name + ": " + error.message());
  }
  return std::unique_ptr<Source>(std::make_unique<FileSource>(file, size));
}

}  // namespace risorius::bytes
