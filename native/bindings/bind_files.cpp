// SPDX-License-Identifier: MIT
// Files that Python writes and that appear as a whole.
#include "bindings/numpy_arrays.h"
#include "bytes/file_write.h"
#include "bytes/path_text.h"

namespace risorius::bindings {

namespace {

[[noreturn]] void throw_os_error(const std::filesystem::path& path, const std::error_code& reason) {
  // OSError makes the class that is the number's own of these, e.g. PermissionError.
  const py::tuple about =
      py::make_tuple(reason.default_error_condition().value(),
                     to_python(bytes::write_trouble(reason)), py::str(py::cast(path)));
  PyErr_SetObject(PyExc_OSError, about.ptr());
  throw py::error_already_set();
}

// The bytes are Python's to write, the rest is as in write_file_atomically.
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
                              "A new file beside `path`, to be written under the name `temporary` "
                              "and closed before commit() puts it in the place of `path`.")
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
      "Makes a hidden folder beside the file that `path` means, and removes there what "
      "remove_leftovers does; its own goes so, should this process end before it is removed.");
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
      "Brings a whole file to the disk and puts it in the place of the one that `path` means, with "
      "an old one's rights; both must be of one file system.");
  m.def(
      "remove_leftovers",
      [](const std::filesystem::path& folder) {
        const py::gil_scoped_release release;
        bytes::remove_leftovers(folder);
      },
      py::arg("folder"),
      "Removes what processes of this machine that have ended left of files that they wrote.");
}

}  // namespace risorius::bindings
