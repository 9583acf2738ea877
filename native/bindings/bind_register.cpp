// SPDX-License-Identifier: MIT
// Surfaces laid onto others.
#include <utility>
#include <vector>

#include "bindings/numpy_arrays.h"
#include "register/closest.h"
#include "register/sparse.h"

namespace risorius::bindings {

namespace {

using registering::ClosestPoints;
using registering::SparseCholesky;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Integers = py::array_t<std::int32_t, py::array::c_style | py::array::forcecast>;

std::vector<registering::Vector3> vectors(const Doubles& values, const char* name) {
  if (values.ndim() != 2 || values.shape(1) != 3) shape_error(name, "(n, 3)", values);
  std::vector<registering::Vector3> out(static_cast<std::size_t>(values.shape(0)));
  for (std::size_t i = 0; i < out.size(); ++i)
    std::copy_n(values.data() + 3 * i, 3, out[i].begin());
  return out;
}

std::vector<registering::Triangle> corners(const Integers& values) {
  if (values.ndim() != 2 || values.shape(1) != 3) shape_error("triangles", "(n, 3)", values);
  std::vector<registering::Triangle> out(static_cast<std::size_t>(values.shape(0)));
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      // A negative corner becomes a number beyond every vertex, which make refuses.
      out[i][k] = static_cast<std::uint32_t>(values.data()[3 * i + k]);
    }
  }
  return out;
}

py::tuple arrays(const std::vector<ClosestPoints::Hit>& hits) {
  const auto count = static_cast<py::ssize_t>(hits.size());
  Integers triangle(count);
  Doubles shares({count, py::ssize_t{3}}), distance(count);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    triangle.mutable_data()[i] = static_cast<std::int32_t>(hits[i].triangle);
    std::copy(hits[i].shares.begin(), hits[i].shares.end(), shares.mutable_data() + 3 * i);
    distance.mutable_data()[i] = hits[i].distance;
  }
  return py::make_tuple(triangle, shares, distance);
}

using Hits = core::Result<std::vector<ClosestPoints::Hit>>;

py::tuple nearest(const ClosestPoints& surface, const Doubles& queries, const py::object& normals,
                  double least_cosine, double farthest, std::size_t threads) {
  const auto points = vectors(queries, "queries");
  std::vector<registering::Vector3> of_queries;
  if (!normals.is_none()) of_queries = vectors(normals.cast<Doubles>(), "normals");
  Hits hits = [&] {
    const py::gil_scoped_release released;
    return surface.nearest(points, of_queries, {least_cosine, farthest, threads});
  }();
  return arrays(unwrap_argument(std::move(hits)));
}

py::tuple first_hit(const ClosestPoints& surface, const Doubles& origins, const Doubles& directions,
                    double farthest, std::size_t threads) {
  const auto from = vectors(origins, "origins"), along = vectors(directions, "directions");
  Hits hits = [&] {
    const py::gil_scoped_release released;
    return surface.first_hit(from, along, {-1.0, farthest, threads});
  }();
  return arrays(unwrap_argument(std::move(hits)));
}

Doubles solve(const SparseCholesky& factors, const Doubles& right, std::size_t threads) {
  if (right.ndim() != 2) shape_error("right", "(n, sides)", right);
  const auto sides = static_cast<std::size_t>(right.shape(1));
  auto solved = [&] {
    const py::gil_scoped_release released;
    return factors.solve({right.data(), static_cast<std::size_t>(right.size())}, sides, threads);
  }();
  const std::vector<double> values = unwrap_argument(std::move(solved));
  Doubles out({right.shape(0), right.shape(1)});
  std::copy(values.begin(), values.end(), out.mutable_data());
  return out;
}

void bind_closest(py::module_& m) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  py::class_<ClosestPoints>(m, "ClosestPoints",
                            "A surface of triangles that finds its points closest to others.")
      .def(py::init([](const Doubles& points, const Integers& triangles) {
             return unwrap_argument(
                 ClosestPoints::make(vectors(points, "points"), corners(triangles)));
           }),
           py::arg("points"), py::arg("triangles"))
      .def("nearest", &nearest, py::arg("queries"), py::arg("normals") = py::none(),
           py::arg("least_cosine") = -1.0, py::arg("farthest") = kFar, py::arg("threads") = 0,
           "int32[n] triangle (-1: none), float64[n, 3] barycentric coordinates, float64[n] "
           "distance. With normals, only triangles count whose normal has at least that cosine "
           "with the normal of the query.")
      .def("first_hit", &first_hit, py::arg("origins"), py::arg("directions"),
           py::arg("farthest") = kFar, py::arg("threads") = 0,
           "int32[n] the first triangle on each ray (-1: none), float64[n, 3] barycentric "
           "coordinates, float64[n] distance from the origin.");
}

}  // namespace

void bind_register(py::module_& m) {
  bind_closest(m);
  py::class_<SparseCholesky>(m, "SparseCholesky",
                             "The Cholesky factors of a sparse symmetric positive definite matrix.")
      .def(py::init([](const Integers& rows, const Integers& columns, const Doubles& values,
                       std::size_t size) {
             const auto list = [](const auto& a) {
               return std::span(a.data(), static_cast<std::size_t>(a.size()));
             };
             auto made = [&] {
               const py::gil_scoped_release released;
               return SparseCholesky::make(list(rows), list(columns), list(values), size);
             }();
             return unwrap_argument(std::move(made));
           }),
           py::arg("rows"), py::arg("columns"), py::arg("values"), py::arg("size"))
      .def("solve", &solve, py::arg("right"), py::arg("threads") = 0, "float64[n, sides].");
}

}  // namespace risorius::bindings
