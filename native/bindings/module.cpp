// SPDX-License-Identifier: MIT
// risorius._native: converts arrays and errors between C++ and Python. No arithmetic.
#include <pybind11/pybind11.h>

#include "bindings/numpy_arrays.h"

namespace risorius::bindings {

void bind_author(py::module_& m);
void bind_correct(py::module_& m);
void bind_clip(py::module_& m);
void bind_direct(py::module_& m);
void bind_dna(py::module_& m);
void bind_edit(py::module_& m);
void bind_files(py::module_& m);
void bind_mixer(py::module_& m);
void bind_outputs(py::module_& m);
void bind_register(py::module_& m);
void bind_rig(py::module_& m);
void bind_skin(py::module_& m);
void bind_solve(py::module_& m);

namespace {

PyObject* dna_error_type = nullptr;

}  // namespace

PyObject* new_error_type(const char* name, const char* doc) {
  const py::object family = py::module_::import("risorius.base.errors").attr("RisoriusError");
  return PyErr_NewExceptionWithDoc(name, doc, family.ptr(), nullptr);
}

void throw_error(const core::Error& error, const std::string& file, PyObject* type) {
  if (type == nullptr) type = dna_error_type;
  const std::string text = (file.empty() ? "" : file + ": ") + error.describe();
  py::object instance = py::reinterpret_borrow<py::object>(type)(to_python(text));
  instance.attr("code") = core::to_string(error.code);
  instance.attr("offset") =
      error.offset ? py::object(py::int_(*error.offset)) : py::object(py::none());
  instance.attr("where") = to_python(error.where);
  PyErr_SetObject(type, instance.ptr());
  throw py::error_already_set();
}

}  // namespace risorius::bindings

PYBIND11_MODULE(_native, m) {
  m.doc() = "The native part of Risorius: DNA files and rig evaluation.";
  // Kept for the life of the process, like the interpreter's own exception types.
  risorius::bindings::dna_error_type =
      risorius::bindings::new_error_type("risorius.DnaError",
                                         "A DNA file or Dna value that cannot be used.\n\n"
                                         "code: str, e.g. 'truncated'. offset: byte offset in the "
                                         "file or None. where: the DNA field.");
  m.attr("DnaError") = pybind11::handle(risorius::bindings::dna_error_type);
  risorius::bindings::bind_dna(m);
  risorius::bindings::bind_rig(m);
  risorius::bindings::bind_outputs(m);
  risorius::bindings::bind_skin(m);
  risorius::bindings::bind_direct(m);
  risorius::bindings::bind_solve(m);
  risorius::bindings::bind_edit(m);
  risorius::bindings::bind_author(m);
  risorius::bindings::bind_correct(m);
  risorius::bindings::bind_register(m);
  risorius::bindings::bind_files(m);
  risorius::bindings::bind_mixer(m);
  risorius::bindings::bind_clip(m);
}
