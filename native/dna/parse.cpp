// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstring>

#include "core/byte_reader.h"
#include "dna/io.h"
#include "dna/layers.h"
#include "dna/parse_layers.h"

namespace risorius::dna {

namespace {

using core::ByteReader;
using core::ErrorCode;
using core::fail;
using core::Field;
using core::Result;
using core::Status;

struct IndexEntry {
  detail::LayerId id{};
  std::uint32_t version = 0, offset = 0, size = 0;
};

Status read_header(ByteReader& r, Dna& dna) {
  if (r.left() == 0) return fail(ErrorCode::kNotDna, "signature", "the file is empty", 0);
  char signature[3] = {};
  const std::uint64_t present = std::min<std::uint64_t>(3, r.left());
  for (std::uint64_t i = 0; i < present; ++i) signature[i] = static_cast<char>(r.u8());
  if (std::memcmp(signature, "DNA", static_cast<std::size_t>(present)) != 0) {
    return fail(ErrorCode::kNotDna, "signature",
                "not a DNA file: it does not begin with the letters DNA", 0);
  }
  if (r.left() < 4) {
    return fail(ErrorCode::kTruncated, "version", "the file is cut short inside its header",
                r.end());
  }
  dna.generation = r.u16();
  dna.version = r.u16();
  if (dna.generation != 2) {
    return fail(ErrorCode::kUnsupportedGeneration, "version",
                "a DNA file of generation " + std::to_string(dna.generation) + " (version " +
                    std::to_string(dna.generation) + "." + std::to_string(dna.version) +
                    "); generation 2 can be read",
                3);
  }
  return core::ok();
}

void read_behavior(ByteReader& r, Dna& dna) {
  detail::read_controls(r, dna.behavior);
  detail::read_joints(r, dna.behavior);
  detail::read_blend_shape_channels(r, dna.behavior);
  detail::read_animated_maps(r, dna.behavior);
}

// Version 2.1: eight offsets, no index, an end mark that is worth a warning when it is missing.
void parse_sections(ByteReader& r, Dna& dna, const ParseOptions& options) {
  const std::uint64_t file_end = r.end();
  std::uint32_t offsets[8];
  {
    Field field(r, "sections");
    for (std::uint32_t& offset : offsets) offset = r.u32();
  }
  const auto at = [&](int section) {
    return r.enter(offsets[section],
                   offsets[section] <= file_end ? file_end - offsets[section] : 0);
  };
  if (at(0)) dna.descriptor = detail::read_descriptor(r);
  if (options.definition && at(1)) dna.definition = detail::read_definition(r);
  if (options.behavior) {
    if (at(3)) detail::read_controls(r, dna.behavior);
    if (at(4)) detail::read_joints(r, dna.behavior);
    if (at(5)) detail::read_blend_shape_channels(r, dna.behavior);
    if (at(6)) detail::read_animated_maps(r, dna.behavior);
  }
  if (options.geometry && at(7)) {
    dna.geometry = detail::read_geometry(r, false, options.blend_shapes);
    const bool mark =
        !r.failed() && r.left() >= 3 && r.u8() == 'A' && r.u8() == 'N' && r.u8() == 'D';
    if (!mark && !r.failed()) {
      dna.warnings.push_back({"geometry", "the end mark AND is missing after the last mesh"});
    }
  }
  dna.index_order = {"desc", "defn", "bhvr", "geom"};
}

std::vector<IndexEntry> read_index(ByteReader& r) {
  Field field(r, "index");
  std::vector<IndexEntry> entries(r.count(16));
  for (IndexEntry& e : entries) {
    for (char& c : e.id) c = static_cast<char>(r.u8());
    e.version = r.u32();
    e.offset = r.u32();
    e.size = r.u32();
  }
  return entries;
}

const IndexEntry* find(const std::vector<IndexEntry>& entries, const char* id) {
  for (const IndexEntry& e : entries) {
    if (detail::is_known(e.id, e.version) && std::memcmp(e.id.data(), id, 4) == 0) return &e;
  }
  return nullptr;
}

void warn_about_rest(ByteReader& r, Dna& dna, const char* id) {
  if (!r.failed() && r.left() > 0) {
    dna.warnings.push_back(
        {id, std::to_string(r.left()) + " bytes at the end of the layer are not understood"});
  }
}

void parse_known_layers(ByteReader& r, const std::vector<IndexEntry>& entries, Dna& dna,
                        const ParseOptions& options) {
  // desc and defn first, wherever the index lists them: the others are read against them.
  const auto enter = [&](const char* id) {
    const IndexEntry* e = find(entries, id);
    return e != nullptr && r.enter(e->offset, e->size);
  };
  dna.descriptor.coordinate_system = {0, 0, 0};  // what a file without a descriptor is taken to say
  if (enter("desc")) {
    dna.descriptor = detail::read_descriptor(r);
    warn_about_rest(r, dna, "desc");
  }
  if (enter("dsce")) {
    // 16 bytes up to 2.7, 17 from 2.8 on, under one layer version: the size tells.
    dna.descriptor_ext = detail::read_descriptor_ext(r, r.left() >= 17);
    warn_about_rest(r, dna, "dsce");
  }
  if (options.definition && enter("defn")) {
    dna.definition = detail::read_definition(r);
    warn_about_rest(r, dna, "defn");
  }
  if (options.behavior && enter("bhvr")) {
    read_behavior(r, dna);
    warn_about_rest(r, dna, "bhvr");
  }
  if (options.geometry && enter("geom")) {
    dna.geometry = detail::read_geometry(r, true, options.blend_shapes);
    warn_about_rest(r, dna, "geom");
  }
}

void parse_indexed(ByteReader& r, Dna& dna, const ParseOptions& options) {
  const std::vector<IndexEntry> entries = read_index(r);
  if (r.failed()) return;
  parse_known_layers(r, entries, dna, options);
  for (std::size_t i = 0; i < entries.size() && !r.failed(); ++i) {
    const IndexEntry& e = entries[i];
    const std::string id(e.id.begin(), e.id.end());
    const bool known = detail::is_known(e.id, e.version);
    if (known && detail::is_typed(e.id)) {
      if (std::find(dna.index_order.begin(), dna.index_order.end(), id) == dna.index_order.end()) {
        dna.index_order.push_back(id);
      } else {
        dna.warnings.push_back({id, "the layer is listed twice, the first one is used"});
      }
      continue;
    }
    if (known ? !options.extensions : !options.unknown_layers) continue;
    Field field(r, "layers", static_cast<std::int64_t>(i));
    if (!r.enter(e.offset, e.size)) return;
    dna.opaque_layers.push_back(
        {e.id, e.version, static_cast<std::uint32_t>(dna.index_order.size()), r.bytes(e.size)});
    dna.index_order.push_back("");  // an opaque layer's place
  }
}

}  // namespace

Result<Dna> parse(core::Source& source, const ParseOptions& options) {
  Dna dna;
  ByteReader r(source);
  if (Status header = read_header(r, dna); !header) return std::move(header).propagate();
  if (dna.version == 1) {
    parse_sections(r, dna, options);
  } else {
    parse_indexed(r, dna, options);
  }
  if (r.failed()) return r.take_error();
  if (Status valid = validate(dna, dna.warnings); !valid) return std::move(valid).propagate();
  return dna;
}

}  // namespace risorius::dna
