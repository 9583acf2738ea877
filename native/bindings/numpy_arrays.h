// SPDX-License-Identifier: MIT
// Converts core arrays to NumPy views and back. A view keeps only the buffer of its array alive,
// not the Dna that contains the array.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/array.h"
#include "core/result.h"

namespace risorius::bindings {

namespace py = pybind11;

/// Raises an error as a Python exception.
/// In: file  the file that the error is about, or ""
///     type  the exception class; nullptr: risorius.DnaError
void throw_error(const core::Error& error, const std::string& file = "", PyObject* type = nullptr);
/// Makes a Python error class derived from risorius.base.errors.RisoriusError. The caller must keep
/// the class until the process ends.
PyObject* new_error_type(const char* name, const char* doc);

/// Returns the value of a result, or raises its error as a risorius.DnaError. In: file  the file
/// that the error is about, or ""
template <class T>
T unwrap(core::Result<T>&& result, const std::string& file = "") {
  if (!result) throw_error(result.error(), file);
  return std::move(result).value();
}

/// Returns the value of a result, or raises its error as a ValueError, for invalid arguments.
template <class T>
T unwrap_argument(core::Result<T>&& result) {
  if (!result) throw py::value_error(result.error().describe());
  return std::move(result).value();
}

/// A NumPy view of an array's buffer. The buffer lives as long as the view.
/// In: shape, strides  of the view; strides in bytes
template <class T>
py::array read_only_view(const core::Array<T>& values, std::vector<py::ssize_t> shape,
                         std::vector<py::ssize_t> strides) {
  if (values.empty()) {
    py::array_t<T> none(shape);
    none.attr("flags").attr("writeable") = false;
    return none;
  }
  auto* owner = new std::shared_ptr<const void>(values.owner());
  py::capsule base(owner, [](void* p) { delete static_cast<std::shared_ptr<const void>*>(p); });
  py::array view(py::dtype::of<T>(), std::move(shape), std::move(strides), values.data(), base);
  view.attr("flags").attr("writeable") = false;
  return view;
}

/// Read-only NumPy views without a copy: T[n] of a core::Array, and float32[n, planes] of a
/// core::PlanarArray.
template <class T>
py::array to_numpy(const core::Array<T>& values) {
  return read_only_view(values, {static_cast<py::ssize_t>(values.size())},
                        {static_cast<py::ssize_t>(sizeof(T))});
}

template <std::size_t kPlanes>
py::array to_numpy(const core::PlanarArray<kPlanes>& array) {
  const auto n = static_cast<py::ssize_t>(array.count());
  return read_only_view(
      array.values, {n, static_cast<py::ssize_t>(kPlanes)},
      {static_cast<py::ssize_t>(sizeof(float)), n * static_cast<py::ssize_t>(sizeof(float))});
}

/// Raises the ValueError that an array has the wrong shape.
/// In: name    of the argument
///     wanted  the expected shape as a text, e.g. "(n, 3)"
///     given   the array
[[noreturn]] inline void shape_error(const std::string& name, const std::string& wanted,
                                     const py::array& given) {
  throw py::value_error(name + ": an array of shape " + wanted + " was expected, the shape is " +
                        py::str(given.attr("shape")).cast<std::string>());
}

using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;

/// Converts numbers to a float32 array of shape (length,). Raises ValueError for other objects or
/// shapes.
inline FloatArray vector_argument(const py::object& object, const char* name, std::size_t length) {
  FloatArray array = FloatArray::ensure(object);
  if (!array) throw py::value_error(std::string(name) + ": an array of numbers was expected");
  if (array.ndim() != 1 || static_cast<std::size_t>(array.shape(0)) != length) {
    shape_error(name, "(" + std::to_string(length) + ",)", array);
  }
  return array;
}

/// Converts numbers to a float32 array; NaN and infinity are accepted. Raises ValueError for other
/// objects, or if they do not have the shape `shape`.
inline FloatArray shaped_argument(const py::object& object, const char* name,
                                  const std::vector<py::ssize_t>& shape) {
  FloatArray array = FloatArray::ensure(object);
  if (!array) throw py::value_error(std::string(name) + ": an array of numbers was expected");
  if (!std::equal(shape.begin(), shape.end(), array.shape(), array.shape() + array.ndim())) {
    std::string text;
    for (const py::ssize_t n : shape) text += (text.empty() ? "" : ", ") + std::to_string(n);
    shape_error(name, "(" + text + (shape.size() == 1 ? ",)" : ")"), array);
  }
  return array;
}

/// The array into which a function writes for its caller. Raises ValueError unless it is a
/// writeable C-contiguous float32 array of shape (rows, 3).
inline py::array_t<float> written_argument(const py::object& object, const char* name,
                                           py::ssize_t rows) {
  if (!py::isinstance<py::array_t<float, py::array::c_style>>(object)) {
    throw py::value_error(std::string(name) + ": a C-contiguous float32 array was expected");
  }
  auto out = object.cast<py::array_t<float>>();
  if (out.ndim() != 2 || out.shape(0) != rows || out.shape(1) != 3) {
    shape_error(name, "(" + std::to_string(rows) + ", 3)", out);
  }
  if (!out.writeable()) throw py::value_error(std::string(name) + ": the array is read-only");
  return out;
}

/// Copies a one-dimensional sequence of numbers to a core array. In: name  of the argument, for
/// errors. Raises ValueError for other objects, and, if T is an integer type, for numbers that are
/// not integers or do not fit T.
template <class T>
core::Array<T> from_python(const py::object& object, const char* name) {
  const py::module_ numpy = py::module_::import("numpy");
  py::array any = py::array::ensure(object);
  if (!any) throw py::value_error(std::string(name) + ": an array of numbers was expected");
  if (any.ndim() != 1) shape_error(name, "(n,)", any);
  if constexpr (std::is_integral_v<T>) {
    if (any.size() > 0) {
      if (std::string("iub").find(any.dtype().kind()) == std::string::npos) {
        throw py::value_error(std::string(name) + ": whole numbers were expected");
      }
      const auto low = any.attr("min")().cast<long long>();
      const auto high = any.attr("max")().cast<long long>();
      if (low < 0 || high > static_cast<long long>(std::numeric_limits<T>::max())) {
        throw py::value_error(std::string(name) + ": values from 0 to " +
                              std::to_string(std::numeric_limits<T>::max()) +
                              " were expected, found " + std::to_string(low < 0 ? low : high));
      }
    }
  }
  auto typed = py::array_t<T, py::array::c_style | py::array::forcecast>(any);
  return core::Array<T>(std::vector<T>(typed.data(), typed.data() + typed.size()));
}

/// Copies an array float[n, kPlanes] to planes: all x, then all y, and so on. An array without
/// numbers, of whatever shape, gives 0 vectors. Raises ValueError for other objects or shapes.
template <std::size_t kPlanes>
core::PlanarArray<kPlanes> planar_from_python(const py::object& object, const char* name) {
  auto typed = py::array_t<float, py::array::c_style | py::array::forcecast>::ensure(object);
  if (!typed) throw py::value_error(std::string(name) + ": an array of numbers was expected");
  const bool none = typed.size() == 0;
  if (!none && (typed.ndim() != 2 || typed.shape(1) != static_cast<py::ssize_t>(kPlanes))) {
    shape_error(name, "(n, " + std::to_string(kPlanes) + ")", typed);
  }
  const std::size_t n = none ? 0 : static_cast<std::size_t>(typed.shape(0));
  std::vector<float> values(n * kPlanes);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t p = 0; p < kPlanes; ++p) values[p * n + i] = typed.data()[i * kPlanes + p];
  }
  return {core::Array<float>(std::move(values))};
}

/// Converts a text of a file to a str. Bytes that are not UTF-8 become surrogate characters, which
/// text_from_python converts back to the same bytes.
inline py::str to_python(const std::string& text) {
  PyObject* decoded =
      PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "surrogateescape");
  if (decoded == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::str>(decoded);
}

/// Converts a str to the text of a file. Raises ValueError for other objects. In: name  of the
/// argument
inline std::string text_from_python(const py::handle& object, const char* name) {
  if (!PyUnicode_Check(object.ptr())) {
    throw py::value_error(std::string(name) + ": a text was expected");
  }
  PyObject* encoded = PyUnicode_AsEncodedString(object.ptr(), "utf-8", "surrogateescape");
  if (encoded == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::bytes>(encoded);
}

}  // namespace risorius::bindings
