// SPDX-License-Identifier: MIT
// Opens a face with the parser and compiler options of risorius_options.
#include "api/face.h"

#include <algorithm>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "api/errors.h"
#include "bytes/source.h"
#include "compile/compile.h"
#include "dna/file/parse.h"

namespace risorius::api {

namespace {

using core::ErrorCode;
using core::fail;
using core::ok;
using core::Result;
using core::Status;

constexpr std::uint32_t kFlags = RISORIUS_GEOMETRY | RISORIUS_TARGETS | RISORIUS_WITHOUT_NETWORKS |
                                 RISORIUS_WITHOUT_SOLVERS | RISORIUS_QUATERNIONS | RISORIUS_FLOAT16;

Status check(const risorius_options& options) {
  const auto bad = [](const char* where, const char* message) {
    return fail(ErrorCode::kInvalidArgument, where, message);
  };
  if ((options.flags & ~kFlags) != 0) return bad("options.flags", "a flag that is not known");
  const bool has_geometry = (options.flags & RISORIUS_GEOMETRY) != 0;
  if (!has_geometry && (options.flags & RISORIUS_TARGETS) != 0) {
    return bad("options.flags", "RISORIUS_TARGETS without RISORIUS_GEOMETRY");
  }
  if (!has_geometry && options.mesh_count > 0) {
    return bad("options.meshes", "meshes without RISORIUS_GEOMETRY");
  }
  if (options.lod_count > 0 && options.lods == nullptr) {
    return bad("options.lods", "a list was expected, found NULL");
  }
  std::vector<bool> asked(std::size_t{1} << 16, false);
  for (const std::uint16_t lod : std::span(options.lods, options.lod_count)) {
    if (asked[lod]) {
      return fail(ErrorCode::kInvalidArgument, "options.lods",
                  "each LOD once was expected, found " + std::to_string(lod) + " twice");
    }
    asked[lod] = true;
  }
  if (options.mesh_count > 0 && options.meshes == nullptr) {
    return bad("options.meshes", "a list was expected, found NULL");
  }
  for (const char* name : std::span(options.meshes, options.mesh_count)) {
    if (name == nullptr) return bad("options.meshes", "a name was expected, found NULL");
  }
  return ok();
}

dna::ParseOptions parse_options(const risorius_options& options) {
  dna::ParseOptions out;
  const auto has = [&](std::uint32_t flag) { return (options.flags & flag) != 0; };
  out.geometry = has(RISORIUS_GEOMETRY);
  out.blend_shapes = has(RISORIUS_TARGETS);
  out.machine_learned_behavior = !has(RISORIUS_WITHOUT_NETWORKS);
  out.rbf_behavior = !has(RISORIUS_WITHOUT_SOLVERS);
  out.unknown_layers = false;
  const std::span lods(options.lods, options.lod_count);
  out.lods.lods.assign(lods.begin(), lods.end());
  return out;
}

compile::CompileOptions compile_options(const risorius_options& options) {
  compile::CompileOptions out;
  if ((options.flags & RISORIUS_QUATERNIONS) != 0) out.rotation = compile::Rotation::kQuaternion;
  if ((options.flags & RISORIUS_FLOAT16) != 0) out.precision = compile::Precision::kFloat16;
  return out;
}

// Fails if the caller asks for a LOD that the file does not have. The parser does not fail if the
// file has at least one of the asked LODs: it ignores the missing ones, as the reader of the DNA
// format's own library does.
Status has_all_lods(const risorius_options& options, const dna::Dna& dna) {
  std::vector<std::uint16_t> asked(options.lods, options.lods + options.lod_count);
  const std::size_t found = dna.descriptor.lod_count;
  if (asked.size() <= found) return ok();
  std::ranges::sort(asked);
  return fail(ErrorCode::kInvalidArgument, "options.lods",
              "LODs of the file were expected, found " + std::to_string(asked[found]));
}

// Drops the geometry of meshes that the options do not name. If they name no mesh, keeps all.
Status keep_meshes(const risorius_options& options, dna::Dna& dna) {
  if (options.mesh_count == 0) return ok();
  const std::vector<std::string>& names = dna.definition.mesh_names;
  std::vector<bool> keep(dna.geometry.meshes.size(), false);
  for (const char* name : std::span(options.meshes, options.mesh_count)) {
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) {
      return fail(ErrorCode::kInvalidArgument, "options.meshes",
                  "no mesh of the LODs that are read is called " + std::string(name));
    }
    const auto index = static_cast<std::size_t>(found - names.begin());
    if (index < keep.size()) keep[index] = true;
  }
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (!keep[i]) dna.geometry.meshes[i] = {};
  }
  return ok();
}

