// SPDX-License-Identifier: MIT
// Binds the conversion of poses to vertex positions and bone matrices.
#include <algorithm>
#include <array>
#include <functional>
#include <set>

#include "bindings/numpy_arrays.h"
#include "compile/compile.h"
#include "core/finite.h"
#include "rig/outputs/bone_space.h"
#include "rig/outputs/morph.h"

namespace risorius::bindings {

namespace {

void require_finite(const FloatArray& array, const char* name) {
  if (core::all_finite({array.data(), static_cast<std::size_t>(array.size())})) return;
  throw py::value_error(std::string(name) + ": finite numbers were expected");
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

// Checks the argument `out`, the caller's array for the result, or makes a new array if it is None.
// Raises ValueError if the array overlaps `base`, or is no writeable float32[rows, 3].
py::array_t<float> output_argument(const py::object& object, py::ssize_t rows, const float* base) {
  if (object.is_none()) return py::array_t<float>({rows, py::ssize_t{3}});
  const py::array_t<float> out = written_argument(object, "out", rows);
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

rig::SpaceConvention space_argument(const py::object& axes, float scale, float radians,
                                    const std::array<int, 3>& sequence,
                                    const std::array<float, 3>& signs) {
  rig::SpaceConvention convention;
  const FloatArray rows = matrix_argument(axes, "axes", 3);
  std::copy(rows.data(), rows.data() + 9, convention.axes.begin());
  convention.scale = scale;
  if (std::set<int>(sequence.begin(), sequence.end()) != std::set<int>{0, 1, 2}) {
    throw py::value_error("sequence: the numbers 0, 1 and 2 in some order were expected");
  }
  for (std::size_t i = 0; i < 3; ++i) {
    convention.euler.order[i] = static_cast<std::uint8_t>(sequence[i]);
  }
  convention.euler.signs = signs;
  convention.euler.radians_per_unit = radians;
  return convention;
}

std::shared_ptr<rig::BoneSpace> make_bone_space(const py::object& neutral_rotations,
                                                const std::vector<std::uint32_t>& bones,
                                                const py::object& axes, float scale, float radians,
                                                const std::array<int, 3>& sequence,
                                                const std::array<float, 3>& signs) {
  const FloatArray neutral = FloatArray::ensure(neutral_rotations);
  if (!neutral || neutral.ndim() != 2 || neutral.shape(1) != 3) {
    throw py::value_error("neutral_rotations: an array of shape (joints, 3) was expected");
  }
  const auto joints = static_cast<std::uint32_t>(neutral.shape(0));
  for (const std::uint32_t joint : bones) {
    if (joint >= joints) {
      throw py::value_error("bones: joint " + std::to_string(joint) + " of " +
                            std::to_string(joints));
    }
  }
  const rig::SpaceConvention convention = space_argument(axes, scale, radians, sequence, signs);
  return std::make_shared<rig::BoneSpace>(
      rig::make_bone_space(convention, neutral.data(), joints, bones));
}

py::tuple evaluate_bones(const rig::BoneSpace& space, const py::object& joints) {
  const FloatArray deltas = FloatArray::ensure(joints);
  if (!deltas || deltas.ndim() != 2 || deltas.shape(0) != space.joint_count ||
      deltas.shape(1) != 9) {
    throw py::value_error("joints: an array of shape (" + std::to_string(space.joint_count) +
                          ", 9) was expected");
  }
  const auto count = static_cast<py::ssize_t>(space.bones.size());
  py::array_t<float> location({count, py::ssize_t{3}});
  py::array_t<float> rotation({count, py::ssize_t{4}});
  py::array_t<float> scale({count, py::ssize_t{3}});
  rig::evaluate_bones(space, deltas.data(), location.mutable_data(), rotation.mutable_data(),
                      scale.mutable_data());
  return py::make_tuple(location, rotation, scale);
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

void bind_bone_space(py::module_& m) {
  py::class_<rig::BoneSpace, std::shared_ptr<rig::BoneSpace>>(
      m, "BoneSpace",
      "Converts poses of joints to transforms of another program's bones, which rest in the "
      "neutral pose, in axes and units of its own.")
      .def(py::init(&make_bone_space), py::arg("neutral_rotations"), py::arg("bones"),
           py::kw_only(), py::arg("axes"), py::arg("scale") = 1.0f, py::arg("radians") = 1.0f,
           py::arg("sequence") = std::array<int, 3>{0, 1, 2},
           py::arg("signs") = std::array<float, 3>{1, 1, 1},
           "neutral_rotations float32[J, 3]; bones: the joint of each; v' = scale * axes @ v; "
           "radians per unit of angle; sequence: axes in the order of rotation; signs of angles.")
      .def("evaluate", &evaluate_bones, py::arg("joints"),
           "float32[J, 9] of a Pose -> (location[n, 3], rotation[n, 4] w x y z, scale[n, 3]).");
}

}  // namespace

void bind_outputs(py::module_& m) {
  bind_morph(m);
  bind_bone_space(m);
}

}  // namespace risorius::bindings
