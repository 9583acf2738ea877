// SPDX-License-Identifier: MIT
// Writes a new file under a hidden name in the folder of its target, flushes it to disk and renames
// it to the target, so that the target is complete at any time. The hidden name contains the
// machine and the process that made the file, so that leftovers of ended processes can be removed.
#include "bytes/file_write.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <random>
#include <string>
#include <string_view>
#include <utility>

#include "bytes/path_text.h"

#ifdef _WIN32
#define NOMINMAX
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
// Headers that must be included after windows.h.
#include <fcntl.h>
#include <io.h>
#include <process.h>
#include <share.h>
#include <sys/stat.h>
#else
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

namespace risorius::bytes {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMark = ".risorius-";
constexpr std::string_view kEnd = ".part";
constexpr std::size_t kTokenDigits = 8;
constexpr std::size_t kMachineLength = 64;

// ---- the system

#ifdef _WIN32

int create_file(const fs::path& path, bool) {
  int file = -1;
  const int reason =
      _wsopen_s(&file, path.c_str(), _O_CREAT | _O_EXCL | _O_WRONLY | _O_BINARY | _O_NOINHERIT,
                _SH_DENYNO, _S_IREAD | _S_IWRITE);
  if (reason != 0) errno = reason;
  return reason == 0 ? file : -1;
}

int open_made_file(const fs::path& path) {
  int file = -1;
  const int reason =
      _wsopen_s(&file, path.c_str(), _O_WRONLY | _O_BINARY | _O_NOINHERIT, _SH_DENYNO, 0);
  if (reason != 0) errno = reason;
  return reason == 0 ? file : -1;
}

std::ptrdiff_t write_some(int file, const std::uint8_t* bytes, std::size_t count) {
  return _write(file, bytes, static_cast<unsigned>(count));
}

int sync_file(int file) { return _commit(file); }
int close_file(int file) { return _close(file); }
int sync_folder(const fs::path&) { return 0; }  // the journal of the volume holds new names

long long process_number() { return _getpid(); }

bool is_running(long long process) {
  const HANDLE handle = OpenProcess(SYNCHRONIZE, FALSE, static_cast<DWORD>(process));
  if (handle == nullptr) return GetLastError() != ERROR_INVALID_PARAMETER;
  const bool running = WaitForSingleObject(handle, 0) == WAIT_TIMEOUT;
  CloseHandle(handle);
  return running;
}

std::string machine_name() {
  char name[MAX_COMPUTERNAME_LENGTH + 1] = {};
  DWORD length = sizeof(name);
  return GetComputerNameA(name, &length) ? std::string(name, length) : std::string();
}

// Gives a new file the access rights of the file that it replaces. Does nothing on Windows, where
// a read-only flag is the only right of a file: a read-only file cannot be replaced anyway, and a
// read-only new file could not be removed.
void inherit_rights(const fs::path&, const fs::path&) {}

#else

int create_file(const fs::path& path, bool is_private) {
  return ::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, is_private ? 0600 : 0666);
}

int open_made_file(const fs::path& path) { return ::open(path.c_str(), O_WRONLY | O_CLOEXEC); }

std::ptrdiff_t write_some(int file, const std::uint8_t* bytes, std::size_t count) {
  return ::write(file, bytes, count);
}

int sync_file(int file) { return ::fsync(file); }
int close_file(int file) { return ::close(file); }

int sync_folder(const fs::path& folder) {
  const int handle = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_CLOEXEC);
  if (handle < 0) return -1;
  const int done = ::fsync(handle);
  ::close(handle);
  return done;
}

long long process_number() { return ::getpid(); }

// Whether a process has ended although its number is still in use. In some containers no process
// waits for orphaned processes: an ended orphan keeps its number as a zombie until the container
// ends.
bool has_ended(long long process) {
  std::ifstream stat("/proc/" + std::to_string(process) + "/stat");
  std::string text;
  std::getline(stat, text, '\0');
  // The letter for the state of the process follows the program's name in parentheses. The name may
  // contain any character, so the last parenthesis is searched for.
  const std::size_t end = text.rfind(") ");
  return end != std::string::npos && end + 2 < text.size() &&
         (text[end + 2] == 'Z' || text[end + 2] == 'X');
}

bool is_running(long long process) {
  if (::kill(static_cast<pid_t>(process), 0) != 0 && errno == ESRCH) return false;
  return !has_ended(process);
}

// The name of the machine, followed by its process namespace, because each container of a machine
// has process numbers of its own.
std::string machine_name() {
  char name[256] = {};
  if (::gethostname(name, sizeof(name) - 1) != 0) return {};
  char space[64] = {};
  const ssize_t length = ::readlink("/proc/self/ns/pid", space, sizeof(space) - 1);
  return std::string(name) +
         (length > 0 ? std::string(space, static_cast<std::size_t>(length)) : "");
}

