// SPDX-License-Identifier: MIT
// Binds the fields of Dna's structs as Python properties.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bindings/numpy_arrays.h"
#include "dna/dna.h"

namespace risorius::bindings {

using DnaClass = py::class_<dna::Dna, std::shared_ptr<dna::Dna>>;

void bind_dna_extensions(py::module_& m);
void bind_dna_extension_fields(DnaClass& c);
void bind_dna_files(py::module_& m, DnaClass& c);

/// Binds a struct of Dna as a class whose constructor takes the fields by keyword.
template <class T>
py::class_<T, std::shared_ptr<T>> value_class(py::module_& m, const char* name, const char* doc) {
  py::class_<T, std::shared_ptr<T>> c(m, name, doc);
  c.def(py::init([](const py::kwargs& fields) {
    auto value = std::make_shared<T>();
    py::object self = py::cast(value);
    for (const auto& [key, field] : fields) py::setattr(self, key, field);
    return value;
  }));
  c.def("__copy__", [](const T& self) { return std::make_shared<T>(self); });
  c.def("__deepcopy__", [](const T& self, const py::dict&) { return std::make_shared<T>(self); });
  return c;
}

// Each of the following functions adds one property to a class.
// In: name  of the property
//     get   function from an object to a reference to its field

/// A property that is a list of numbers, as a NumPy array; float32[n, 3] or float32[n, 2] if the
/// field is a list of coordinates.
template <class Class, class Get>
void numbers(Class& c, const char* name, Get get) {
  using Owner = typename Class::type;
  using Field = std::remove_cvref_t<decltype(get(std::declval<Owner&>()))>;
  c.def_property(
      name, [get](Owner& self) { return to_numpy(get(self)); },
      [get, name](Owner& self, const py::object& value) {
        if constexpr (requires { Field{}.values; }) {
          constexpr std::size_t planes = std::is_same_v<Field, core::Vec3Array> ? 3 : 2;
          get(self) = planar_from_python<planes>(value, name);
        } else {
          using Number = std::remove_cvref_t<decltype(*get(self).data())>;
          get(self) = from_python<Number>(value, name);
        }
      });
}

/// One text.
template <class Class, class Get>
void text(Class& c, const char* name, Get get) {
  using Owner = typename Class::type;
  c.def_property(
      name, [get](Owner& self) { return to_python(get(self)); },
      [get, name](Owner& self, const py::object& v) { get(self) = text_from_python(v, name); });
}

/// A property that is a list of texts.
template <class Class, class Get>
void texts(Class& c, const char* name, Get get) {
  using Owner = typename Class::type;
  c.def_property(
      name,
      [get](Owner& self) {
        py::list out;
        for (const std::string& t : get(self)) out.append(to_python(t));
        return out;
      },
      [get, name](Owner& self, const py::iterable& values) {
        std::vector<std::string> out;
        for (const py::handle& v : values) out.push_back(text_from_python(v, name));
        get(self) = std::move(out);
      });
}

/// One number.
template <class Class, class Get>
void number(Class& c, const char* name, Get get) {
  using Owner = typename Class::type;
  using Number = std::remove_cvref_t<decltype(get(std::declval<Owner&>()))>;
  c.def_property(
      name, [get](Owner& self) { return get(self); },
      [get](Owner& self, Number value) { get(self) = value; });
}

/// A property that is a struct; its Python object keeps the outer object alive.
template <class Class, class Get>
void part(Class& c, const char* name, Get get) {
  using Owner = typename Class::type;
  using Field = std::remove_cvref_t<decltype(get(std::declval<Owner&>()))>;
  c.def_property(
      name,
      [get](const std::shared_ptr<Owner>& self) {
        return std::shared_ptr<Field>(self, &get(*self));
      },
      [get](Owner& self, const Field& value) { get(self) = value; });
}

/// A property that is a list of structs, shown as a tuple. A change of an element of the tuple
/// changes the struct in the list.
template <class Class, class Get>
void parts(Class& c, const char* name, Get get) {
  using Owner = typename Class::type;
  using Field = std::remove_cvref_t<decltype(get(std::declval<Owner&>())[0])>;
  c.def_property(
      name,
      [get](Owner& self) {
        const auto& list = get(self);
        py::tuple out(list.size());
        for (std::size_t i = 0; i < list.size(); ++i) out[i] = list.element_ptr(i);
        return out;
      },
      [get](Owner& self, const py::iterable& values) {
        std::vector<Field> out;
        for (const py::handle& v : values) out.push_back(v.cast<const Field&>());
        get(self) = core::List<Field>(std::move(out));
      });
}

// The words that Python uses for units, axis directions, rotation sequences and winding orders of a
// DNA file.
inline constexpr std::array<const char*, 2> kTranslationUnits{"cm", "m"};
inline constexpr std::array<const char*, 2> kRotationUnits{"degrees", "radians"};
inline constexpr std::array<const char*, 6> kDirections{"left", "right", "up",
                                                        "down", "front", "back"};
inline constexpr std::array<const char*, 6> kSequences{"xyz", "xzy", "yxz", "yzx", "zxy", "zyx"};
inline constexpr std::array<const char*, 2> kWindings{"ccw", "cw"};

/// The word for a number of an enumeration; for a number that the format does not define, the
/// number after "#", for example "#17".
template <std::size_t kCount>
std::string word(const std::array<const char*, kCount>& words, std::uint32_t value) {
  return value < kCount ? words[value] : "#" + std::to_string(value);
}

/// The number that `word` turns into the text, for example 17 for "#17". Raises ValueError for an
/// unknown word. In: name  of the field, for the error
template <class Number, std::size_t kCount>
Number value_of_word(const std::array<const char*, kCount>& words, const std::string& text,
                     const char* name) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (text == words[i]) return static_cast<Number>(i);
  }
  if (text.size() > 1 && text[0] == '#') return static_cast<Number>(std::stoul(text.substr(1)));
  std::string known;
  for (const char* w : words) known += std::string(known.empty() ? "" : ", ") + w;
  throw py::value_error(std::string(name) + ": one of " + known + " was expected, found " + text);
}

