// SPDX-License-Identifier: MIT
// Python bindings of author/correct.h: faults of a skin in combined expressions, and their repair.
#include <algorithm>
#include <utility>

#include "author/correct.h"
#include "bindings/fields.h"

namespace risorius::bindings {

namespace {

using author::FaultSums;
using author::SkinChecker;
using author::SkinFaults;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Indices = py::array_t<std::uint32_t, py::array::c_style | py::array::forcecast>;

template <class T, class Array>
std::vector<std::array<T, 3>> triples(const Array& values, const char* name) {
  if (values.ndim() != 2 || values.shape(1) != 3) shape_error(name, "(n, 3)", values);
  std::vector<std::array<T, 3>> out(static_cast<std::size_t>(values.shape(0)));
  for (std::size_t i = 0; i < out.size(); ++i)
    std::copy_n(values.data() + 3 * i, 3, out[i].begin());
  return out;
}

SkinChecker make(const Doubles& neutral, const Indices& face_offsets, const Indices& corners,
                 const std::vector<std::pair<Indices, std::size_t>>& solids, double mm) {
  author::Skin skin;
  skin.neutral = triples<double>(neutral, "neutral");
  skin.face_offsets.assign(face_offsets.data(), face_offsets.data() + face_offsets.size());
  skin.corners.assign(corners.data(), corners.data() + corners.size());
  for (const auto& [triangles, vertices] : solids) {
    skin.solids.push_back({triples<std::uint32_t>(triangles, "triangles"), vertices});
  }
  skin.mm = mm;
  return unwrap(SkinChecker::make(std::move(skin)));
}

author::SkinPose pose(const Doubles& skin, const std::vector<Doubles>& solids) {
  author::SkinPose out;
  out.skin = triples<double>(skin, "skin");
  for (const Doubles& solid : solids) out.solids.push_back(triples<double>(solid, "solids"));
  return out;
}

Floats array(const std::vector<float>& values) {
  return Floats(static_cast<py::ssize_t>(values.size()), values.data());
}
SkinFaults faults(const Floats& depth, const Floats& stretch, const Floats& fold) {
  const auto list = [](const Floats& a) {
    return std::vector<float>(a.data(), a.data() + a.size());
  };
  return {list(depth), list(stretch), list(fold)};
}

void bind_faults(py::module_& m) {
  py::class_<FaultSums>(m, "FaultSums", "Sums of the faults beyond the allowed ones.")
      .def_readonly("volume", &FaultSums::volume, "Depth times area, mm3.")
      .def_readonly("deepest", &FaultSums::deepest, "Largest depth beyond the allowed one, mm.")
      .def_readonly("stretched", &FaultSums::stretched, "Faces with over 2.5 times their area.")
      .def_readonly("widest", &FaultSums::widest, "Largest of these ratios of areas.")
      .def_readonly("folded", &FaultSums::folded,
                    "Number of edges whose faces are folded together.");
  py::class_<SkinFaults>(m, "SkinFaults", "The faults of a posed skin.")
      .def(py::init(&faults), py::arg("depth"), py::arg("stretch"), py::arg("fold"))
      .def_property_readonly(
          "depth", [](const SkinFaults& f) { return array(f.depth); },
          "float32[V]: depth of each vertex inside a solid or the skin itself, mm.")
      .def_property_readonly(
          "stretch", [](const SkinFaults& f) { return array(f.stretch); },
          "float32[F]: area of each face relative to the neutral pose.")
      .def_property_readonly(
          "fold", [](const SkinFaults& f) { return array(f.fold); },
          "float32[inner edges]: cosine between the normals of both faces.");
}

using CheckerClass = py::class_<SkinChecker>;

// Binds the methods of SkinChecker that find faults or nearest points, but repair nothing.
void bind_looks(CheckerClass& c) {
  c.def_property_readonly(
       "shown",
       [](const SkinChecker& checker) {
         const std::vector<bool>& shown = checker.shown();
         py::array_t<bool> out(static_cast<py::ssize_t>(shown.size()));
         std::ranges::copy(shown, out.mutable_data());
         return out;
       },
       "bool[V]: whether a vertex can be visible. Only visible vertices must stay out of solids.")
      .def(
          "nearest",
          [](const SkinChecker& checker, const Doubles& points, const Doubles& normals) {
            const auto places = unwrap(checker.nearest(triples<double>(points, "points"),
                                                       triples<double>(normals, "normals")));
            const auto count = static_cast<py::ssize_t>(places.size());
            Indices corners({count, py::ssize_t{3}});
            Doubles shares({count, py::ssize_t{3}}), distances(count);
            for (std::size_t i = 0; i < places.size(); ++i) {
              std::ranges::copy(places[i].corners, corners.mutable_data() + 3 * i);
              std::ranges::copy(places[i].shares, shares.mutable_data() + 3 * i);
              distances.mutable_data()[i] = places[i].distance;
            }
            return py::make_tuple(corners, shares, distances);
          },
          py::arg("points"), py::arg("normals"),
          "uint32[n, 3] corners of the nearest triangle of the neutral skin, float64[n, 3] weights "
          "of the corners, float64[n] distances in mm.")
      .def(
          "look",
          [](const SkinChecker& checker, const Doubles& skin, const std::vector<Doubles>& solids) {
            const author::SkinPose here = pose(skin, solids);
            auto result = [&] {
              const py::gil_scoped_release released;
              return checker.look(here);
            }();
            return unwrap(std::move(result));
          },
          py::arg("skin"), py::arg("solids"), "Returns the SkinFaults of a pose.")
      .def(
          "sum",
          [](const SkinChecker& checker, const SkinFaults& found, const SkinFaults& allowed) {
            return unwrap(checker.sum(found, allowed));
          },
          py::arg("faults"), py::arg("allowed"), "Returns FaultSums.");
}

void bind_repair(CheckerClass& c) {
  c.def(
      "repair",
      [](const SkinChecker& checker, const Doubles& skin, const std::vector<Doubles>& solids,
         const SkinFaults& allowed, const std::vector<Doubles>& without) {
        const author::SkinPose here = pose(skin, solids);
        const author::SkinPose others = pose(skin, without);
        auto result = [&] {
          const py::gil_scoped_release released;
          return checker.repair(here, allowed, others.solids);
        }();
        const author::Repair out = unwrap(std::move(result));
        Doubles moved({static_cast<py::ssize_t>(out.displacement.size()), py::ssize_t{3}});
        double* to = moved.mutable_data();
        for (const author::Vector3& x : out.displacement) to = std::copy(x.begin(), x.end(), to);
        return py::make_tuple(moved, out.before, out.after);
      },
      py::arg("skin"), py::arg("solids"), py::arg("allowed"), py::arg("without"),
      "Returns displacements float64[V, 3] to be added, and FaultSums before and after.");
}

}  // namespace

void bind_correct(py::module_& m) {
  bind_faults(m);
  CheckerClass c(m, "SkinChecker", "See risorius.author.correctives.");
  c.def(py::init(&make), py::arg("neutral"), py::arg("face_offsets"), py::arg("corners"),
        py::arg("solids"), py::arg("mm"));
  bind_looks(c);
  bind_repair(c);
}

}  // namespace risorius::bindings