// Gives a new file the group of the file that it replaces. If that is not allowed, the new file
// stays in another group, and the group in `rights` gets only the rights that everybody has.
// In/out: rights  rights that the new file will get
void keep_group(const fs::path& old, const fs::path& made, fs::perms& rights) {
  struct stat before = {}, now = {};
  if (::stat(old.c_str(), &before) != 0 || ::stat(made.c_str(), &now) != 0) return;
  if (before.st_gid == now.st_gid) return;
  if (::chown(made.c_str(), static_cast<uid_t>(-1), before.st_gid) == 0) return;
  const auto others = static_cast<unsigned>(rights & fs::perms::others_all);
  rights = (rights & ~fs::perms::group_all) | static_cast<fs::perms>(others << 3);
}

void inherit_rights(const fs::path& old, const fs::path& made) {
  std::error_code error;
  const fs::file_status before = fs::status(old, error);
  if (error || !fs::exists(before)) return;
  fs::perms rights = before.permissions();
  keep_group(old, made, rights);
  fs::permissions(made, rights, error);
}

#endif

int rename_file(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (!error) return 0;
  errno = error.default_error_condition().value();
  return -1;
}

std::error_code last_error() { return {errno == 0 ? EIO : errno, std::generic_category()}; }

// ---- names

// The beginning of a hidden name: ".risorius-MACHINE-" of the name
// ".risorius-MACHINE-PROCESS-TOKEN.part".
std::string name_begin() {
  std::string machine = machine_name().substr(0, kMachineLength);
  std::replace_if(
      machine.begin(), machine.end(),
      [](char c) {
        return !((c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'));
      },
      '_');
  return std::string(kMark) + machine + "-";
}

std::string hidden_name() {
  char token[kTokenDigits + 1] = {};
  std::snprintf(token, sizeof(token), "%08x", static_cast<unsigned>(std::random_device{}()));
  return name_begin() + std::to_string(process_number()) + "-" + token + std::string(kEnd);
}

// The number of the process that made the file with the hidden name `name`. Nullopt if `name` is no
// such name, or is one of another machine. In: begin  result of name_begin()
std::optional<long long> maker_of(std::string_view name, std::string_view begin) {
  constexpr std::size_t kTail = 1 + kTokenDigits + kEnd.size();
  if (!name.starts_with(begin) || !name.ends_with(kEnd)) return {};
  if (name.size() <= begin.size() + kTail) return {};
  const std::string_view tail = name.substr(name.size() - kTail);
  const std::string_view number = name.substr(begin.size(), name.size() - kTail - begin.size());
  long long process = 0;
  const auto [last, error] = std::from_chars(number.data(), number.data() + number.size(), process);
  const bool whole = error == std::errc() && last == number.data() + number.size();
  const bool token =
      tail.substr(1, kTokenDigits).find_first_not_of("0123456789abcdef") == std::string_view::npos;
  if (!whole || !token || tail[0] != '-' || process <= 0) return {};
  return process;
}

core::Unexpected failure(const fs::path& path, const std::error_code& reason) {
  std::error_code error;
  const bool is_there = fs::is_regular_file(path, error);
  return core::fail(core::ErrorCode::kIoWrite, "",
                    "cannot write " + utf8(path) + ": " + write_trouble(reason) +
                        (is_there ? "; the file of that name from before is unchanged" : ""));
}

}  // namespace

const FileCalls& system_file_calls() {
  static constexpr FileCalls kCalls = {create_file, write_some,  sync_file,
                                       close_file,  rename_file, sync_folder};
  return kCalls;
}

fs::path linked_file(const fs::path& path) {
  constexpr int kMostLinks = 40;  // the same limit as the system's
  fs::path file = path;
  std::error_code error;
  for (int i = 0; i < kMostLinks && fs::is_symlink(file, error); ++i) {
    // The links are read one by one, because functions that resolve a whole path fail if its target
    // does not exist.
    const fs::path next = fs::read_symlink(file, error);
    if (error) return path;
    file = file.parent_path() / next;
  }
  return file;
}

void remove_leftovers(const fs::path& folder) {
  const std::string begin = name_begin();
  std::error_code error;
  fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const auto maker = maker_of(utf8(entry->path().filename()), begin);
    std::error_code ignored;
    if (maker && !is_running(*maker)) fs::remove_all(entry->path(), ignored);
  }
}

std::string write_trouble(const std::error_code& reason) {
  if (reason == std::errc::no_such_file_or_directory) return "its folder is not there";
  if (reason == std::errc::not_a_directory) return "a file stands where its folder should be";
  return reason.default_error_condition().message();
}

NewFile::NewFile(fs::path path, Leftover leftover, int file, const FileCalls& calls)
    : path_(std::move(path)), calls_(&calls), leftover_(leftover), file_(file) {}

