// SPDX-License-Identifier: MIT
// Joint rigs made from shapes.
#include <utility>

#include "author/fit.h"
#include "author/simplify.h"
#include "bindings/fields.h"

namespace risorius::bindings {

namespace {

using author::Fit;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Indices = py::array_t<std::uint32_t, py::array::c_style | py::array::forcecast>;

/// [V, 3], [E, V, 3] and [edges, 2] as Shapes. Raises ValueError where shapes do not agree.
author::Shapes shapes(const Doubles& neutral, const Floats& displacements, const Indices& edges,
                      const Doubles& importance) {
  if (neutral.ndim() != 2 || neutral.shape(1) != 3) shape_error("neutral", "(V, 3)", neutral);
  if (displacements.ndim() != 3 || displacements.shape(1) != neutral.shape(0) ||
      displacements.shape(2) != 3) {
    shape_error("displacements", "(E, V, 3)", displacements);
  }
  if (edges.ndim() != 2 || edges.shape(1) != 2) shape_error("edges", "(n, 2)", edges);
  author::Shapes out;
  out.neutral.resize(static_cast<std::size_t>(neutral.shape(0)));
  out.expressions = static_cast<std::size_t>(displacements.shape(0));
  for (std::size_t v = 0; v < out.neutral.size(); ++v) {
    for (std::size_t k = 0; k < 3; ++k) out.neutral[v][k] = neutral.data()[3 * v + k];
  }
  const std::size_t count = out.neutral.size();
  out.displacements.resize(3 * count * out.expressions);
  for (std::size_t e = 0; e < out.expressions; ++e) {
    for (std::size_t v = 0; v < count; ++v) {
      const float* from = displacements.data() + 3 * (e * count + v);
      std::copy(from, from + 3, out.displacements.data() + 3 * (v * out.expressions + e));
    }
  }
  for (py::ssize_t i = 0; i < edges.shape(0); ++i) {
    out.edges.push_back({edges.data()[2 * i], edges.data()[2 * i + 1]});
  }
  out.importance.assign(importance.data(), importance.data() + importance.size());
  return out;
}

/// Told of progress under the GIL; what Python raises there stops the work and is raised again.
struct Teller {
  py::object told;
  std::exception_ptr raised;

  bool operator()(double share) {
    const py::gil_scoped_acquire held;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      return told.is_none() || !told(share).is(py::bool_(false));
    } catch (...) {
      raised = std::current_exception();
      return false;
    }
  }
};

/// Positions [J, 3] and motions [E, J, 3] of joints that are there, as GivenJoint.
/// A joint that no expression moves has no motions.
std::vector<author::GivenJoint> given_joints(const Doubles& positions, const Doubles& rotations,
                                             const Doubles& translations, std::size_t expressions) {
  const auto joints = static_cast<std::size_t>(positions.shape(0));
  const std::size_t size = 3 * joints * expressions;
  if (static_cast<std::size_t>(rotations.size()) != size) {
    shape_error("rotations", "(E, J, 3)", rotations);
  }
  if (static_cast<std::size_t>(translations.size()) != size) {
    shape_error("translations", "(E, J, 3)", translations);
  }
  std::vector<author::GivenJoint> out(joints);
  for (std::size_t j = 0; j < joints; ++j) {
    bool moves = false;
    out[j].motions.resize(expressions);
    for (std::size_t k = 0; k < 3; ++k) out[j].position[k] = positions.data()[3 * j + k];
    for (std::size_t e = 0; e < expressions; ++e) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t at = 3 * (e * joints + j) + k;
        out[j].motions[e].rotation[k] = rotations.data()[at];
        out[j].motions[e].translation[k] = translations.data()[at];
        moves = moves || rotations.data()[at] != 0.0 || translations.data()[at] != 0.0;
      }
    }
    if (!moves) out[j].motions.clear();
  }
  return out;
}

Fit fit_joints(const Doubles& neutral, const Floats& displacements, const Indices& edges,
               const Doubles& importance, const Doubles& positions, const Doubles& rotations,
               const Doubles& translations, std::size_t joints, std::size_t influences,
               double smoothness, double emphasis, std::size_t rounds, bool symmetric,
               std::size_t threads, double least_effect, bool bound, const Doubles& pivots,
               const std::vector<std::vector<std::uint32_t>>& pivot_expressions,
               py::object progress) {
  const author::Shapes input = shapes(neutral, displacements, edges, importance);
  author::FitOptions options;
  options.joints = joints;
  options.influences = influences;
  options.smoothness = smoothness;
  options.emphasis = emphasis;
  options.rounds = rounds;
  options.symmetric = symmetric;
  options.threads = threads;
  options.least_effect = least_effect;
  options.bound = bound;
  options.given = given_joints(positions, rotations, translations, input.expressions);
  if (static_cast<std::size_t>(pivots.size()) != 3 * pivot_expressions.size()) {
    shape_error("pivots", "(P, 3)", pivots);
  }
  for (std::size_t i = 0; i < pivot_expressions.size(); ++i) {
    author::Pivot pivot;
    std::copy_n(pivots.data() + 3 * i, 3, pivot.position.begin());
    pivot.expressions = pivot_expressions[i];
    options.pivots.push_back(std::move(pivot));
  }
  Teller teller{std::move(progress), nullptr};
  auto result = [&] {
    const py::gil_scoped_release released;
    return author::fit_joints(input, options, std::ref(teller));
  }();
  if (teller.raised) std::rethrow_exception(teller.raised);
  return unwrap(std::move(result));
}

