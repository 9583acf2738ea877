// SPDX-License-Identifier: MIT
// Checks promises of the native code about any bytes. Each function with a text as result returns
// the broken promise, or kKept (no text). Numbers are moderate if results must be finite; a forged
// rig is opened from changed bytes.
#include "support/promises.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "bytes/source.h"
#include "compile/compile.h"
#include "core/aligned.h"
#include "dna/controls.h"
#include "dna/file/json.h"
#include "dna/file/write.h"
#include "rig/block.h"
#include "rig/stages/evaluate.h"
#include "rig/stages/instance.h"
#include "rig/stages/tables.h"

namespace risorius::promises {

namespace {

using core::ErrorCode;
using core::Result;
using dna::Dna;
using dna::ParseOptions;

const std::string kKept;

Result<Bytes> write(const Dna& dna, std::uint16_t minor = 8) {
  std::vector<dna::Warning> warnings;
  return dna::write(dna, {minor, true}, warnings);
}

std::string broken(const std::string& promise, const core::Error& error) {
  return promise + ": " + error.describe();
}

// ---- sources that are not memory

// A file that the parser can read only in pieces. The first `honest_reads` reads give the bytes of
// the file; later reads give each byte plus 1.
class PieceSource final : public bytes::Source {
 public:
  PieceSource(View bytes, std::size_t honest_reads) : bytes_(bytes), honest_(honest_reads) {}
  std::uint64_t size() const override { return bytes_.size(); }
  std::size_t read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    bytes::SpanSource memory(bytes_);
    const std::size_t n = memory.read(offset, out);
    if (reads_++ < honest_) return n;
    for (std::size_t i = 0; i < n; ++i) out[i] = static_cast<std::uint8_t>(out[i] + 1);
    return n;
  }

 private:
  View bytes_;
  std::size_t honest_, reads_ = 0;
};

// ---- errors

std::string placed(const core::Error& e, std::size_t size) {
  if (e.code == ErrorCode::kInvalidArgument) return kKept;
  if (e.where.empty()) return broken("an error has a field", e);
  if (!e.offset) return broken("an error has an offset", e);
  if (*e.offset > size) return broken("an error lies in the file", e);
  return kKept;
}

// ---- evaluation

class Random {
 public:
  explicit Random(std::uint32_t seed) : state_(seed * 2654435761u + 1) {}
  std::uint32_t next() {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 17;
    return state_ ^= state_ << 5;
  }
  float moderate() { return static_cast<float>(next() % 4097) / 1024.0f - 2.0f; }
  float any() {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    constexpr std::array<float, 8> kOdd{0,      -0.0f,     1e30f,      -3e38f,
                                        1e-42f, kInfinity, -kInfinity, NAN};
    return next() % 2 == 0 ? moderate() : kOdd[next() % kOdd.size()];
  }

