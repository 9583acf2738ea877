// SPDX-License-Identifier: MIT
// The contents of a face: names, joints, meshes and their shapes. All pointers that these functions
// give point into the face.
#include <span>
#include <string>
#include <vector>

#include "api/errors.h"
#include "api/face.h"

namespace risorius::api {

namespace {

// The mapping from LODs to the items of a list: joints, blend shape channels, animated maps or
// meshes. Null for other lists.
const dna::LodMapping* lods_of(const dna::Definition& d, risorius_list list) {
  switch (list) {
    case RISORIUS_JOINTS:
      return &d.lod_joint_mapping;
    case RISORIUS_SHAPES:
      return &d.lod_blend_shape_mapping;
    case RISORIUS_MAPS:
      return &d.lod_animated_map_mapping;
    case RISORIUS_MESHES:
      return &d.lod_mesh_mapping;
    default:
      return nullptr;
  }
}

const std::vector<std::string>* names_of(const dna::Definition& d, risorius_list list) {
  switch (list) {
    case RISORIUS_RAW_CONTROLS:
      return &d.raw_control_names;
    case RISORIUS_GUI_CONTROLS:
      return &d.gui_control_names;
    case RISORIUS_JOINTS:
      return &d.joint_names;
    case RISORIUS_SHAPES:
      return &d.blend_shape_channel_names;
    case RISORIUS_MAPS:
      return &d.animated_map_names;
    case RISORIUS_MESHES:
      return &d.mesh_names;
    default:
      return nullptr;
  }
}

risorius_status refuse_index(const char* argument, std::uint32_t found, std::size_t count) {
  return guarded([&] {
    return refuse(argument, "a number below " + std::to_string(count) + " was expected, found " +
                                std::to_string(found));
  });
}

// A mesh of a face; a mesh whose geometry was not read is empty. Null, with the last error set, if
// the face is null or has no mesh with this index.
const dna::Mesh* mesh_of(const risorius_face* face, std::uint32_t index) {
  if (face == nullptr) return (void)refuse("face", "a face was expected, found NULL"), nullptr;
  const std::size_t count = face->face->dna.definition.mesh_names.size();
  if (index >= count) return (void)refuse_index("mesh", index, count), nullptr;
  static const dna::Mesh kNotRead;
  const auto& meshes = face->face->dna.geometry.meshes;
  return index < meshes.size() ? &meshes[index] : &kNotRead;
}

template <class T>
std::uint32_t size_of(const T& list) {
  return static_cast<std::uint32_t>(list.size());
}

std::uint32_t elements_of_offsets(const core::Array<std::uint32_t>& offsets) {
  return offsets.empty() ? 0 : size_of(offsets) - 1;
}

}  // namespace
}  // namespace risorius::api

using namespace risorius;

uint32_t risorius_count(const risorius_face* face, risorius_list list) {
  if (face == nullptr) return (void)api::refuse("face", "a face was expected, found NULL"), 0;
  if (list == RISORIUS_LODS) return face->face->rig.lod_count;
  if (const auto* names = api::names_of(face->face->dna.definition, list)) {
    return api::size_of(*names);
  }
  return (void)api::refuse("list",
                           "a list from RISORIUS_RAW_CONTROLS to RISORIUS_LODS was expected"),
         0;
}

const char* risorius_name(const risorius_face* face, risorius_list list, uint32_t index) {
  if (face == nullptr) return (void)api::refuse("face", "a face was expected, found NULL"), nullptr;
  const auto* names = api::names_of(face->face->dna.definition, list);
  if (names == nullptr) return (void)api::refuse("list", "a list with names was expected"), nullptr;
  if (index < names->size()) return (*names)[index].c_str();
  return (void)api::refuse_index("index", index, names->size()), nullptr;
}