author::StartWeights start_weights_of(const Indices& joints, const Floats& weights) {
  if (joints.ndim() != 2 || weights.ndim() != 2) shape_error("start", "(V, n)", joints);
  author::StartWeights out;
  out.influences = static_cast<std::size_t>(joints.shape(1));
  out.joints.assign(joints.data(), joints.data() + joints.size());
  out.weights.assign(weights.data(), weights.data() + weights.size());
  return out;
}

Fit fit_weights(const Doubles& neutral, const Floats& displacements, const Indices& edges,
                const Doubles& importance, const Doubles& positions, const Doubles& rotations,
                const Doubles& translations, const Indices& mirrored, const Indices& start_joints,
                const Floats& start_weights, std::size_t influences, double smoothness,
                bool symmetric, std::size_t threads) {
  const author::Shapes input = shapes(neutral, displacements, edges, importance);
  author::FitOptions options;
  options.influences = influences;
  options.smoothness = smoothness;
  options.symmetric = symmetric;
  options.threads = threads;
  auto joints = given_joints(positions, rotations, translations, input.expressions);
  if (mirrored.size() != 0) {
    if (static_cast<std::size_t>(mirrored.size()) != joints.size()) {
      shape_error("mirrored", "(J,)", mirrored);
    }
    for (std::size_t j = 0; j < joints.size(); ++j) joints[j].mirrored = mirrored.data()[j];
  }
  const author::StartWeights start = start_weights_of(start_joints, start_weights);
  auto result = [&] {
    const py::gil_scoped_release released;
    return author::fit_weights(input, joints, options, start);
  }();
  return unwrap(std::move(result));
}

Fit fit_motions(const Doubles& neutral, const Floats& displacements, const Indices& edges,
                const Doubles& positions, const Doubles& rotations, const Doubles& translations,
                const Indices& weight_joints, const Floats& weights, const Doubles& pivots,
                const std::vector<std::uint32_t>& at, double emphasis, std::size_t threads,
                double least_effect) {
  const author::Shapes input = shapes(neutral, displacements, edges, Doubles(0));
  author::FitOptions options;
  options.emphasis = emphasis;
  options.threads = threads;
  options.least_effect = least_effect;
  options.given = given_joints(positions, rotations, translations, input.expressions);
  options.joints = options.given.size() + at.size();
  options.pivots.resize(static_cast<std::size_t>(pivots.size()) / 3);
  for (std::size_t i = 0; i < options.pivots.size(); ++i) {
    std::copy_n(pivots.data() + 3 * i, 3, options.pivots[i].position.begin());
  }
  const author::StartWeights start = start_weights_of(weight_joints, weights);
  auto result = [&] {
    const py::gil_scoped_release released;
    return author::fit_motions(input, options, start, at);
  }();
  return unwrap(std::move(result));
}

/// float64[expressions, joints, 3] of one half of the motions.
Doubles motions(const Fit& fit, author::Vector3 author::JointMotion::* half) {
  const std::size_t joints = fit.joints.size(), count = fit.motions.size() / joints;
  Doubles out({static_cast<py::ssize_t>(count), static_cast<py::ssize_t>(joints), py::ssize_t{3}});
  double* to = out.mutable_data();
  for (std::size_t e = 0; e < count; ++e) {
    for (std::size_t j = 0; j < joints; ++j) {
      for (const double x : fit.motions[j * count + e].*half) *to++ = x;
    }
  }
  return out;
}

template <class T>
py::array_t<T> rows(const std::vector<T>& values, std::size_t width) {
  py::array_t<T> out(
      {static_cast<py::ssize_t>(values.size() / width), static_cast<py::ssize_t>(width)});
  std::copy(values.begin(), values.end(), out.mutable_data());
  return out;
}

