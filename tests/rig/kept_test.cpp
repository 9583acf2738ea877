// SPDX-License-Identifier: MIT
// State that a workspace keeps between frames is never visible: a pose has the same bits as one
// from a fresh workspace.
#include <array>
#include <cstring>
#include <random>
#include <span>

#include "support/face.h"

namespace risorius::rig {
namespace {

using namespace testing_support;

constexpr std::size_t kInputs = 12, kCorrectives = 40, kBones = 30, kLevels = 3;

// The evaluator has two ways to find the active channels. A face with 20 channels (seed 1) looks at
// every channel in most frames. A face with 150 channels looks only at the channels of active
// controls at LOD 0.
void add_channels(dna::Dna& dna, std::uint32_t seed) {
  const std::size_t count = seed == 1 ? 20 : 150;
  dna.definition.blend_shape_channel_names = names("shape", count);
  std::vector<std::uint16_t> inputs(count), outputs(count);
  for (std::size_t i = 0; i < count; ++i) {
    inputs[i] = static_cast<std::uint16_t>(i * 7 % (kInputs + kCorrectives));
    outputs[i] = static_cast<std::uint16_t>(count - 1 - i);
  }
  dna.behavior.blend_shape_channels.lods = {static_cast<std::uint16_t>(count), 9, 3};
  dna.behavior.blend_shape_channels.input_indices = std::move(inputs);
  dna.behavior.blend_shape_channels.output_indices = std::move(outputs);
}

// Adds animated maps. Each raw control drives two runs of table rows, which write different maps.
// For every third control, a map is not 0 while the control is 0.
void add_maps(dna::Dna& dna) {
  dna.definition.animated_map_names = names("map", kInputs);
  dna::Conditionals& table = dna.behavior.animated_maps.conditionals;
  std::vector<std::uint16_t> inputs, outputs;
  std::vector<float> from, to, slope, cut;
  for (std::uint16_t r = 0; r < 4 * kInputs; ++r) {
    inputs.push_back(static_cast<std::uint16_t>(r / 2 % kInputs));
    outputs.push_back(static_cast<std::uint16_t>((r / 2 + r / (2 * kInputs)) % kInputs));
    from.push_back(r % 2 == 0 ? -1.0f : 0.5f);
    to.push_back(r % 2 == 0 ? 0.4f : 1.0f);
    slope.push_back(0.3f);
    cut.push_back(r % 6 == 0 ? 0.25f : 0.0f);
  }
  dna.behavior.animated_maps.lods = {4 * kInputs, 7, 2};
  table.input_indices = std::move(inputs);
  table.output_indices = std::move(outputs);
  table.from_values = std::move(from);
  table.to_values = std::move(to);
  table.slope_values = std::move(slope);
  table.cut_values = std::move(cut);
}

// A face with correctives of two to four raw controls, and joint groups that list all controls. The
// factors of the correctives and the values of the joint groups are random. All seeds give the same
// sizes, except for the number of channels.
dna::Dna correcting_face(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(-2.0f, 2.0f);
  dna::Dna dna = make_face(kInputs, 0, kBones, kLevels);
  dna::Psds& psds = dna.behavior.psds;
  dna.behavior.psd_count = kCorrectives;
  std::vector<std::uint16_t> rows, columns;
  for (std::size_t p = 0; p < kCorrectives; ++p) {
    const std::size_t first = random() % kInputs;
    for (std::size_t f = 0; f < 2 + p % 3; ++f) {
      rows.push_back(static_cast<std::uint16_t>(kInputs + p));
      columns.push_back(static_cast<std::uint16_t>((first + f * (1 + p % 2)) % kInputs));
    }
  }
  // A negative weight makes a corrective -0 if a factor is 0.
  std::vector<float> weights(rows.size(), 1.25f);
  for (std::size_t i = 0; i < weights.size(); i += 5) weights[i] = -0.5f;
  psds.values = std::move(weights);
  psds.rows = std::move(rows);
  psds.columns = std::move(columns);
  std::vector<std::uint16_t> inputs(kInputs + kCorrectives);
  for (std::size_t c = 0; c < inputs.size(); ++c) inputs[c] = static_cast<std::uint16_t>(c);
  std::vector<dna::JointGroup> groups;
  for (const int first : {0, 100, 200}) {
    std::vector<std::uint16_t> outputs(70);
    for (std::size_t r = 0; r < outputs.size(); ++r) {
      outputs[r] = static_cast<std::uint16_t>(static_cast<std::size_t>(first) + r);
    }
    std::vector<float> values(inputs.size() * outputs.size());
    // A third of the columns has only zeros; for successive seeds it is another third.
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = (i % inputs.size() + seed) % 3 == 0 ? 0.0f : value(random);
    }
    groups.push_back(make_group({70, 33, static_cast<std::uint16_t>(first == 100 ? 0 : 9)}, inputs,
                                outputs, std::move(values)));
  }
  dna.behavior.joint_groups = std::move(groups);
  add_channels(dna, seed);
  add_maps(dna);
  return dna;
}

// Frames in which the same controls remain active for a while. Some values are negative or NaN.
class Film {
 public:
  const std::vector<float>& next() {
    std::uniform_real_distribution<float> value(0.1f, 1.2f);
    if (random_() % 3 == 0) active_ = random_() % (1u << kInputs);
    for (std::size_t c = 0; c < kInputs; ++c) {
      raw_[c] = (active_ >> c & 1) == 0 ? 0.0f : value(random_);
      if (random_() % 40 == 0) raw_[c] = -raw_[c];
    }
    if (random_() % 25 == 0) raw_[random_() % kInputs] = kNan;
    return raw_;
  }
  std::uint32_t any(std::uint32_t below) { return static_cast<std::uint32_t>(random_()) % below; }

