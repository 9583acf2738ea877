// SPDX-License-Identifier: MIT
// Writes a Dna as JSON text.
#include <bit>
#include <charconv>
#include <cmath>
#include <span>

#include "core/function_ref.h"
#include "dna/file/json.h"
#include "dna/file/json_document.h"
#include "dna/file/json_words.h"
#include "dna/layers.h"
#include "dna/schema.h"
#include "dna/validate.h"

namespace risorius::dna {

namespace {

using core::Array;
using core::FunctionRef;
using core::List;
using core::PlanarArray;
using core::Result;
using detail::axis;
using detail::describe;
using detail::describe_setup;
using detail::Json;
using detail::json_name;
using detail::layer_name;
using detail::Name;
using detail::to_hex;

class Writer {
 public:
  std::string take() { return std::move(out_); }

  void object(FunctionRef<void()> body);
  void member(const std::string& name, FunctionRef<void()> body);
  // Writes an array. In: lines  true: each item is on a separate line, as for structs; false: all
  // items are on one line, as for numbers
  template <class Items, class Each>
  void array(const Items& items, bool lines, Each each) {
    begin_array();
    bool first = true;
    for (const auto& item : items) {
      begin_item(first, lines);
      each(item);
      first = false;
    }
    end_array(lines && !first);
  }

  void group(Name name, FunctionRef<void()> body);
  template <class T>
  void field(Name name, const T& v) {
    named(name, [&] { value(v); });
  }
  template <class T>
  void sized(Name name, const List<T>& v, const LodMapping*) {
    field(name, v);
  }
  void setups(Name name, const List<TwistSwingSetup>& v, bool twist) {
    named(name, [&] {
      array(v, true, [&](const TwistSwingSetup& setup) {
        object([&] { describe_setup(*this, setup, twist); });
      });
    });
  }
  void matrix(Name name, const JointGroup& g) { field(name, g.values); }
  void faces(const Mesh& m) {
    member("faces", [&] {
      rows(m.face_offsets, [&](std::size_t begin, std::size_t n) {
        out_ += "{\"layoutIndices\": ";
        value(m.face_layouts.span().subspan(begin, n));
        out_ += '}';
      });
    });
  }
  void skin(const Mesh& m) {
    member("skinWeights", [&] {
      rows(m.skin_offsets, [&](std::size_t begin, std::size_t n) {
        out_ += "{\"weights\": ";
        value(m.skin_weights.span().subspan(begin, n));
        out_ += ", \"jointIndices\": ";
        value(m.skin_joint_indices.span().subspan(begin, n));
        out_ += '}';
      });
    });
  }
  void targets(const Mesh& m) { field("blend_shape_targets", m.blend_shape_targets); }

  template <class T>
    requires std::is_integral_v<T>
  void value(T v) {
    char text[24];
    out_.append(text, std::to_chars(text, text + sizeof(text), v).ptr);
  }
  // Rotation signs: the file stores them as uint32, and other tools of the format print them as
  // uint32, so that -1 is 4294967295.
  void value(std::int32_t v) { value(static_cast<std::uint32_t>(v)); }
  void value(float v);
  void value(const std::string& v);
  void value(const std::pair<std::string, std::string>& v);
  template <class T>
  void value(std::span<const T> v) {
    array(v, false, [this](T number) { value(number); });
  }
  template <class T>
  void value(const Array<T>& v) {
    value(v.span());
  }
  template <std::size_t kPlanes>
  void value(const PlanarArray<kPlanes>& v) {
    object([&] {
      for (std::size_t p = 0; p < kPlanes; ++p) {
        member(axis<kPlanes>(p), [&] { value(v.plane(p)); });
      }
    });
  }
  template <class T>
  void value(const std::vector<T>& v) {
    array(v, true, [this](const T& item) { value(item); });
  }
  template <class T>
  void value(const List<T>& v) {
    array(v, true, [this](const T& item) { value(item); });
  }
  template <class T>
    requires std::is_class_v<T>
  void value(const T& v) {
    object([&] { describe(*this, v); });
  }

 private:
  template <class Row>
  void rows(const Array<std::uint32_t>& offsets, Row row) {
    std::vector<std::size_t> numbers(offsets.empty() ? 0 : offsets.size() - 1);
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
    array(numbers, true, [&](std::size_t i) { row(offsets[i], offsets[i + 1] - offsets[i]); });
  }
  void named(Name name, FunctionRef<void()> body);
  void begin_array();
  void begin_item(bool first, bool on_a_line);
  void end_array(bool on_a_line);
  void line() {
    out_ += '\n';
    out_.append(depth_, ' ');
  }

