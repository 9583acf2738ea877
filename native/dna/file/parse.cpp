// SPDX-License-Identifier: MIT
// Parses a DNA file: its header, then the layers of the index (2.2 and later) or the sections whose
// offsets follow the header (2.1).
#include "dna/file/parse.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <set>
#include <utility>

#include "bytes/byte_reader.h"
#include "dna/file/layer_reader.h"
#include "dna/layers.h"

namespace risorius::dna {

namespace {

using bytes::ByteReader;
using bytes::Field;
using core::Error;
using core::ErrorCode;
using core::fail;
using core::Result;
using core::Status;
using detail::LayerReader;

constexpr std::uint64_t kIndexOffset = 7;  // behind signature and version

struct IndexEntry {
  detail::LayerId id{};
  std::uint32_t version = 0, offset = 0, size = 0;
  const detail::KnownLayer* known = nullptr;
  bool repeated = false;  // a known layer that the index listed before

  std::string name() const { return {id.begin(), id.end()}; }
  std::uint64_t end() const { return std::uint64_t{offset} + size; }
};

Status read_header(ByteReader& r, const Limits& limits, Dna& dna) {
  if (r.left() == 0) return fail(ErrorCode::kNotDna, "signature", "the file is empty", 0);
  if (r.left() > limits.max_bytes) {
    return fail(ErrorCode::kLimitExceeded, "",
                "the file has " + std::to_string(r.left()) + " bytes, the limit is " +
                    std::to_string(limits.max_bytes),
                0);
  }
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

// Reads a file; each object is used for one run. If `findings` is set, as by check(), the error of
// a layer is added to it and the next layer is read; otherwise the first error ends the reading.
class Parser {
 public:
  Parser(bytes::Source& source, const ParseOptions& options, detail::Places* places,
         std::vector<Finding>* findings)
      : file_size_(source.size()), r_(source), layer_(r_), options_(options), findings_(findings) {
    r_.set_max_count(options.limits.max_count);
    layer_.blend_shapes = options.blend_shapes;
    layer_.places = places;
  }

  Result<Dna> run() {
    RISORIUS_TRY(read_header(r_, options_.limits, dna_));
    if (dna_.version == 1) {
      parse_sections();
    } else {
      parse_indexed();
    }
    if (r_.failed()) return r_.take_error();
    if (error_) return core::Unexpected{*error_};
    if (layer_.plan != nullptr) {
      RISORIUS_TRY(detail::apply(*plan_, true, dna_));
    }
    return std::move(dna_);
  }
  detail::Known known() const { return layer_.known; }

 private:
  using Body = void (Parser::*)();

  // Reads one layer, or one section of a 2.1 file, by calling `body`.
  // In:  offset, size  place of the layer's bytes in the file
  // Out: false if parsing must stop
  template <class Read>
  bool read(const char* name, std::uint64_t offset, std::uint64_t size, Read body) {
    if (r_.failed() || error_) return false;
    {
      Field field(r_, name);
      r_.read_small();
      layer_.note(std::min(offset, file_size_));
      if (r_.enter(offset, size)) body();
    }
    if (!r_.failed()) return true;
    if (findings_ == nullptr) return false;
    findings_->push_back({true, r_.error()});
    r_.clear_error();
    return true;
  }

  template <class T>
  auto describe_into(T& layer) {
    return [this, &layer] { describe(layer_, layer); };
  }

  // Makes the plan that carries out the LOD selection. It needs a valid definition, which is
  // therefore checked first.
  void make_plan() {
    if (options_.lods.everything() || r_.failed() || error_) return;
    std::vector<Warning> unused;
    if (Status valid = validate(dna_, unused); !valid) {
      error_ = valid.error();
      return;
    }
    auto plan = detail::plan_lods(dna_.descriptor, dna_.definition, options_.lods);
    if (!plan) {
      error_ = plan.error();
      return;
    }
    plan_ = std::move(*plan);
    if (plan_) layer_.plan = &*plan_;
  }

  // ---- 2.1: eight offsets, no index; a missing end mark is only a warning
  void parse_sections() {
    layer_.mesh_sizes = false;
    const std::uint64_t file_end = r_.end();
    std::uint32_t offsets[8];
    {
      Field field(r_, "sections");
      for (std::uint32_t& offset : offsets) offset = r_.u32();
    }
    std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges{{0, r_.position()}};
    // Version 2.1 stores no sizes of sections: a section ends where the next one begins. With the
    // ends known, unwanted sections need not be read.
    const auto end_of = [&](std::uint64_t begin) {
      std::uint64_t end = std::max(begin, file_end);
      for (const std::uint64_t other : offsets) {
        if (other > begin) end = std::min(end, other);
      }
      return end;
    };
    const auto section = [&](int i, const char* name, auto body) {
      const bool good = read(name, offsets[i], end_of(offsets[i]) - offsets[i], body);
      ranges.emplace_back(offsets[i], r_.position());
      return good;
    };
    dna_.index_order = {"desc", "defn", "bhvr", "geom"};
    if (!section(0, "descriptor", describe_into(dna_.descriptor))) return;
    if (options_.definition && !section(1, "definition", describe_into(dna_.definition))) return;
    make_plan();
    Behavior& b = dna_.behavior;
    if (options_.behavior) {
      section(3, "behavior", [&] { detail::describe_controls(layer_, b); });
      section(4, "behavior", [&] { detail::describe_joints(layer_, b); });
      section(5, "behavior", [&] { layer_.field("blend_shape_channels", b.blend_shape_channels); });
      section(6, "behavior", [&] { layer_.field("animated_maps", b.animated_maps); });
    } else if (options_.definition) {
      read("behavior", offsets[3], 2, [&] { layer_.field("psd_count", b.psd_count); });
      dna_.unread_controls.psd = std::exchange(b.psd_count, std::uint16_t{0});
    }
    if (options_.geometry) {
      section(7, "geometry", describe_into(dna_.geometry));
      check_end_mark();
    }
    check_sections(ranges);
  }

  void check_end_mark() {
    if (r_.failed() || error_) return;
    const std::uint64_t at = r_.position();
    const bool mark = r_.left() >= 3 && r_.u8() == 'A' && r_.u8() == 'N' && r_.u8() == 'D';
    if (!mark) warn("geometry", "the end mark AND is missing after the last mesh", at);
  }

  void check_sections(std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges) {
    std::ranges::sort(ranges);
    for (std::size_t i = 1; i < ranges.size() && !r_.failed() && !error_; ++i) {
      if (ranges[i].first >= ranges[i - 1].second) continue;
      refuse({ErrorCode::kInvalidValue, ranges[i].first, "sections",
              "two sections overlap: one begins here, another ends at byte " +
                  std::to_string(ranges[i - 1].second)});
    }
  }

  // ---- 2.2 and later: an index of layers
  void parse_indexed() {
    read_index();
    if (r_.failed() || error_) return;
    // desc and defn are read first, wherever the index lists them, because the other layers refer
    // to them. mlbe is read before mlbh, because its operations name the networks that are needed.
    dna_.descriptor.coordinate_system = {0, 0, 0};  // the values of a file without a descriptor
    const bool go_on =
        known("desc", "descriptor", true, describe_into(dna_.descriptor)) &&
        known("dsce", "descriptor_ext", true, [this] { read_descriptor_ext(); }) &&
        known("defn", "definition", options_.definition, describe_into(dna_.definition));
    if (!go_on) return;
    make_plan();
    const ParseOptions& o = options_;
    MachineLearnedBehavior& ml = dna_.machine_learned_behavior;
    MachineLearnedBehaviorExt& operations = dna_.machine_learned_behavior_ext;
    layer_.operations = &operations;
    known("bhvr", "behavior", o.behavior, describe_into(dna_.behavior));
    known("geom", "geometry", o.geometry, describe_into(dna_.geometry));
    known("mlbe", "machine_learned_behavior_ext", o.machine_learned_behavior,
          describe_into(operations));
    known("mlbh", "machine_learned_behavior", o.machine_learned_behavior, describe_into(ml));
    layer_.operations = nullptr;
    known("rbfb", "rbf_behavior", o.rbf_behavior, describe_into(dna_.rbf_behavior));
    known("rbfe", "rbf_behavior_ext", o.rbf_behavior, describe_into(dna_.rbf_behavior_ext));
    known("jbmd", "joint_behavior_metadata", o.joint_behavior_metadata,
          describe_into(dna_.joint_behavior_metadata));
    known("twsw", "twist_swing_behavior", o.twist_swing_behavior,
          describe_into(dna_.twist_swing_behavior));
    if (o.definition) count_unread_controls();
    read_unknown_layers();
  }

  void read_index() {
    Field field(r_, "index");
    const std::uint64_t at = r_.position();
    const std::uint32_t n = r_.count(16);
    if (n > options_.limits.max_layers) {
      r_.fail_at(at, ErrorCode::kLimitExceeded,
                 std::to_string(n) + " layers, the limit is " +
                     std::to_string(options_.limits.max_layers));
      return;
    }
    entries_.resize(n);
    for (IndexEntry& e : entries_) {
      for (char& c : e.id) c = static_cast<char>(r_.u8());
      e.version = r_.u32();
      e.offset = r_.u32();
      e.size = r_.u32();
      e.known = detail::find_layer(e.id, e.version);
    }
    check_ranges(r_.position());
    order_index(at);
  }

  // Refuses layers that overlap, because with them a small file could have many layers of the same
  // bytes, and would need much more memory than its size.
  void check_ranges(std::uint64_t index_end) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      if (entries_[i].size > 0) order.push_back(i);
    }
    std::ranges::sort(order, {}, [&](std::size_t i) { return entries_[i].offset; });
    std::uint64_t taken = index_end;
    std::string owner = "the index";
    for (const std::size_t i : order) {
      const IndexEntry& e = entries_[i];
      if (e.offset < taken) {
        refuse({ErrorCode::kInvalidValue, kIndexOffset + 4 + 16 * std::uint64_t{i},
                "index[" + std::to_string(i) + "]",
                "layer " + e.name() + " begins at byte " + std::to_string(e.offset) + ", but " +
                    owner + " ends at byte " + std::to_string(taken)});
        return;
      }
      taken = e.end();
      owner = "layer " + e.name();
    }
  }

