// SPDX-License-Identifier: MIT
// Binds atomic writing: a file gets its name only after Python has written its whole content.
#include "bindings/numpy_arrays.h"
#include "bytes/file_write.h"
#include "bytes/path_text.h"

namespace risorius::bindings {

namespace {

[[noreturn]] void throw_os_error(const std::filesystem::path& path, const std::error_code& reason) {
  // The error number is the first argument, because Python's OSError chooses its subclass, such as
  // PermissionError, by this number.
  const py::tuple about =
      py::make_tuple(reason.default_error_condition().value(),
                     to_python(bytes::write_trouble(reason)), py::str(py::cast(path)));
  PyErr_SetObject(PyExc_OSError, about.ptr());
  throw py::error_already_set();
}

// A new hidden file in the folder of `path`, into which Python writes. commit() flushes the hidden
// file to disk and replaces the file at `path` with it; discard() removes the hidden file.
class FileReplacement {
 public:
  FileReplacement(const std::filesystem::path& path, bool sweep) : path_(path) {
    std::error_code reason;
    {
      const py::gil_scoped_release release;
      target_ = bytes::linked_file(path);
      if (sweep) bytes::remove_leftovers(target_.parent_path());
      file_ = bytes::NewFile::beside(target_, reason);
    }
    if (!file_) throw_os_error(path_, reason);
    temporary_ = file_->path();
  }

  const std::filesystem::path& temporary() const { return temporary_; }

  void commit() {
    if (!file_) throw py::value_error("the file has been written or given up");
    const std::error_code reason = [&] {
      const py::gil_scoped_release release;
      const std::error_code error = file_->take_place_of(target_);
      file_.reset();
      return error;
    }();
    if (reason) throw_os_error(path_, reason);
  }

  void discard() { file_.reset(); }

 private:
  std::filesystem::path path_, target_, temporary_;
  std::optional<bytes::NewFile> file_;
};

}  // namespace

void bind_files(py::module_& m) {
  py::class_<FileReplacement>(m, "FileReplacement",
                              "A new file in the folder of `path`. Write it under the name "
                              "`temporary` and close it before commit() replaces `path` with it.")
      .def(py::init<const std::filesystem::path&, bool>(), py::arg("path"), py::arg("sweep") = true)
      .def_property_readonly("temporary", &FileReplacement::temporary)
      .def("commit", &FileReplacement::commit)
      .def("discard", &FileReplacement::discard);
  m.def(
      "make_hidden_folder",
      [](const std::filesystem::path& path) {
        std::error_code reason;
        std::filesystem::path folder;
        {
          const py::gil_scoped_release release;
          const std::filesystem::path target = bytes::linked_file(path);
          bytes::remove_leftovers(target.parent_path());
          folder = bytes::make_hidden_folder(target, reason);
        }
        if (reason) throw_os_error(path, reason);
        return folder;
      },
      py::arg("path"),
      "Makes a hidden folder beside the file that `path` refers to, and calls remove_leftovers "
      "there. If this process ends early, a later call removes this folder the same way.");
  m.def(
      "put_in_place",
      [](const std::filesystem::path& file, const std::filesystem::path& path) {
        std::error_code reason;
        {
          const py::gil_scoped_release release;
          auto made = bytes::NewFile::adopt(file, reason);
          if (made) reason = made->take_place_of(bytes::linked_file(path));
        }
        if (reason) throw_os_error(path, reason);
      },
      py::arg("file"), py::arg("path"),
      "Flushes a complete file to disk and replaces the file that `path` refers to with it, "
      "keeping the old rights. Both must be on one file system.");
  m.def(
      "remove_leftovers",
      [](const std::filesystem::path& folder) {
        const py::gil_scoped_release release;
        bytes::remove_leftovers(folder);
      },
      py::arg("folder"), "Removes unfinished files of processes of this machine that have ended.");
}

}  // namespace risorius::bindings
