// SPDX-License-Identifier: MIT
// Writes layers to bytes: a visitor of schema.h. Private to native/dna.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bytes/byte_writer.h"
#include "dna/schema.h"

namespace risorius::dna::detail {

class LayerWriter {
 public:
  bool mesh_sizes = true;  // 2.2+: a mesh is preceded by its size; 2.1: by the offset of its end

  explicit LayerWriter(bytes::ByteWriter& writer) : w_(writer) {}

  template <class Body>
  void group(Name, Body body) {
    body();
  }
  void field(Name, std::uint8_t v) { w_.u8(v); }
  void field(Name, std::uint16_t v) { w_.u16(v); }
  void field(Name, std::uint32_t v) { w_.u32(v); }
  void field(Name, std::int32_t v) { w_.u32(static_cast<std::uint32_t>(v)); }
  void field(Name, float v) { w_.f32(v); }
  template <class T>
  void field(Name, const T& v) {
    element(v);
  }

  template <class T>
  void sized(Name, const core::List<T>& v, const LodMapping*) {
    w_.u32(static_cast<std::uint32_t>(v.size()));
    const bool is_size = mesh_sizes || !std::is_same_v<T, Mesh>;
    for (const T& item : v) {
      const std::size_t mark = w_.position();
      w_.u32(0);
      describe(*this, item);
      const std::size_t value = is_size ? w_.position() - mark - 4 : w_.position();
      w_.patch_u32(mark, static_cast<std::uint32_t>(value));
    }
  }
  void setups(Name, const core::List<TwistSwingSetup>& v, bool twist) {
    w_.u32(static_cast<std::uint32_t>(v.size()));
    for (const TwistSwingSetup& setup : v) describe_setup(*this, setup, twist);
  }
  void matrix(Name, const JointGroup& g) { w_.list(g.values.span()); }
  void faces(const Mesh& m) {
    rows(m.face_offsets, [&](std::size_t begin, std::size_t n) {
      w_.list(m.face_layouts.span().subspan(begin, n));
    });
  }
  void skin(const Mesh& m) {
    rows(m.skin_offsets, [&](std::size_t begin, std::size_t n) {
      w_.list(m.skin_weights.span().subspan(begin, n));
      w_.list(m.skin_joint_indices.span().subspan(begin, n));
    });
  }
  void targets(const Mesh& m) { element(m.blend_shape_targets); }

 private:
  void element(const std::string& v) { w_.str(v); }
  void element(const std::pair<std::string, std::string>& v) {
    w_.str(v.first);
    w_.str(v.second);
  }
  template <class T>
  void element(const core::Array<T>& v) {
    w_.list(v.span());
  }
  template <std::size_t kPlanes>
  void element(const core::PlanarArray<kPlanes>& v) {
    for (std::size_t p = 0; p < kPlanes; ++p) w_.list(v.plane(p));
  }
  template <class T>
  void element(const std::vector<T>& v) {
    w_.u32(static_cast<std::uint32_t>(v.size()));
    for (const T& item : v) element(item);
  }
  template <class T>
  void element(const core::List<T>& v) {
    w_.u32(static_cast<std::uint32_t>(v.size()));
    for (const T& item : v) element(item);
  }
  template <class T>
  void element(const T& v) {
    describe(*this, v);
  }
  // Writes a list of lists, which a Dna stores as one flat list and the offsets of the inner lists.
  // In: item(begin, n)  writes an inner list: n elements of the flat list, from index `begin` on
  template <class Item>
  void rows(const core::Array<std::uint32_t>& offsets, Item item) {
    const std::size_t n = offsets.empty() ? 0 : offsets.size() - 1;
    w_.u32(static_cast<std::uint32_t>(n));
    for (std::size_t i = 0; i < n; ++i) item(offsets[i], offsets[i + 1] - offsets[i]);
  }

  bytes::ByteWriter& w_;
};

}  // namespace risorius::dna::detail