  void order_index(std::uint64_t at) {
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      IndexEntry& e = entries_[i];
      if (e.known == nullptr) {
        if (options_.unknown_layers) dna_.index_order.emplace_back();
        continue;
      }
      e.repeated = std::ranges::find(dna_.index_order, e.name()) != dna_.index_order.end();
      if (e.repeated) {
        warn("index[" + std::to_string(i) + "]",
             "layer " + e.name() + " is listed twice, the first one is used", at + 4 + 16 * i);
      } else {
        dna_.index_order.push_back(e.name());
      }
    }
  }

  const IndexEntry* find(const char* id) const {
    for (const IndexEntry& e : entries_) {
      if (e.known != nullptr && !e.repeated && std::memcmp(e.id.data(), id, 4) == 0) return &e;
    }
    return nullptr;
  }

  template <class Read>
  bool known(const char* id, const char* name, bool wanted, Read body) {
    const IndexEntry* e = wanted ? find(id) : nullptr;
    if (e == nullptr) {
      Field field(r_, name);
      layer_.note(kIndexOffset);  // the position of the index that lacks the layer
      return true;
    }
    return read(name, e->offset, e->size, [&] {
      body();
      if (!r_.failed() && r_.left() > 0) {
        warn(name, std::to_string(r_.left()) + " bytes at the end of the layer are not understood",
             r_.position());
      }
    });
  }

