// SPDX-License-Identifier: MIT
// Reads a Dna from the JSON text that to_json writes.
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

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
using core::ErrorCode;
using core::FunctionRef;
using core::List;
using core::PlanarArray;
using core::Result;
using detail::axis;
using detail::describe;
using detail::describe_setup;
using detail::from_hex;
using detail::Json;
using detail::json_name;
using detail::layer_name;
using detail::Name;

// A visitor of schema.h that reads the members of JSON objects. It keeps the first error, with the
// path of its member.
class Reader {
 public:
  explicit Reader(const Limits& limits) : limits_(limits) {}
  bool failed() const { return error_.has_value(); }
  core::Unexpected take_error() { return core::Unexpected{*error_}; }

  void error(const std::string& message, ErrorCode code = ErrorCode::kInvalidValue);
  // Runs `body`, which reads the members of object `json`. A member that body does not read is an
  // error, except "signature", "size" and "offset".
  void object(const Json& json, FunctionRef<void()> body);
  void member(const std::string& name, FunctionRef<void(const Json&)> body);
  bool has(const std::string& name) const { return object_->contains(name); }

  void group(Name name, FunctionRef<void()> body);
  template <class T>
  void field(Name name, T& v) {
    named(name, [&](const Json& json) { read(json, v); });
  }
  template <class T>
  void sized(Name name, List<T>& v, const LodMapping*) {
    field(name, v);
  }
  void setups(Name name, List<TwistSwingSetup>& v, bool twist) {
    named(name, [&](const Json& json) {
      std::vector<TwistSwingSetup> setups;
      elements(json, [&](const Json& item) {
        object(item, [&] { describe_setup(*this, setups.emplace_back(), twist); });
      });
      v = std::move(setups);
    });
  }
  void matrix(Name name, JointGroup& g) { field(name, g.values); }
  void faces(Mesh& m) {
    std::vector<std::uint32_t> offsets, layouts;
    member("faces", [&](const Json& json) {
      elements(json, [&](const Json& item) {
        object(item,
               [&] { member("layoutIndices", [&](const Json& list) { append(list, layouts); }); });
        offsets.push_back(static_cast<std::uint32_t>(layouts.size()));
      });
    });
    if (!offsets.empty()) offsets.insert(offsets.begin(), 0);
    m.face_offsets = std::move(offsets);
    m.face_layouts = std::move(layouts);
  }
  void skin(Mesh& m) {
    std::vector<std::uint32_t> offsets;
    std::vector<float> weights;
    std::vector<std::uint16_t> joints;
    member("skinWeights", [&](const Json& json) {
      elements(json, [&](const Json& item) {
        object(item, [&] {
          member("weights", [&](const Json& list) { append(list, weights); });
          member("jointIndices", [&](const Json& list) { append(list, joints); });
        });
        if (weights.size() != joints.size()) error("weights and joint indices of other numbers");
        offsets.push_back(static_cast<std::uint32_t>(weights.size()));
      });
    });
    if (!offsets.empty()) offsets.insert(offsets.begin(), 0);
    m.skin_offsets = std::move(offsets);
    m.skin_weights = std::move(weights);
    m.skin_joint_indices = std::move(joints);
  }
  void targets(Mesh& m) { field("blend_shape_targets", m.blend_shape_targets); }

  template <class T>
    requires std::is_integral_v<T>
  void read(const Json& json, T& v) {
    if (!json.is_number_unsigned() || json.get<std::uint64_t>() > std::numeric_limits<T>::max()) {
      return error("a whole number from 0 to " + std::to_string(std::numeric_limits<T>::max()) +
                   " was expected");
    }
    v = static_cast<T>(json.get<std::uint64_t>());
  }
  void read(const Json& json, std::int32_t& v);
  void read(const Json& json, float& v);
  void read(const Json& json, std::string& v);
  void read(const Json& json, std::pair<std::string, std::string>& v);
  template <class T>
  void read(const Json& json, Array<T>& v) {
    std::vector<T> numbers;
    append(json, numbers);
    v = std::move(numbers);
  }
  template <std::size_t kPlanes>
  void read(const Json& json, PlanarArray<kPlanes>& v) {
    std::vector<float> numbers;
    object(json, [&] {
      std::size_t count = 0;
      for (std::size_t p = 0; p < kPlanes; ++p) {
        member(axis<kPlanes>(p), [&](const Json& list) { append(list, numbers); });
        if (p == 0) count = numbers.size();
        if (numbers.size() != (p + 1) * count) error("the lists have other lengths");
      }
    });
    v.values = std::move(numbers);
  }
  template <class T>
  void read(const Json& json, std::vector<T>& v) {
    std::vector<T> items;
    elements(json, [&](const Json& item) { read(item, items.emplace_back()); });
    v = std::move(items);
  }
  template <class T>
  void read(const Json& json, List<T>& v) {
    std::vector<T> items;
    read(json, items);
    v = std::move(items);
  }
  template <class T>
    requires std::is_class_v<T>
  void read(const Json& json, T& v) {
    object(json, [&] { describe(*this, v); });
  }