 private:
  std::uint32_t state_;
};

void widen(float& most, const core::Array<float>& values) {
  for (const float v : values) {
    if (!(std::abs(v) <= most)) most = std::isnan(v) ? HUGE_VALF : std::abs(v);
  }
}

void widen(float& most, const dna::Conditionals& t) {
  for (const auto* list : {&t.from_values, &t.to_values, &t.slope_values, &t.cut_values}) {
    widen(most, *list);
  }
}

float largest_joint_value(const Dna& dna) {
  float most = 0;
  for (const dna::JointGroup& g : dna.behavior.joint_groups) widen(most, g.values);
  return most;
}

// Whether the weights, biases and activation parameters of the networks are at most 10 in size, all
// networks together have at most four layers, and no operation is a weighted sum. Even with 100
// terms in each sum, the results of four such layers stay far below the largest float.
bool has_moderate_networks(const Dna& dna) {
  float most = 0;
  std::size_t layers = 0;
  for (const dna::NeuralNetwork& n : dna.machine_learned_behavior.neural_networks) {
    for (const dna::NeuralNetworkLayer& l : n.layers) {
      ++layers;
      for (const auto* list : {&l.biases, &l.weights, &l.activation_parameters}) widen(most, *list);
    }
  }
  constexpr std::uint16_t kWeightedSum = 4;  // its weights are the bits of floats
  for (const dna::MlType& type : dna.machine_learned_behavior_ext.types) {
    for (const auto& set : type.operations) {
      for (const auto& op : set) layers += op.operation_type == kWeightedSum ? 5 : 0;
    }
  }
  return most <= 10 && layers <= 4;
}

bool has_moderate_solvers(const Dna& dna) {
  float most = 0;
  for (const dna::RbfSolver& s : dna.rbf_behavior.solvers) {
    widen(most, s.raw_control_values);
    widen(most, core::Array<float>{s.radius, s.weight_threshold});
  }
  for (const dna::RbfPose& p : dna.rbf_behavior.poses) widen(most, core::Array<float>{p.scale});
  std::size_t factors = 0;
  for (const dna::RbfPoseControls& p : dna.rbf_behavior_ext.poses) {
    widen(most, p.output_control_weights);
    factors += p.input_control_indices.size();
  }
  return most <= 1000 && factors <= 4;
}

// Whether the numbers of a face are so moderate that results must be finite. A corrective
// multiplies its weights, so that weights above 1 could overflow.
bool is_moderate(const Dna& dna) {
  float weights = 0, rows = 0;
  widen(weights, dna.behavior.psds.values);
  widen(rows, dna.behavior.gui_to_raw);
  widen(rows, dna.behavior.animated_maps.conditionals);
  widen(rows, dna.definition.neutral_joint_rotations.values);
  for (const auto* setups : {&dna.twist_swing_behavior.twists, &dna.twist_swing_behavior.swings}) {
    for (const dna::TwistSwingSetup& s : *setups) widen(rows, s.blend_weights);
  }
  return weights <= 1 && rows <= 1000 && largest_joint_value(dna) <= 1000 &&
         has_moderate_networks(dna) && has_moderate_solvers(dna);
}

bool all_finite(const std::vector<float>& values) {
  return std::ranges::all_of(values, [](float v) { return std::isfinite(v); });
}

bool all_finite(const rig::Pose& p) {
  return all_finite(p.joints) && all_finite(p.blend_shapes) && all_finite(p.animated_maps) &&
         all_finite(p.controls);
}

// Whether all pairs of numbers have the same bits or are both NaN.
bool same(const float* a, const std::vector<float>& b) {
  for (std::size_t i = 0; i < b.size(); ++i) {
    const bool equal = std::bit_cast<std::uint32_t>(a[i]) == std::bit_cast<std::uint32_t>(b[i]);
    if (!equal && !(std::isnan(a[i]) && std::isnan(b[i]))) return false;
  }
  return true;
}

bool same(const rig::Pose& a, const rig::Pose& b) {
  return same(a.joints.data(), b.joints) && same(a.blend_shapes.data(), b.blend_shapes) &&
         same(a.animated_maps.data(), b.animated_maps) && same(a.controls.data(), b.controls);
}

// The largest difference that another order of additions, or fused operations, may cause between
// joint values. For n products of a value and a control, with each sum rounded once, it is 2 n eps
// * sum |value * control|. The controls of compared poses are at most 2.
float joint_tolerance(const Dna& dna, const rig::Rig& rig) {
  const float n = static_cast<float>(rig.control_count) + 1;
  constexpr float kEpsilon = std::numeric_limits<float>::epsilon();
  return 2 * n * n * kEpsilon * 2 * largest_joint_value(dna) + 1e-37f;
}

// ---- one Rig

using Controls = std::vector<float>;

rig::Pose pose_of(const rig::Rig& rig, const Controls& raw, std::uint32_t lod, bool settle) {
  rig::Workspace work = rig::make_workspace(rig);
  rig::Pose pose = rig::make_pose(rig);
  rig::evaluate(rig, raw.data(), lod, settle, work, pose);
  return pose;
}

// Whether a rig was compiled, or opened from changed bytes. A compiled rig must give the same pose
// in every way of evaluation. A forged rig must only be safe: its steps may read values that no
// step wrote in this frame.
enum class Origin { kCompiled, kForged };

// Checks that the first and the last frame of a batch equal the same frames evaluated alone. In the
// last frame all controls have half their values. The batch of a forged rig is evaluated but not
// compared.
std::string batch(const rig::Rig& rig, const Controls& raw, std::uint32_t lod, bool settle,
                  Origin origin) {
  constexpr std::size_t kCount = simd::kFrames + 3;
  Controls frames;
  for (std::size_t f = 0; f < kCount; ++f) frames.insert(frames.end(), raw.begin(), raw.end());
  Controls last(raw);
  for (float& v : last) v = 0.5f * v;
  std::copy(last.begin(), last.end(), frames.end() - std::ptrdiff_t(last.size()));
  rig::Pose all = rig::make_pose(rig);
  for (auto* list : {&all.joints, &all.blend_shapes, &all.animated_maps, &all.controls}) {
    list->resize(list->size() * kCount);
  }
  rig::Workspace work = rig::make_batch_workspace(rig);
  rig::evaluate_frames(rig, frames.data(), kCount, lod, settle, work, rig::view(all));
  if (origin == Origin::kForged) return kKept;
  for (const std::size_t f : {std::size_t{0}, kCount - 1}) {
    const rig::Pose alone = pose_of(rig, f == 0 ? raw : last, lod, settle);
    const auto frame = [&](const Controls& list, const Controls& one) {
      return same(list.data() + f * one.size(), one);
    };
    if (!frame(all.joints, alone.joints) || !frame(all.blend_shapes, alone.blend_shapes) ||
        !frame(all.animated_maps, alone.animated_maps) || !frame(all.controls, alone.controls)) {
      return "a frame of a batch has the bits of the frame alone";
    }
  }
  return kKept;
}

// Checks that all three ways to visit the columns of a joint group give the same joints. The joints
// of a forged rig are not compared. -0 equals 0: a product below the float range may leave a sum at
// -0, which the column of a control at 0 changes to 0.
std::string traversals(const rig::Rig& rig, const Controls& raw, std::uint32_t lod, Origin origin) {
  rig::Workspace work = rig::make_workspace(rig);
  rig::Pose listed = rig::make_pose(rig), whole = listed, added = listed;
  work.traversal = rig::Traversal::kListed;
  rig::evaluate(rig, raw.data(), lod, true, work, listed);
  work.traversal = rig::Traversal::kAdded;
  rig::evaluate(rig, raw.data(), lod, true, work, added);
  work.traversal = rig::Traversal::kWhole;
  rig::evaluate(rig, raw.data(), lod, true, work, whole);
  if (origin == Origin::kForged) return kKept;
  const auto alike = [](float a, float b) { return a == b || (a != a && b != b); };
  return std::ranges::equal(listed.joints, whole.joints, alike) &&
                 std::ranges::equal(listed.joints, added.joints, alike)
             ? kKept
             : "all ways through the columns give one pose";
}

std::string instance(const rig::Rig& rig, const Controls& raw, std::uint32_t lod, Origin origin) {
  rig::Instance face(rig);
  face.set_lod(lod);
  const rig::Pose first = face.evaluate(raw.data());
  if (origin == Origin::kCompiled && rig.lod_count > 0 &&
      !same(first, pose_of(rig, raw, lod, false))) {
    return "an instance begins as evaluate without settling";
  }
  for (std::size_t i = 0; i < face.masks().size(); i += 2) face.set_mask(i, 0.0f);
  face.evaluate(raw.data());
  return kKept;
}

// Evaluates a rig in every way at LODs 0 to 3. If the rig has fewer LODs, the highest number is the
// first that no LOD has. If its last LOD is above 3, one settled pose is made at this LOD.
// Out: poses  the settled pose of each evaluated LOD is appended
std::string evaluate_rig(const rig::Rig& rig, const Controls& raw, std::vector<rig::Pose>& poses,
                         Origin origin = Origin::kCompiled) {
  for (std::uint32_t lod = 0; lod <= std::min(rig.lod_count, 3u); ++lod) {
    poses.push_back(pose_of(rig, raw, lod, true));
    if (std::string b = batch(rig, raw, lod, lod % 2 == 0, origin); !b.empty()) return b;
    if (std::string b = traversals(rig, raw, lod, origin); !b.empty()) return b;
    if (std::string b = instance(rig, raw, lod, origin); !b.empty()) return b;
  }
  if (rig.lod_count > 4) poses.push_back(pose_of(rig, raw, rig.lod_count - 1, true));
  return kKept;
}

// Checks that the bytes of a rig can be opened as a rig that gives the `expected` pose: the settled
// pose of LOD 0.
std::string reopened(const rig::Rig& rig, const Controls& raw, const rig::Pose& expected) {
  const auto owner = core::allocate_pages(rig.block().size());
  std::ranges::copy(rig.block(), owner.get());
  const auto again =
      rig::open_rig({owner.get(), rig.block().size()}, owner, rig::BlockCheck::kFull, *rig.kernels);
  if (!again) return broken("a compiled rig passes its own check", again.error());
  return same(pose_of(*again, raw, 0, true), expected) ? kKept : "a rig is its bytes";
}

struct Evaluated {
  rig::Rig rig;
  std::vector<rig::Pose> poses;
};

std::string evaluate_on(const Dna& dna, const compile::CompileOptions& options, const Controls& raw,
                        std::vector<Evaluated>& out) {
  Result<rig::Rig> rig = compile::compile(dna, options);
  if (!rig) return rig.error().where.empty() ? broken("an error has a field", rig.error()) : kKept;
  Evaluated all{std::move(*rig), {}};
  if (std::string b = evaluate_rig(all.rig, raw, all.poses); !b.empty()) return b;
  if (std::string b = reopened(all.rig, raw, all.poses[0]); !b.empty()) return b;
  out.push_back(std::move(all));
  return kKept;
}

// The scalar kernels, and the kernels of one other instruction set that this CPU supports, or null.
std::array<const simd::Kernels*, 2> two_kernels(std::uint32_t choice) {
  std::vector<const simd::Kernels*> others;
  for (const char* name : {"sse4", "avx2", "avx512", "neon"}) {
    if (const simd::Kernels* k = simd::find_kernels(name)) others.push_back(k);
  }
  if (others.empty()) return {&simd::scalar_kernels(), nullptr};
  return {&simd::scalar_kernels(), others[choice % others.size()]};
}

// Compares the poses of the scalar kernels, `a`, with those of another instruction set, `b`. SSE4
// must give the same bits. For other sets the joints are compared with a tolerance, and only if all
// controls are equal and at most 2 in size, because a control that differs in its last bits may
// select another row of a table.
// In:  tame  whether the numbers of face and input are moderate; false: only the bits of SSE4 are
//            compared
// Out: kKept, or the broken promise
std::string compare(const Dna& dna, const Evaluated& a, const Evaluated& b, bool tame) {
  const float tolerance = joint_tolerance(dna, a.rig);
  const bool exact = std::string_view(b.rig.kernels->name) == "sse4";
  for (std::size_t i = 0; i < a.poses.size(); ++i) {
    const rig::Pose &p = a.poses[i], &q = b.poses[i];
    if (exact && !same(p, q)) return "SSE4 has the bits of the scalar path";
    if (!tame || !same(p.controls.data(), q.controls)) continue;
    const bool small = std::ranges::all_of(p.controls, [](float v) { return std::abs(v) <= 2; });
    for (std::size_t j = 0; small && j < p.joints.size(); ++j) {
      if (std::abs(p.joints[j] - q.joints[j]) <= tolerance) continue;
      return "instruction sets agree: " + std::to_string(p.joints[j]) + " and " +
             std::to_string(q.joints[j]) + " at " + std::to_string(j);
    }
  }
  return kKept;
}

std::string gui(const rig::Rig& rig, Random& random, bool moderate) {
  Controls in(rig.gui_count), out(rig.raw_count, NAN);
  for (float& v : in) v = moderate ? random.moderate() : random.any();
  rig::gui_to_raw(rig, in.data(), out.data());
  if (moderate && !all_finite(out)) return "moderate GUI controls give finite controls";
  rig::raw_to_gui(rig, out.data(), in.data());
  return kKept;
}

std::string morphs(const Dna& dna, Random& random) {
  std::vector<float> weights(dna.definition.blend_shape_channel_names.size());
  for (float& w : weights) w = random.any();
  for (std::size_t i = 0; i < dna.geometry.meshes.size(); ++i) {
    const auto morph = compile::compile_morph(dna, i, {1, 0, 0, 0, 1, 0, 0, 0, 1});
    if (!morph) return broken("a mesh compiles", morph.error());
    std::vector<float> vertices(std::size_t{morph->vertex_count} * 3);
    rig::evaluate_morph(*morph, weights.data(), nullptr, vertices.data());
  }
  return kKept;
}

// ---- filters

struct Filter {
  ParseOptions options;
  bool in_pieces = false, lying = false;
};

dna::LodSelection selection(View o) {
  dna::LodSelection s;
  switch (o[1] >> 5) {
    case 1:
      s.max_lod = o[2];
      break;
    case 2:
      s.min_lod = o[2];
      break;
    case 3:
      s.max_lod = o[2] & 3;
      s.min_lod = o[2] >> 4;
      break;
    case 4:
      s.lods = {o[2]};
      break;
    case 5:
      s.lods = {std::uint16_t(o[2] & 3), std::uint16_t(o[2] >> 4)};
      break;
    default:
      break;
  }
  return s;
}

Filter filter_of(View o) {
  Filter f;
  ParseOptions& p = f.options;
  const auto on = [&](int bit) { return (o[0] >> bit & 1) == 0; };
  p.behavior = on(0);
  p.geometry = on(1);
  p.blend_shapes = on(2);
  p.machine_learned_behavior = on(3);
  p.rbf_behavior = on(4);
  p.joint_behavior_metadata = on(5);
  p.twist_swing_behavior = on(6);
  p.definition = on(7);
  p.unknown_layers = (o[1] & 1) == 0;
  p.unreferenced_blend_shapes = (o[1] & 2) == 0;
  f.in_pieces = (o[1] & 4) != 0;
  f.lying = (o[1] & 8) != 0;
  if ((o[1] & 16) != 0) {
    p.limits.max_bytes = std::uint64_t{64} * o[4];
    p.limits.max_layers = o[5];
    p.limits.max_count = std::uint32_t{4} * o[6];
  }
  p.lods = selection(o);
  return f;
}

Result<Dna> parse_as(View bytes, const Filter& f, std::size_t honest_reads) {
  if (!f.in_pieces) return parse(bytes, f.options);
  PieceSource source(bytes, f.lying ? honest_reads : SIZE_MAX);
  return dna::parse(source, f.options);
}

// Removes from a completely loaded Dna the layers that `o` would have left out when loading, and
// counts the controls of these layers in unread_controls if `o` loads the definition.
Dna without_layers(Dna dna, const ParseOptions& o) {
  const dna::ControlCounts controls = dna::control_counts(dna);
  const bool uncounted = !o.definition;
  if (!o.definition) dna.definition = {};
  if (!o.behavior) {
    dna.unread_controls.psd = uncounted ? 0 : controls.psd;
    dna.behavior = {};
  }
  if (!o.machine_learned_behavior) {
    dna.unread_controls.ml = uncounted ? 0 : controls.ml;
    dna.machine_learned_behavior = {};
    dna.machine_learned_behavior_ext = {};
  }
  if (!o.rbf_behavior) {
    dna.unread_controls.rbf_pose = uncounted ? 0 : controls.rbf_pose;
    dna.rbf_behavior = {};
    dna.rbf_behavior_ext = {};
  }
  if (!o.geometry) dna.geometry = {};
  for (dna::Mesh& m : dna.geometry.meshes) {
    if (!o.blend_shapes) m.blend_shape_targets = {};
  }
  if (!o.joint_behavior_metadata) dna.joint_behavior_metadata = {};
  if (!o.twist_swing_behavior) dna.twist_swing_behavior = {};
  if (!o.unknown_layers) {
    dna.unknown_layers.clear();
    std::erase(dna.index_order, "");
  }
  return dna;
}

// Whether every layer is loaded together with the layers that it needs. Otherwise the caller made a
// mistake, and parsing must only be safe.
bool is_comparable(const ParseOptions& o) {
  const bool some = o.behavior || o.geometry || o.machine_learned_behavior || o.rbf_behavior ||
                    o.joint_behavior_metadata || o.twist_swing_behavior;
  return (o.definition || !some) && (o.behavior || !o.rbf_behavior);
}

// Whether writing may have failed because a network, pose or setup needs an unloaded control, which
// is allowed: the error is an invalid argument, and some controls are not loaded.
bool lacks_controls(const Dna& dna, const core::Error& error) {
  return error.code == ErrorCode::kInvalidArgument &&
         !(dna.unread_controls == dna::UnreadControls{});
}

std::string compare_filtered(const Dna& full, const ParseOptions& o, const Result<Dna>& filtered) {
  Result<Dna> expected = dna::filter_lods(full, o.lods);
  if (expected) expected = without_layers(std::move(*expected), o);
  if (expected && !o.unreferenced_blend_shapes && o.definition) {
    expected = dna::remove_unreferenced_blend_shapes(*expected);
  }
  if (!expected) {
    if (!filtered && filtered.error().code == expected.error().code) return kKept;
    return broken("a filtered load fails as the filter does", expected.error());
  }
  if (!filtered) return broken("a part of a file that is good is good", filtered.error());
  // The two faces are compared as JSON and not as files, because writing a file renumbers the
  // controls if some are not loaded.
  const Result<std::string> a = dna::to_json(*expected), b = dna::to_json(*filtered);
  if (!a) return broken("what was filtered is whole", a.error());
  if (!b) return broken("what was loaded filtered is whole", b.error());
  if (*a != *b) return "a filtered load is the full load, filtered";
  if (!(expected->unread_controls == filtered->unread_controls)) {
    return "a filtered load counts the controls that it leaves out";
  }
  return kKept;
}

// ---- coordinates

dna::CoordinateSystem axes(std::uint8_t choice) {
  if (choice >= 240) return {choice, 2, 4};
  constexpr std::uint16_t kOrders[6][3] = {{0, 2, 4}, {0, 4, 2}, {2, 0, 4},
                                           {2, 4, 0}, {4, 0, 2}, {4, 2, 0}};
  const auto& order = kOrders[choice / 8 % 6];
  const auto turned = [&](int i) {
    return static_cast<std::uint16_t>(order[i] + (choice >> i & 1));
  };
  return {turned(0), turned(1), turned(2)};
}

dna::CoordinateTarget target_of(View o) {
  dna::CoordinateTarget t;
  const auto has = [&](int bit) { return (o[0] >> bit & 1) != 0; };
  const auto sign = [&](int bit) { return (o[3] >> bit & 1) != 0 ? -1 : 1; };
  if (has(0)) t.axes = axes(o[1]);
  if (has(1)) t.rotation_sequence = o[2] % 7;
  if (has(2)) t.rotation_signs = {sign(0), sign(1), sign(2)};
  if (has(3)) t.face_winding_order = static_cast<std::uint8_t>(o[4] % 3);
  if (has(4)) t.translation_unit = static_cast<std::uint16_t>(o[5] % 3);
  if (has(5)) t.rotation_unit = static_cast<std::uint16_t>(o[6] % 3);
  return t;
}

}  // namespace

