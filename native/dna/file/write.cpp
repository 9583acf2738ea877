// SPDX-License-Identifier: MIT
// Writes a Dna as the bytes of a DNA file of version 2.1 to 2.8.
#include "dna/file/write.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <string_view>

#include "bytes/byte_writer.h"
#include "dna/controls.h"
#include "dna/file/layer_writer.h"
#include "dna/layers.h"
#include "dna/validate.h"

namespace risorius::dna {

namespace {

using bytes::ByteWriter;
using core::ErrorCode;
using core::fail;
using core::Result;
using detail::LayerWriter;

void write_header(ByteWriter& w, std::uint16_t minor) {
  for (const char c : {'D', 'N', 'A'}) w.u8(static_cast<std::uint8_t>(c));
  w.u16(2);
  w.u16(minor);
}

void write_layer(ByteWriter& w, const Dna& dna, std::string_view wanted, std::uint16_t minor) {
  LayerWriter layer(w);
  detail::for_each_layer(dna, [&](std::string_view id, const char*, const auto& value) {
    if (id == wanted) describe(layer, value);
  });
  if (wanted == "dsce" && minor >= 8) w.u8(dna.descriptor_ext.face_winding_order);
}

std::vector<std::uint8_t> write_sections(const Dna& dna) {
  ByteWriter w;
  LayerWriter layer(w);
  layer.mesh_sizes = false;
  write_header(w, 1);
  const std::size_t table = w.position();
  for (int i = 0; i < 8; ++i) w.u32(0);
  const auto begin = [&](std::size_t section) {
    w.patch_u32(table + 4 * section, static_cast<std::uint32_t>(w.position()));
  };
  begin(0);
  describe(layer, dna.descriptor);
  begin(1);
  describe(layer, dna.definition);
  begin(2);
  begin(3);
  detail::describe_controls(layer, dna.behavior);
  begin(4);
  detail::describe_joints(layer, dna.behavior);
  begin(5);
  layer.field("blend_shape_channels", dna.behavior.blend_shape_channels);
  begin(6);
  layer.field("animated_maps", dna.behavior.animated_maps);
  begin(7);
  describe(layer, dna.geometry);
  for (const char c : {'A', 'N', 'D'}) w.u8(static_cast<std::uint8_t>(c));
  return w.take();
}

// A layer to write. Exactly one of `known` and `unknown` is set.
struct PlannedLayer {
  const detail::KnownLayer* known = nullptr;
  const UnknownLayer* unknown = nullptr;
};

// The layers to write: first the layers of the source's index in its order, then the layers of the
// target version that the source lacks, then layers with content that neither of them has (only
// with options.newer_layers).
std::vector<PlannedLayer> plan_layers(const Dna& dna, const WriteOptions& options) {
  std::vector<PlannedLayer> plan;
  std::size_t next_unknown = 0;
  const auto add_known = [&](const detail::KnownLayer& layer) {
    const bool there = std::ranges::find(plan, &layer, &PlannedLayer::known) != plan.end();
    if (!there) plan.push_back({&layer, nullptr});
  };
  const auto add_unknown = [&] {
    const UnknownLayer& layer = dna.unknown_layers[next_unknown++];
    if (options.newer_layers) plan.push_back({nullptr, &layer});
  };
  for (const std::string& id : dna.index_order) {
    if (id.empty() && next_unknown < dna.unknown_layers.size()) add_unknown();
    for (const detail::KnownLayer& layer : detail::kLayers) {
      const bool held = layer.since_minor <= options.minor || options.newer_layers;
      if (id == layer.id && held) add_known(layer);
    }
  }
  while (next_unknown < dna.unknown_layers.size()) add_unknown();
  for (const detail::KnownLayer& layer : detail::kLayers) {
    if (layer.since_minor <= options.minor) add_known(layer);
  }
  // Layers with content that are neither in the source's index nor in the target version.
  detail::for_each_layer(dna, [&](std::string_view id, const char*, const auto& value) {
    if (value == std::remove_cvref_t<decltype(value)>{} || !options.newer_layers) return;
    for (const detail::KnownLayer& layer : detail::kLayers) {
      if (id == layer.id) add_known(layer);
    }
  });
  return plan;
}

std::vector<std::uint8_t> write_indexed(const Dna& dna, const WriteOptions& options) {
  const std::vector<PlannedLayer> plan = plan_layers(dna, options);
  ByteWriter w;
  write_header(w, options.minor);
  w.u32(static_cast<std::uint32_t>(plan.size()));
  const std::size_t table = w.position();
  for (std::size_t i = 0; i < plan.size() * 4; ++i) w.u32(0);
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const PlannedLayer& p = plan[i];
    const std::size_t begin = w.position();
    if (p.unknown != nullptr) {
      w.raw(p.unknown->bytes);
    } else {
      write_layer(w, dna, p.known->id, options.minor);
    }
    const char* letters = p.unknown != nullptr ? p.unknown->id.data() : p.known->id;
    std::uint32_t id = 0;
    for (int c = 0; c < 4; ++c) id = (id << 8) | static_cast<std::uint8_t>(letters[c]);
    const std::size_t entry = table + 16 * i;
    w.patch_u32(entry, id);
    w.patch_u32(entry + 4, p.unknown != nullptr ? p.unknown->version : p.known->version);
    w.patch_u32(entry + 8, static_cast<std::uint32_t>(begin));
    w.patch_u32(entry + 12, static_cast<std::uint32_t>(w.position() - begin));
  }
  return w.take();
}

// Whether a version can store a layer. 2.1 stores the layers of 2.2 too, but without an index.
bool holds(std::uint16_t minor, const detail::KnownLayer& layer) {
  return layer.since_minor <= std::max<std::uint16_t>(minor, 2);
}

// Ids of the layers with content that the version cannot store.
std::vector<std::string> newer_layers(const Dna& dna, std::uint16_t minor) {
  std::vector<std::string> ids;
  detail::for_each_layer(dna, [&](std::string_view id, const char*, const auto& value) {
    if (value == std::remove_cvref_t<decltype(value)>{}) return;
    for (const detail::KnownLayer& layer : detail::kLayers) {
      if (id == layer.id && !holds(minor, layer)) ids.emplace_back(id);
    }
  });
  return ids;
}

// Warns of each layer with content that the version does not know, of unknown layers if they are
// left out, and of a face winding order that the version cannot store. In: kept  true: layers that
// the version does not know are written nevertheless; false: they are left out
void warn_of_losses(const Dna& dna, const WriteOptions& options, bool kept,
                    std::vector<Warning>& warnings) {
  const std::string version = "version 2." + std::to_string(options.minor);
  const auto warn = [&](const std::string& id) {
    warnings.push_back({id, version + " has no layer " + id +
                                (kept ? "; it is written all the same, for readers that know it"
                                      : "; it is left out")});
  };
  for (const std::string& id : newer_layers(dna, options.minor)) warn(id);
  if (options.minor < 8 && dna.descriptor_ext.face_winding_order != 0) {
    warnings.push_back({"descriptor_ext.face_winding_order",
                        version + " cannot say that faces are clockwise (dsce)"});
  }
  if (kept) return;
  for (const UnknownLayer& layer : dna.unknown_layers) {
    warn(std::string(layer.id.begin(), layer.id.end()));
  }
}

// The face without the layers that this version cannot store, and without everything that reads
// the controls of these layers or of layers that were not loaded. nullopt: nothing has to be left
// out. In: kept  true: layers that the version does not know are written nevertheless
Result<std::optional<Dna>> reduced(const Dna& dna, std::uint16_t minor, bool kept,
                                   std::vector<Warning>& warnings) {
  const std::vector<std::string> lost =
      kept ? std::vector<std::string>{} : newer_layers(dna, minor);
  if (lost.empty() && dna.unread_controls == UnreadControls{}) return std::optional<Dna>();
  Dna out = dna;
  for (const std::string& id : lost) detail::drop_layer(id, out);
  auto dropped = detail::forget_unread_controls(out);
  if (!dropped) return std::move(dropped).propagate();
  if (*dropped > 0) {
    warnings.push_back({"behavior", std::to_string(*dropped) +
                                        " matrix columns, entries and correctives went with the "
                                        "controls that drove them"});
  }
  std::vector<Warning> oddities;
  RISORIUS_TRY(validate(out, oddities));
  return std::optional<Dna>(std::move(out));
}

}  // namespace

Result<std::vector<std::uint8_t>> write(const Dna& dna, const WriteOptions& options,
                                        std::vector<Warning>& warnings) {
  if (options.minor < 1 || options.minor > 8) {
    return fail(
        ErrorCode::kInvalidArgument, "version",
        "version 2." + std::to_string(options.minor) + " cannot be written, 2.1 to 2.8 can");
  }
  std::vector<Warning> oddities;
  RISORIUS_TRY(validate(dna, oddities));
  const bool kept = options.newer_layers && options.minor > 1;
  warn_of_losses(dna, options, kept, warnings);
  auto smaller = reduced(dna, options.minor, kept, warnings);
  if (!smaller) return std::move(smaller).propagate();
  const Dna& whole = smaller->has_value() ? **smaller : dna;
  std::vector<std::uint8_t> bytes =
      options.minor == 1 ? write_sections(whole) : write_indexed(whole, options);
  if (bytes.size() > std::numeric_limits<std::uint32_t>::max()) {
    return fail(ErrorCode::kLimitExceeded, "", "the file would pass the format's 4 GiB");
  }
  return bytes;
}

}  // namespace risorius::dna