  std::string out_;
  std::size_t depth_ = 0;
  bool first_ = true;
};

// The following functions are called for every field. They take a FunctionRef and are not
// templates, so that they are compiled once and not for each of about 150 fields.
void Writer::object(FunctionRef<void()> body) {
  out_ += '{';
  ++depth_;
  first_ = true;
  body();
  --depth_;
  if (!first_) line();
  out_ += '}';
  first_ = false;
}

void Writer::member(const std::string& name, FunctionRef<void()> body) {
  if (!first_) out_ += ',';
  line();
  out_ += '"' + name + "\": ";
  body();
  first_ = false;
}

void Writer::named(Name name, FunctionRef<void()> body) { member(json_name(name), body); }

void Writer::group(Name name, FunctionRef<void()> body) {
  named(name, [&] { object(body); });
}

void Writer::begin_array() {
  out_ += '[';
  ++depth_;
}

void Writer::begin_item(bool first, bool on_a_line) {
  if (!first) out_ += on_a_line ? "," : ", ";
  if (on_a_line) line();
}

void Writer::end_array(bool on_a_line) {
  --depth_;
  if (on_a_line) line();
  out_ += ']';
}

void Writer::value(float v) {
  if (std::isnan(v)) {
    char bits[16];
    const auto* end =
        std::to_chars(bits, bits + sizeof(bits), std::bit_cast<std::uint32_t>(v), 16).ptr;
    out_ += "\"NaN:" + std::string(static_cast<const char*>(bits), end) + '"';
  } else if (std::isinf(v)) {
    out_ += v > 0 ? "\"Infinity\"" : "\"-Infinity\"";
  } else if (v == 0.0f && std::signbit(v)) {
    out_ += "-0.0";
  } else {
    char text[32];
    out_.append(text, std::to_chars(text, text + sizeof(text), v).ptr);
  }
}

void Writer::value(const std::string& v) {
  try {
    out_ += Json(v).dump();
  } catch (const Json::exception&) {  // not UTF-8
    out_ += "{\"hex\": \"" + to_hex(v.data(), v.size()) + "\"}";
  }
}

void Writer::value(const std::pair<std::string, std::string>& v) {
  out_ += '[';
  value(v.first);
  out_ += ", ";
  value(v.second);
  out_ += ']';
}

void write_index(Writer& w, const Dna& dna) {
  std::size_t next_unknown = 0;
  struct Entry {
    std::string id;
    std::uint32_t version;
    const UnknownLayer* unknown;
  };
  std::vector<Entry> entries;
  const auto add_unknown = [&] {
    const UnknownLayer& u = dna.unknown_layers[next_unknown++];
    entries.push_back({{u.id.begin(), u.id.end()}, u.version, &u});
  };
  for (const std::string& id : dna.index_order) {
    if (id.empty() && next_unknown < dna.unknown_layers.size()) add_unknown();
    for (const detail::KnownLayer& layer : detail::kLayers) {
      if (id == layer.id) entries.push_back({id, layer.version, nullptr});
    }
  }
  while (next_unknown < dna.unknown_layers.size()) add_unknown();
  w.array(entries, true, [&](const Entry& e) {
    w.object([&] {
      w.field("id", e.id);
      w.field("version", e.version);
      if (e.unknown != nullptr) {
        w.field("bytes", to_hex(e.unknown->bytes.data(), e.unknown->bytes.size()));
      }
    });
  });
}

}  // namespace

Result<std::string> to_json(const Dna& dna) {
  std::vector<Warning> oddities;
  RISORIUS_TRY(validate(dna, oddities));
  Writer w;
  w.object([&] {
    w.member("version", [&] {
      w.object([&] {
        w.field("generation", dna.generation);
        w.field("version", dna.version);
      });
    });
    w.member("index",
             [&] { w.object([&] { w.member("entries", [&] { write_index(w, dna); }); }); });
    detail::for_each_layer(dna, [&](std::string_view id, const char*, const auto& layer) {
      for (const detail::KnownLayer& known : detail::kLayers) {
        if (id != known.id) continue;
        w.member(layer_name(known), [&] {
          w.object([&] {
            describe(w, layer);
            if (id == "dsce") w.field("face_winding_order", dna.descriptor_ext.face_winding_order);
          });
        });
      }
    });
  });
  return w.take() + "\n";
}

}  // namespace risorius::dna