Result<Dna> parse(View bytes, const ParseOptions& options) {
  bytes::SpanSource source(bytes);
  return dna::parse(source, options);
}

std::string reading(View bytes, const Result<Dna>& dna) {
  return dna ? kKept : placed(dna.error(), bytes.size());
}

std::string checking(View bytes, bool is_good) {
  bytes::SpanSource source(bytes);
  bool wrong = false;
  for (const dna::Finding& f : dna::check(source)) {
    wrong = wrong || f.is_error;
    if (std::string place = placed(f.error, bytes.size()); !place.empty()) return "check: " + place;
  }
  if (wrong != is_good) return kKept;
  return wrong ? "check finds no error in a file that can be read" : "check finds what parse finds";
}

std::string rewriting(const Dna& dna, std::uint16_t minor) {
  const Result<Bytes> first = write(dna, minor);
  if (!first) return broken("what was read can be written", first.error());
  const Result<Dna> again = parse(*first);
  if (!again) return broken("what was written can be read", again.error());
  const Result<Bytes> second = write(*again, minor);
  if (!second) return broken("what was read again can be written", second.error());
  return *first == *second ? kKept : "what was read is written as it was";
}

std::string json(const Dna& dna) {
  const Result<std::string> text = dna::to_json(dna);
  if (!text) return broken("what was read becomes JSON", text.error());
  const Result<Dna> again = dna::from_json(*text);
  if (!again) return broken("JSON that was written can be read", again.error());
  const Result<std::string> twice = dna::to_json(*again);
  if (!twice || *twice != *text) return "JSON that was read is written as it was";
  const Result<Bytes> bytes = write(dna), through_json = write(*again);
  if (!bytes || !through_json || *bytes != *through_json) return "JSON loses nothing";
  return kKept;
}

