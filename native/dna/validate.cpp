// SPDX-License-Identifier: MIT
#include <cmath>
#include <functional>

#include "dna/io.h"

namespace risorius::dna {

namespace {

using core::Array;
using core::ErrorCode;
using core::ok;
using core::Status;

// Collects the first error; every check returns at once after it.
class Checker {
 public:
  explicit Checker(std::vector<Warning>& warnings) : warnings_(warnings) {}

  Status status() && { return error_ ? Status(core::Unexpected{*error_}) : ok(); }
  bool failed() const { return error_.has_value(); }
  void error(ErrorCode code, std::string where, std::string message) {
    if (!error_) error_ = core::Error{code, std::nullopt, std::move(where), std::move(message)};
  }
  void warn(std::string where, std::string message) {
    warnings_.push_back({std::move(where), std::move(message)});
  }
  void same_length(const std::string& where, const char* a, std::size_t na, const char* b,
                   std::size_t nb) {
    if (na == nb) return;
    error(ErrorCode::kInvalidLength, where,
          std::to_string(na) + " " + a + ", but " + std::to_string(nb) + " " + b);
  }
  template <class T>
  void below(const std::string& where, const Array<T>& indices, std::size_t limit,
             const char* space) {
    for (std::size_t i = 0; i < indices.size(); ++i) {
      if (indices[i] < limit) continue;
      error(ErrorCode::kInvalidIndex, where + "[" + std::to_string(i) + "]",
            "index " + std::to_string(indices[i]) + ", but there are " + std::to_string(limit) +
                " " + space);
      return;
    }
  }
  void finite(const std::string& where, const Array<float>& values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::isfinite(values[i])) continue;
      warn(where + "[" + std::to_string(i) + "]", "not a finite number");
      return;
    }
  }
  void row_counts(const std::string& where, const Array<std::uint16_t>& lods, std::size_t rows) {
    for (std::size_t l = 0; l < lods.size(); ++l) {
      const std::string at = where + ".lods[" + std::to_string(l) + "]";
      if (lods[l] > rows) {
        error(ErrorCode::kInvalidValue, at,
              std::to_string(lods[l]) + " rows, but the table has " + std::to_string(rows));
      } else if (l > 0 && lods[l] > lods[l - 1]) {
        warn(at, "more rows than the LOD before it");
      }
    }
  }

 private:
  std::vector<Warning>& warnings_;
  std::optional<core::Error> error_;
};

void check_lod_mapping(Checker& c, const std::string& where, const LodMapping& m, std::size_t limit,
                       const char* space) {
  c.below(where + ".lods", m.lods, m.rows.size(), "index lists");
  for (std::size_t i = 0; i < m.rows.size(); ++i) {
    c.below(where + ".indices[" + std::to_string(i) + "]", m.rows[i], limit, space);
  }
}

void check_hierarchy(Checker& c, const Array<std::uint16_t>& parents) {
  // Walk up from each joint until a joint that is known to reach a root.
  std::vector<std::uint8_t> good(parents.size(), 0);
  std::vector<std::size_t> path;
  for (std::size_t j = 0; j < parents.size(); ++j) {
    path.clear();
    std::size_t at = j;
    while (!good[at] && parents[at] != at) {
      path.push_back(at);
      at = parents[at];
      if (path.size() <= parents.size()) continue;
      c.error(ErrorCode::kInvalidValue, "definition.joint_parents[" + std::to_string(j) + "]",
              "the joint hierarchy has a cycle");
      return;
    }
    good[at] = 1;
    for (const std::size_t p : path) good[p] = 1;
  }
}

void check_definition(Checker& c, const Dna& dna) {
  const Definition& d = dna.definition;
  const std::size_t joints = d.joint_names.size();
  const std::size_t channels = d.blend_shape_channel_names.size();
  const std::size_t meshes = d.mesh_names.size();
  check_lod_mapping(c, "definition.lod_joint_mapping", d.lod_joint_mapping, joints, "joints");
  check_lod_mapping(c, "definition.lod_blend_shape_mapping", d.lod_blend_shape_mapping, channels,
                    "blend shape channels");
  check_lod_mapping(c, "definition.lod_animated_map_mapping", d.lod_animated_map_mapping,
                    d.animated_map_names.size(), "animated maps");
  check_lod_mapping(c, "definition.lod_mesh_mapping", d.lod_mesh_mapping, meshes, "meshes");
  const std::string pairs = "definition.mesh_blend_shape_channel_mapping";
  c.same_length(pairs, "meshes", d.mesh_blend_shape_channel_mapping_from.size(), "channels",
                d.mesh_blend_shape_channel_mapping_to.size());
  c.below(pairs + ".from", d.mesh_blend_shape_channel_mapping_from, meshes, "meshes");
  c.below(pairs + ".to", d.mesh_blend_shape_channel_mapping_to, channels, "blend shape channels");
  c.same_length("definition.joint_parents", "joint names", joints, "parents",
                d.joint_parents.size());
  c.same_length("definition.neutral_joint_translations", "joint names", joints, "translations",
                d.neutral_joint_translations.count());
  c.same_length("definition.neutral_joint_rotations", "joint names", joints, "rotations",
                d.neutral_joint_rotations.count());
  c.below("definition.joint_parents", d.joint_parents, joints, "joints");
  if (!c.failed()) check_hierarchy(c, d.joint_parents);
  c.finite("definition.neutral_joint_translations", d.neutral_joint_translations.values);
  c.finite("definition.neutral_joint_rotations", d.neutral_joint_rotations.values);
}

