// SPDX-License-Identifier: MIT
// Prints a hash of the raw controls, poses and skinned vertices that the scalar path computes for
// generated rigs with Euler angles. packaging/check/cross.sh compiles this program and the
// evaluator in several ways and demands one hash.
#include <cstdio>
#include <cstring>

#include "compile/compile.h"
#include "rig/outputs/joint_chain.h"
#include "rig/outputs/skin.h"
#include "rig/stages/evaluate.h"
#include "rig/stages/tables.h"

namespace {

using namespace risorius;

// Random numbers that are the same everywhere, unlike the distributions of the standard library.
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : state_(seed * 2 + 1) {}
  std::uint32_t below(std::uint32_t n) {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<std::uint32_t>((state_ >> 33) % n);
  }
  std::uint16_t index(std::size_t n) {
    return static_cast<std::uint16_t>(below(static_cast<std::uint32_t>(n)));
  }
  float within(float low, float high) {
    return low + (high - low) * (static_cast<float>(below(1u << 24)) / 16777216.0f);
  }

 private:
  std::uint64_t state_;
};

class Hash {
 public:
  void take(const std::vector<float>& values) {
    for (const float value : values) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, &value, sizeof bits);
      for (int byte = 0; byte < 4; ++byte) {
        hash_ = (hash_ ^ ((bits >> (8 * byte)) & 255u)) * 1099511628211u;
      }
    }
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 14695981039346656037u;
};

constexpr std::uint16_t kRaw = 20, kPsds = 15, kControls = kRaw + kPsds, kJoints = 12, kLods = 2,
                        kOutputs = 6;

std::vector<std::string> names(std::size_t n) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < n; ++i) out.push_back("n" + std::to_string(i));
  return out;
}

dna::Conditionals table(Numbers& numbers, std::size_t rows, std::size_t inputs) {
  std::vector<std::uint16_t> in, out;
  std::vector<float> from, to, slope, cut;
  for (std::size_t r = 0; r < rows; ++r) {
    in.push_back(numbers.index(inputs));
    out.push_back(numbers.index(kOutputs));
    from.push_back(numbers.within(-0.5f, 0.5f));
    to.push_back(numbers.within(0.5f, 1.5f));
    slope.push_back(numbers.within(-0.3f, 0.3f));
    cut.push_back(numbers.within(0.0f, 0.2f));
  }
  return {in, out, from, to, slope, cut};
}

dna::JointGroup group(Numbers& numbers) {
  const std::uint16_t rows = static_cast<std::uint16_t>(1 + numbers.index(9 * kJoints - 1));
  const std::size_t columns = 1 + numbers.index(50);
  dna::JointGroup g;
  g.lods = {rows, static_cast<std::uint16_t>(rows / 2)};
  std::vector<std::uint16_t> inputs, outputs;
  for (std::size_t c = 0; c < columns; ++c) inputs.push_back(numbers.index(kControls));
  for (std::uint16_t r = 0; r < rows; ++r) outputs.push_back(r);
  std::vector<float> values;
  for (std::size_t i = 0; i < rows * columns; ++i) {
    values.push_back(numbers.below(4) == 0 ? 0.0f : numbers.within(-3.0f, 3.0f));
  }
  g.input_indices = std::move(inputs);
  g.output_indices = std::move(outputs);
  g.values = std::move(values);
  return g;
}

// Correctives with up to five factors each: raw controls and earlier correctives.
dna::Psds correctives(Numbers& numbers) {
  std::vector<std::uint16_t> rows, columns;
  std::vector<float> values;
  for (std::uint16_t p = kRaw; p < kControls; ++p) {
    const std::uint16_t first = numbers.index(p);
    for (std::uint16_t i = 0; i <= numbers.index(5); ++i) {
      rows.push_back(p);
      columns.push_back(static_cast<std::uint16_t>((first + i) % p));
      values.push_back(numbers.within(0.7f, 1.3f));
    }
  }
  return {rows, columns, values};
}

dna::Dna face(Numbers& numbers) {
  dna::Dna dna;
  dna.descriptor.lod_count = kLods;
  dna::Definition& d = dna.definition;
  d.raw_control_names = names(kRaw);
  d.gui_control_names = names(kRaw);
  d.joint_names = names(kJoints);
  d.joint_parents = std::vector<std::uint16_t>(kJoints, 0);
  d.neutral_joint_translations.values = std::vector<float>(kJoints * 3, 0.0f);
  d.neutral_joint_rotations.values = std::vector<float>(kJoints * 3, 0.0f);
  d.blend_shape_channel_names = names(kOutputs);
  d.animated_map_names = names(kOutputs);
  dna::Behavior& b = dna.behavior;
  b.psd_count = kPsds;
  b.psds = correctives(numbers);
  b.gui_to_raw = table(numbers, 60, kRaw);
  std::vector<dna::JointGroup> groups;
  for (int g = 0; g < 3; ++g) groups.push_back(group(numbers));
  b.joint_groups = std::move(groups);
  std::vector<std::uint16_t> inputs, outputs;
  for (std::uint16_t i = 0; i < kOutputs; ++i) {
    inputs.push_back(numbers.index(kControls));
    outputs.push_back(i);
  }
  b.blend_shape_channels = {{kOutputs, kOutputs / 2}, inputs, outputs};
  b.animated_maps = {{40, 20}, table(numbers, 40, kControls)};
  return dna;
}