  // Layer dsce has 16 bytes up to 2.7 and 17 or more from 2.8 on, with the same layer version, so
  // that only the size tells whether it has a winding order.
  void read_descriptor_ext() {
    const bool has_winding = r_.left() >= 17;
    describe(layer_, dna_.descriptor_ext);
    if (has_winding) layer_.field("face_winding_order", dna_.descriptor_ext.face_winding_order);
  }

  // Reads, from layers that are not loaded, only how many controls they have, because control
  // indices in other layers still count them.
  void count_unread_controls() {
    const auto names = [&](const char* id, bool loaded, std::uint32_t& count) {
      const IndexEntry* e = loaded ? nullptr : find(id);
      if (e == nullptr || e->size < 4) return;
      read(id, e->offset, 4, [&] {
        count = r_.u32();
        if (count <= (e->size - 4) / 4) return;
        r_.fail_at(e->offset, ErrorCode::kInvalidCount,
                   std::to_string(count) + " names need more bytes than the layer has");
      });
    };
    const IndexEntry* bhvr = options_.behavior ? nullptr : find("bhvr");
    if (bhvr != nullptr) {
      read("behavior", bhvr->offset, std::min(bhvr->size, 2u),
           [&] { layer_.field("psd_count", dna_.behavior.psd_count); });
      dna_.unread_controls.psd = std::exchange(dna_.behavior.psd_count, std::uint16_t{0});
    }
    names("mlbh", options_.machine_learned_behavior, dna_.unread_controls.ml);
    names("rbfe", options_.rbf_behavior, dna_.unread_controls.rbf_pose);
    const IndexEntry* rbfb = find("rbfb");
    if (options_.rbf_behavior || dna_.unread_controls.rbf_pose > 0 || rbfb == nullptr) return;
    read("rbf_behavior", rbfb->offset, rbfb->size, [&] {  // in 2.4 each pose is a control
      LodMapping mapping;
      layer_.field("lod_solver_mapping", mapping);
      const std::uint32_t solvers = r_.count(4);
      for (std::uint32_t i = 0; i < solvers && !r_.failed(); ++i) r_.skip(r_.count(1));
      dna_.unread_controls.rbf_pose = r_.count(8);
    });
  }

