// SPDX-License-Identifier: MIT
// Transforms of bones to matrices, and matrices to vertices.
#include <functional>

#include "bindings/numpy_arrays.h"
#include "core/aligned.h"
#include "rig/outputs/joint_chain.h"
#include "rig/outputs/skin.h"

namespace risorius::bindings {

namespace {

using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

// The parents of bones as int32. `from_python` cannot convert them, because it rejects -1, which
// means no parent.
std::vector<std::int32_t> parents_argument(const py::object& object) {
  const py::array any = py::array::ensure(object);
  if (!any || any.ndim() != 1 ||
      (any.size() > 0 && std::string("iu").find(any.dtype().kind()) == std::string::npos)) {
    throw py::value_error("parents: whole numbers, one for each bone, were expected");
  }
  const py::array_t<std::int64_t, py::array::c_style | py::array::forcecast> wide(any);
  std::vector<std::int32_t> parents;
  for (py::ssize_t i = 0; i < wide.size(); ++i) {
    const std::int64_t parent = wide.data()[i];
    // A parent that does not fit 32 bits is clamped; make_joint_chain rejects the clamped number.
    parents.push_back(static_cast<std::int32_t>(
        std::clamp<std::int64_t>(parent, std::numeric_limits<std::int32_t>::min(),
                                 std::numeric_limits<std::int32_t>::max())));
  }
  return parents;
}

std::shared_ptr<rig::JointChain> make_chain(const py::object& parents, const py::object& rest) {
  const std::vector<std::int32_t> above = parents_argument(parents);
  const DoubleArray matrices = DoubleArray::ensure(rest);
  if (!matrices) throw py::value_error("rest: an array of numbers was expected");
  const auto bones = static_cast<py::ssize_t>(above.size());
  if (matrices.ndim() != 3 || matrices.shape(0) != bones || matrices.shape(1) != 4 ||
      matrices.shape(2) != 4) {
    shape_error("rest", "(" + std::to_string(bones) + ", 4, 4)", matrices);
  }
  return std::make_shared<rig::JointChain>(
      unwrap_argument(rig::make_joint_chain(above, matrices.data())));
}

py::array_t<float> evaluate_chain(const rig::JointChain& chain, const py::object& location,
                                  const py::object& rotation, const py::object& scale) {
  const py::ssize_t bones = chain.size();
  const FloatArray l = shaped_argument(location, "location", {bones, 3}),
                   q = shaped_argument(rotation, "rotation", {bones, 4}),
                   s = shaped_argument(scale, "scale", {bones, 3});
  py::array_t<float> out({bones, py::ssize_t{3}, py::ssize_t{4}});
  std::vector<rig::JointChain::Affine> work(chain.size());
  rig::evaluate_chain(chain, l.data(), q.data(), s.data(), work.data(), out.mutable_data());
  return out;
}

std::shared_ptr<rig::Skin> make_skin(std::uint32_t vertex_count, const py::object& offsets,
                                     const py::object& bones, const py::object& weights,
                                     std::uint32_t bone_count) {
  const auto begins = from_python<std::uint32_t>(offsets, "offsets");
  const auto which = from_python<std::uint32_t>(bones, "bones");
  const FloatArray shares = FloatArray::ensure(weights);
  if (!shares || shares.ndim() != 1) {
    throw py::value_error("weights: an array of numbers of shape (n,) was expected");
  }
  return std::make_shared<rig::Skin>(unwrap_argument(
      rig::make_skin(vertex_count, begins.span(), which.span(),
                     {shares.data(), static_cast<std::size_t>(shares.size())}, bone_count)));
}

const simd::Kernels& named_kernels(const std::optional<std::string>& simd) {
  const simd::Kernels* kernels = simd::find_kernels(simd ? simd->c_str() : nullptr);
  if (kernels != nullptr) return *kernels;
  throw py::value_error("simd: " + simd.value_or("RISORIUS_SIMD") +
                        " is not available here; there are: " + simd::available_kernels());
}

py::array_t<float> evaluate_skin(const rig::Skin& skin, const py::object& points,
                                 const py::object& matrices, const py::object& out,
                                 const std::optional<std::string>& simd) {
  const simd::Kernels& kernels = named_kernels(simd);
  const auto vertices = static_cast<py::ssize_t>(skin.vertex_count);
  const auto bones = static_cast<py::ssize_t>(skin.bone_count);
  const FloatArray from = shaped_argument(points, "points", {vertices, 3}),
                   moved = shaped_argument(matrices, "matrices", {bones, 3, 4});
  py::array_t<float> to = out.is_none() ? py::array_t<float>({vertices, py::ssize_t{3}})
                                        : written_argument(out, "out", vertices);
  const std::less<const float*> before;
  if (from.data() != to.data() && before(from.data(), to.data() + to.size()) &&
      before(to.data(), from.data() + from.size())) {
    throw py::value_error("out: points, or an array that does not overlap them, was expected");
  }
  core::AlignedVector<float> rows((std::size_t{skin.bone_count} + 1) * simd::kSkinRow);
  float* finished = to.mutable_data();
  const py::gil_scoped_release released;
  kernels.skin_rows(moved.data(), skin.bone_count, rows.data());
  rig::evaluate_skin(skin, kernels, rows.data(), from.data(), finished);
  return to;
}

}  // namespace

void bind_skin(py::module_& m) {
  py::class_<rig::JointChain, std::shared_ptr<rig::JointChain>>(
      m, "JointChain",
      "Computes skinning matrices from the transforms of an armature's bones. A bone passes its "
      "whole motion to its children, shear included.")
      .def(py::init(&make_chain), py::arg("parents"), py::arg("rest"),
           "parents int[B], -1: none, in any order; rest float[B, 4, 4] in the armature's space, "
           "invertible.")
      .def_property_readonly("bone_count", &rig::JointChain::size)
      .def("evaluate", &evaluate_chain, py::arg("location"), py::arg("rotation"), py::arg("scale"),
           "float32 [B, 3], [B, 4] w x y z of any length, [B, 3] -> float32[B, 3, 4], pose times "
           "the inverse of rest. A value that is not finite spoils its bone and the bone's "
           "descendants.");
  py::class_<rig::Skin, std::shared_ptr<rig::Skin>>(m, "Skin",
                                                    "The weights of a mesh's vertices on bones.")
      .def(py::init(&make_skin), py::arg("vertex_count"), py::arg("offsets"), py::arg("bones"),
           py::arg("weights"), py::arg("bone_count"),
           "offsets int[V + 1]: the first influence of each vertex; bones int[N] below bone_count; "
           "weights float32[N], 0 or more, divided by the sum of their vertex. A vertex whose sum "
           "is at most 0.0001 stays in place.")
      .def_readonly("vertex_count", &rig::Skin::vertex_count)
      .def_readonly("bone_count", &rig::Skin::bone_count)
      .def_property_readonly("memory_bytes", &rig::Skin::memory_bytes)
      .def("evaluate", &evaluate_skin, py::arg("points"), py::arg("matrices"),
           py::arg("out") = py::none(), py::arg("simd") = py::none(),
           "points float32[V, 3], matrices float32[B, 3, 4] of JointChain.evaluate -> float32[V, "
           "3], written into out if given; out may be points. A matrix that is not finite spoils "
           "the vertices that have a weight on its bone.");
}

}  // namespace risorius::bindings