/// uint32[n, 3] triangles and the error: see risorius.author.simplify.
py::tuple simplify(const Floats& positions, const Floats& attributes, const Indices& triangles,
                   std::size_t count) {
  if (positions.ndim() != 2 || positions.shape(1) != 3)
    shape_error("positions", "(C, 3)", positions);
  if (attributes.ndim() != 2 || attributes.shape(0) != positions.shape(0)) {
    shape_error("attributes", "(C, n)", attributes);
  }
  if (triangles.ndim() != 2 || triangles.shape(1) != 3)
    shape_error("triangles", "(n, 3)", triangles);
  author::Surface surface;
  surface.positions.resize(static_cast<std::size_t>(positions.shape(0)));
  for (std::size_t c = 0; c < surface.positions.size(); ++c) {
    std::copy_n(positions.data() + 3 * c, 3, surface.positions[c].begin());
  }
  surface.attribute_count = static_cast<std::size_t>(attributes.shape(1));
  surface.attributes.assign(attributes.data(), attributes.data() + attributes.size());
  for (py::ssize_t t = 0; t < triangles.shape(0); ++t) {
    const std::uint32_t* at = triangles.data() + 3 * t;
    surface.triangles.push_back({at[0], at[1], at[2]});
  }
  auto result = [&] {
    const py::gil_scoped_release released;
    return author::simplify(surface, count);
  }();
  const author::Simplified out = unwrap(std::move(result));
  py::array_t<std::uint32_t> found(
      {static_cast<py::ssize_t>(out.triangles.size()), py::ssize_t{3}});
  std::uint32_t* to = found.mutable_data();
  for (const author::Triangle& t : out.triangles) to = std::copy(t.begin(), t.end(), to);
  return py::make_tuple(found, out.error);
}

}  // namespace

void bind_author(py::module_& m) {
  py::class_<Fit>(m, "JointFit", "Joints, weights and joint motions that repeat shapes.")
      .def_property_readonly(
          "joints",
          [](const Fit& f) {
            Doubles out({static_cast<py::ssize_t>(f.joints.size()), py::ssize_t{3}});
            double* to = out.mutable_data();
            for (const author::Vector3& p : f.joints) to = std::copy(p.begin(), p.end(), to);
            return out;
          },
          "float64[J, 3]: neutral positions.")
      .def_property_readonly(
          "mirrored", [](const Fit& f) { return rows(f.mirrored, 1).attr("ravel")(); },
          "uint32[J]: the joint of the other side, itself in the middle.")
      .def_property_readonly(
          "weight_joints", [](const Fit& f) { return rows(f.weight_joints, f.influences); },
          "uint16[V, influences]: joints of each vertex.")
      .def_property_readonly(
          "weights", [](const Fit& f) { return rows(f.weights, f.influences); },
          "float32[V, influences]: their weights, rows sum to 1.")
      .def_property_readonly(
          "rotations", [](const Fit& f) { return motions(f, &author::JointMotion::rotation); },
          "float64[E, J, 3]: rotation vectors about the joint, radians.")
      .def_property_readonly(
          "translations",
          [](const Fit& f) { return motions(f, &author::JointMotion::translation); },
          "float64[E, J, 3]: shifts of the joint.");
  m.def("fit_joints", &fit_joints, py::arg("neutral"), py::arg("displacements"), py::arg("edges"),
        py::arg("importance"), py::arg("positions"), py::arg("rotations"), py::arg("translations"),
        py::kw_only(), py::arg("joints"), py::arg("influences"), py::arg("smoothness"),
        py::arg("emphasis"), py::arg("rounds"), py::arg("symmetric"), py::arg("threads"),
        py::arg("least_effect"), py::arg("bound"), py::arg("pivots"), py::arg("pivot_expressions"),
        py::arg("progress"), "JointFit: see risorius.author.fitting.");
  m.def("fit_weights", &fit_weights, py::arg("neutral"), py::arg("displacements"), py::arg("edges"),
        py::arg("importance"), py::arg("positions"), py::arg("rotations"), py::arg("translations"),
        py::arg("mirrored"), py::arg("start_joints"), py::arg("start_weights"), py::kw_only(),
        py::arg("influences"), py::arg("smoothness"), py::arg("symmetric"), py::arg("threads"),
        "JointFit with these joints: see risorius.author.fitting.");
  m.def("fit_motions", &fit_motions, py::arg("neutral"), py::arg("displacements"), py::arg("edges"),
        py::arg("positions"), py::arg("rotations"), py::arg("translations"),
        py::arg("weight_joints"), py::arg("weights"), py::kw_only(), py::arg("pivots"),
        py::arg("at"), py::arg("emphasis"), py::arg("threads"), py::arg("least_effect"),
        "JointFit with these weights: see risorius.author.fitting.");
  m.def("simplify", &simplify, py::arg("positions"), py::arg("attributes"), py::arg("triangles"),
        py::arg("count"), "See risorius.author.simplify.");
}

}  // namespace risorius::bindings
