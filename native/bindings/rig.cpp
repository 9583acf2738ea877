// SPDX-License-Identifier: MIT
#include "rig/rig.h"

#include <bit>
#include <functional>

#include "bindings/arrays.h"
#include "compile/compile.h"
#include "core/parallel_for.h"
#include "rig/morph.h"

namespace risorius::bindings {

namespace {

using FloatArray = py::array_t<float, py::array::c_style | py::array::forcecast>;
using RigPtr = std::shared_ptr<const rig::Rig>;

struct PoseArrays {
  FloatArray joints, blend_shapes, animated_maps, controls;
};

struct PyInstance {
  RigPtr rig;
  rig::Instance instance;
};

FloatArray vector_argument(const py::object& object, const char* name, std::size_t length) {
  FloatArray array = FloatArray::ensure(object);
  if (!array) throw py::value_error(std::string(name) + ": an array of numbers was expected");
  if (array.ndim() != 1 || static_cast<std::size_t>(array.shape(0)) != length) {
    shape_error(name, "(" + std::to_string(length) + ",)", array);
  }
  return array;
}

// Exponents of all ones are infinities and NaN; without an early exit the compiler vectorises.
void require_finite(const FloatArray& array, const char* name) {
  constexpr std::uint32_t kExponent = 0x7f800000u;
  const float* begin = array.data();
  std::uint32_t spoiled = 0;
  for (py::ssize_t i = 0; i < array.size(); ++i) {
    spoiled |= (std::bit_cast<std::uint32_t>(begin[i]) & kExponent) == kExponent ? 1u : 0u;
  }
  if (spoiled != 0) throw py::value_error(std::string(name) + ": finite numbers were expected");
}

FloatArray matrix_argument(const py::object& object, const char* name, py::ssize_t rows) {
  FloatArray array = FloatArray::ensure(object);
  if (!array) throw py::value_error(std::string(name) + ": an array of numbers was expected");
  if (array.ndim() != 2 || array.shape(0) != rows || array.shape(1) != 3) {
    shape_error(name, "(" + std::to_string(rows) + ", 3)", array);
  }
  require_finite(array, name);
  return array;
}

// A caller's array is written in place, or a new one is made.
py::array_t<float> output_argument(const py::object& object, py::ssize_t rows, const float* base) {
  if (object.is_none()) return py::array_t<float>({rows, py::ssize_t{3}});
  if (!py::isinstance<py::array_t<float, py::array::c_style>>(object)) {
    throw py::value_error("out: a C-contiguous float32 array was expected");
  }
  auto out = object.cast<py::array_t<float>>();
  if (out.ndim() != 2 || out.shape(0) != rows || out.shape(1) != 3) {
    shape_error("out", "(" + std::to_string(rows) + ", 3)", out);
  }
  if (!out.writeable()) throw py::value_error("out: the array is read-only");
  const std::less<const float*> before;
  if (base != nullptr && before(base, out.data() + rows * 3) &&
      before(out.data(), base + rows * 3)) {
    throw py::value_error("out: an array that does not overlap base was expected");
  }
  return out;
}

py::array evaluate_morph(const rig::Morph& morph, const py::object& weights, const py::object& base,
                         const py::object& out) {
  const FloatArray w = vector_argument(weights, "blend_shapes", morph.channel_count);
  require_finite(w, "blend_shapes");
  const auto vertices = static_cast<py::ssize_t>(morph.vertex_count);
  const FloatArray from = base.is_none() ? FloatArray() : matrix_argument(base, "base", vertices);
  const float* start = base.is_none() ? nullptr : from.data();
  py::array_t<float> to = output_argument(out, vertices, start);
  rig::evaluate_morph(morph, w.data(), start, to.mutable_data());
  return to;
}

py::array_t<float> copied(std::span<const float> values, std::vector<py::ssize_t> shape) {
  py::array_t<float> out(std::move(shape));
  std::copy(values.begin(), values.end(), out.mutable_data());
  return out;
}

PoseArrays to_arrays(const rig::Rig& rig, const rig::Pose& pose) {
  const auto size = [](const std::vector<float>& v) { return static_cast<py::ssize_t>(v.size()); };
  return {copied(pose.joints, {static_cast<py::ssize_t>(rig.joint_count), 9}),
          copied(pose.blend_shapes, {size(pose.blend_shapes)}),
          copied(pose.animated_maps, {size(pose.animated_maps)}),
          copied(pose.controls, {size(pose.controls)})};
}

RigPtr make_rig(const dna::Dna& dna, const std::string& precision,
                const std::optional<std::string>& simd) {
  compile::CompileOptions options;
  if (precision != "float32" && precision != "float16") {
    throw py::value_error("precision: float32 or float16 was expected, found " + precision);
  }
  if (precision == "float16") options.precision = compile::Precision::kFloat16;
  if (simd) {
    options.kernels = simd::find_kernels(simd->c_str());
    if (options.kernels == nullptr) {
      throw py::value_error("simd: " + *simd +
                            " is not available here; there are: " + simd::available_kernels());
    }
  }
  return std::make_shared<const rig::Rig>(unwrap(compile::compile(dna, options)));
}

PoseArrays evaluate(const rig::Rig& rig, const py::object& raw, std::uint32_t lod, bool settle) {
  const FloatArray in = vector_argument(raw, "raw", rig.raw_count);
  rig::Workspace work = rig::make_workspace(rig);
  rig::Pose pose = rig::make_pose(rig);
  rig::evaluate(rig, in.data(), lod, settle, work, pose);
  return to_arrays(rig, pose);
}

PoseArrays evaluate_batch(const rig::Rig& rig, const py::object& raw, std::uint32_t lod,
                          std::size_t threads, bool settle) {
  const FloatArray in = FloatArray::ensure(raw);
  if (!in || in.ndim() != 2 || static_cast<std::size_t>(in.shape(1)) != rig.raw_count) {
    if (!in) throw py::value_error("raw: an array of numbers was expected");
    shape_error("raw", "(n, " + std::to_string(rig.raw_count) + ")", in);
  }
  const auto n = in.shape(0);
  const auto columns = [](std::uint32_t v) { return static_cast<py::ssize_t>(v); };
  PoseArrays out{FloatArray({n, columns(rig.joint_count), py::ssize_t{9}}),
                 FloatArray({n, columns(rig.blend_shape_count)}),
                 FloatArray({n, columns(rig.animated_map_count)}),
                 FloatArray({n, columns(rig.control_count)})};
  const rig::PoseView all{out.joints.mutable_data(), out.blend_shapes.mutable_data(),
                          out.animated_maps.mutable_data(), out.controls.mutable_data()};
  const float* rows = in.data();
  py::gil_scoped_release released;
  core::parallel_for(static_cast<std::size_t>(n), threads, [&](std::size_t begin, std::size_t end) {
    rig::Workspace work = rig::make_batch_workspace(rig);
    const rig::PoseView part{all.joints + begin * rig.joint_count * 9,
                             all.blend_shapes + begin * rig.blend_shape_count,
                             all.animated_maps + begin * rig.animated_map_count,
                             all.controls + begin * rig.control_count};
    rig::evaluate_frames(rig, rows + begin * rig.raw_count, end - begin, lod, settle, work, part);
  });
  return out;
}

void bind_rig_class(py::module_& m) {
  py::class_<rig::Rig, std::shared_ptr<rig::Rig>>(
      m, "Rig", "A compiled face: turns raw controls into a Pose. Immutable, shared freely.")
      .def(py::init([](const dna::Dna& dna, const std::string& precision,
                       const std::optional<std::string>& simd) {
             return std::const_pointer_cast<rig::Rig>(make_rig(dna, precision, simd));
           }),
           py::arg("dna"), py::kw_only(), py::arg("precision") = "float32",
           py::arg("simd") = py::none())
      .def_property_readonly("raw_control_names",
                             [](const rig::Rig& r) {
                               py::list out;
                               for (const auto& n : r.raw_control_names()) out.append(to_python(n));
                               return out;
                             })
      .def_property_readonly("gui_control_names",
                             [](const rig::Rig& r) {
                               py::list out;
                               for (const auto& n : r.gui_control_names()) out.append(to_python(n));
                               return out;
                             })
      .def_readonly("joint_count", &rig::Rig::joint_count)
      .def_readonly("blend_shape_count", &rig::Rig::blend_shape_count)
      .def_readonly("animated_map_count", &rig::Rig::animated_map_count)
      .def_readonly("lod_count", &rig::Rig::lod_count)
      .def_readonly("control_count", &rig::Rig::control_count)
      .def_property_readonly("ignored_layers", &rig::Rig::ignored_layers)
      .def_property_readonly("memory_bytes", &rig::Rig::memory_bytes)
      .def_property_readonly("simd", [](const rig::Rig& r) { return r.kernels->name; })
      .def_property_readonly("neutral_joints",
                             [](const rig::Rig& r) {
                               return copied(r.neutral_joints,
                                             {static_cast<py::ssize_t>(r.joint_count), 9});
                             })
      .def_property_readonly("joint_indices_written",
                             [](const rig::Rig& r) {
                               return py::array_t<std::uint16_t>(
                                   static_cast<py::ssize_t>(r.joints_written.size()),
                                   r.joints_written.data());
                             })
      .def(
          "gui_to_raw",
          [](const rig::Rig& r, const py::object& gui) {
            const FloatArray in = vector_argument(gui, "gui", r.gui_count);
            py::array_t<float> raw(static_cast<py::ssize_t>(r.raw_count));
            rig::gui_to_raw(r, in.data(), raw.mutable_data());
            return raw;
          },
          py::arg("gui"), "float32[G] -> float32[R] in [0, 1]")
      .def("evaluate", &evaluate, py::arg("raw"), py::arg("lod") = 0, py::arg("settle") = true,
           "float32[R] -> Pose; a function of raw alone when settle is true.")
      .def("evaluate_batch", &evaluate_batch, py::arg("raw"), py::arg("lod") = 0,
           py::arg("threads") = 0, py::arg("settle") = true,
           "float32[N, R] -> Pose whose fields have a leading N; threads 0 is all cores.")
      .def("instance",
           [](const std::shared_ptr<rig::Rig>& r) { return PyInstance{r, rig::Instance(*r)}; });
}

void bind_morph(py::module_& m) {
  py::class_<rig::Morph, std::shared_ptr<rig::Morph>>(
      m, "Morph", "The blend shape targets of one mesh, compiled for summing.")
      .def(py::init([](const dna::Dna& dna, std::size_t mesh_index, const py::object& matrix) {
             std::array<float, 9> rows{1, 0, 0, 0, 1, 0, 0, 0, 1};
             if (!matrix.is_none()) {
               const FloatArray given = matrix_argument(matrix, "matrix", 3);
               std::copy(given.data(), given.data() + 9, rows.begin());
             }
             return std::make_shared<rig::Morph>(
                 unwrap(compile::compile_morph(dna, mesh_index, rows)));
           }),
           py::arg("dna"), py::arg("mesh_index"), py::kw_only(), py::arg("matrix") = py::none())
      .def_readonly("vertex_count", &rig::Morph::vertex_count)
      .def_property_readonly("channel_indices",
                             [](const rig::Morph& s) {
                               return py::array_t<std::uint16_t>(
                                   static_cast<py::ssize_t>(s.channels.size()), s.channels.data());
                             })
      .def_property_readonly("memory_bytes", &rig::Morph::memory_bytes)
      .def("evaluate", &evaluate_morph, py::arg("blend_shapes"), py::arg("base") = py::none(),
           py::arg("out") = py::none(),
           "float32[B] -> float32[V, 3]: base + sum of weight * delta.");
}

}  // namespace

void bind_rig(py::module_& m) {
  py::class_<PoseArrays>(m, "Pose",
                         "joints float32[J, 9]: tx ty tz rx ry rz sx sy sz deltas from neutral in "
                         "the file's units and axes; blend_shapes[B]; animated_maps[A] in [0, 1]; "
                         "controls[raw + corrective + ...]")
      .def_readonly("joints", &PoseArrays::joints)
      .def_readonly("blend_shapes", &PoseArrays::blend_shapes)
      .def_readonly("animated_maps", &PoseArrays::animated_maps)
      .def_readonly("controls", &PoseArrays::controls);
  py::class_<PyInstance>(m, "Instance",
                         "One face through time, with the reference's one-frame latencies.")
      .def_property(
          "lod", [](const PyInstance& s) { return s.instance.lod(); },
          [](PyInstance& s, std::uint32_t lod) { s.instance.set_lod(lod); })
      .def("evaluate", [](PyInstance& s, const py::object& raw) {
        const FloatArray in = vector_argument(raw, "raw", s.rig->raw_count);
        return to_arrays(*s.rig, s.instance.evaluate(in.data()));
      });
  bind_rig_class(m);
  bind_morph(m);
  m.def("available_simd", [] { return std::string(simd::available_kernels()); });
}

}  // namespace risorius::bindings
