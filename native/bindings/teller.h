// SPDX-License-Identifier: MIT
// Progress of native work, told to Python.
#pragma once

#include <pybind11/pybind11.h>

#include <exception>

namespace risorius::bindings {

/// Told of progress under the GIL; what Python raises there stops the work and is raised again.
struct Teller {
  pybind11::object told;
  std::exception_ptr raised;

  bool operator()(double share) {
    const pybind11::gil_scoped_acquire held;
    try {
      if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
      return told.is_none() || !told(share).is(pybind11::bool_(false));
    } catch (...) {
      raised = std::current_exception();
      return false;
    }
  }
};

}  // namespace risorius::bindings