  void elements(const Json& json, FunctionRef<void(const Json&)> each);

 private:
  void named(Name name, FunctionRef<void(const Json&)> body);
  bool is_list(const Json& json);
  // Appends the numbers of a JSON list. There may be millions, so that the path of a number is only
  // built for an error.
  template <class T>
  void append(const Json& json, std::vector<T>& out) {
    if (!is_list(json)) return;
    out.reserve(out.size() + json.size());
    std::size_t i = 0;
    for (const Json& item : json) {
      const bool before = failed();
      read(item, out.emplace_back());
      if (failed() && !before) error_->where += "[" + std::to_string(i) + "]";
      if (failed()) return;
      ++i;
    }
  }

  const Limits& limits_;
  const Json* object_ = nullptr;
  std::set<std::string> used_;
  std::vector<std::string> path_;
  std::optional<core::Error> error_;
};

void Reader::error(const std::string& message, ErrorCode code) {
  if (error_) return;
  std::string where;
  for (const std::string& part : path_) {
    if (!where.empty() && part[0] != '[') where += '.';
    where += part;
  }
  std::optional<std::uint64_t> offset;
  if (where.empty()) offset = 0;  // the whole text
  error_ = core::Error{code, offset, where, message};
}

void Reader::object(const Json& json, FunctionRef<void()> body) {
  if (!json.is_object()) return error("an object was expected");
  const Json* outer = std::exchange(object_, &json);
  std::set<std::string> outer_used = std::exchange(used_, {"signature", "size", "offset"});
  body();
  for (const auto& member : json.items()) {
    if (used_.contains(member.key())) continue;
    path_.push_back(member.key());
    error("this member is not known");
    path_.pop_back();
  }
  object_ = outer;
  used_ = std::move(outer_used);
}

void Reader::member(const std::string& name, FunctionRef<void(const Json&)> body) {
  if (failed()) return;
  path_.push_back(name);
  const auto at = object_->find(name);
  if (at == object_->end()) {
    error("this member is missing");
  } else {
    used_.insert(name);
    body(*at);
  }
  path_.pop_back();
}

void Reader::named(Name name, FunctionRef<void(const Json&)> body) {
  member(json_name(name), body);
}

void Reader::group(Name name, FunctionRef<void()> body) {
  named(name, [&](const Json& json) { object(json, body); });
}

void Reader::elements(const Json& json, FunctionRef<void(const Json&)> each) {
  if (!is_list(json)) return;
  std::size_t i = 0;
  for (const Json& item : json) {
    if (failed()) return;
    path_.push_back("[" + std::to_string(i++) + "]");
    each(item);
    path_.pop_back();
  }
}

bool Reader::is_list(const Json& json) {
  if (!json.is_array()) {
    error("an array was expected");
  } else if (json.size() > limits_.max_count) {
    error(std::to_string(json.size()) + " elements, the limit is " +
              std::to_string(limits_.max_count),
          ErrorCode::kLimitExceeded);
  }
  return !failed();
}

void Reader::read(const Json& json, std::int32_t& v) {
  std::uint32_t bits = 0;
  if (json.is_number_integer() && !json.is_number_unsigned()) {
    if (json.get<std::int64_t>() < INT32_MIN) return error("the number is too small");
    v = static_cast<std::int32_t>(json.get<std::int64_t>());
    return;
  }
  read(json, bits);
  v = static_cast<std::int32_t>(bits);
}

