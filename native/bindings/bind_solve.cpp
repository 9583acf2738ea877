// SPDX-License-Identifier: MIT
// Solves for raw controls from target positions of a skin.
#include <algorithm>
#include <mutex>

#include "bindings/numpy_arrays.h"
#include "core/finite.h"
#include "solve/bounded.h"
#include "solve/probe.h"
#include "solve/surface.h"

namespace risorius::bindings {

namespace {

using solve::Jacobian;
using solve::Probe;
using SurfacePtr = std::shared_ptr<const solve::Surface>;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Bools = py::array_t<bool, py::array::c_style | py::array::forcecast>;
using Indices = py::array_t<std::uint32_t, py::array::c_style | py::array::forcecast>;

template <class Array>
const Array& sized(const Array& values, std::size_t count, const char* name) {
  if (values.ndim() == 1 && static_cast<std::size_t>(values.shape(0)) == count) return values;
  shape_error(name, "(" + std::to_string(count) + ",)", values);
}

py::array_t<double> made(std::size_t count) {
  return py::array_t<double>(static_cast<py::ssize_t>(count));
}
py::array_t<double> made(std::size_t rows, std::size_t columns) {
  return py::array_t<double>({static_cast<py::ssize_t>(rows), static_cast<py::ssize_t>(columns)});
}

/// Points of a surface, and the Jacobian of their positions that the last linearise() computed. A
/// lock lets only one thread use it at a time.
class PyProbe {
 public:
  PyProbe(SurfacePtr surface, const Indices& points)
      : surface_(std::move(surface)), probe_(*surface_, checked(*surface_, points)) {}

  py::array_t<double> positions(const Floats& raw) {
    py::array_t<double> out = made(probe_.size(), 3);
    const float* values = controls(raw, "raw");
    double* to = out.mutable_data();
    const py::gil_scoped_release released;
    const std::lock_guard held(lock_);
    probe_.positions(values, to);
    return out;
  }
  void linearise(const Floats& raw, const Floats& high, const Bools& free) {
    const float* values = controls(raw, "raw");
    const float* most = controls(high, "highest");
    sized(free, surface_->rig->raw_count, "free");
    const std::vector<std::uint8_t> which(free.data(), free.data() + free.size());
    const py::gil_scoped_release released;
    const std::lock_guard held(lock_);
    jacobian_ = probe_.jacobian(values, most, which.data());
  }
  py::array_t<float> jacobian() {
    const std::size_t count = surface_->rig->raw_count, points = probe_.size();
    py::array_t<float> out(
        {static_cast<py::ssize_t>(points), py::ssize_t{3}, static_cast<py::ssize_t>(count)});
    std::fill(out.mutable_data(), out.mutable_data() + out.size(), 0.0f);
    for (std::size_t p = 0; p < jacobian_.points; ++p) {
      const Jacobian::Block& block = jacobian_.blocks[p / Jacobian::kBlock];
      for (std::size_t i = 0; i < block.controls.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
          out.mutable_data()[(3 * p + k) * count + block.controls[i]] =
              block.values[3 * (i * Jacobian::kBlock + p % Jacobian::kBlock) + k];
        }
      }
    }
    return out;
  }
  py::array_t<double> normal_matrix() {
    const std::size_t count = surface_->rig->raw_count;
    py::array_t<double> out = made(count, count);
    double* to = out.mutable_data();
    const py::gil_scoped_release released;
    const std::lock_guard held(lock_);
    if (jacobian_.controls == 0) {
      std::fill(to, to + count * count, 0.0);
    } else {
      solve::normal_matrix(jacobian_, to);
    }
    return out;
  }
  py::array_t<double> gradient(const Doubles& residual) {
    const auto points = static_cast<py::ssize_t>(jacobian_.points);
    if (residual.ndim() != 2 || residual.shape(0) != points || residual.shape(1) != 3) {
      shape_error("residual", "(" + std::to_string(points) + ", 3)", residual);
    }
    py::array_t<double> out = made(surface_->rig->raw_count);
    std::fill(out.mutable_data(), out.mutable_data() + out.size(), 0.0);
    solve::gradient(jacobian_, residual.data(), out.mutable_data());
    return out;
  }