std::string json_text(std::string_view text) {
  const Result<Dna> dna = dna::from_json(text);
  if (!dna) {
    const core::Error& e = dna.error();
    return e.where.empty() && !e.offset ? broken("an error has a field or an offset", e) : kKept;
  }
  if (std::string b = json(*dna); !b.empty()) return b;
  return rewriting(*dna, 8);
}

std::string evaluation(const Dna& dna, std::uint32_t seed) {
  Random random(seed);
  const bool moderate = seed % 2 == 0;
  Controls raw(dna.definition.raw_control_names.size());
  for (float& v : raw) v = moderate ? random.moderate() : random.any();
  compile::CompileOptions options;
  if ((seed & 2) != 0) options.rotation = compile::Rotation::kQuaternion;
  if ((seed & 4) != 0) options.precision = compile::Precision::kFloat16;
  std::vector<Evaluated> evaluated;
  for (const simd::Kernels* kernels : two_kernels(seed / 8)) {
    if (kernels == nullptr) continue;
    options.kernels = kernels;
    if (std::string b = evaluate_on(dna, options, raw, evaluated); !b.empty()) return b;
  }
  if (evaluated.empty()) return morphs(dna, random);
  const bool tame = moderate && is_moderate(dna);
  for (const Evaluated& e : evaluated) {
    const bool finite = std::ranges::all_of(e.poses, [](const auto& p) { return all_finite(p); });
    if (tame && !finite) return "moderate numbers give finite poses";
  }
  if (evaluated.size() == 2) {
    if (std::string b = compare(dna, evaluated[0], evaluated[1], tame); !b.empty()) return b;
  }
  if (std::string b = gui(evaluated[0].rig, random, tame); !b.empty()) return b;
  return morphs(dna, random);
}

