// SPDX-License-Identifier: MIT
// Copies a whole file into memory or maps its pages, and tells whether only the user of this
// process can write the file.
#include "bytes/file_read.h"

#include <cerrno>
#include <string>
#include <system_error>

#include "bytes/path_text.h"
#include "bytes/read_at.h"
#include "bytes/source.h"
#include "core/aligned.h"

#ifndef _WIN32
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

namespace risorius::bytes {

namespace {

using std::filesystem::path;

core::Unexpected cut_short(const path& file) {
  return core::fail(core::ErrorCode::kIoRead, "", utf8(file) + " was cut while it was read");
}

}  // namespace

#ifdef _WIN32

core::Result<FileBytes> read_file(const path& file, ReadBy) {
  auto source = open_file(file);
  if (!source) return std::move(source).propagate();
  const auto size = static_cast<std::size_t>((*source)->size());
  const std::shared_ptr<std::uint8_t> bytes = core::allocate_pages(size, core::Fill::kNothing);
  if ((*source)->read(0, {bytes.get(), size}) != size) return cut_short(file);
  return FileBytes{{bytes.get(), size}, bytes, false};
}

#else

namespace {

core::Unexpected failure(core::ErrorCode code, const char* verb, const path& file, int reason) {
  return core::fail(code, "",
                    std::string("cannot ") + verb + " " + utf8(file) + ": " +
                        std::generic_category().message(reason));
}

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

// Maps a file into memory. Null if the system refuses.
std::shared_ptr<const void> mapped(int file, std::size_t size) {
  void* memory = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
  if (memory == MAP_FAILED) return nullptr;
  return {memory, [size](const void* p) { ::munmap(const_cast<void*>(p), size); }};
}

}  // namespace

core::Result<FileBytes> read_file(const path& name, ReadBy by) {
  // O_NONBLOCK, because opening a pipe without this flag would wait for a writer.
  const Descriptor file(::open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.number() < 0) return failure(core::ErrorCode::kIoOpen, "open", name, errno);
  struct stat about = {};
  if (::fstat(file.number(), &about) != 0) {
    return failure(core::ErrorCode::kIoRead, "read the size of", name, errno);
  }
  if (!S_ISREG(about.st_mode)) {
    return core::fail(core::ErrorCode::kIoOpen, "",
                      utf8(name) + (S_ISDIR(about.st_mode) ? " is a folder" : " is no plain file") +
                          ", a file was expected");
  }
  const auto size = static_cast<std::size_t>(about.st_size);
  const bool own = about.st_uid == ::geteuid() && (about.st_mode & (S_IWGRP | S_IWOTH)) == 0;
  if (by == ReadBy::kMap && size > 0) {
    if (auto map = mapped(file.number(), size)) {
      return FileBytes{{static_cast<const std::uint8_t*>(map.get()), size}, map, own};
    }
  }
  const std::shared_ptr<std::uint8_t> bytes = core::allocate_pages(size, core::Fill::kNothing);
  errno = 0;
  if (detail::read_at(file.number(), 0, {bytes.get(), size}) != size) {
    return errno == 0 ? cut_short(name) : failure(core::ErrorCode::kIoRead, "read", name, errno);
  }
  return FileBytes{{bytes.get(), size}, bytes, own};
}

#endif

}  // namespace risorius::bytes
