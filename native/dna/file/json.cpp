// SPDX-License-Identifier: MIT
#include "dna/file/json.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "core/function_ref.h"
#include "dna/layers.h"
#include "dna/schema.h"
#include "dna/validate.h"

namespace risorius::dna {

namespace {

using core::Array;
using core::ErrorCode;
using core::fail;
using core::FunctionRef;
using core::List;
using core::PlanarArray;
using core::Result;
using detail::describe;
using detail::describe_setup;
using detail::Name;

struct RepeatedMember {
  std::string name;
};

// An object that does not let a later member replace an earlier one: readers would differ in which
// of them they take.
template <class Key, class Value, class Less, class Allocator>
struct UniqueMap : std::map<Key, Value, Less, Allocator> {
  using std::map<Key, Value, Less, Allocator>::map;
  Value& operator[](const Key& key) {
    const auto [at, added] = this->try_emplace(key);
    // NOLINTNEXTLINE(bugprone-std-exception-baseclass): nobody but parse_text may catch it
    if (!added) throw RepeatedMember{key};
    return at->second;
  }
};

// float as the type of numbers: read once, rounded once.
using Json = nlohmann::basic_json<UniqueMap, std::vector, std::string, bool, std::int64_t,
                                  std::uint64_t, float>;

constexpr const char* kAxes3[] = {"xs", "ys", "zs"};
constexpr const char* kAxes2[] = {"us", "vs"};
template <std::size_t kPlanes>
const char* axis(std::size_t p) {
  return kPlanes == 3 ? kAxes3[p] : kAxes2[p];
}

std::string json_name(const Name& name) {
  if (name.json != nullptr) return name.json;
  std::string out;
  bool up = false;
  for (const char* c = name.dna; *c != '\0'; ++c) {
    if (*c == '_') {
      up = true;
      continue;
    }
    out += up && *c >= 'a' && *c <= 'z' ? static_cast<char>(*c - 'a' + 'A') : *c;
    up = false;
  }
  return out;
}

std::string layer_name(const detail::KnownLayer& layer) {
  return std::string(layer.id) + std::to_string(layer.version >> 16) + "." +
         std::to_string(layer.version & 0xFFFF);
}

std::string to_hex(const void* data, std::size_t size) {
  constexpr char kDigits[] = "0123456789abcdef";
  const auto* bytes = static_cast<const unsigned char*>(data);
  std::string out;
  out.reserve(2 * size);
  for (std::size_t i = 0; i < size; ++i) {
    out += kDigits[bytes[i] >> 4];
    out += kDigits[bytes[i] & 15];
  }
  return out;
}

std::optional<std::string> from_hex(std::string_view text) {
  if (text.size() % 2 != 0) return std::nullopt;
  std::string out(text.size() / 2, '\0');
  for (std::size_t i = 0; i < out.size(); ++i) {
    unsigned value = 0;
    const char* begin = text.data() + 2 * i;
    const auto [end, error] = std::from_chars(begin, begin + 2, value, 16);
    if (error != std::errc{} || end != begin + 2) return std::nullopt;
    out[i] = static_cast<char>(value);
  }
  return out;
}

// ---- writing

class Writer {
 public:
  std::string take() { return std::move(out_); }

  void object(FunctionRef<void()> body);
  void member(const std::string& name, FunctionRef<void()> body);
  // Members of an array on lines of their own (structs) or in a row (numbers).
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
  // Signs are stored as u32; other tools of the format print them so.
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

// What every field calls is no template and stands outside of the class: it is compiled once, not
// once more for each of some 150 fields.
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

// ---- reading

// A visitor that takes members out of objects; the first error stays, with the path to it.
class Reader {
 public:
  explicit Reader(const Limits& limits) : limits_(limits) {}
  bool failed() const { return error_.has_value(); }
  core::Unexpected take_error() { return core::Unexpected{*error_}; }

  void error(const std::string& message, ErrorCode code = ErrorCode::kInvalidValue);
  // Runs body with `json` as the object whose members fields are; every member must be used.
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
  // Numbers come by the million: no path is kept for each until one is wrong.
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
  if (where.empty()) offset = 0;  // the text as a whole
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

// Where a text goes deeper than so many levels, before anything is built from it.
std::optional<std::size_t> find_too_deep(std::string_view text, std::size_t limit) {
  std::size_t depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_text) {
      if (c == '\\') ++i;
      if (c == '"') in_text = false;
    } else if (c == '"') {
      in_text = true;
    } else if (c == '[' || c == '{') {
      if (++depth > limit) return i;
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return std::nullopt;
}

// The library's exception for a number beyond every float quotes it, but does not say where it is.
std::optional<std::uint64_t> find_quoted(std::string_view text, std::string_view message) {
  const std::size_t begin = message.find('\''), end = message.rfind('\'');
  if (begin == end) return std::nullopt;
  const std::size_t at = text.find(message.substr(begin + 1, end - begin - 1));
  return at == std::string_view::npos ? std::nullopt : std::optional<std::uint64_t>(at);
}

Result<Json> parse_text(std::string_view text) {
  try {
    // The library takes a zero byte for the end.
    const std::size_t zero = text.find('\0');
    if (zero != std::string_view::npos) {
      return fail(ErrorCode::kNotDna, "", "not JSON: the text has a zero byte", zero);
    }
    return Json::parse(text);
  } catch (const RepeatedMember& member) {
    return fail(ErrorCode::kInvalidValue, member.name.empty() ? "\"\"" : member.name,
                "an object has this member twice");
  } catch (const Json::parse_error& e) {
    return fail(ErrorCode::kNotDna, "", "not JSON: the text cannot be read on from here",
                e.byte == 0 ? 0 : e.byte - 1);
  } catch (const Json::exception& e) {
    const std::string message = e.what();
    return fail(ErrorCode::kInvalidValue, "",
                "a number is beyond every float: " + message.substr(message.rfind(' ') + 1),
                find_quoted(text, message));
  }
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

Result<Dna> from_json(std::string_view text, const Limits& limits) {
  if (text.size() > limits.max_bytes) {
    return fail(ErrorCode::kLimitExceeded, "",
                "the text has " + std::to_string(text.size()) + " bytes, the limit is " +
                    std::to_string(limits.max_bytes),
                0);
  }
  if (const auto at = find_too_deep(text, limits.max_nesting)) {
    return fail(
        ErrorCode::kLimitExceeded, "",
        "the levels of nesting pass the limit of " + std::to_string(limits.max_nesting) + " here",
        at);
  }
  Result<Json> json = parse_text(text);
  if (!json) return std::move(json).propagate();
  Dna dna;
  dna.descriptor.coordinate_system = {0, 0, 0};  // as in a file without this layer
  Reader r(limits);
  r.object(*json, [&] { read_layers(r, dna); });
  if (r.failed()) return r.take_error();
  RISORIUS_TRY(validate(dna, dna.warnings));
  return dna;
}

}  // namespace risorius::dna