  void read_unknown_layers() {
    for (std::size_t i = 0; options_.unknown_layers && i < entries_.size(); ++i) {
      const IndexEntry& e = entries_[i];
      if (e.known != nullptr) continue;
      const std::string name = "index[" + std::to_string(i) + "]";
      const bool good = read(name.c_str(), e.offset, e.size, [&] {
        dna_.unknown_layers.push_back({e.id, e.version, r_.bytes(e.size)});
      });
      if (!good) return;
    }
  }

  void warn(std::string where, std::string message, std::uint64_t offset) {
    dna_.warnings.push_back({std::move(where), std::move(message), offset});
  }
  void refuse(Error error) {
    if (findings_ != nullptr) {
      findings_->push_back({true, std::move(error)});
    } else if (!error_) {
      error_ = std::move(error);
    }
  }

  std::uint64_t file_size_;
  ByteReader r_;
  LayerReader layer_;
  const ParseOptions& options_;
  std::vector<Finding>* findings_;
  Dna dna_;
  std::vector<IndexEntry> entries_;
  std::optional<detail::LodPlan> plan_;
  std::optional<Error> error_;
};

Result<Dna> run_parser(bytes::Source& source, const ParseOptions& options, detail::Known& known) {
  Parser parser(source, options, nullptr, nullptr);
  Result<Dna> dna = parser.run();
  known = parser.known();
  return dna;
}

// Adds the byte offset to an error that lacks it. The file is parsed a second time for this,
// because the first time no positions of fields are recorded.
Error with_offset(bytes::Source& source, const ParseOptions& options, Error error) {
  if (error.offset || error.code == ErrorCode::kInvalidArgument) return error;
  detail::Places places({error.where});
  static_cast<void>(Parser(source, options, &places, nullptr).run());
  error.offset = places.find(error.where);
  return error;
}

void add_offsets(bytes::Source& source, const ParseOptions& options,
                 std::vector<Finding>& findings) {
  std::set<std::string> fields;
  for (const Finding& f : findings) {
    if (!f.error.offset) fields.insert(f.error.where);
  }
  if (fields.empty()) return;
  detail::Places places(std::move(fields));
  std::vector<Finding> found_before;
  static_cast<void>(Parser(source, options, &places, &found_before).run());
  for (Finding& f : findings) {
    if (!f.error.offset) f.error.offset = places.find(f.error.where);
  }
}

}  // namespace

Result<Dna> parse(bytes::Source& source, const ParseOptions& options) {
  detail::Known known;
  Result<Dna> dna = run_parser(source, options, known);
  if (!dna) return core::Unexpected{with_offset(source, options, dna.error())};
  if (Status valid = detail::validate(*dna, known, dna->warnings); !valid) {
    // If LODs were selected, the indices in the error's field count only kept elements, so that
    // they would give a wrong place in the file. The error then has no byte offset.
    if (!options.lods.everything()) return std::move(valid).propagate();
    dna = std::move(valid).propagate();  // free the first Dna before the second parse
    return core::Unexpected{with_offset(source, options, dna.error())};
  }
  if (!options.unreferenced_blend_shapes && options.definition) {
    return remove_unreferenced_blend_shapes(*dna);
  }
  return dna;
}

std::vector<Finding> check(bytes::Source& source, const Limits& limits) {
  ParseOptions options;
  options.limits = limits;
  std::vector<Finding> findings;
  Result<Dna> dna = Parser(source, options, nullptr, &findings).run();
  if (!dna) {
    findings.push_back({true, dna.error()});
    return findings;
  }
  for (const Warning& w : dna->warnings) {
    findings.push_back({false, {ErrorCode::kInvalidValue, w.offset, w.where, w.message}});
  }
  // A layer that could not be read is empty or incomplete. Errors of indices and lengths might only
  // follow from that, so that they are left out.
  const bool whole = std::ranges::none_of(findings, &Finding::is_error);
  for (Finding& f : detail::find_all(*dna)) {
    if (!whole && f.error.code != ErrorCode::kInvalidValue) continue;
    findings.push_back(std::move(f));
  }
  add_offsets(source, options, findings);
  std::ranges::stable_sort(findings, {},
                           [](const Finding& f) { return f.error.offset.value_or(UINT64_MAX); });
  return findings;
}

}  // namespace risorius::dna