std::string opening(View bytes, std::uint32_t seed) {
  const auto owner = core::allocate_pages(std::max<std::size_t>(bytes.size(), 1));
  std::ranges::copy(bytes, owner.get());
  const std::span<std::uint8_t> block(owner.get(), bytes.size());
  const auto kernels = two_kernels(seed / 2);
  const simd::Kernels* used = seed % 2 == 0 || kernels[1] == nullptr ? kernels[0] : kernels[1];
  if (!rig::open_rig(block, owner, rig::BlockCheck::kHeader, *used)) return kKept;
  rig::seal_block(block);
  const auto rig = rig::open_rig(block, owner, rig::BlockCheck::kFull, *used);
  if (!rig) return rig.error().where.empty() ? broken("an error has a field", rig.error()) : kKept;
  Random random(seed);
  Controls raw(rig->raw_count);
  for (float& v : raw) v = random.any();
  std::vector<rig::Pose> poses;
  if (std::string b = evaluate_rig(*rig, raw, poses, Origin::kForged); !b.empty()) return b;
  rig->raw_control_names();
  rig->gui_control_names();
  rig->ignored_layers();
  return gui(*rig, random, false);
}

std::string filtering(View bytes) {
  if (bytes.size() < kOptionBytes) return kKept;
  const Filter f = filter_of(bytes);
  const std::size_t honest_reads = bytes[7];
  const View file = bytes.subspan(kOptionBytes);
  const Result<Dna> filtered = parse_as(file, f, honest_reads);
  if (filtered) {
    const Result<Bytes> written = write(*filtered);
    if (!written && !lacks_controls(*filtered, written.error())) {
      return broken("what was loaded filtered can be written", written.error());
    }
  }
  const bool limited = !filtered && filtered.error().code == ErrorCode::kLimitExceeded;
  if (f.lying || limited || !is_comparable(f.options)) return kKept;
  const Result<Dna> full = parse(file);
  return full ? compare_filtered(*full, f.options, filtered) : kKept;
}