void Reader::read(const Json& json, float& v) {
  if (json.is_number()) {
    v = json.get<float>();
    return;
  }
  const std::string text = json.is_string() ? json.get<std::string>() : "";
  if (text == "Infinity" || text == "-Infinity") {
    v = text[0] == '-' ? -HUGE_VALF : HUGE_VALF;
    return;
  }
  std::uint32_t bits = 0;
  const char* begin = text.data() + 4;
  const char* end = text.data() + text.size();
  if (!text.starts_with("NaN:") || std::from_chars(begin, end, bits, 16).ptr != end ||
      !std::isnan(std::bit_cast<float>(bits))) {
    return error("a number was expected");
  }
  v = std::bit_cast<float>(bits);
}

void Reader::read(const Json& json, std::string& v) {
  if (json.is_string()) {
    v = json.get<std::string>();
  } else if (json.is_object() && json.size() == 1 && json.contains("hex")) {
    const Json& hex = json["hex"];
    const auto bytes = hex.is_string() ? from_hex(hex.get_ref<const std::string&>()) : std::nullopt;
    if (!bytes) return error("pairs of hex digits were expected");
    v = *bytes;
  } else {
    error("a text was expected");
  }
}

void Reader::read(const Json& json, std::pair<std::string, std::string>& v) {
  if (!json.is_array() || json.size() != 2) return error("a pair of texts was expected");
  read(json[0], v.first);
  read(json[1], v.second);
}

void read_index_entry(Reader& r, Dna& dna) {
  std::string id;
  std::uint32_t version = 0;
  r.field("id", id);
  r.field("version", version);
  if (r.failed()) return;
  if (id.size() != 4) return r.error("an id of 4 letters was expected");
  detail::LayerId letters{};
  std::copy(id.begin(), id.end(), letters.begin());
  if (!r.has("bytes")) {
    if (detail::find_layer(letters, version) == nullptr) {
      return r.error("a layer that is not known needs its bytes");
    }
    dna.index_order.push_back(id);
    return;
  }
  std::string hex;
  r.field("bytes", hex);
  const auto bytes = from_hex(hex);
  if (!bytes) return r.error("bytes: pairs of hex digits were expected");
  dna.unknown_layers.push_back({letters, version, {bytes->begin(), bytes->end()}});
  dna.index_order.emplace_back();
}

void read_layers(Reader& r, Dna& dna) {
  r.member("version", [&](const Json& json) {
    r.object(json, [&] {
      r.member("generation", [&](const Json& number) {
        r.read(number, dna.generation);
        if (dna.generation == 2) return;
        r.error("generation 2 was expected, found " + std::to_string(dna.generation),
                ErrorCode::kUnsupportedGeneration);
      });
      r.field("version", dna.version);
    });
  });
  if (r.has("index")) {
    r.member("index", [&](const Json& json) {
      r.object(json, [&] {
        r.member("entries", [&](const Json& entries) {
          r.elements(entries,
                     [&](const Json& e) { r.object(e, [&] { read_index_entry(r, dna); }); });
        });
      });
    });
  }
  detail::for_each_layer(dna, [&](std::string_view id, const char*, auto& layer) {
    for (const detail::KnownLayer& known : detail::kLayers) {
      if (id != known.id || !r.has(layer_name(known))) continue;
      r.member(layer_name(known), [&](const Json& json) {
        r.object(json, [&] {
          describe(r, layer);
          if (id == "dsce" && r.has("faceWindingOrder")) {
            r.field("face_winding_order", dna.descriptor_ext.face_winding_order);
          }
        });
      });
    }
  });
}

}  // namespace

Result<Dna> from_json(std::string_view text, const Limits& limits) {
  Result<Json> json = detail::parse_document(text, limits);
  if (!json) return std::move(json).propagate();
  Dna dna;
  dna.descriptor.coordinate_system = {0, 0, 0};  // the values of a text without the layer desc
  Reader r(limits);
  r.object(*json, [&] { read_layers(r, dna); });
  if (r.failed()) return r.take_error();
  RISORIUS_TRY(validate(dna, dna.warnings));
  return dna;
}

}  // namespace risorius::dna
