// SPDX-License-Identifier: MIT
// Python bindings of author/: fits of joint rigs, simplification, and packed buffers of meshes.
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "author/fit.h"
#include "author/packed.h"
#include "author/simplify.h"
#include "bindings/fields.h"
#include "bindings/teller.h"

namespace risorius::bindings {

namespace {

using author::Fit;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Indices = py::array_t<std::uint32_t, py::array::c_style | py::array::forcecast>;

/// Makes author::Shapes from NumPy arrays: neutral [V, 3], displacements [E, V, 3], edges [n, 2],
/// and importance [V] or []. Raises ValueError if one of the first three arrays has another shape.
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

/// Makes GivenJoints from positions [J, 3] of existing joints, and from their rotations (vectors in
/// radians) and translations [E, J, 3]. A joint that no expression moves gets no motions.
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

/// Joints that the rig has already, with their motions; the class GivenJoints of Python.
struct GivenJoints {
  std::vector<author::GivenJoint> joints;
};

/// Makes GivenJoints from the arguments of Python: positions [J, 3]; rotations (vectors in radians)
/// and translations [E, J, 3]; mirrored [J], the index of each joint's mirrored joint, or [].
GivenJoints given(const Doubles& positions, const Doubles& rotations, const Doubles& translations,
                  const Indices& mirrored) {
  if (positions.ndim() != 2 || positions.shape(1) != 3) {
    shape_error("positions", "(J, 3)", positions);
  }
  if (rotations.ndim() != 3) shape_error("rotations", "(E, J, 3)", rotations);
  const auto expressions = static_cast<std::size_t>(rotations.shape(0));
  GivenJoints out{given_joints(positions, rotations, translations, expressions)};
  if (mirrored.size() == 0) return out;
  if (static_cast<std::size_t>(mirrored.size()) != out.joints.size()) {
    shape_error("mirrored", "(J,)", mirrored);
  }
  for (std::size_t j = 0; j < out.joints.size(); ++j) out.joints[j].mirrored = mirrored.data()[j];
  return out;
}

author::Pivot pivot(const std::array<double, 3>& position, std::vector<std::uint32_t> expressions) {
  return {position, std::move(expressions)};
}

author::StartWeights start_weights(const Indices& joints, const Floats& weights) {
  if (joints.ndim() != 2 || weights.ndim() != 2) shape_error("joints", "(V, n)", joints);
  author::StartWeights out;
  out.influences = static_cast<std::size_t>(joints.shape(1));
  out.joints.assign(joints.data(), joints.data() + joints.size());
  out.weights.assign(weights.data(), weights.data() + weights.size());
  return out;
}

/// The options with the given joints. In Python, options.joints counts only new joints, so the
/// number of given joints is added. Raises ValueError if the motions of a given joint and the
/// shapes have different numbers of expressions.
author::FitOptions with_given(author::FitOptions options, const author::Shapes& shapes,
                              const GivenJoints& given) {
  for (const author::GivenJoint& joint : given.joints) {
    if (joint.motions.empty() || joint.motions.size() == shapes.expressions) continue;
    throw py::value_error("rotations: has " + std::to_string(joint.motions.size()) +
                          " expressions, the shapes have " + std::to_string(shapes.expressions));
  }
  options.given = given.joints;
  options.joints += given.joints.size();
  return options;
}

/// Runs the fit `work` without the GIL. Returns its Fit, or raises its error.
template <class Work>
Fit fitted(const Work& work) {
  auto result = [&] {
    const py::gil_scoped_release released;
    return work();
  }();
  return unwrap(std::move(result));
}

Fit fit_joints(const author::Shapes& shapes, const GivenJoints& given,
               const author::FitOptions& options, py::object progress) {
  const author::FitOptions all = with_given(options, shapes, given);
  Teller teller{std::move(progress), nullptr};
  auto result = [&] {
    const py::gil_scoped_release released;
    return author::fit_joints(shapes, all, std::ref(teller));
  }();
  if (teller.raised) std::rethrow_exception(teller.raised);
  return unwrap(std::move(result));
}

Fit fit_weights(const author::Shapes& shapes, const GivenJoints& given,
                const author::FitOptions& options, const author::StartWeights& start) {
  const author::FitOptions all = with_given(options, shapes, given);
  return fitted([&] { return author::fit_weights(shapes, all.given, all, start); });
}

Fit fit_motions(const author::Shapes& shapes, const GivenJoints& given,
                const author::FitOptions& options, const author::StartWeights& weights,
                const std::vector<std::uint32_t>& at) {
  const author::FitOptions all = with_given(options, shapes, given);
  return fitted([&] { return author::fit_motions(shapes, all, weights, at); });
}

/// float64[expressions, joints, 3]: the rotations (vectors in radians) or the translations of the
/// fit's joint motions.
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

/// Returns triangles uint32[n, 3] and the error, see risorius.author.geometry.simplify.
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

void bind_fit_inputs(py::module_& m) {
  py::class_<author::Shapes>(m, "FitShapes", "A mesh and the displacements of its expressions.")
      .def(py::init(&shapes), py::arg("neutral"), py::arg("displacements"), py::arg("edges"),
           py::arg("importance") = Doubles(0));
  py::class_<GivenJoints>(m, "GivenJoints", "Existing joints and their motions.")
      .def(py::init(&given), py::arg("positions"), py::arg("rotations"), py::arg("translations"),
           py::arg("mirrored") = Indices(0));
  py::class_<author::Pivot>(m, "FitPivot", "A point about which some expressions turn.")
      .def(py::init(&pivot), py::arg("position"), py::arg("expressions"));
  py::class_<author::StartWeights>(m, "FitWeights", "Joints and weights of each vertex.")
      .def(py::init(&start_weights), py::arg("joints"), py::arg("weights"));
  using Options = author::FitOptions;
  py::class_<Options>(m, "FitSettings", "risorius.author.FitOptions, and the pivots.")
      .def(py::init<>())
      .def_readwrite("joints", &Options::joints, "Number of new joints.")
      .def_readwrite("influences", &Options::influences)
      .def_readwrite("smoothness", &Options::smoothness)
      .def_readwrite("symmetric", &Options::symmetric)
      .def_readwrite("emphasis", &Options::emphasis)
      .def_readwrite("least_effect", &Options::least_effect)
      .def_readwrite("bound", &Options::bound)
      .def_readwrite("rounds", &Options::rounds)
      .def_readwrite("threads", &Options::threads)
      .def_readwrite("pivots", &Options::pivots);
}

void bind_fits(py::module_& m) {
  py::class_<Fit>(m, "JointFit", "Joints, weights and joint motions that reproduce shapes.")
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
          "uint32[J]: the joint of the other side; a joint in the middle names itself.")
      .def_property_readonly(
          "weight_joints", [](const Fit& f) { return rows(f.weight_joints, f.influences); },
          "uint16[V, influences]: joints of each vertex.")
      .def_property_readonly(
          "weights", [](const Fit& f) { return rows(f.weights, f.influences); },
          "float32[V, influences]: weights of these joints; rows sum to 1.")
      .def_property_readonly(
          "rotations", [](const Fit& f) { return motions(f, &author::JointMotion::rotation); },
          "float64[E, J, 3]: rotation vectors about the joint, radians.")
      .def_property_readonly(
          "translations",
          [](const Fit& f) { return motions(f, &author::JointMotion::translation); },
          "float64[E, J, 3]: shifts of the joint.");
  m.def("fit_joints", &fit_joints, py::arg("shapes"), py::arg("given"), py::arg("options"),
        py::arg("progress"), "JointFit: see risorius.author.fitting.");
  m.def("fit_weights", &fit_weights, py::arg("shapes"), py::arg("given"), py::arg("options"),
        py::arg("start"), "JointFit with these joints: see risorius.author.fitting.");
  m.def("fit_motions", &fit_motions, py::arg("shapes"), py::arg("given"), py::arg("options"),
        py::arg("weights"), py::arg("at"),
        "JointFit with these weights: see risorius.author.fitting.");
  m.def("simplify", &simplify, py::arg("positions"), py::arg("attributes"), py::arg("triangles"),
        py::arg("count"), "See risorius.author.geometry.simplify.");
}

using Bytes = std::vector<std::uint8_t>;

/// The enumerator whose name in `known` is `name`, such as "TRIANGLES". Raises ValueError if
/// `known` does not contain the name. In: what  name of the argument, for the error
template <class T, std::size_t kCount>
T named(const char* what, const std::string& name,
        const std::array<std::pair<const char*, T>, kCount>& known) {
  std::string all;
  for (const auto& [own, value] : known) {
    if (name == own) return value;
    all += (all.empty() ? "" : ", ") + std::string(own);
  }
  throw py::value_error(std::string(what) + ": one of " + all + " was expected, found " + name);
}

author::Packing packing(std::size_t count, std::size_t stride, const std::string& mode,
                        const std::string& filter) {
  using author::PackedFilter;
  using author::PackedMode;
  constexpr std::array<std::pair<const char*, PackedMode>, 3> kModes{
      {{"ATTRIBUTES", PackedMode::kAttributes},
       {"TRIANGLES", PackedMode::kTriangles},
       {"INDICES", PackedMode::kIndices}}};
  constexpr std::array<std::pair<const char*, PackedFilter>, 4> kFilters{
      {{"NONE", PackedFilter::kNone},
       {"OCTAHEDRAL", PackedFilter::kOctahedral},
       {"QUATERNION", PackedFilter::kQuaternion},
       {"EXPONENTIAL", PackedFilter::kExponential}}};
  return {count, stride, named("mode", mode, kModes), named("filter", filter, kFilters)};
}

/// Runs `work` without the GIL and returns its bytes. Raises ValueError with the error's sentence.
template <class Work>
py::bytes worked(const Work& work) {
  const core::Result<Bytes> result = [&] {
    const py::gil_scoped_release released;
    return work();
  }();
  if (!result) throw py::value_error(result.error().describe());
  return {reinterpret_cast<const char*>(result.value().data()), result.value().size()};
}

std::span<const std::uint8_t> span_of(const py::bytes& bytes) {
  const std::string_view view = bytes;
  return {reinterpret_cast<const std::uint8_t*>(view.data()), view.size()};
}

void bind_packed(py::module_& m) {
  m.def(
      "unpack_buffer",
      [](const py::bytes& packed, std::size_t count, std::size_t stride, const std::string& mode,
         const std::string& filter) {
        const auto span = span_of(packed);
        const author::Packing how = packing(count, stride, mode, filter);
        return worked([&] { return author::unpack(span, how); });
      },
      py::arg("packed"), py::arg("count"), py::arg("stride"), py::arg("mode"), py::arg("filter"),
      "Unpacks a buffer view of glTF's EXT_meshopt_compression. The arguments have the names and "
      "values of the extension.");
  m.def(
      "pack_buffer",
      [](const py::bytes& rows, std::size_t count, std::size_t stride, const std::string& mode,
         const std::string& filter) {
        const auto span = span_of(rows);
        const author::Packing how = packing(count, stride, mode, filter);
        return worked([&] { return author::pack(span, how); });
      },
      py::arg("rows"), py::arg("count"), py::arg("stride"), py::arg("mode"), py::arg("filter"),
      "Packs rows for unpack_buffer. With a filter, the rows must come from filter_buffer.");
  m.def(
      "filter_buffer",
      [](const py::array_t<float, py::array::c_style | py::array::forcecast>& values,
         std::size_t stride, const std::string& filter, int bits) {
        if (values.ndim() != 2) shape_error("values", "(n, k)", values);
        const auto count = static_cast<std::size_t>(values.shape(0));
        const author::Packing how = packing(count, stride, "ATTRIBUTES", filter);
        const std::span<const float> span(values.data(), static_cast<std::size_t>(values.size()));
        return worked([&] { return author::filtered(span, how, bits); });
      },
      py::arg("values"), py::arg("stride"), py::arg("filter"), py::arg("bits"),
      "Encodes values[n, k] as rows of `stride` bytes that the filter of unpack_buffer decodes.");
}

}  // namespace

void bind_author(py::module_& m) {
  bind_fit_inputs(m);
  bind_fits(m);
  bind_packed(m);
}

}  // namespace risorius::bindings
