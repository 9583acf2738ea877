// SPDX-License-Identifier: MIT
#include "core/source.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>

namespace risorius::core {

std::size_t SpanSource::read(std::uint64_t offset, std::span<std::uint8_t> out) {
  if (offset >= bytes_.size()) return 0;
  const std::size_t n = std::min<std::size_t>(out.size(), bytes_.size() - std::size_t(offset));
  if (n > 0) std::memcpy(out.data(), bytes_.data() + offset, n);
  return n;
}

namespace {

std::FILE* open_for_reading(const std::filesystem::path& path) {
#ifdef _WIN32
  std::FILE* file = nullptr;
  return _wfopen_s(&file, path.c_str(), L"rb") == 0 ? file : nullptr;
#else
  return std::fopen(path.c_str(), "rb");
#endif
}

bool seek_to(std::FILE* file, std::uint64_t offset) {
#ifdef _WIN32
  return _fseeki64(file, static_cast<long long>(offset), SEEK_SET) == 0;
#else
  return fseeko(file, static_cast<off_t>(offset), SEEK_SET) == 0;
#endif
}

class FileSource final : public Source {
 public:
  FileSource(std::FILE* file, std::uint64_t size) : file_(file), size_(size) {
    // The reader above has a window of its own; a second buffer would only copy.
    std::setvbuf(file_, nullptr, _IONBF, 0);
  }
  ~FileSource() override { std::fclose(file_); }
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;
  std::uint64_t size() const override { return size_; }
  std::size_t read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    if (!seek_to(file_, offset)) return 0;
    return std::fread(out.data(), 1, out.size(), file_);
  }

 private:
  std::FILE* file_;
  std::uint64_t size_;
};

}  // namespace

Result<std::unique_ptr<Source>> open_file(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    return fail(ErrorCode::kIoOpen, "", name + " is a folder, a file was expected");
  }
  std::FILE* file = open_for_reading(path);
  if (file == nullptr) {
    return fail(ErrorCode::kIoOpen, "",
                "cannot open " + name + ": " + std::generic_category().message(errno));
  }
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) {
    std::fclose(file);
    return fail(ErrorCode::kIoRead, "", "cannot read the size of " + name + ": " + error.message());
  }
  return std::unique_ptr<Source>(std::make_unique<FileSource>(file, size));
}

}  // namespace risorius::core