 private:
  static std::vector<solve::Point> checked(const solve::Surface& surface, const Indices& points) {
    if (points.ndim() != 2 || points.shape(1) != 2) shape_error("points", "(n, 2)", points);
    std::vector<solve::Point> out;
    for (py::ssize_t i = 0; i < points.shape(0); ++i) {
      const solve::Point point{points.data()[2 * i], points.data()[2 * i + 1]};
      const std::string at = "points[" + std::to_string(i) + "]: ";
      if (point.mesh >= surface.meshes.size()) {
        throw py::index_error(at + "a mesh below " + std::to_string(surface.meshes.size()) +
                              " was expected, found " + std::to_string(point.mesh));
      }
      const std::size_t vertices = surface.meshes[point.mesh].positions.size();
      if (point.vertex >= vertices) {
        throw py::index_error(at + "a vertex below " + std::to_string(vertices) +
                              " was expected, found " + std::to_string(point.vertex));
      }
      out.push_back(point);
    }
    return out;
  }
  const float* controls(const Floats& values, const char* name) const {
    sized(values, surface_->rig->raw_count, name);
    if (!core::all_finite({values.data(), static_cast<std::size_t>(values.size())})) {
      throw py::value_error(std::string(name) + ": finite numbers were expected");
    }
    return values.data();
  }

  SurfacePtr surface_;
  Probe probe_;
  Jacobian jacobian_;
  std::mutex lock_;
};

py::array_t<double> least_change(const Doubles& a, const Doubles& b, const Doubles& low,
                                 const Doubles& high, double ridge) {
  if (a.ndim() != 2) shape_error("a", "(m, n)", a);
  if (!(ridge > 0.0)) throw py::value_error("ridge: a number above 0 was expected");
  const auto rows = static_cast<std::size_t>(a.shape(0)),
             columns = static_cast<std::size_t>(a.shape(1));
  sized(b, rows, "b"), sized(low, columns, "low"), sized(high, columns, "high");
  py::array_t<double> out = made(columns);
  solve::least_change(rows, columns, a.data(), b.data(), low.data(), high.data(), ridge,
                      out.mutable_data());
  return out;
}

py::array_t<double> descend(const Doubles& h, const Doubles& g, const Doubles& low,
                            const Doubles& high, const Doubles& rest, const Doubles& sparse,
                            const Doubles& start, double tolerance) {
  const auto count = static_cast<std::size_t>(g.size());
  if (h.ndim() != 2 || h.shape(0) != g.size() || h.shape(1) != g.size()) {
    shape_error("h", "(n, n)", h);
  }
  for (const auto& [values, name] :
       {std::pair(&low, "low"), std::pair(&high, "high"), std::pair(&rest, "rest"),
        std::pair(&sparse, "sparse"), std::pair(&start, "start")}) {
    sized(*values, count, name);
  }
  const solve::Quadratic q{count,       h.data(),    g.data(),     low.data(),
                           high.data(), rest.data(), sparse.data()};
  py::array_t<double> out = made(count);
  double* x = out.mutable_data();
  std::copy(start.data(), start.data() + count, x);
  const py::gil_scoped_release released;
  solve::descend(q, tolerance, x);
  return out;
}

}  // namespace

void bind_solve(py::module_& m) {
  py::class_<solve::Surface, std::shared_ptr<solve::Surface>>(m, "Skins", "See risorius.Surface.")
      .def(py::init([](const dna::Dna& dna, std::shared_ptr<rig::Rig> rig, std::uint32_t lod) {
             return std::make_shared<solve::Surface>(
                 unwrap(solve::make_surface(dna, std::move(rig), lod)));
           }),
           py::arg("dna"), py::arg("rig"), py::arg("lod"));
  py::class_<PyProbe>(m, "Probe", "Some points of Skins: uint32[P, 2], mesh and vertex.")
      .def(py::init([](std::shared_ptr<solve::Surface> surface, const Indices& points) {
             return std::make_unique<PyProbe>(std::move(surface), points);
           }),
           py::arg("skins"), py::arg("points"))
      .def("positions", &PyProbe::positions, py::arg("raw"), "float32[R] -> float64[P, 3].")
      .def("linearise", &PyProbe::linearise, py::arg("raw"), py::arg("highest"), py::arg("free"),
           "Computes and keeps the derivatives of the points by each control at a pose.")
      .def("jacobian", &PyProbe::jacobian, "float32[P, 3, R], computed by linearise.")
      .def("normal_matrix", &PyProbe::normal_matrix, "float64[R, R]: J^T J of the Jacobian.")
      .def("gradient", &PyProbe::gradient, py::arg("residual"),
           "float64[P, 3] -> float64[R]: J^T residual.");
  m.def("least_change", &least_change, py::arg("a"), py::arg("b"), py::arg("low"), py::arg("high"),
        py::arg("ridge"), "The x in [low, high] that minimises |a x - b|^2 + ridge |x|^2.");
  m.def("descend", &descend, py::arg("h"), py::arg("g"), py::arg("low"), py::arg("high"),
        py::arg("rest"), py::arg("sparse"), py::arg("start"), py::arg("tolerance") = 1e-5,
        "The x in [low, high] that minimises 1/2 x^T h x - g^T x + sparse |x - rest|.");
}

}  // namespace risorius::bindings
