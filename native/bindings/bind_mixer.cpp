// SPDX-License-Identifier: MIT
// Binds the mixer, which combines layers of curves and reactions to the controls of a frame.
#include "bindings/numpy_arrays.h"
#include "clip/mixer/mixer.h"

namespace risorius::bindings {

namespace {

using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;
using IndexArray = py::array_t<std::uint32_t, py::array::c_style | py::array::forcecast>;
using CurvesPtr = std::shared_ptr<const clip::LayerCurves>;
// The class LayerCurves of Python. It contains the pointer to the curves, because pybind11 cannot
// hold a pointer to a const object.
struct PyLayerCurves {
  CurvesPtr curves;
};
// Arguments of a part of a reaction: controls, weights, delay, attack, hold, release.
using PartTuple = std::tuple<IndexArray, FloatArray, double, double, double, double>;
// Arguments of the mixer's rule Yield: by, of, measure, amount.
using YieldTuple = std::tuple<IndexArray, IndexArray, std::string, float>;

// Returns the value of a result, or raises its error as a ValueError. The errors of the mixer
// concern no file, so that no other class of error fits.
template <class T>
T value_or_throw(core::Result<T>&& result) {
  if (!result) throw py::value_error(result.error().describe());
  return std::move(result).value();
}

template <class T>
std::span<const T> span_of(const py::array_t<T, py::array::c_style | py::array::forcecast>& a) {
  return {a.data(), static_cast<std::size_t>(a.size())};
}

template <class T>
std::vector<T> vector_of(const py::array_t<T, py::array::c_style | py::array::forcecast>& a) {
  return {a.data(), a.data() + a.size()};
}

template <class Enum>
Enum named(const char* what, const std::string& given,
           std::initializer_list<std::pair<const char*, Enum>> names) {
  std::string all;
  for (const auto& [name, value] : names) {
    if (given == name) return value;
    all += (all.empty() ? "" : ", ") + std::string(name);
  }
  throw py::value_error(std::string(what) + ": one of " + all + " was expected, found " + given);
}

std::shared_ptr<PyLayerCurves> make_curves(const std::vector<std::string>& controls,
                                           const std::vector<std::string>& names,
                                           const FloatArray& values, double rate, double start,
                                           const std::optional<DoubleArray>& times,
                                           const std::optional<FloatArray>& mask) {
  if (values.ndim() != 2) shape_error("values", "(names, frames)", values);
  clip::CurvesView view;
  view.names = names;
  view.values = span_of(values);
  view.frame_count = static_cast<std::size_t>(values.shape(1));
  view.rate = rate;
  view.start = start;
  if (times) view.times = span_of(*times);
  const std::span<const float> masks = mask ? span_of(*mask) : std::span<const float>{};
  return std::make_shared<PyLayerCurves>(
      PyLayerCurves{value_or_throw(clip::LayerCurves::make(controls, view, masks))});
}

clip::Line line_of(const std::pair<DoubleArray, DoubleArray>& points) {
  return {vector_of(points.first), vector_of(points.second)};
}

clip::Layer layer_of(const py::dict& given) {
  clip::Layer layer;
  layer.curves = given["curves"].cast<const PyLayerCurves&>().curves;
  layer.blend = named<clip::Blend>("blend", given["blend"].cast<std::string>(),
                                   {{"override", clip::Blend::kOverride},
                                    {"additive", clip::Blend::kAdditive},
                                    {"max", clip::Blend::kMax}});
  layer.extend = named<clip::Extend>("extend", given["extend"].cast<std::string>(),
                                     {{"hold", clip::Extend::kHold},
                                      {"hold_forward", clip::Extend::kHoldForward},
                                      {"nothing", clip::Extend::kNothing},
                                      {"repeat", clip::Extend::kRepeat}});
  layer.weight = line_of(given["weight"].cast<std::pair<DoubleArray, DoubleArray>>());
  layer.warp = line_of(given["warp"].cast<std::pair<DoubleArray, DoubleArray>>());
  layer.start = given["start"].cast<double>();
  layer.end = given["end"].cast<double>();
  std::tie(layer.first, layer.last) = given["clip_range"].cast<std::pair<double, double>>();
  layer.scale = given["scale"].cast<double>();
  layer.repeat = given["repeat"].cast<double>();
  layer.reverse = given["reverse"].cast<bool>();
  layer.fade_in = given["fade_in"].cast<double>();
  layer.fade_out = given["fade_out"].cast<double>();
  layer.mute = given["mute"].cast<bool>();
  layer.solo = given["solo"].cast<bool>();
  return layer;
}

void set_layers(clip::Mixer& mixer, const std::vector<py::dict>& given) {
  std::vector<clip::Layer> layers;
  layers.reserve(given.size());
  for (const py::dict& layer : given) layers.push_back(layer_of(layer));
  value_or_throw(mixer.set_layers(std::move(layers)));
}

void set_reactions(clip::Mixer& mixer, const std::vector<std::vector<PartTuple>>& given) {
  std::vector<clip::Reaction> reactions;
  for (const auto& parts : given) {
    clip::Reaction& reaction = reactions.emplace_back();
    for (const auto& [controls, weights, delay, attack, hold, release] : parts) {
      reaction.push_back({vector_of(controls), vector_of(weights), delay, attack, hold, release});
    }
  }
  value_or_throw(mixer.set_reactions(std::move(reactions)));
}

void set_rules(clip::Mixer& mixer, const std::vector<YieldTuple>& yields,
               const std::vector<std::pair<std::uint32_t, std::uint32_t>>& opposites) {
  using Measure = clip::Yield::Measure;
  std::vector<clip::Yield> rules;
  for (const auto& [by, of, measure, amount] : yields) {
    const auto kind =
        named<Measure>("measure", measure,
                       {{"max", Measure::kMax}, {"min", Measure::kMin}, {"mean", Measure::kMean}});
    rules.push_back({vector_of(by), vector_of(of), kind, amount});
  }
  std::vector<clip::Opposites> pairs;
  pairs.reserve(opposites.size());
  for (const auto& [a, b] : opposites) pairs.push_back({a, b});
  value_or_throw(mixer.set_rules(std::move(rules), std::move(pairs)));
}

clip::Mixer make_mixer(std::vector<std::string> controls, const FloatArray& low,
                       const FloatArray& high, std::size_t max_fired) {
  return value_or_throw(
      clip::Mixer::make(std::move(controls), vector_of(low), vector_of(high), max_fired));
}

FloatArray base_argument(const clip::Mixer& mixer, const py::object& base) {
  FloatArray array = FloatArray::ensure(base);
  if (!array) throw py::value_error("base: an array of numbers was expected");
  if (array.ndim() != 1 || static_cast<std::size_t>(array.size()) != mixer.control_count()) {
    shape_error("base", "(" + std::to_string(mixer.control_count()) + ",)", array);
  }
  return array;
}

FloatArray out_argument(const clip::Mixer& mixer, const py::object& out) {
  const auto count = static_cast<py::ssize_t>(mixer.control_count());
  if (out.is_none()) return FloatArray(count);
  const auto given = py::cast<py::array>(out);
  const bool fits = FloatArray::check_(given) && given.writeable() && given.ndim() == 1 &&
                    given.shape(0) == count;
  if (!fits) {
    throw py::value_error("out: a writeable contiguous float32 array of shape (" +
                          std::to_string(count) + ",) was expected");
  }
  return py::cast<FloatArray>(given);
}

FloatArray mix(clip::Mixer& mixer, double time, const py::object& base, const py::object& out) {
  FloatArray result = out_argument(mixer, out);
  FloatArray below;
  if (!base.is_none()) below = base_argument(mixer, base);
  mixer.evaluate(time, base.is_none() ? nullptr : below.data(), result.mutable_data());
  return result;
}

// Mixes the layers at several times.
// In: base  [controls] one base frame for all times, or [times, controls]
FloatArray mix_batch(clip::Mixer& mixer, const DoubleArray& times, const py::object& base) {
  if (times.ndim() != 1) shape_error("times", "(n,)", times);
  const auto count = static_cast<py::ssize_t>(mixer.control_count());
  FloatArray below;
  py::ssize_t stride = 0;
  if (!base.is_none()) {
    below = FloatArray::ensure(base);
    if (!below) throw py::value_error("base: an array of numbers was expected");
    const bool each = below.ndim() == 2 && below.shape(0) == times.size();
    if (below.ndim() < 1 || below.shape(below.ndim() - 1) != count ||
        (below.ndim() != 1 && !each)) {
      shape_error("base", "(controls,) or (times, controls)", below);
    }
    stride = each ? count : 0;
  }
  FloatArray out({times.size(), count});
  for (py::ssize_t n = 0; n < times.size(); ++n) {
    const float* row = base.is_none() ? nullptr : below.data() + n * stride;
    mixer.evaluate(times.data()[n], row, out.mutable_data() + n * count);
  }
  return out;
}

bool fire(clip::Mixer& mixer, std::size_t reaction, double time, float strength) {
  return mixer.fire(reaction, time, strength);
}

}  // namespace

void bind_mixer(py::module_& m) {
  using namespace py::literals;
  py::class_<PyLayerCurves, std::shared_ptr<PyLayerCurves>>(
      m, "LayerCurves", "The curves of a layer, prepared for a list of controls.")
      .def(py::init(&make_curves), "controls"_a, "names"_a, "values"_a, "rate"_a, "start"_a,
           "times"_a = py::none(), "mask"_a = py::none())
      .def_property_readonly("frame_count",
                             [](const PyLayerCurves& c) { return c.curves->frame_count(); })
      .def_property_readonly(
          "range",
          [](const PyLayerCurves& c) {
            return std::make_pair(c.curves->first_time(), c.curves->last_time());
          },
          "Seconds of the first and of the last frame.");
  py::class_<clip::Mixer>(m, "MixerCore", "The native part of risorius.Mixer.")
      .def(py::init(&make_mixer), "controls"_a, "low"_a, "high"_a, "max_fired"_a)
      .def("set_layers", &set_layers, "layers"_a)
      .def("set_reactions", &set_reactions, "reactions"_a)
      .def("set_rules", &set_rules, "yields"_a, "opposites"_a)
      .def("fire", &fire, "reaction"_a, "time"_a, "strength"_a)
      .def("clear_fired", &clip::Mixer::clear_fired)
      .def("evaluate", &mix, "time"_a, "base"_a = py::none(), "out"_a = py::none())
      .def("evaluate_batch", &mix_batch, "times"_a, "base"_a = py::none());
}

}  // namespace risorius::bindings
