// SPDX-License-Identifier: MIT
// Binds the functions that make a new Dna from another Dna.
#include "bindings/fields.h"
#include "dna/convert/lods.h"
#include "edit/regroup.h"

namespace risorius::bindings {

namespace {

using edit::GroupSizes;
using edit::LargestChange;
using edit::RegroupReport;
using JointLists = std::vector<std::vector<std::uint16_t>>;

py::tuple regroup(const dna::Dna& dna, const JointLists& regions, double translation_mm,
                  double rotation_degrees, double scale, double foreign_share,
                  std::uint32_t combinations, std::uint64_t seed, std::uint32_t timed) {
  const edit::RegroupOptions options{
      regions, {translation_mm, rotation_degrees, scale}, foreign_share, combinations, seed, timed};
  auto result = [&] {
    const py::gil_scoped_release released;
    return edit::regroup(dna, options);
  }();
  edit::Regrouped out = unwrap(std::move(result));
  return py::make_tuple(std::make_shared<dna::Dna>(std::move(out.dna)), std::move(out.report));
}

std::shared_ptr<dna::Dna> keep_parts(const dna::Dna& dna, const std::vector<bool>& joints,
                                     const std::vector<bool>& correctives) {
  auto result = [&] {
    const py::gil_scoped_release released;
    return dna::keep_parts(dna, joints, correctives);
  }();
  return std::make_shared<dna::Dna>(unwrap(std::move(result)));
}

template <class Change>
void change(py::class_<RegroupReport>& c, const char* name, Change member, const char* doc) {
  c.def_property_readonly(
      name, [member](const RegroupReport& r) { return r.changes.*member; }, doc);
}

void bind_report(py::module_& m) {
  py::class_<GroupSizes>(m, "GroupSizes",
                         "Numbers of joint groups, their rows, stored coefficients (zeros "
                         "included), and coefficients other than 0.")
      .def_readonly("groups", &GroupSizes::groups)
      .def_readonly("rows", &GroupSizes::rows)
      .def_readonly("coefficients", &GroupSizes::coefficients)
      .def_readonly("nonzero", &GroupSizes::nonzero);
  py::class_<LargestChange>(m, "LargestChange",
                            "The largest difference of one kind; joint is \"\" if nothing differs.")
      .def_readonly("value", &LargestChange::value)
      .def_property_readonly("joint", [](const LargestChange& s) { return to_python(s.joint); })
      .def_property_readonly("expression",
                             [](const LargestChange& s) { return to_python(s.expression); })
      .def_readonly("lod", &LargestChange::lod);
  py::class_<RegroupReport> report(m, "RegroupReport", "The result of regroup.");
  report.def_readonly("before", &RegroupReport::before)
      .def_readonly("after", &RegroupReport::after)
      .def_readonly("regions", &RegroupReport::regions)
      .def_readonly("removed", &RegroupReport::removed)
      .def_readonly("microseconds_before", &RegroupReport::microseconds_before)
      .def_readonly("microseconds_after", &RegroupReport::microseconds_after);
  using edit::Changes;
  change(report, "translation_mm", &Changes::translation_mm, "Of a joint against its parent.");
  change(report, "rotation_degrees", &Changes::rotation_degrees, "Of a joint against its parent.");
  change(report, "scale", &Changes::scale, "Scale of a joint; 1 is its neutral size.");
  change(report, "position_mm", &Changes::position_mm, "Of a joint in the face.");
  change(report, "expressions", &Changes::expressions,
         "Number of raw controls that were compared one by one.");
  change(report, "combinations", &Changes::combinations,
         "Number of random poses that were compared.");
}

}  // namespace

void bind_edit(py::module_& m) {
  bind_report(m);
  m.def("regroup", &regroup, py::arg("dna"), py::kw_only(), py::arg("regions"),
        py::arg("translation_mm"), py::arg("rotation_degrees"), py::arg("scale"),
        py::arg("foreign_share"), py::arg("combinations"), py::arg("seed"), py::arg("timed"),
        "(Dna, RegroupReport): see risorius.rigs.edit.regroup.");
  m.def("keep_parts", &keep_parts, py::arg("dna"), py::kw_only(), py::arg("joints"),
        py::arg("correctives"),
        "A copy with only the joints and correctives that are True; all indices are renumbered.");
}

}  // namespace risorius::bindings
