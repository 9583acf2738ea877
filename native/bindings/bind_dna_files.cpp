// SPDX-License-Identifier: MIT
// Reads and writes a Dna as bytes, file and JSON, and operations on a whole Dna.
#include <charconv>

#include "bindings/fields.h"
#include "bytes/file_write.h"
#include "bytes/path_text.h"
#include "bytes/source.h"
#include "dna/convert/coordinates.h"
#include "dna/file/json.h"
#include "dna/file/parse.h"
#include "dna/file/write.h"
#include "dna/size.h"
#include "dna/validate.h"

namespace risorius::bindings {

namespace {

using dna::Dna;
using Bytes = std::vector<std::uint8_t>;

// Runs native work without the interpreter lock.
template <class F>
auto unlocked(F f) {
  const py::gil_scoped_release released;
  return f();
}

py::bytes to_bytes(const Bytes& bytes) {
  return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

bytes::SpanSource source_of(const py::bytes& bytes) {
  const std::string_view view = bytes;
  return bytes::SpanSource({reinterpret_cast<const std::uint8_t*>(view.data()), view.size()});
}

std::uint16_t minor_version(const std::string& version) {
  if (version.size() == 3 && version.rfind("2.", 0) == 0 && version[2] >= '1' &&
      version[2] <= '8') {
    return static_cast<std::uint16_t>(version[2] - '0');
  }
  throw py::value_error("version: one of 2.1 to 2.8 was expected, found " + version);
}

bool preserves(const std::string& policy) {
  if (policy == "preserve" || policy == "ignore") return policy == "preserve";
  throw py::value_error("unknown_layers: preserve or ignore was expected, found " + policy);
}

void emit(const std::vector<dna::Warning>& warnings) {
  for (const dna::Warning& w : warnings) {
    const py::str text = to_python(w.where + ": " + w.message);
    if (PyErr_WarnFormat(PyExc_UserWarning, 2, "%U", text.ptr()) != 0) {
      throw py::error_already_set();
    }
  }
}

Bytes serialise(const Dna& self, const std::string& version, const std::string& unknown_layers) {
  const dna::WriteOptions options{minor_version(version), preserves(unknown_layers)};
  std::vector<dna::Warning> warnings;
  Bytes out = unwrap(unlocked([&] { return dna::write(self, options, warnings); }));
  emit(warnings);
  return out;
}

py::list describe(const std::vector<dna::Warning>& warnings) {
  py::list out;
  for (const dna::Warning& w : warnings) out.append(to_python(w.where + ": " + w.message));
  return out;
}

dna::LodSelection lod_selection(const py::object& lods) {
  dna::LodSelection selection;
  if (lods.is_none()) return selection;
  const bool is_range = py::isinstance<py::tuple>(lods);
  try {
    if (is_range) {
      const auto [max_lod, min_lod] = lods.cast<std::pair<std::uint16_t, std::uint16_t>>();
      selection.max_lod = max_lod;
      selection.min_lod = min_lod;
    } else {
      selection.lods = lods.cast<std::vector<std::uint16_t>>();
    }
  } catch (const py::cast_error&) {
    throw py::value_error("lods: (max_lod, min_lod) or [lod, ...] was expected, found " +
                          py::repr(lods).cast<std::string>());
  }
  if (is_range ? selection.max_lod > selection.min_lod : selection.lods.empty()) {
    throw py::value_error("lods: " + py::repr(lods).cast<std::string>() + " has no LOD");
  }
  return selection;
}

void bind_writing(DnaClass& c) {
  c.def(
      "to_bytes",
      [](const Dna& s, const std::string& version, const std::string& unknown_layers) {
        return to_bytes(serialise(s, version, unknown_layers));
      },
      py::arg("version") = "2.8", py::arg("unknown_layers") = "preserve",
      "The bytes of a file of this version. A UserWarning for each layer that the version does not "
      "know: newer and unknown layers are written anyway (2.1 has no place for them), or left out "
      "with unknown_layers='ignore'.");
  c.def(
      "save",
      [](const Dna& s, const std::filesystem::path& path, const std::string& version,
         const std::string& unknown_layers) {
        const Bytes bytes = serialise(s, version, unknown_layers);
        unwrap(unlocked([&] { return bytes::write_file_atomically(path, bytes); }));
      },
      py::arg("path"), py::arg("version") = "2.8", py::arg("unknown_layers") = "preserve",
      "Writes the file. The old file stays whole until the new one is.");
  c.def(
      "to_json",
      [](const Dna& s) { return py::str(unwrap(unlocked([&] { return dna::to_json(s); }))); },
      "The whole value as JSON with the format's own field names. Lossless: numbers are the "
      "shortest decimals that give the same bits.");
  c.def_static(
      "from_json",
      [](const py::str& text, const dna::Limits& limits) {
        const std::string utf8 = text_from_python(text, "text");
        return std::make_shared<Dna>(
            unwrap(unlocked([&] { return dna::from_json(utf8, limits); })));
      },
      py::arg("text"), py::arg("limits") = dna::Limits{}, "Reads the output of to_json.");
}

// Converts a text like "1.0" to a number: major version in the upper 16 bits, minor in the lower.
std::uint32_t layer_version(const std::string& text) {
  std::uint16_t major = 0, minor = 0;
  const char *begin = text.data(), *end = begin + text.size();
  const auto first = std::from_chars(begin, end, major);
  if (first.ec == std::errc{} && first.ptr != end && *first.ptr == '.') {
    const auto second = std::from_chars(first.ptr + 1, end, minor);
    if (second.ec == std::errc{} && second.ptr == end) {
      return std::uint32_t{major} << 16 | minor;
    }
  }
  throw py::value_error("unknown_layers: a version from 0.0 to 65535.65535 was expected, found '" +
                        text + "'");
}

void bind_layers(DnaClass& c) {
  c.def_property(
      "unknown_layers",
      [](const Dna& s) {
        py::list out;
        for (const dna::UnknownLayer& l : s.unknown_layers) {
          out.append(py::make_tuple(
              to_python(std::string(l.id.begin(), l.id.end())),
              std::to_string(l.version >> 16) + "." + std::to_string(l.version & 0xFFFF),
              to_bytes(l.bytes)));
        }
        return out;
      },
      [](Dna& s, const std::vector<std::tuple<std::string, std::string, std::string>>& layers) {
        std::vector<dna::UnknownLayer> out;
        for (const auto& [id, version, bytes] : layers) {
          dna::UnknownLayer layer;
          if (id.size() != 4) {
            throw py::value_error("unknown_layers: an id of 4 letters was expected, found " +
                                  std::to_string(id.size()));
          }
          std::copy(id.begin(), id.end(), layer.id.begin());
          layer.version = layer_version(version);
          layer.bytes.assign(bytes.begin(), bytes.end());
          out.push_back(std::move(layer));
        }
        s.unknown_layers = std::move(out);
      },
      "Layers that this version does not know: (id, version, bytes).");
  c.def_property_readonly(
      "layers",
      [](const Dna& s) {
        py::list out;
        std::size_t unknown = 0;
        for (const std::string& id : s.index_order) {
          if (!id.empty()) {
            out.append(to_python(id));
          } else if (unknown < s.unknown_layers.size()) {
            const auto& raw = s.unknown_layers[unknown++].id;
            out.append(to_python(std::string(raw.begin(), raw.end())));
          }
        }
        return out;
      },
      "Ids of the file's layers in its order.");
}

// The number that the DNA format gives to a word such as "cm"; nullopt without a text. Raises
// ValueError for other words, also for words such as "#17", by which properties show a number that
// the format does not define.
template <class Number, std::size_t kCount>
std::optional<Number> choice_argument(const std::array<const char*, kCount>& words,
                                      const std::optional<std::string>& text, const char* name) {
  if (!text) return std::nullopt;
  return value_of_word<Number>(words, text->starts_with('#') ? "'" + *text + "'" : *text, name);
}

template <class T>
void require_three(const std::vector<T>& values, const char* name) {
  if (values.size() == 3) return;
  throw py::value_error(std::string(name) + ": x, y and z were expected, found " +
                        std::to_string(values.size()) + " values");
}

using Words = std::optional<std::vector<std::string>>;
using Word = std::optional<std::string>;
using Signs = std::optional<std::vector<std::int32_t>>;

std::shared_ptr<Dna> convert(const Dna& self, const Words& axes, const Word& rotation_sequence,
                             const Signs& rotation_signs, const Word& face_winding_order,
                             const Word& translation_unit, const Word& rotation_unit) {
  dna::CoordinateTarget t;
  if (axes) {
    require_three(*axes, "axes");
    const auto axis = [&](std::size_t i) {
      return *choice_argument<std::uint16_t>(kDirections, (*axes)[i], "axes");
    };
    t.axes = dna::CoordinateSystem{axis(0), axis(1), axis(2)};
  }
  if (rotation_signs) {
    require_three(*rotation_signs, "rotation_signs");
    t.rotation_signs = {(*rotation_signs)[0], (*rotation_signs)[1], (*rotation_signs)[2]};
  }
  t.rotation_sequence =
      choice_argument<std::uint32_t>(kSequences, rotation_sequence, "rotation_sequence");
  t.face_winding_order =
      choice_argument<std::uint8_t>(kWindings, face_winding_order, "face_winding_order");
  t.translation_unit =
      choice_argument<std::uint16_t>(kTranslationUnits, translation_unit, "translation_unit");
  t.rotation_unit = choice_argument<std::uint16_t>(kRotationUnits, rotation_unit, "rotation_unit");
  std::vector<dna::Warning> warnings;
  auto out = std::make_shared<Dna>(
      unwrap(unlocked([&] { return dna::convert_coordinates(self, t, warnings); })));
  emit(warnings);
  return out;
}

void bind_changes(DnaClass& c) {
  c.def_property_readonly("warnings", [](const Dna& s) { return describe(s.warnings); });
  c.def(
      "validate",
      [](const Dna& s) {
        std::vector<dna::Warning> warnings;
        unwrap(unlocked([&] { return dna::validate(s, warnings); }));
        return describe(warnings);
      },
      "The oddities that do not prevent using the face. Raises DnaError for an error.");
  c.def(
      "size_in_bytes", [](const Dna& s) { return dna::size_in_bytes(s); },
      "Bytes of its numbers and texts in a file; limits of work on the face are set in proportion "
      "to it.");
  c.def(
      "filter_lods",
      [](const Dna& s, const py::object& lods) {
        const dna::LodSelection selection = lod_selection(lods);
        return std::make_shared<Dna>(
            unwrap(unlocked([&] { return dna::filter_lods(s, selection); })));
      },
      py::arg("lods"),
      "A copy with the LODs (max_lod, min_lod) or [lod, ...] only; all indices are renumbered.");
  c.def("convert", &convert, py::kw_only(), py::arg("axes") = py::none(),
        py::arg("rotation_sequence") = py::none(), py::arg("rotation_signs") = py::none(),
        py::arg("face_winding_order") = py::none(), py::arg("translation_unit") = py::none(),
        py::arg("rotation_unit") = py::none(),
        "A copy in another coordinate system or other units, e.g. axes=('right', 'front', 'up'), "
        "rotation_sequence='xyz', rotation_signs=(1, 1, 1), face_winding_order='ccw', "
        "translation_unit='m', rotation_unit='radians'. Omitted properties stay. Raw controls that "
        "carry a rotation refer to the new axes afterwards. A UserWarning for each field that the "
        "format cannot express in the new system. Raises ValueError for invalid arguments, "
        "DnaError if the file's own system is invalid.");
  c.def("__reduce__", [](const py::object& self) {
    return py::make_tuple(py::module_::import("risorius").attr("load"),
                          py::make_tuple(self.attr("to_bytes")()));
  });
}

std::shared_ptr<Dna> parse(bytes::Source& source, const dna::ParseOptions& options,
                           const std::string& file) {
  return std::make_shared<Dna>(unwrap(unlocked([&] { return dna::parse(source, options); }), file));
}

// The findings of a check, as tuples (is_error, code, where, offset or None, message).
py::list findings(bytes::Source& source, const dna::Limits& limits) {
  py::list out;
  for (const dna::Finding& f : unlocked([&] { return dna::check(source, limits); })) {
    const core::Error& e = f.error;
    out.append(py::make_tuple(f.is_error, core::to_string(e.code), to_python(e.where), e.offset,
                              to_python(e.message)));
  }
  return out;
}

void bind_options(py::module_& m) {
  py::class_<dna::Limits>(m, "Limits",
                          "Upper limits for a file: bytes of the file, layers in its index, "
                          "elements of one list, levels of JSON.")
      .def(py::init(
               [](std::uint64_t bytes, std::uint32_t layers, std::uint32_t count,
                  std::uint32_t nesting) { return dna::Limits{bytes, layers, count, nesting}; }),
           py::kw_only(), py::arg("max_bytes") = dna::Limits{}.max_bytes,
           py::arg("max_layers") = dna::Limits{}.max_layers,
           py::arg("max_count") = dna::Limits{}.max_count,
           py::arg("max_nesting") = dna::Limits{}.max_nesting)
      .def_readwrite("max_bytes", &dna::Limits::max_bytes)
      .def_readwrite("max_layers", &dna::Limits::max_layers)
      .def_readwrite("max_count", &dna::Limits::max_count)
      .def_readwrite("max_nesting", &dna::Limits::max_nesting);
  using Options = dna::ParseOptions;
  py::class_<Options>(m, "ParseOptions")
      .def(py::init<>())
      .def_readwrite("definition", &Options::definition)
      .def_readwrite("behavior", &Options::behavior)
      .def_readwrite("geometry", &Options::geometry)
      .def_readwrite("blend_shapes", &Options::blend_shapes)
      .def_readwrite("machine_learned_behavior", &Options::machine_learned_behavior)
      .def_readwrite("rbf_behavior", &Options::rbf_behavior)
      .def_readwrite("joint_behavior_metadata", &Options::joint_behavior_metadata)
      .def_readwrite("twist_swing_behavior", &Options::twist_swing_behavior)
      .def_readwrite("unknown_layers", &Options::unknown_layers)
      .def_readwrite("unreferenced_blend_shapes", &Options::unreferenced_blend_shapes)
      .def_readwrite("limits", &Options::limits)
      .def("set_lods",
           [](Options& self, const py::object& lods) { self.lods = lod_selection(lods); });
}

}  // namespace

void bind_dna_files(py::module_& m, DnaClass& c) {
  bind_options(m);
  bind_writing(c);
  bind_layers(c);
  bind_changes(c);
  m.def("parse_bytes", [](const py::bytes& bytes, const dna::ParseOptions& options) {
    bytes::SpanSource source = source_of(bytes);
    return parse(source, options, "");
  });
  m.def("parse_file", [](const std::filesystem::path& path, const dna::ParseOptions& options) {
    std::unique_ptr<bytes::Source> source = unwrap(bytes::open_file(path));
    return parse(*source, options, bytes::utf8(path));
  });
  m.def("check_bytes", [](const py::bytes& bytes, const dna::Limits& limits) {
    bytes::SpanSource source = source_of(bytes);
    return findings(source, limits);
  });
  m.def("check_file", [](const std::filesystem::path& path, const dna::Limits& limits) {
    std::unique_ptr<bytes::Source> source = unwrap(bytes::open_file(path));
    return findings(*source, limits);
  });
}

}  // namespace risorius::bindings