NewFile::NewFile(NewFile&& other) noexcept
    : path_(std::move(other.path_)),
      calls_(other.calls_),
      leftover_(std::exchange(other.leftover_, Leftover::kKeep)),
      file_(std::exchange(other.file_, -1)) {}

NewFile& NewFile::operator=(NewFile&& other) noexcept {
  if (this == &other) return *this;
  drop();
  path_ = std::move(other.path_);
  calls_ = other.calls_;
  leftover_ = std::exchange(other.leftover_, Leftover::kKeep);
  file_ = std::exchange(other.file_, -1);
  return *this;
}

NewFile::~NewFile() { drop(); }

void NewFile::drop() {
  static_cast<void>(close());
  std::error_code ignored;
  if (leftover_ == Leftover::kRemove) fs::remove(path_, ignored);
  leftover_ = Leftover::kKeep;
}

std::optional<NewFile> NewFile::create(const fs::path& path, Leftover leftover,
                                       std::error_code& error, const FileCalls& calls,
                                       bool is_private) {
  error.clear();
  errno = 0;
  const int file = calls.create(path, is_private);
  if (file >= 0) return NewFile(path, leftover, file, calls);
  error = last_error();
  return {};
}

std::optional<NewFile> NewFile::create(const fs::path& path, Leftover leftover,
                                       std::error_code& error, const FileCalls& calls) {
  return create(path, leftover, error, calls, false);
}

std::optional<NewFile> NewFile::beside(const fs::path& target, std::error_code& error,
                                       const FileCalls& calls) {
  std::error_code ignored;
  if (fs::is_directory(target, ignored)) {
    error = std::make_error_code(std::errc::is_a_directory);
    return {};
  }
  const bool is_private = fs::exists(target, ignored);
  const fs::path folder = target.parent_path();
  auto file = create(folder / hidden_name(), Leftover::kRemove, error, calls, is_private);
  // Windows reports a file in the place of a folder like a missing folder.
  if (error == std::errc::no_such_file_or_directory && fs::is_regular_file(folder, ignored)) {
    error = std::make_error_code(std::errc::not_a_directory);
  }
  return file;
}

std::optional<NewFile> NewFile::adopt(const fs::path& path, std::error_code& error,
                                      const FileCalls& calls) {
  error.clear();
  errno = 0;
  const int file = open_made_file(path);
  if (file >= 0) return NewFile(path, Leftover::kKeep, file, calls);
  error = last_error();
  return {};
}

std::error_code NewFile::write(std::span<const std::uint8_t> bytes) {
  // macOS and Windows refuse to write 2 GiB or more in one call.
  constexpr std::size_t kMost = std::size_t{1} << 30;
  while (!bytes.empty()) {
    errno = 0;
    const std::ptrdiff_t n = calls_->write(file_, bytes.data(), std::min(bytes.size(), kMost));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return last_error();
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return {};
}

std::error_code NewFile::close() {
  if (file_ < 0) return {};
  errno = 0;
  // A network folder may report a full disk only on close. A close that a signal interrupts has
  // closed the descriptor as well.
  const bool closed = calls_->close(std::exchange(file_, -1)) == 0 || errno == EINTR;
  return closed ? std::error_code() : last_error();
}

std::error_code NewFile::take_place_of(const fs::path& target) {
  errno = 0;
  while (calls_->sync(file_) != 0) {
    if (errno != EINTR) return last_error();
  }
  if (const std::error_code error = close()) return error;
  inherit_rights(target, path_);
  errno = 0;
  if (calls_->rename(path_, target) != 0) return last_error();
  leftover_ = Leftover::kKeep;
  // A failure is ignored: some network folders cannot be flushed, and the file is already in place.
  static_cast<void>(calls_->sync_folder(target.parent_path()));
  return {};
}

fs::path make_hidden_folder(const fs::path& target, std::error_code& error) {
  std::error_code ignored;
  error.clear();
  if (fs::is_directory(target, ignored)) error = std::make_error_code(std::errc::is_a_directory);
  const fs::path folder = target.parent_path() / hidden_name();
  if (!error) fs::create_directory(folder, error);
  if (error == std::errc::no_such_file_or_directory &&
      fs::is_regular_file(target.parent_path(), ignored)) {
    error = std::make_error_code(std::errc::not_a_directory);  // as in NewFile::beside
  }
  return error ? fs::path() : folder;
}

core::Status write_file_atomically(const fs::path& path, std::span<const std::uint8_t> bytes,
                                   const FileCalls& calls) {
  const fs::path target = linked_file(path);
  remove_leftovers(target.parent_path());
  std::error_code reason;
  auto file = NewFile::beside(target, reason, calls);
  if (file) reason = file->write(bytes);
  if (!reason) reason = file->take_place_of(target);
  if (reason) return failure(path, reason);
  return core::ok();
}

}  // namespace risorius::bytes
