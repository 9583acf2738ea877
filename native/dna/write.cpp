// SPDX-License-Identifier: MIT
#include <algorithm>
#include <limits>

#include "core/byte_writer.h"
#include "dna/io.h"
#include "dna/layers.h"

namespace risorius::dna {

namespace {

using core::ByteWriter;
using core::ErrorCode;
using core::fail;
using core::PlanarArray;
using core::Result;

void write_strings(ByteWriter& w, const std::vector<std::string>& texts) {
  w.u32(static_cast<std::uint32_t>(texts.size()));
  for (const std::string& text : texts) w.str(text);
}

template <std::size_t kPlanes>
void write_planes(ByteWriter& w, const PlanarArray<kPlanes>& array) {
  for (std::size_t p = 0; p < kPlanes; ++p) w.list(array.plane(p));
}

void write_lod_mapping(ByteWriter& w, const LodMapping& m) {
  w.list(m.lods.span());
  w.u32(static_cast<std::uint32_t>(m.rows.size()));
  for (const auto& row : m.rows) w.list(row.span());
}

void write_conditionals(ByteWriter& w, const Conditionals& c) {
  w.list(c.input_indices.span());
  w.list(c.output_indices.span());
  w.list(c.from_values.span());
  w.list(c.to_values.span());
  w.list(c.slope_values.span());
  w.list(c.cut_values.span());
}

void write_descriptor(ByteWriter& w, const Descriptor& d) {
  w.str(d.name);
  w.u16(d.archetype);
  w.u16(d.gender);
  w.u16(d.age);
  w.u32(static_cast<std::uint32_t>(d.metadata.size()));
  for (const auto& [key, value] : d.metadata) {
    w.str(key);
    w.str(value);
  }
  w.u16(d.translation_unit);
  w.u16(d.rotation_unit);
  w.u16(d.coordinate_system.x_axis);
  w.u16(d.coordinate_system.y_axis);
  w.u16(d.coordinate_system.z_axis);
  w.u16(d.lod_count);
  w.u16(d.max_lod);
  w.str(d.complexity);
  w.str(d.db_name);
}

void write_definition(ByteWriter& w, const Definition& d) {
  write_lod_mapping(w, d.lod_joint_mapping);
  write_lod_mapping(w, d.lod_blend_shape_mapping);
  write_lod_mapping(w, d.lod_animated_map_mapping);
  write_lod_mapping(w, d.lod_mesh_mapping);
  write_strings(w, d.gui_control_names);
  write_strings(w, d.raw_control_names);
  write_strings(w, d.joint_names);
  write_strings(w, d.blend_shape_channel_names);
  write_strings(w, d.animated_map_names);
  write_strings(w, d.mesh_names);
  w.list(d.mesh_blend_shape_channel_mapping_from.span());
  w.list(d.mesh_blend_shape_channel_mapping_to.span());
  w.list(d.joint_parents.span());
  write_planes(w, d.neutral_joint_translations);
  write_planes(w, d.neutral_joint_rotations);
}

void write_controls(ByteWriter& w, const Behavior& b) {
  w.u16(b.psd_count);
  write_conditionals(w, b.gui_to_raw);
  w.list(b.psds.rows.span());
  w.list(b.psds.columns.span());
  w.list(b.psds.values.span());
}

void write_joints(ByteWriter& w, const Behavior& b) {
  w.u16(b.joint_row_count);
  w.u16(b.joint_column_count);
  w.u32(static_cast<std::uint32_t>(b.joint_groups.size()));
  for (const JointGroup& g : b.joint_groups) {
    w.list(g.lods.span());
    w.list(g.input_indices.span());
    w.list(g.output_indices.span());
    w.list(g.values.span());
    w.list(g.joint_indices.span());
  }
}

void write_blend_shape_channels(ByteWriter& w, const Behavior& b) {
  w.list(b.blend_shape_channels.lods.span());
  w.list(b.blend_shape_channels.input_indices.span());
  w.list(b.blend_shape_channels.output_indices.span());
}

void write_animated_maps(ByteWriter& w, const Behavior& b) {
  w.list(b.animated_maps.lods.span());
  write_conditionals(w, b.animated_maps.conditionals);
}

// A list of lists, from its flat form.
template <class Item>
void write_rows(ByteWriter& w, const core::Array<std::uint32_t>& offsets, Item item) {
  const std::size_t n = offsets.empty() ? 0 : offsets.size() - 1;
  w.u32(static_cast<std::uint32_t>(n));
  for (std::size_t i = 0; i < n; ++i) item(offsets[i], offsets[i + 1] - offsets[i]);
}

void write_mesh(ByteWriter& w, const Mesh& m) {
  write_planes(w, m.positions);
  write_planes(w, m.texture_coordinates);
  write_planes(w, m.normals);
  w.list(m.layout_positions.span());
  w.list(m.layout_texture_coordinates.span());
  w.list(m.layout_normals.span());
  write_rows(w, m.face_offsets, [&](std::size_t begin, std::size_t n) {
    w.list(m.face_layouts.span().subspan(begin, n));
  });
  w.u16(m.maximum_influence_per_vertex);
  write_rows(w, m.skin_offsets, [&](std::size_t begin, std::size_t n) {
    w.list(m.skin_weights.span().subspan(begin, n));
    w.list(m.skin_joint_indices.span().subspan(begin, n));
  });
  w.u32(static_cast<std::uint32_t>(m.blend_shape_targets.size()));
  for (const BlendShapeTarget& t : m.blend_shape_targets) {
    write_planes(w, t.deltas);
    w.list(t.vertex_indices.span());
    w.u16(t.blend_shape_channel_index);
  }
}

// Each mesh is preceded by its size, or in 2.1 by the offset of the byte after it.
void write_geometry(ByteWriter& w, const Geometry& g, bool sizes) {
  w.u32(static_cast<std::uint32_t>(g.meshes.size()));
  for (const Mesh& m : g.meshes) {
    const std::size_t mark = w.position();
    w.u32(0);
    write_mesh(w, m);
    const std::size_t value = sizes ? w.position() - mark - 4 : w.position();
    w.patch_u32(mark, static_cast<std::uint32_t>(value));
  }
}

void write_typed_layer(ByteWriter& w, const Dna& dna, std::string_view id, std::uint16_t minor) {
  if (id == "desc") {
    write_descriptor(w, dna.descriptor);
  } else if (id == "defn") {
    write_definition(w, dna.definition);
  } else if (id == "bhvr") {
    write_controls(w, dna.behavior);
    write_joints(w, dna.behavior);
    write_blend_shape_channels(w, dna.behavior);
    write_animated_maps(w, dna.behavior);
  } else if (id == "geom") {
    write_geometry(w, dna.geometry, true);
  } else {
    w.u32(dna.descriptor_ext.rotation_sequence);
    for (const std::int32_t sign : dna.descriptor_ext.rotation_sign) {
      w.u32(static_cast<std::uint32_t>(sign));
    }
    if (minor >= 8) w.u8(dna.descriptor_ext.face_winding_order);
  }
}

void write_header(ByteWriter& w, std::uint16_t minor) {
  for (const char c : {'D', 'N', 'A'}) w.u8(static_cast<std::uint8_t>(c));
  w.u16(2);
  w.u16(minor);
}

std::vector<std::uint8_t> write_sections(const Dna& dna, std::vector<std::string>& dropped) {
  for (const OpaqueLayer& layer : dna.opaque_layers) {
    const bool empty = std::ranges::all_of(layer.bytes, [](std::uint8_t b) { return b == 0; });
    if (!empty) dropped.emplace_back(layer.id.begin(), layer.id.end());
  }
  if (dna.descriptor_ext != DescriptorExt{}) dropped.emplace_back("dsce");
  ByteWriter w;
  write_header(w, 1);
  const std::size_t table = w.position();
  for (int i = 0; i < 8; ++i) w.u32(0);
  const auto begin = [&](std::size_t section) {
    w.patch_u32(table + 4 * section, static_cast<std::uint32_t>(w.position()));
  };
  begin(0);
  write_descriptor(w, dna.descriptor);
  begin(1);
  write_definition(w, dna.definition);
  begin(2);
  begin(3);
  write_controls(w, dna.behavior);
  begin(4);
  write_joints(w, dna.behavior);
  begin(5);
  write_blend_shape_channels(w, dna.behavior);
  begin(6);
  write_animated_maps(w, dna.behavior);
  begin(7);
  write_geometry(w, dna.geometry, false);
  for (const char c : {'A', 'N', 'D'}) w.u8(static_cast<std::uint8_t>(c));
  return w.take();
}

struct PlannedLayer {
  detail::LayerId id{};
  std::uint32_t version = 0;
  const OpaqueLayer* opaque = nullptr;  // null: typed, or an empty extension
  std::uint32_t empty_size = 0;
};

// The layers in the order of the source's index, then what the version has and the source lacks.
std::vector<PlannedLayer> plan_layers(const Dna& dna, std::uint16_t minor) {
  std::vector<PlannedLayer> plan;
  std::size_t next_opaque = 0;
  const auto has = [&](const char* id) {
    return std::ranges::any_of(plan, [&](const PlannedLayer& p) {
      return std::memcmp(p.id.data(), id, 4) == 0 && detail::is_known(p.id, p.version);
    });
  };
  const auto add_opaque = [&] {
    const OpaqueLayer& layer = dna.opaque_layers[next_opaque++];
    plan.push_back({layer.id, layer.version, &layer, 0});
  };
  const auto add_known = [&](const detail::KnownLayer& layer) {
    plan.push_back({{layer.id[0], layer.id[1], layer.id[2], layer.id[3]},
                    layer.version,
                    nullptr,
                    layer.empty_size});
  };
  for (const std::string& id : dna.index_order) {
    if (id.empty()) {
      if (next_opaque < dna.opaque_layers.size()) add_opaque();
    } else if (!has(id.c_str())) {
      for (const detail::KnownLayer& layer : detail::kLayers) {
        if (id == layer.id) add_known(layer);
      }
    }
  }
  while (next_opaque < dna.opaque_layers.size()) add_opaque();
  for (const detail::KnownLayer& layer : detail::kLayers) {
    if (layer.since_minor <= minor && !has(layer.id)) add_known(layer);
  }
  return plan;
}

std::vector<std::uint8_t> write_indexed(const Dna& dna, std::uint16_t minor) {
  const std::vector<PlannedLayer> plan = plan_layers(dna, minor);
  ByteWriter w;
  write_header(w, minor);
  w.u32(static_cast<std::uint32_t>(plan.size()));
  const std::size_t table = w.position();
  for (std::size_t i = 0; i < plan.size() * 4; ++i) w.u32(0);
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const PlannedLayer& p = plan[i];
    const std::size_t begin = w.position();
    if (p.opaque != nullptr) {
      w.raw(p.opaque->bytes);
    } else if (p.empty_size > 0) {
      for (std::uint32_t b = 0; b < p.empty_size; ++b) w.u8(0);
    } else {
      write_typed_layer(w, dna, {p.id.data(), 4}, minor);
    }
    const std::size_t entry = table + 16 * i;
    std::uint32_t id = 0;
    for (const char c : p.id) id = (id << 8) | static_cast<std::uint8_t>(c);
    w.patch_u32(entry, id);
    w.patch_u32(entry + 4, p.version);
    w.patch_u32(entry + 8, static_cast<std::uint32_t>(begin));
    w.patch_u32(entry + 12, static_cast<std::uint32_t>(w.position() - begin));
  }
  return w.take();
}

}  // namespace

Result<std::vector<std::uint8_t>> write(const Dna& dna, std::uint16_t minor,
                                        std::vector<std::string>& dropped) {
  if (minor < 1 || minor > 8) {
    return fail(ErrorCode::kInvalidArgument, "version",
                "version 2." + std::to_string(minor) + " cannot be written, 2.1 to 2.8 can");
  }
  std::vector<Warning> warnings;
  if (core::Status valid = validate(dna, warnings); !valid) return std::move(valid).propagate();
  std::vector<std::uint8_t> bytes =
      minor == 1 ? write_sections(dna, dropped) : write_indexed(dna, minor);
  if (bytes.size() > std::numeric_limits<std::uint32_t>::max()) {
    return fail(ErrorCode::kLimitExceeded, "", "the file would pass the format's 4 GiB");
  }
  return bytes;
}

}  // namespace risorius::dna
