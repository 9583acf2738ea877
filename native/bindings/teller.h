// SPDX-License-Identifier: MIT
// Reports the progress of native work to a Python function.
#pragma once

#include <pybind11/pybind11.h>

#include <exception>

namespace risorius::bindings {

/// Calls the Python function `told`, under the GIL, with the share of the work that is done, 0 to
/// 1. If `told` is None, nothing is called. The work stops if the function returns False. An
/// exception, also Ctrl-C, stops the work too and is kept in `raised`, so that the caller can throw
/// it again.
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