bool add(const dna::Dna& dna, compile::Precision precision, Numbers& numbers, Hash& hash) {
  compile::CompileOptions options;
  options.kernels = &simd::scalar_kernels();
  options.precision = precision;
  const core::Result<rig::Rig> rig = compile::compile(dna, options);
  if (!rig) {
    std::fprintf(stderr, "%s\n", rig.error().describe().c_str());
    return false;
  }
  rig::Workspace work = rig::make_workspace(*rig);
  rig::Pose pose = rig::make_pose(*rig);
  std::vector<float> gui(kRaw), raw(kRaw);
  for (std::uint32_t frame = 0; frame < 8; ++frame) {
    for (float& v : gui) v = numbers.below(3) == 0 ? 0.0f : numbers.within(-0.3f, 1.3f);
    rig::gui_to_raw(*rig, gui.data(), raw.data());
    hash.take(raw);
    rig::evaluate(*rig, gui.data(), frame % kLods, frame % 4 < 2, work, pose);
    hash.take(pose.joints);
    hash.take(pose.blend_shapes);
    hash.take(pose.animated_maps);
    hash.take(pose.controls);
  }
  return true;
}

// Adds the matrices of a chain of random bones, and deformed vertices with 0 to 15 influences each,
// to the hash. Returns false if chain or influences are rejected.
bool add_skin(Numbers& numbers, Hash& hash) {
  constexpr std::uint32_t kBones = 20, kVertices = 200;
  std::vector<std::int32_t> parents;
  std::vector<double> rest;
  std::vector<float> location, rotation, scale, weights, points;
  for (std::uint32_t b = 0; b < kBones; ++b) {
    parents.push_back(static_cast<std::int32_t>(b) - 1);
    for (std::size_t i = 0; i < 16; ++i) {
      const double v = (i % 5 == 0 ? 1.0 : 0.0) + double{numbers.within(-0.2f, 0.2f)};
      rest.push_back(i < 12 ? v : (i == 15 ? 1.0 : 0.0));
    }
    for (int i = 0; i < 3; ++i) location.push_back(numbers.within(-0.1f, 0.1f));
    for (int i = 0; i < 4; ++i) rotation.push_back(numbers.within(-1.0f, 1.0f));
    for (int i = 0; i < 3; ++i) scale.push_back(numbers.within(0.8f, 1.2f));
  }
  std::vector<std::uint32_t> offsets{0}, bones;
  for (std::uint32_t v = 0; v < kVertices; ++v) {
    for (std::uint32_t i = numbers.below(16); i > 0; --i) {
      bones.push_back(numbers.below(kBones));
      weights.push_back(numbers.within(0.1f, 1.0f));
    }
    offsets.push_back(static_cast<std::uint32_t>(bones.size()));
    for (int i = 0; i < 3; ++i) points.push_back(numbers.within(-1.0f, 1.0f));
  }
  const auto chain = rig::make_joint_chain(parents, rest.data());
  const auto skin = rig::make_skin(kVertices, offsets, bones, weights, kBones);
  if (!chain || !skin) return false;
  std::vector<rig::JointChain::Affine> work(kBones);
  std::vector<float> matrices(kBones * 12);
  rig::evaluate_chain(*chain, location.data(), rotation.data(), scale.data(), work.data(),
                      matrices.data());
  hash.take(matrices);
  core::AlignedVector<float> rows((kBones + 1) * simd::kSkinRow);
  simd::scalar_kernels().skin_rows(matrices.data(), kBones, rows.data());
  rig::evaluate_skin(*skin, simd::scalar_kernels(), rows.data(), points.data(), points.data());
  hash.take(points);
  return true;
}

}  // namespace

int main() {
  Hash hash;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    Numbers numbers(seed);
    const dna::Dna dna = face(numbers);
    if (!add(dna, compile::Precision::kFloat32, numbers, hash)) return 1;
    if (!add(dna, compile::Precision::kFloat16, numbers, hash)) return 1;
    if (!add_skin(numbers, hash)) return 1;
  }
  std::printf("%016llx\n", static_cast<unsigned long long>(hash.value()));
}
