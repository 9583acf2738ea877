// SPDX-License-Identifier: MIT
#include "dna/size.h"

#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "dna/layers.h"
#include "dna/schema.h"

namespace risorius::dna {

namespace {

using core::Array;
using core::List;
using detail::describe;
using detail::Name;

constexpr std::uint64_t kCount = 4;  // in front of each list

class SizeVisitor {
 public:
  std::uint64_t bytes = 0;

  template <class Body>
  void group(Name, Body body) {
    body();
  }
  template <class T>
  void field(Name, const T& v) {
    add(v);
  }
  template <class T>
  void sized(Name, const List<T>& v, const LodMapping*) {
    add(v);
  }
  void setups(Name, const List<TwistSwingSetup>& v, bool twist) {
    bytes += kCount;
    for (const TwistSwingSetup& s : v) detail::describe_setup(*this, s, twist);
  }
  void matrix(Name, const JointGroup& g) { add(g.values); }
  void faces(const Mesh& m) { add(m.face_offsets), add(m.face_layouts); }
  void skin(const Mesh& m) { add(m.skin_offsets), add(m.skin_weights), add(m.skin_joint_indices); }
  void targets(const Mesh& m) { add(m.blend_shape_targets); }

 private:
  template <class T>
    requires std::is_arithmetic_v<T>
  void add(const T&) {
    bytes += sizeof(T);
  }
  void add(const std::string& v) { bytes += kCount + v.size(); }
  void add(const std::pair<std::string, std::string>& v) { add(v.first), add(v.second); }
  template <class T>
  void add(const Array<T>& v) {
    bytes += kCount + v.size() * sizeof(T);
  }
  template <std::size_t kPlanes>
  void add(const core::PlanarArray<kPlanes>& v) {
    add(v.values);
  }
  template <class T>
  void add(const std::vector<T>& v) {
    bytes += kCount;
    for (const T& item : v) add(item);
  }
  template <class T>
  void add(const List<T>& v) {
    bytes += kCount;
    for (const T& item : v) add(item);
  }
  template <class T>
    requires std::is_class_v<T>
  void add(const T& v) {
    describe(*this, v);
  }
};

}  // namespace

std::uint64_t size_in_bytes(const Dna& dna) {
  SizeVisitor size;
  detail::for_each_layer(
      dna, [&](std::string_view, const char*, const auto& layer) { describe(size, layer); });
  for (const UnknownLayer& u : dna.unknown_layers) size.bytes += 2 * kCount + u.bytes.size();
  return size.bytes;
}

}  // namespace risorius::dna