// Drops the layers of the DNA file that are needed only to compile the rig.
void drop_behavior(dna::Dna& dna) {
  dna.behavior = {};
  dna.machine_learned_behavior = {};
  dna.machine_learned_behavior_ext = {};
  dna.rbf_behavior = {};
  dna.rbf_behavior_ext = {};
  dna.joint_behavior_metadata = {};
  dna.twist_swing_behavior = {};
}

Result<Face> make_face(bytes::Source& source, const risorius_options& options) {
  Result<dna::Dna> dna = dna::parse(source, parse_options(options));
  if (!dna) return std::move(dna).propagate();
  RISORIUS_TRY(has_all_lods(options, *dna));
  RISORIUS_TRY(keep_meshes(options, *dna));
  Result<rig::Rig> rig = compile::compile(*dna, compile_options(options));
  if (!rig) return std::move(rig).propagate();
  Face face{std::move(*rig), std::move(*dna), {}};
  drop_behavior(face.dna);
  face.gui_writes.resize(face.rig.raw_count);
  for (const rig::ConditionalRow& row : face.rig.gui_rows) face.gui_writes[row.output] = true;
  return face;
}

risorius_status open(bytes::Source& source, const char* path, const risorius_options& options,
                     risorius_face** face) {
  Result<Face> made = make_face(source, options);
  if (!made) return remember(made.error(), path);
  auto handle = std::make_unique<risorius_face>();
  handle->face = std::make_shared<const Face>(std::move(*made));
  *face = handle.release();
  return RISORIUS_OK;
}

const risorius_options& or_default(const risorius_options* options) {
  static constexpr risorius_options kDefault{};
  return options != nullptr ? *options : kDefault;
}

}  // namespace
}  // namespace risorius::api

using namespace risorius;

risorius_status risorius_open_file(const char* path, const risorius_options* options,
                                   risorius_face** face) {
  if (path == nullptr) return api::refuse("path", "a path was expected, found NULL");
  if (face == nullptr) return api::refuse("face", "a place was expected, found NULL");
  return api::guarded([&] {
    const risorius_options& wanted = api::or_default(options);
    if (const core::Status checked = api::check(wanted); !checked) {
      return api::remember(checked.error(), path);
    }
    const std::string bytes(path);
    auto source = bytes::open_file(std::u8string(bytes.begin(), bytes.end()));
    if (!source) return api::remember(source.error(), path);
    return api::open(**source, path, wanted, face);
  });
}

risorius_status risorius_open_memory(const void* bytes, size_t size,
                                     const risorius_options* options, risorius_face** face) {
  if (bytes == nullptr && size > 0) return api::refuse("bytes", "bytes were expected, found NULL");
  if (face == nullptr) return api::refuse("face", "a place was expected, found NULL");
  return api::guarded([&] {
    const risorius_options& wanted = api::or_default(options);
    if (const core::Status checked = api::check(wanted); !checked) {
      return api::remember(checked.error());
    }
    bytes::SpanSource source({static_cast<const std::uint8_t*>(bytes), size});
    return api::open(source, "", wanted, face);
  });
}

void risorius_close(risorius_face* face) { delete face; }
