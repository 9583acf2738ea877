// SPDX-License-Identifier: MIT
// Reads layers from bytes: a visitor of schema.h. Private to native/dna.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bytes/byte_reader.h"
#include "dna/convert/lods.h"
#include "dna/file/empty_size.h"
#include "dna/file/parse.h"
#include "dna/schema.h"

namespace risorius::dna::detail {

/// The position of a field in the file, for error messages about its values.
struct Place {
  std::uint64_t offset = 0;        // of the field, including its count
  std::uint32_t element_size = 0;  // 0: not a list of numbers
  std::uint32_t plane = 0;         // numbers in each plane of a vector list; 0: no planes
};

/// Records the positions of the given fields, which error messages name, and of the structs and
/// lists that contain them. Recording all fields of a large file would take many times the file's
/// size.
class Places {
 public:
  explicit Places(std::set<std::string> fields) : fields_(std::move(fields)) {}
  void note(const std::string& where, const Place& place) {
    const auto at = fields_.lower_bound(where);
    if (at != fields_.end() && at->starts_with(where)) places_.insert({where, place});
  }
  /// The byte offset in the file of the value that `where` names, such as
  /// "geometry.meshes[3].positions[7]"; if the value has no recorded place, the offset of the
  /// smallest recorded struct or list around it; nullopt if there is none.
  std::optional<std::uint64_t> find(std::string where) const;

 private:
  std::set<std::string> fields_;
  std::map<std::string, Place> places_;
};

class LayerReader {
 public:
  bool blend_shapes = true;
  bool mesh_sizes = true;  // 2.2+: a mesh is preceded by its size; 2.1: by the offset of its end
  const LodPlan* plan = nullptr;
  const MachineLearnedBehaviorExt* operations = nullptr;  // read before the networks that they name
  Places* places = nullptr;
  Known known{true, true};  // facts about all numbers read so far

  explicit LayerReader(bytes::ByteReader& reader) : r_(reader) {}

  template <class Body>
  void group(Name name, Body body) {
    if (*name.dna == '\0') return body();
    bytes::Field field(r_, name.dna);
    note(r_.position());
    body();
  }

  void field(Name name, std::uint8_t& v) {
    scalar(name, v, [this] { return r_.u8(); });
  }
  void field(Name name, std::uint16_t& v) {
    scalar(name, v, [this] { return r_.u16(); });
  }
  void field(Name name, std::uint32_t& v) {
    scalar(name, v, [this] { return r_.u32(); });
  }
  void field(Name name, std::int32_t& v) {
    scalar(name, v, [this] { return static_cast<std::int32_t>(r_.u32()); });
  }
  void field(Name name, float& v) {
    scalar(name, v, [this] { return r_.f32(); });
  }
  void field(Name name, std::string& v) {
    scalar(name, v, [this] { return r_.str(); });
  }
  void field(Name name, core::Array<std::uint16_t>& v) {
    numbers(name, 2, [&] { v = r_.u16_list(); });
  }
  void field(Name name, core::Array<std::uint32_t>& v) {
    largest_ = 0;
    numbers(name, 4, [&] { v = r_.u32_list(&largest_); });
  }
  void field(Name name, core::Array<float>& v) {
    numbers(name, 4, [&] { v = r_.f32_list(&known.finite); });
  }
  template <std::size_t kPlanes>
  void field(Name name, core::PlanarArray<kPlanes>& v) {
    bytes::Field field(r_, name.dna);
    const std::uint64_t at = r_.position();
    v = planes<kPlanes>();
    note(at, 4, static_cast<std::uint32_t>(v.count()));
  }
  template <class T>
  void field(Name name, std::vector<T>& v) {
    bytes::Field field(r_, name.dna);
    note(r_.position());
    list(v);
  }
  template <class T>
  void field(Name name, core::List<T>& v) {
    bytes::Field field(r_, name.dna);
    note(r_.position());
    list(v);
  }
  template <class T>
  void field(Name name, T& v) {
    bytes::Field field(r_, name.dna);
    note(r_.position());
    describe(*this, v);
  }

  template <class T>
  void sized(Name name, core::List<T>& v, const LodMapping* mapping);
  void setups(Name name, core::List<TwistSwingSetup>& v, bool twist);
  void matrix(Name name, JointGroup& g);
  void faces(Mesh& m);
  void skin(Mesh& m);
  void targets(Mesh& m);
  /// Records the position of the field that is being read, if positions are wanted.
  /// In: at                   its byte offset in the file
  ///     element_size, plane  as in Place
  void note(std::uint64_t at, std::uint32_t element_size = 0, std::uint32_t plane = 0) {
    if (places != nullptr) add_place({at, element_size, plane});
  }

 private:
  void add_place(const Place& place);
  template <class T, class Read>
  void scalar(Name name, T& v, Read read) {
    bytes::Field field(r_, name.dna);
    note(r_.position());
    v = read();
  }
  template <class Read>
  void numbers(Name name, std::uint32_t element_size, Read read) {
    bytes::Field field(r_, name.dna);
    note(r_.position(), element_size);
    read();
  }

  // Elements of lists.
  void element(std::string& v) { v = r_.str(); }
  void element(core::Array<std::uint16_t>& v) { v = r_.u16_list(); }
  void element(std::pair<std::string, std::string>& v) {
    v.first = r_.str();
    v.second = r_.str();
  }
  template <class T>
  void element(std::vector<T>& v) {
    list(v);
  }
  template <class T>
  void element(core::List<T>& v) {
    list(v);
  }
  template <class T>
  void element(T& v) {
    describe(*this, v);
  }
  template <class T>
  void list(std::vector<T>& v) {
    const std::uint32_t n = r_.count(empty_size<T>());
    v.reserve(n);
    for (std::uint32_t i = 0; i < n && !r_.failed(); ++i) {
      bytes::Field item(r_, "", i);
      note(r_.position());
      element(v.emplace_back());
    }
  }
  template <class T>
  void list(core::List<T>& v) {
    std::vector<T> items;
    list(items);
    v = std::move(items);
  }
  template <std::size_t kPlanes>
  core::PlanarArray<kPlanes> planes();
  std::vector<bool> wanted(const core::List<Mesh>*, const LodMapping* mapping, std::size_t n) const;
  template <class T>
  std::vector<bool> wanted(const core::List<T>*, const LodMapping* mapping, std::size_t n) const;
  bool target_is_wanted();
  bool channel_is_wanted(std::uint16_t channel) const;
  std::size_t cut_vertex(float* weights, std::uint16_t* joints, std::size_t n);

  bytes::ByteReader& r_;
  std::uint32_t largest_ = 0;  // the largest number of the uint32 list that was read last
};

}  // namespace risorius::dna::detail