void check_conditionals(Checker& c, const std::string& where, const Conditionals& t,
                        std::size_t inputs, const char* input_space, std::size_t outputs,
                        const char* output_space) {
  const std::size_t rows = t.input_indices.size();
  c.same_length(where, "inputs", rows, "outputs", t.output_indices.size());
  c.same_length(where, "inputs", rows, "from values", t.from_values.size());
  c.same_length(where, "inputs", rows, "to values", t.to_values.size());
  c.same_length(where, "inputs", rows, "slope values", t.slope_values.size());
  c.same_length(where, "inputs", rows, "cut values", t.cut_values.size());
  c.below(where + ".input_indices", t.input_indices, inputs, input_space);
  c.below(where + ".output_indices", t.output_indices, outputs, output_space);
}

void check_joint_group(Checker& c, const std::string& where, const JointGroup& g,
                       std::size_t joints) {
  if (g.values.size() != g.output_indices.size() * g.input_indices.size()) {
    c.error(ErrorCode::kInvalidLength, where + ".values",
            std::to_string(g.values.size()) + " values, but " +
                std::to_string(g.output_indices.size()) + " rows of " +
                std::to_string(g.input_indices.size()));
  }
  c.below(where + ".output_indices", g.output_indices, joints * 9, "joint attributes");
  c.below(where + ".joint_indices", g.joint_indices, joints, "joints");
  c.row_counts(where, g.lods, g.output_indices.size());
  c.finite(where + ".values", g.values);
}

// Controls of the layers that are kept as bytes come after raw and corrective ones; how many there
// are is their business, so an index beyond is only odd.
void check_behavior(Checker& c, const Dna& dna) {
  const Behavior& b = dna.behavior;
  const Definition& d = dna.definition;
  const std::size_t raw = d.raw_control_names.size();
  check_conditionals(c, "behavior.gui_to_raw", b.gui_to_raw, d.gui_control_names.size(),
                     "GUI controls", raw, "raw controls");
  c.same_length("behavior.psds", "rows", b.psds.rows.size(), "columns", b.psds.columns.size());
  c.same_length("behavior.psds", "rows", b.psds.rows.size(), "values", b.psds.values.size());
  c.below("behavior.psds.rows", b.psds.rows, raw + b.psd_count, "raw and corrective controls");
  for (std::size_t i = 0; i < b.joint_groups.size(); ++i) {
    check_joint_group(c, "behavior.joint_groups[" + std::to_string(i) + "]", b.joint_groups[i],
                      d.joint_names.size());
  }
  const BlendShapeChannels& s = b.blend_shape_channels;
  c.same_length("behavior.blend_shape_channels", "inputs", s.input_indices.size(), "outputs",
                s.output_indices.size());
  c.below("behavior.blend_shape_channels.output_indices", s.output_indices,
          d.blend_shape_channel_names.size(), "blend shape channels");
  c.row_counts("behavior.blend_shape_channels", s.lods, s.output_indices.size());
  const Conditionals& maps = b.animated_maps.conditionals;
  check_conditionals(c, "behavior.animated_maps", maps, 65536, "controls",
                     d.animated_map_names.size(), "animated maps");
  c.row_counts("behavior.animated_maps", b.animated_maps.lods, maps.input_indices.size());
}

void check_offsets(Checker& c, const std::string& where, const Array<std::uint32_t>& offsets,
                   std::size_t items) {
  if (offsets.empty()) {
    if (items > 0) c.error(ErrorCode::kInvalidLength, where, "values without offsets");
    return;
  }
  bool good = offsets[0] == 0 && offsets[offsets.size() - 1] == items;
  for (std::size_t i = 1; i < offsets.size(); ++i) good = good && offsets[i] >= offsets[i - 1];
  if (!good) {
    c.error(ErrorCode::kInvalidValue, where,
            "offsets must begin at 0, never fall and end at the number of values");
  }
}