 private:
  std::mt19937 random_{5};
  std::uint64_t active_ = 0;
  std::vector<float> raw_ = std::vector<float>(kInputs);
};

// Compares bits, because NaN does not equal itself.
bool same_bits(std::span<const float> a, std::span<const float> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

constexpr std::array kParts{&Pose::joints, &Pose::blend_shapes, &Pose::animated_maps,
                            &Pose::controls};

TEST(Kept, IsNeverSeenInAPose) {
  const Rig rigs[2] = {must_compile(correcting_face(1)), must_compile(correcting_face(2))};
  Workspace work = make_batch_workspace(rigs[0]);
  Film film;
  for (int n = 0; n < 3000; ++n) {
    const Rig& rig = rigs[film.any(8) == 0 ? 1 : 0];
    const std::uint32_t lod = film.any(6) == 0 ? film.any(kLevels) : 0;
    const std::size_t count = film.any(3) != 0 ? 1 : 1 + film.any(2 * simd::kFrames);
    work.traversal = film.any(7) == 0 ? static_cast<Traversal>(film.any(4)) : Traversal::kCounted;
    std::vector<float> frames;
    for (std::size_t f = 0; f < count; ++f) {
      const std::vector<float>& raw = film.next();
      frames.insert(frames.end(), raw.begin(), raw.end());
    }
    Pose all = make_pose(rig);
    for (const auto part : kParts) (all.*part).assign((all.*part).size() * count, 7.0f);
    evaluate_frames(rig, frames.data(), count, lod, true, work, view(all));
    for (std::size_t f = 0; f < count; ++f) {
      const auto from = frames.begin() + static_cast<std::ptrdiff_t>(f * kInputs);
      const Pose one = evaluate_once(rig, {from, from + kInputs}, lod);
      for (const auto part : kParts) {
        const std::size_t size = (one.*part).size();
        ASSERT_TRUE(same_bits(one.*part, std::span(all.*part).subspan(f * size, size)))
            << "frame " << n << ", " << f << " of " << count << ": " << size;
      }
    }
  }
}

TEST(Kept, IsOfOneRigThoughAnotherTakesItsPlace) {
  Workspace work;
  std::vector<float> raw(kInputs, 0.5f);
  for (const std::uint32_t seed : {1u, 2u}) {
    // The first rig is destroyed before the second is made, so both may have the same address. Then
    // only Rig::number distinguishes them.
    const Rig rig = must_compile(correcting_face(seed));
    if (seed == 1) work = make_workspace(rig);
    work.traversal = Traversal::kListed;
    Pose pose = make_pose(rig);
    evaluate(rig, raw.data(), 0, true, work, pose);
    EXPECT_TRUE(same_bits(pose.joints, evaluate_once(rig, raw).joints));
  }
}

}  // namespace
}  // namespace risorius::rig
