// SPDX-License-Identifier: MIT
#include <array>

#include "bindings/fields.h"

namespace risorius::bindings {

namespace {

using dna::Dna;

constexpr std::array<const char*, 6> kArchetypes{"asian",    "black", "caucasian",
                                                 "hispanic", "alien", "other"};
constexpr std::array<const char*, 3> kGenders{"male", "female", "other"};

void bind_structs(py::module_& m) {
  py::class_<dna::LodMapping, std::shared_ptr<dna::LodMapping>>(
      m, "LodMapping", "For each LOD a list of indices; mapping[lod] is a uint16 array.")
      .def("__len__", [](const dna::LodMapping& s) { return s.lods.size(); })
      .def("__getitem__",
           [](const dna::LodMapping& s, std::size_t lod) {
             if (lod >= s.lods.size() || s.lods[lod] >= s.rows.size()) throw py::index_error();
             return to_numpy(s.rows[s.lods[lod]]);
           })
      .def_property_readonly("lods", [](const dna::LodMapping& s) { return to_numpy(s.lods); })
      .def_property_readonly("rows", [](const dna::LodMapping& s) {
        py::list rows;
        for (const auto& row : s.rows) rows.append(to_numpy(row));
        return rows;
      });

  auto table = value_class<dna::Conditionals>(
      m, "Conditionals", "Rows from <= in <= to: out += slope * in + cut; six parallel arrays.");
  numbers(table, "input_indices", [](auto& s) -> auto& { return s.input_indices; });
  numbers(table, "output_indices", [](auto& s) -> auto& { return s.output_indices; });
  numbers(table, "from_values", [](auto& s) -> auto& { return s.from_values; });
  numbers(table, "to_values", [](auto& s) -> auto& { return s.to_values; });
  numbers(table, "slope_values", [](auto& s) -> auto& { return s.slope_values; });
  numbers(table, "cut_values", [](auto& s) -> auto& { return s.cut_values; });

  auto psds = value_class<dna::Psds>(
      m, "Psds",
      "Correctives as a sparse matrix: rows[i] is driven by columns[i] times values[i].");
  numbers(psds, "rows", [](auto& s) -> auto& { return s.rows; });
  numbers(psds, "columns", [](auto& s) -> auto& { return s.columns; });
  numbers(psds, "values", [](auto& s) -> auto& { return s.values; });
}

void bind_behavior_structs(py::module_& m) {
  auto group = value_class<dna::JointGroup>(
      m, "JointGroup", "A dense matrix from controls (columns) to joint attributes (rows).");
  numbers(group, "lods", [](auto& s) -> auto& { return s.lods; });
  numbers(group, "input_indices", [](auto& s) -> auto& { return s.input_indices; });
  numbers(group, "output_indices", [](auto& s) -> auto& { return s.output_indices; });
  numbers(group, "joint_indices", [](auto& s) -> auto& { return s.joint_indices; });
  group.def_property(
      "values",
      [](dna::JointGroup& s) -> py::array {
        const auto cols = static_cast<py::ssize_t>(s.input_indices.size());
        const auto rows = static_cast<py::ssize_t>(s.output_indices.size());
        if (rows * cols != static_cast<py::ssize_t>(s.values.size())) return to_numpy(s.values);
        return read_only_view(s.values, {rows, cols}, {cols * 4, 4});
      },
      [](dna::JointGroup& s, const py::object& v) {
        s.values = from_python<float>(py::array::ensure(v).attr("ravel")(), "values");
      },
      "float32[rows, columns]");

  auto channels = value_class<dna::BlendShapeChannels>(m, "BlendShapeChannels",
                                                       "The control of each blend shape channel.");
  numbers(channels, "lods", [](auto& s) -> auto& { return s.lods; });
  numbers(channels, "input_indices", [](auto& s) -> auto& { return s.input_indices; });
  numbers(channels, "output_indices", [](auto& s) -> auto& { return s.output_indices; });

  auto maps = value_class<dna::AnimatedMaps>(m, "AnimatedMaps",
                                             "Controls to animated maps, by conditionals.");
  numbers(maps, "lods", [](auto& s) -> auto& { return s.lods; });
  part(maps, "conditionals", [](auto& s) -> auto& { return s.conditionals; });
}

void bind_meshes(py::module_& m) {
  auto target = value_class<dna::BlendShapeTarget>(m, "BlendShapeTarget",
                                                   "Sparse deltas of one channel on one mesh.");
  numbers(target, "deltas", [](auto& s) -> auto& { return s.deltas; });
  numbers(target, "vertex_indices", [](auto& s) -> auto& { return s.vertex_indices; });
  number(target, "blend_shape_channel_index",
         [](auto& s) -> auto& { return s.blend_shape_channel_index; });

  auto mesh = value_class<dna::Mesh>(
      m, "Mesh", "Geometry in file units; faces and skin weights are flat lists with offsets.");
  numbers(mesh, "positions", [](auto& s) -> auto& { return s.positions; });
  numbers(mesh, "texture_coordinates", [](auto& s) -> auto& { return s.texture_coordinates; });
  numbers(mesh, "normals", [](auto& s) -> auto& { return s.normals; });
  numbers(mesh, "layout_positions", [](auto& s) -> auto& { return s.layout_positions; });
  numbers(mesh, "layout_texture_coordinates",
          [](auto& s) -> auto& { return s.layout_texture_coordinates; });
  numbers(mesh, "layout_normals", [](auto& s) -> auto& { return s.layout_normals; });
  numbers(mesh, "face_offsets", [](auto& s) -> auto& { return s.face_offsets; });
  numbers(mesh, "face_layouts", [](auto& s) -> auto& { return s.face_layouts; });
  number(mesh, "maximum_influence_per_vertex",
         [](auto& s) -> auto& { return s.maximum_influence_per_vertex; });
  numbers(mesh, "skin_offsets", [](auto& s) -> auto& { return s.skin_offsets; });
  numbers(mesh, "skin_weights", [](auto& s) -> auto& { return s.skin_weights; });
  numbers(mesh, "skin_joint_indices", [](auto& s) -> auto& { return s.skin_joint_indices; });
  parts(mesh, "blend_shape_targets", [](auto& s) -> auto& { return s.blend_shape_targets; });
}

void bind_descriptor(DnaClass& c) {
  c.def_property_readonly("generation", [](const Dna& s) { return s.generation; });
  c.def_property_readonly(
      "version", [](const Dna& s) { return s.version; },
      "Minor version of the file it was read from: 8 is 2.8.");
  text(c, "name", [](auto& s) -> auto& { return s.descriptor.name; });
  choice(c, "archetype", kArchetypes, [](auto& s) -> auto& { return s.descriptor.archetype; });
  choice(c, "gender", kGenders, [](auto& s) -> auto& { return s.descriptor.gender; });
  number(c, "age", [](auto& s) -> auto& { return s.descriptor.age; });
  choice(c, "translation_unit", kTranslationUnits,
         [](auto& s) -> auto& { return s.descriptor.translation_unit; });
  choice(c, "rotation_unit", kRotationUnits,
         [](auto& s) -> auto& { return s.descriptor.rotation_unit; });
  number(c, "lod_count", [](auto& s) -> auto& { return s.descriptor.lod_count; });
  number(c, "max_lod", [](auto& s) -> auto& { return s.descriptor.max_lod; });
  text(c, "complexity", [](auto& s) -> auto& { return s.descriptor.complexity; });
  text(c, "db_name", [](auto& s) -> auto& { return s.descriptor.db_name; });
  choice(c, "rotation_sequence", kSequences,
         [](auto& s) -> auto& { return s.descriptor_ext.rotation_sequence; });
  choice(c, "face_winding_order", kWindings,
         [](auto& s) -> auto& { return s.descriptor_ext.face_winding_order; });
  c.def_property(
      "rotation_signs",
      [](const Dna& s) {
        const auto& v = s.descriptor_ext.rotation_sign;
        return py::make_tuple(v[0], v[1], v[2]);
      },
      [](Dna& s, const std::array<std::int32_t, 3>& v) { s.descriptor_ext.rotation_sign = v; });
  c.def_property(
      "coordinate_system",
      [](const Dna& s) {
        const auto& a = s.descriptor.coordinate_system;
        return py::make_tuple(word(kDirections, a.x_axis), word(kDirections, a.y_axis),
                              word(kDirections, a.z_axis));
      },
      [](Dna& s, const std::array<std::string, 3>& axes) {
        auto& a = s.descriptor.coordinate_system;
        a.x_axis = value_of_word<std::uint16_t>(kDirections, axes[0], "coordinate_system");
        a.y_axis = value_of_word<std::uint16_t>(kDirections, axes[1], "coordinate_system");
        a.z_axis = value_of_word<std::uint16_t>(kDirections, axes[2], "coordinate_system");
      },
      "Directions of the file's x, y and z axes, e.g. ('right', 'up', 'front').");
  c.def_property(
      "metadata",
      [](const Dna& s) {
        py::dict out;
        for (const auto& [key, value] : s.descriptor.metadata)
          out[to_python(key)] = to_python(value);
        return out;
      },
      [](Dna& s, const py::dict& d) {
        std::vector<std::pair<std::string, std::string>> out;
        for (const auto& [key, value] : d) {
          out.emplace_back(text_from_python(key, "metadata"), text_from_python(value, "metadata"));
        }
        s.descriptor.metadata = std::move(out);
      });
}

void bind_definition(DnaClass& c) {
  texts(c, "gui_control_names", [](auto& s) -> auto& { return s.definition.gui_control_names; });
  texts(c, "raw_control_names", [](auto& s) -> auto& { return s.definition.raw_control_names; });
  texts(c, "joint_names", [](auto& s) -> auto& { return s.definition.joint_names; });
  texts(c, "blend_shape_channel_names",
        [](auto& s) -> auto& { return s.definition.blend_shape_channel_names; });
  texts(c, "animated_map_names", [](auto& s) -> auto& { return s.definition.animated_map_names; });
  texts(c, "mesh_names", [](auto& s) -> auto& { return s.definition.mesh_names; });
  numbers(c, "joint_parents", [](auto& s) -> auto& { return s.definition.joint_parents; });
  numbers(c, "neutral_joint_translations",
          [](auto& s) -> auto& { return s.definition.neutral_joint_translations; });
  numbers(c, "neutral_joint_rotations",
          [](auto& s) -> auto& { return s.definition.neutral_joint_rotations; });
  lod_mapping(c, "lod_joint_mapping",
              [](auto& s) -> auto& { return s.definition.lod_joint_mapping; });
  lod_mapping(c, "lod_blend_shape_mapping",
              [](auto& s) -> auto& { return s.definition.lod_blend_shape_mapping; });
  lod_mapping(c, "lod_animated_map_mapping",
              [](auto& s) -> auto& { return s.definition.lod_animated_map_mapping; });
  lod_mapping(c, "lod_mesh_mapping",
              [](auto& s) -> auto& { return s.definition.lod_mesh_mapping; });
  c.def_property(
      "mesh_blend_shape_channel_mapping",
      [](const Dna& s) {
        const auto& from = s.definition.mesh_blend_shape_channel_mapping_from;
        const auto& to = s.definition.mesh_blend_shape_channel_mapping_to;
        py::array_t<std::uint16_t> pairs({static_cast<py::ssize_t>(from.size()), py::ssize_t{2}});
        for (std::size_t i = 0; i < from.size(); ++i) {
          pairs.mutable_data()[2 * i] = from[i];
          pairs.mutable_data()[2 * i + 1] = to[i];
        }
        return pairs;
      },
      [](Dna& s, const py::object& v) {
        py::array any = py::array::ensure(v);
        if (any && any.size() == 0)
          any = py::array_t<std::uint16_t>(std::vector<py::ssize_t>{0, 2});
        if (!any || any.ndim() != 2 || any.shape(1) != 2) {
          shape_error("mesh_blend_shape_channel_mapping", "(n, 2)", any);
        }
        const py::object transposed = any.attr("T");
        s.definition.mesh_blend_shape_channel_mapping_from =
            from_python<std::uint16_t>(transposed[py::int_(0)], "mesh_blend_shape_channel_mapping");
        s.definition.mesh_blend_shape_channel_mapping_to =
            from_python<std::uint16_t>(transposed[py::int_(1)], "mesh_blend_shape_channel_mapping");
      },
      "uint16[n, 2]: mesh, channel");
}

void bind_behavior_and_geometry(DnaClass& c) {
  number(c, "psd_count", [](auto& s) -> auto& { return s.behavior.psd_count; });
  part(c, "gui_to_raw", [](auto& s) -> auto& { return s.behavior.gui_to_raw; });
  part(c, "psds", [](auto& s) -> auto& { return s.behavior.psds; });
  number(c, "joint_row_count", [](auto& s) -> auto& { return s.behavior.joint_row_count; });
  number(c, "joint_column_count", [](auto& s) -> auto& { return s.behavior.joint_column_count; });
  parts(c, "joint_groups", [](auto& s) -> auto& { return s.behavior.joint_groups; });
  part(c, "blend_shape_channels", [](auto& s) -> auto& { return s.behavior.blend_shape_channels; });
  part(c, "animated_maps", [](auto& s) -> auto& { return s.behavior.animated_maps; });
  parts(c, "meshes", [](auto& s) -> auto& { return s.geometry.meshes; });
}

}  // namespace

void bind_dna(py::module_& m) {
  bind_structs(m);
  bind_behavior_structs(m);
  bind_meshes(m);
  bind_dna_extensions(m);
  DnaClass c = value_class<Dna>(m, "Dna", "A whole DNA file as a value; see risorius.load.");
  bind_descriptor(c);
  bind_definition(c);
  bind_behavior_and_geometry(c);
  bind_dna_extension_fields(c);
  bind_dna_files(m, c);
}

}  // namespace risorius::bindings