void check_mesh(Checker& c, const std::string& where, const Dna& dna, const Mesh& m) {
  const std::size_t vertices = m.positions.count();
  const std::size_t layouts = m.layout_positions.size();
  c.same_length(where, "layout positions", layouts, "layout texture coordinates",
                m.layout_texture_coordinates.size());
  c.same_length(where, "layout positions", layouts, "layout normals", m.layout_normals.size());
  c.below(where + ".layout_positions", m.layout_positions, vertices, "vertices");
  c.below(where + ".layout_texture_coordinates", m.layout_texture_coordinates,
          m.texture_coordinates.count(), "texture coordinates");
  c.below(where + ".layout_normals", m.layout_normals, m.normals.count(), "normals");
  check_offsets(c, where + ".face_offsets", m.face_offsets, m.face_layouts.size());
  c.below(where + ".face_layouts", m.face_layouts, layouts, "layouts");
  check_offsets(c, where + ".skin_offsets", m.skin_offsets, m.skin_weights.size());
  c.same_length(where, "skin weights", m.skin_weights.size(), "skin joint indices",
                m.skin_joint_indices.size());
  if (!m.skin_offsets.empty() && m.skin_offsets.size() != vertices + 1) {
    c.error(ErrorCode::kInvalidLength, where + ".skin_weights",
            std::to_string(m.skin_offsets.size() - 1) + " entries, but " +
                std::to_string(vertices) + " vertices");
  }
  c.below(where + ".skin_joint_indices", m.skin_joint_indices, dna.definition.joint_names.size(),
          "joints");
  c.finite(where + ".positions", m.positions.values);
  for (std::size_t t = 0; t < m.blend_shape_targets.size(); ++t) {
    const BlendShapeTarget& target = m.blend_shape_targets[t];
    const std::string at = where + ".blend_shape_targets[" + std::to_string(t) + "]";
    c.same_length(at, "deltas", target.deltas.count(), "vertex indices",
                  target.vertex_indices.size());
    c.below(at + ".vertex_indices", target.vertex_indices, vertices, "vertices");
    if (target.blend_shape_channel_index >= dna.definition.blend_shape_channel_names.size()) {
      c.error(ErrorCode::kInvalidIndex, at + ".blend_shape_channel_index",
              "channel " + std::to_string(target.blend_shape_channel_index) + ", but there are " +
                  std::to_string(dna.definition.blend_shape_channel_names.size()));
    }
    c.finite(at + ".deltas", target.deltas.values);
    if (c.failed()) return;
  }
}

void check_enum(Checker& c, const char* where, std::uint32_t value, std::uint32_t limit) {
  if (value >= limit) c.warn(where, "the value " + std::to_string(value) + " is not known");
}

void check_descriptor(Checker& c, const Dna& dna) {
  const Descriptor& d = dna.descriptor;
  check_enum(c, "descriptor.archetype", d.archetype, 6);
  check_enum(c, "descriptor.gender", d.gender, 3);
  check_enum(c, "descriptor.translation_unit", d.translation_unit, 2);
  check_enum(c, "descriptor.rotation_unit", d.rotation_unit, 2);
  check_enum(c, "descriptor_ext.rotation_sequence", dna.descriptor_ext.rotation_sequence, 6);
  check_enum(c, "descriptor_ext.face_winding_order", dna.descriptor_ext.face_winding_order, 2);
  const CoordinateSystem& a = d.coordinate_system;
  const bool axes = a.x_axis < 6 && a.y_axis < 6 && a.z_axis < 6 && a.x_axis / 2 != a.y_axis / 2 &&
                    a.y_axis / 2 != a.z_axis / 2 && a.x_axis / 2 != a.z_axis / 2;
  if (!axes) c.warn("descriptor.coordinate_system", "the axes do not span space");
}

}  // namespace

Status validate(const Dna& dna, std::vector<Warning>& warnings) {
  Checker c(warnings);
  check_descriptor(c, dna);
  check_definition(c, dna);
  // Without a definition there are no spaces to check against: a descriptor-only load.
  if (!c.failed() && dna.behavior != Behavior{}) check_behavior(c, dna);
  for (std::size_t i = 0; i < dna.geometry.meshes.size() && !c.failed(); ++i) {
    check_mesh(c, "geometry.meshes[" + std::to_string(i) + "]", dna, dna.geometry.meshes[i]);
  }
  if (dna.geometry.meshes.size() > 0 &&
      dna.geometry.meshes.size() != dna.definition.mesh_names.size()) {
    c.warn("geometry.meshes", std::to_string(dna.geometry.meshes.size()) + " meshes, but " +
                                  std::to_string(dna.definition.mesh_names.size()) + " mesh names");
  }
  return std::move(c).status();
}

}  // namespace risorius::dna