std::string conversion(const Dna& dna, View options) {
  std::vector<dna::Warning> warnings;
  const auto same = dna::convert_coordinates(dna, {}, warnings);
  const Result<Bytes> before = write(dna), unchanged = same ? write(*same) : before;
  if (!unchanged || *before != *unchanged) return "a target equal to the source changes no bit";
  const dna::CoordinateTarget target = target_of(options);
  const auto converted = dna::convert_coordinates(dna, target, warnings);
  if (!converted) {
    const core::Error& e = converted.error();
    return e.where.empty() ? broken("an error has a field", e) : kKept;
  }
  const Result<Bytes> once = write(*converted);
  if (!once) return broken("what was converted can be written", once.error());
  const auto again = dna::convert_coordinates(*converted, target, warnings);
  if (!again) return broken("what was converted can be converted", again.error());
  const Result<Bytes> twice = write(*again);
  return twice && *twice == *once ? kKept : "converting again changes nothing";
}

std::string everything(View bytes, std::size_t turn) {
  const Result<Dna> read = parse(bytes);
  if (std::string b = checking(bytes, read.has_value()); !b.empty()) return b;
  if (!read) return reading(bytes, read);
  const Dna& dna = *read;
  const std::uint16_t own = dna.version >= 1 && dna.version <= 8 ? dna.version : std::uint16_t{8};
  for (const std::uint16_t minor : {own, static_cast<std::uint16_t>(1 + turn % 8)}) {
    if (std::string b = rewriting(dna, minor); !b.empty()) return b;
  }
  if (std::string b = json(dna); !b.empty()) return b;
  if (std::string b = evaluation(dna, static_cast<std::uint32_t>(turn)); !b.empty()) return b;
  const Bytes turned{0x3F, static_cast<std::uint8_t>(turn), 4, 2, 1, 1, 1, 0};
  if (std::string b = conversion(dna, turned); !b.empty()) return b;
  Bytes filtered{0, 0x80, static_cast<std::uint8_t>(turn % 2), 0, 0, 0, 0, 0};
  filtered.insert(filtered.end(), bytes.begin(), bytes.end());
  return filtering(filtered);
}

}  // namespace risorius::promises
