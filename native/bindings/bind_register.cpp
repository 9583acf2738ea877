// SPDX-License-Identifier: MIT
// Python bindings of register/: closest points, surface registration, sparse Cholesky factors.
#include <exception>
#include <functional>
#include <utility>
#include <vector>

#include "bindings/numpy_arrays.h"
#include "bindings/teller.h"
#include "register/closest.h"
#include "register/register.h"
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
      // A negative index becomes larger than any vertex index, so that later checks reject it.
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
                            "A surface of triangles that finds its closest points to given points.")
      .def(py::init([](const Doubles& points, const Integers& triangles) {
             return unwrap_argument(
                 ClosestPoints::make(vectors(points, "points"), corners(triangles)));
           }),
           py::arg("points"), py::arg("triangles"))
      .def("nearest", &nearest, py::arg("queries"), py::arg("normals") = py::none(),
           py::arg("least_cosine") = -1.0, py::arg("farthest") = kFar, py::arg("threads") = 0,
           "Returns int32[n] triangle (-1: none), float64[n, 3] barycentric coordinates and "
           "float64[n] distance. With normals, only triangles are considered for which the cosine "
           "between their normal and the query's normal is at least `least_cosine`.")
      .def("first_hit", &first_hit, py::arg("origins"), py::arg("directions"),
           py::arg("farthest") = kFar, py::arg("threads") = 0,
           "Returns int32[n] the first triangle on each ray (-1: none), float64[n, 3] barycentric "
           "coordinates and float64[n] distance from the origin.");
}

registering::Mesh mesh(const Doubles& points, const Integers& triangles) {
  return {vectors(points, "points"), corners(triangles)};
}

std::vector<registering::Pair> pairs_of(const Integers& vertices, const Doubles& points,
                                        const Doubles& weights) {
  const std::vector<registering::Vector3> to = vectors(points, "pair_points");
  if (vertices.size() != static_cast<py::ssize_t>(to.size()) || vertices.size() != weights.size()) {
    throw py::value_error("pairs: a vertex, a point and a weight of each were expected");
  }
  std::vector<registering::Pair> out;
  for (std::size_t i = 0; i < to.size(); ++i) {
    out.push_back({static_cast<std::uint32_t>(vertices.data()[i]), to[i], weights.data()[i]});
  }
  return out;
}

py::tuple arrays(const registering::Registered& found) {
  const auto count = static_cast<py::ssize_t>(found.points.size());
  Integers triangle(count);
  Doubles points({count, py::ssize_t{3}}), shares({count, py::ssize_t{3}}), distance(count);
  py::array_t<bool> trusted(count);
  for (std::size_t i = 0; i < found.points.size(); ++i) {
    std::copy(found.points[i].begin(), found.points[i].end(), points.mutable_data() + 3 * i);
    std::copy(found.shares[i].begin(), found.shares[i].end(), shares.mutable_data() + 3 * i);
    triangle.mutable_data()[i] = found.triangle[i];
    distance.mutable_data()[i] = found.distance[i];
    trusted.mutable_data()[i] = found.trusted[i] != 0;
  }
  return py::make_tuple(points, triangle, shares, distance, trusted);
}

py::tuple register_surface(const Doubles& points, const Integers& triangles,
                           const Doubles& target_points, const Integers& target_triangles,
                           const Integers& pair_vertices, const Doubles& pair_points,
                           const Doubles& pair_weights, const py::object& start,
                           const registering::RegisterOptions& options, py::object progress) {
  const registering::Mesh templ = mesh(points, triangles);
  const registering::Mesh target = mesh(target_points, target_triangles);
  const auto pairs = pairs_of(pair_vertices, pair_points, pair_weights);
  std::vector<registering::Vector3> begin;
  if (!start.is_none()) begin = vectors(start.cast<Doubles>(), "start");
  Teller teller{std::move(progress), nullptr};
  auto result = [&] {
    const py::gil_scoped_release released;
    return registering::register_surface(templ, target, pairs, begin, options, std::ref(teller));
  }();
  if (teller.raised) std::rethrow_exception(teller.raised);
  return arrays(unwrap_argument(std::move(result)));
}

void bind_registration(py::module_& m) {
  using Options = registering::RegisterOptions;
  py::class_<Options>(m, "RegisterOptions", "See risorius.anyhead.registration.")
      .def(py::init([](double mm, std::vector<std::uint8_t> trusted,
                       std::vector<std::uint32_t> mirrored, double symmetry, std::size_t nodes,
                       double noise, std::size_t threads) {
             return Options{mm,     std::move(trusted), std::move(mirrored), symmetry, nodes, noise,
                            threads};
           }),
           py::kw_only(), py::arg("mm"), py::arg("trusted"), py::arg("mirrored"),
           py::arg("symmetry"), py::arg("nodes"), py::arg("noise"), py::arg("threads"));
  m.def("register_surface", &register_surface, py::arg("points"), py::arg("triangles"),
        py::arg("target_points"), py::arg("target_triangles"), py::arg("pair_vertices"),
        py::arg("pair_points"), py::arg("pair_weights"), py::arg("start"), py::arg("options"),
        py::arg("progress"),
        "Returns points, triangle, shares, distance and trusted, see "
        "risorius.anyhead.registration.");
}

}  // namespace

void bind_register(py::module_& m) {
  bind_closest(m);
  bind_registration(m);
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
      .def("solve", &solve, py::arg("right"), py::arg("threads") = 0,
           "Returns the solutions float64[n, sides] of the right sides.");
}

}  // namespace risorius::bindings
