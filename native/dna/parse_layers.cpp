// SPDX-License-Identifier: MIT
#include "dna/parse_layers.h"

namespace risorius::dna::detail {

namespace {

using core::Array;
using core::ErrorCode;
using core::Field;
using core::PlanarArray;

template <class T, class Read>
T in_field(ByteReader& r, const char* name, Read read) {
  Field field(r, name);
  return read(r);
}

Array<std::uint16_t> u16s(ByteReader& r, const char* name) {
  return in_field<Array<std::uint16_t>>(r, name, [](ByteReader& in) { return in.u16_list(); });
}
Array<std::uint32_t> u32s(ByteReader& r, const char* name) {
  return in_field<Array<std::uint32_t>>(r, name, [](ByteReader& in) { return in.u32_list(); });
}
Array<float> f32s(ByteReader& r, const char* name) {
  return in_field<Array<float>>(r, name, [](ByteReader& in) { return in.f32_list(); });
}

std::vector<std::string> strings(ByteReader& r, const char* name) {
  Field field(r, name);
  const std::uint32_t n = r.count(4);
  std::vector<std::string> out;
  out.reserve(n);
  for (std::uint32_t i = 0; i < n && !r.failed(); ++i) {
    Field item(r, "", i);
    out.push_back(r.str());
  }
  return out;
}

// The planes are counted one by one in the file and must agree.
template <std::size_t kPlanes>
PlanarArray<kPlanes> planes(ByteReader& r, const char* name) {
  Field field(r, name);
  std::vector<float> values;
  std::uint32_t n = 0;
  for (std::size_t p = 0; p < kPlanes && !r.failed(); ++p) {
    const std::uint64_t at = r.position();
    const std::uint32_t m = r.count(4);
    if (p == 0) {
      n = m;
      if (std::uint64_t{n} * 4 * kPlanes > r.left()) {
        r.fail_at(at, ErrorCode::kInvalidCount,
                  std::to_string(n) + " vectors need more bytes than are left");
        return {};
      }
      values.resize(std::size_t{n} * kPlanes);
    } else if (m != n && !r.failed()) {
      r.fail_at(at, ErrorCode::kInvalidLength,
                "coordinate list " + std::to_string(p) + " has " + std::to_string(m) +
                    " values, the first has " + std::to_string(n));
    }
    if (!r.failed()) r.read_f32(values.data() + p * n, n);
  }
  if (r.failed()) return {};
  return {Array<float>(std::move(values))};
}

LodMapping lod_mapping(ByteReader& r, const char* name) {
  Field field(r, name);
  LodMapping m;
  m.lods = u16s(r, "lods");
  const std::uint32_t rows = r.count(4);
  m.rows.reserve(rows);
  for (std::uint32_t i = 0; i < rows && !r.failed(); ++i) {
    Field item(r, "indices", i);
    m.rows.push_back(r.u16_list());
  }
  return m;
}

Conditionals conditionals(ByteReader& r) {
  Conditionals c;
  c.input_indices = u16s(r, "input_indices");
  c.output_indices = u16s(r, "output_indices");
  c.from_values = f32s(r, "from_values");
  c.to_values = f32s(r, "to_values");
  c.slope_values = f32s(r, "slope_values");
  c.cut_values = f32s(r, "cut_values");
  return c;
}

// Lists of lists become one flat list and offsets: no allocation per face or vertex.
void read_faces(ByteReader& r, Mesh& mesh) {
  Field field(r, "faces");
  const std::uint32_t n = r.count(4);
  if (n == 0) return;
  std::vector<std::uint32_t> offsets, layouts;
  offsets.reserve(std::size_t{n} + 1);
  layouts.reserve(std::size_t{n} * 4);
  offsets.push_back(0);
  for (std::uint32_t i = 0; i < n && !r.failed(); ++i) {
    const std::uint32_t corners = r.count(4);
    const std::size_t begin = layouts.size();
    layouts.resize(begin + corners);
    r.read_u32(layouts.data() + begin, corners);
    offsets.push_back(static_cast<std::uint32_t>(layouts.size()));
  }
  mesh.face_offsets = std::move(offsets);
  mesh.face_layouts = std::move(layouts);
}

void read_skin_weights(ByteReader& r, Mesh& mesh) {
  Field field(r, "skin_weights");
  const std::uint32_t n = r.count(8);
  if (n == 0) return;
  std::vector<std::uint32_t> offsets;
  std::vector<float> weights;
  std::vector<std::uint16_t> joints;
  offsets.reserve(std::size_t{n} + 1);
  offsets.push_back(0);
  for (std::uint32_t i = 0; i < n && !r.failed(); ++i) {
    const std::uint64_t at = r.position();
    const std::uint32_t influences = r.count(4);
    const std::size_t begin = weights.size();
    weights.resize(begin + influences);
    r.read_f32(weights.data() + begin, influences);
    const std::uint32_t indices = r.count(2);
    if (indices != influences && !r.failed()) {
      Field item(r, "", i);
      r.fail_at(at, ErrorCode::kInvalidLength,
                std::to_string(influences) + " weights, but " + std::to_string(indices) +
                    " joint indices");
      return;
    }
    joints.resize(begin + indices);
    r.read_u16(joints.data() + begin, indices);
    offsets.push_back(static_cast<std::uint32_t>(weights.size()));
  }
  mesh.skin_offsets = std::move(offsets);
  mesh.skin_weights = std::move(weights);
  mesh.skin_joint_indices = std::move(joints);
}

void read_targets(ByteReader& r, Mesh& mesh) {
  const std::uint32_t n = r.count(18);
  std::vector<BlendShapeTarget> targets;
  targets.reserve(n);
  for (std::uint32_t i = 0; i < n && !r.failed(); ++i) {
    Field item(r, "blend_shape_targets", i);
    BlendShapeTarget t;
    const std::uint64_t at = r.position();
    t.deltas = planes<3>(r, "deltas");
    t.vertex_indices = u32s(r, "vertex_indices");
    t.blend_shape_channel_index = r.u16();
    if (t.deltas.count() != t.vertex_indices.size() && !r.failed()) {
      r.fail_at(at, ErrorCode::kInvalidLength,
                std::to_string(t.deltas.count()) + " deltas, but " +
                    std::to_string(t.vertex_indices.size()) + " vertex indices");
    }
    targets.push_back(std::move(t));
  }
  mesh.blend_shape_targets = std::move(targets);
}

Mesh read_mesh(ByteReader& r, bool blend_shapes) {
  Mesh m;
  m.positions = planes<3>(r, "positions");
  m.texture_coordinates = planes<2>(r, "texture_coordinates");
  m.normals = planes<3>(r, "normals");
  m.layout_positions = u32s(r, "layout_positions");
  m.layout_texture_coordinates = u32s(r, "layout_texture_coordinates");
  m.layout_normals = u32s(r, "layout_normals");
  read_faces(r, m);
  m.maximum_influence_per_vertex = r.u16();
  read_skin_weights(r, m);
  if (blend_shapes) read_targets(r, m);
  return m;
}

}  // namespace

Descriptor read_descriptor(ByteReader& r) {
  Field field(r, "descriptor");
  Descriptor d;
  d.name = r.str();
  d.archetype = r.u16();
  d.gender = r.u16();
  d.age = r.u16();
  const std::uint32_t n = r.count(8);
  for (std::uint32_t i = 0; i < n && !r.failed(); ++i) {
    Field item(r, "metadata", i);
    std::string key = r.str();
    d.metadata.emplace_back(std::move(key), r.str());
  }
  d.translation_unit = r.u16();
  d.rotation_unit = r.u16();
  d.coordinate_system.x_axis = r.u16();
  d.coordinate_system.y_axis = r.u16();
  d.coordinate_system.z_axis = r.u16();
  const std::uint64_t at = r.position();
  d.lod_count = r.u16();
  if (d.lod_count > 33) {
    r.fail_at(at, ErrorCode::kInvalidValue,
              "lod_count is " + std::to_string(d.lod_count) + ", the format allows 33");
  }
  d.max_lod = r.u16();
  d.complexity = r.str();
  d.db_name = r.str();
  return d;
}

DescriptorExt read_descriptor_ext(ByteReader& r, bool has_winding) {
  Field field(r, "descriptor_ext");
  DescriptorExt d;
  d.rotation_sequence = r.u32();
  for (std::int32_t& sign : d.rotation_sign) sign = static_cast<std::int32_t>(r.u32());
  if (has_winding) d.face_winding_order = r.u8();
  return d;
}

Definition read_definition(ByteReader& r) {
  Field field(r, "definition");
  Definition d;
  d.lod_joint_mapping = lod_mapping(r, "lod_joint_mapping");
  d.lod_blend_shape_mapping = lod_mapping(r, "lod_blend_shape_mapping");
  d.lod_animated_map_mapping = lod_mapping(r, "lod_animated_map_mapping");
  d.lod_mesh_mapping = lod_mapping(r, "lod_mesh_mapping");
  d.gui_control_names = strings(r, "gui_control_names");
  d.raw_control_names = strings(r, "raw_control_names");
  d.joint_names = strings(r, "joint_names");
  d.blend_shape_channel_names = strings(r, "blend_shape_channel_names");
  d.animated_map_names = strings(r, "animated_map_names");
  d.mesh_names = strings(r, "mesh_names");
  d.mesh_blend_shape_channel_mapping_from = u16s(r, "mesh_blend_shape_channel_mapping.from");
  d.mesh_blend_shape_channel_mapping_to = u16s(r, "mesh_blend_shape_channel_mapping.to");
  d.joint_parents = u16s(r, "joint_parents");
  d.neutral_joint_translations = planes<3>(r, "neutral_joint_translations");
  d.neutral_joint_rotations = planes<3>(r, "neutral_joint_rotations");
  return d;
}

void read_controls(ByteReader& r, Behavior& b) {
  Field field(r, "behavior");
  b.psd_count = r.u16();
  {
    Field table(r, "gui_to_raw");
    b.gui_to_raw = conditionals(r);
  }
  Field psds(r, "psds");
  b.psds.rows = u16s(r, "rows");
  b.psds.columns = u16s(r, "columns");
  b.psds.values = f32s(r, "values");
}

void read_joints(ByteReader& r, Behavior& b) {
  Field field(r, "behavior");
  b.joint_row_count = r.u16();
  b.joint_column_count = r.u16();
  const std::uint32_t n = r.count(20);
  std::vector<JointGroup> groups;
  groups.reserve(n);
  for (std::uint32_t i = 0; i < n && !r.failed(); ++i) {
    Field item(r, "joint_groups", i);
    JointGroup g;
    g.lods = u16s(r, "lods");
    g.input_indices = u16s(r, "input_indices");
    g.output_indices = u16s(r, "output_indices");
    g.values = f32s(r, "values");
    g.joint_indices = u16s(r, "joint_indices");
    groups.push_back(std::move(g));
  }
  b.joint_groups = std::move(groups);
}

void read_blend_shape_channels(ByteReader& r, Behavior& b) {
  Field field(r, "behavior");
  Field part(r, "blend_shape_channels");
  b.blend_shape_channels.lods = u16s(r, "lods");
  b.blend_shape_channels.input_indices = u16s(r, "input_indices");
  b.blend_shape_channels.output_indices = u16s(r, "output_indices");
}

void read_animated_maps(ByteReader& r, Behavior& b) {
  Field field(r, "behavior");
  Field part(r, "animated_maps");
  b.animated_maps.lods = u16s(r, "lods");
  b.animated_maps.conditionals = conditionals(r);
}

Geometry read_geometry(ByteReader& r, bool mesh_sizes, bool blend_shapes) {
  Field field(r, "geometry");
  Geometry g;
  const std::uint64_t layer_end = r.end();
  const std::uint32_t n = r.count(4 + 52);
  std::vector<Mesh> meshes;
  meshes.reserve(n);
  for (std::uint32_t i = 0; i < n && !r.failed(); ++i) {
    Field item(r, "meshes", i);
    const std::uint64_t at = r.position();
    const std::uint32_t mark = r.u32();
    const std::uint64_t mesh_end = mesh_sizes ? r.position() + mark : mark;
    if (r.failed()) break;
    if (mesh_end < r.position() || mesh_end > layer_end) {
      r.fail_at(at, ErrorCode::kTruncated,
                "the mesh is said to end at byte " + std::to_string(mesh_end) +
                    ", its layer ends at byte " + std::to_string(layer_end));
      break;
    }
    r.enter(r.position(), mesh_end - r.position());
    meshes.push_back(read_mesh(r, blend_shapes));
    if (!r.failed()) r.enter(mesh_end, layer_end - mesh_end);
  }
  g.meshes = std::move(meshes);
  return g;
}

}  // namespace risorius::dna::detail