/// A property that is an enumeration, shown as a word.
template <class Class, std::size_t kCount, class Get>
void choice(Class& c, const char* name, const std::array<const char*, kCount>& words, Get get) {
  using Owner = typename Class::type;
  using Number = std::remove_cvref_t<decltype(get(std::declval<Owner&>()))>;
  c.def_property(
      name, [get, words](Owner& self) { return word(words, get(self)); },
      [get, words, name](Owner& self, const std::string& text) {
        get(self) = value_of_word<Number>(words, text, name);
      });
}

/// Converts a Python value to a LodMapping: a LodMapping itself, or a list that contains for each
/// LOD a list of indices.
inline dna::LodMapping lod_mapping_from_python(const py::object& value) {
  if (py::isinstance<dna::LodMapping>(value)) return value.cast<dna::LodMapping>();
  dna::LodMapping mapping;
  std::vector<std::uint16_t> lods;
  for (const py::handle& row : value) {
    lods.push_back(static_cast<std::uint16_t>(mapping.rows.size()));
    mapping.rows.push_back(
        from_python<std::uint16_t>(py::reinterpret_borrow<py::object>(row), "indices"));
  }
  mapping.lods = std::move(lods);
  return mapping;
}

/// A property that is a LodMapping. A list that contains for each LOD a list of indices can be
/// assigned to it as well.
template <class Class, class Get>
void lod_mapping(Class& c, const char* name, Get get) {
  using Owner = typename Class::type;
  c.def_property(
      name,
      [get](const std::shared_ptr<Owner>& self) {
        return std::shared_ptr<dna::LodMapping>(self, &get(*self));
      },
      [get](Owner& self, const py::object& v) { get(self) = lod_mapping_from_python(v); });
}

}  // namespace risorius::bindings