risorius_status risorius_lod_items(const risorius_face* face, risorius_list list, uint32_t lod,
                                   const uint16_t** items, uint32_t* count) {
  if (face == nullptr) return api::refuse("face", "a face was expected, found NULL");
  if (items == nullptr) return api::refuse("items", "a place was expected, found NULL");
  if (count == nullptr) return api::refuse("count", "a place was expected, found NULL");
  const dna::LodMapping* mapping = api::lods_of(face->face->dna.definition, list);
  if (mapping == nullptr) return api::refuse("list", "a list that LODs differ in was expected");
  const std::uint32_t lods = face->face->rig.lod_count;
  if (lod >= lods) return api::refuse_index("lod", lod, lods);
  // A LOD without a row in the mapping has no items of this list.
  const bool is_listed = lod < mapping->lods.size() && mapping->lods[lod] < mapping->rows.size();
  const core::Array<std::uint16_t> none;
  const auto& row = is_listed ? mapping->rows[mapping->lods[lod]] : none;
  *items = row.data();
  *count = api::size_of(row);
  return RISORIUS_OK;
}

risorius_status risorius_get_skeleton(const risorius_face* face, risorius_skeleton* skeleton) {
  if (face == nullptr) return api::refuse("face", "a face was expected, found NULL");
  if (skeleton == nullptr) return api::refuse("skeleton", "a place was expected, found NULL");
  const rig::Rig& rig = face->face->rig;
  const dna::Descriptor& d = face->face->dna.descriptor;
  const dna::DescriptorExt& ext = face->face->dna.descriptor_ext;
  skeleton->joint_count = rig.joint_count;
  skeleton->stride = rig.joint_stride;
  skeleton->parents = face->face->dna.definition.joint_parents.data();
  skeleton->neutral = rig.neutral_joints.data();
  skeleton->translation_unit = d.translation_unit;
  skeleton->rotation_unit = d.rotation_unit;
  skeleton->axes[0] = d.coordinate_system.x_axis;
  skeleton->axes[1] = d.coordinate_system.y_axis;
  skeleton->axes[2] = d.coordinate_system.z_axis;
  skeleton->rotation_order = ext.rotation_sequence;
  for (std::size_t i = 0; i < 3; ++i) skeleton->rotation_signs[i] = ext.rotation_sign[i];
  return RISORIUS_OK;
}

risorius_status risorius_get_mesh(const risorius_face* face, uint32_t mesh, risorius_mesh* out) {
  if (out == nullptr) return api::refuse("out", "a place was expected, found NULL");
  const dna::Mesh* m = api::mesh_of(face, mesh);
  if (m == nullptr) return RISORIUS_BAD_ARGUMENT;
  out->vertex_count = static_cast<std::uint32_t>(m->positions.count());
  out->uv_count = static_cast<std::uint32_t>(m->texture_coordinates.count());
  out->normal_count = static_cast<std::uint32_t>(m->normals.count());
  out->corner_count = api::size_of(m->layout_positions);
  out->polygon_count = api::elements_of_offsets(m->face_offsets);
  out->target_count = api::size_of(m->blend_shape_targets);
  out->positions = m->positions.values.data();
  out->uvs = m->texture_coordinates.values.data();
  out->normals = m->normals.values.data();
  out->corner_positions = m->layout_positions.data();
  out->corner_uvs = m->layout_texture_coordinates.data();
  out->corner_normals = m->layout_normals.data();
  out->polygon_begins = m->face_offsets.data();
  out->polygon_corners = m->face_layouts.data();
  out->skin_begins = m->skin_offsets.data();
  out->skin_weights = m->skin_weights.data();
  out->skin_joints = m->skin_joint_indices.data();
  return RISORIUS_OK;
}

risorius_status risorius_get_target(const risorius_face* face, uint32_t mesh, uint32_t target,
                                    risorius_target* out) {
  if (out == nullptr) return api::refuse("out", "a place was expected, found NULL");
  const dna::Mesh* m = api::mesh_of(face, mesh);
  if (m == nullptr) return RISORIUS_BAD_ARGUMENT;
  if (target >= m->blend_shape_targets.size()) {
    return api::refuse_index("target", target, m->blend_shape_targets.size());
  }
  const dna::BlendShapeTarget& t = m->blend_shape_targets[target];
  out->shape = t.blend_shape_channel_index;
  out->count = api::size_of(t.vertex_indices);
  out->vertices = t.vertex_indices.data();
  out->deltas = t.deltas.values.data();
  return RISORIUS_OK;
}
