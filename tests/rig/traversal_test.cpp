// SPDX-License-Identifier: MIT
// Tests the three ways to visit the columns of the joint groups. kListed lists the columns of
// active controls, kAdded adds these columns one by one, and kWhole visits all columns.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <utility>

#include "rig/stages/instance.h"
#include "support/face.h"

namespace risorius::rig {
namespace {

using namespace testing_support;

constexpr std::size_t kRaw = 24, kJoints = 40;

// A face whose joint groups have 1 to 90 rows at LOD 0. LODs 1 and 2 have about half of the rows of
// the next finer LOD, or none. Some attributes are written by two groups, and some by no group.
dna::Dna many_groups() {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> value(-2.0f, 2.0f);
  dna::Dna dna = make_face(kRaw, 0, kJoints, 3);
  std::vector<dna::JointGroup> groups;
  std::uint16_t first = 0;
  constexpr std::uint16_t kRows[] = {1, 16, 90, 33, 5, 64, 17, 7};
  for (const std::uint16_t rows : kRows) {
    std::vector<std::uint16_t> inputs, outputs;
    for (std::uint16_t c = 0; c < kRaw; ++c) {
      if (random() % 4 != 0) inputs.push_back(c);
    }
    for (std::uint16_t r = 0; r < rows; ++r)
      outputs.push_back(static_cast<std::uint16_t>(first + r));
    std::ranges::shuffle(outputs, random);
    std::vector<float> values(rows * inputs.size());
    for (float& v : values) v = random() % 8 == 0 ? 0.0f : value(random);
    const auto half = static_cast<std::uint16_t>(rows / 2);
    groups.push_back(make_group({rows, half, static_cast<std::uint16_t>(rows == 90 ? 0 : half / 2)},
                                inputs, outputs, values));
    first = static_cast<std::uint16_t>(first + rows + (rows == 33 ? 30 : rows == 64 ? -3 : 2));
  }
  dna.behavior.joint_groups = groups;
  return dna;
}

std::vector<float> some_active(std::size_t n, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  std::vector<float> raw(kRaw, 0.0f);
  for (std::size_t i = 0; i < n; ++i) raw[(i * 7 + seed) % kRaw] = value(random);
  return raw;
}

// The value of a joint attribute, computed in double from the matrices of the file, and the largest
// possible error of a float32 sum.
struct Expected {
  double value = 0, bound = 0;
};
std::vector<Expected> expected(const dna::Dna& dna, const std::vector<float>& raw,
                               std::uint32_t lod) {
  std::vector<Expected> out(kJoints * 9);
  for (const dna::JointGroup& g : dna.behavior.joint_groups) {
    const std::size_t columns = g.input_indices.size();
    for (std::size_t r = 0; r < g.lods[lod]; ++r) {
      Expected& e = out[g.output_indices[r]] = {};
      for (std::size_t c = 0; c < columns; ++c) {
        const double term = double{g.values[r * columns + c]} * raw[g.input_indices[c]];
        e.value += term;
        e.bound += std::fabs(term);
      }
      e.bound *= (static_cast<double>(columns) + 1) * std::numeric_limits<float>::epsilon();
    }
  }
  return out;
}

Pose evaluate_by(const Rig& rig, Workspace& work, Traversal traversal,
                 const std::vector<float>& raw, std::uint32_t lod) {
  Pose pose = make_pose(rig);
  std::ranges::fill(pose.joints, kNan);  // old content of the memory
  work.traversal = traversal;
  evaluate(rig, raw.data(), lod, true, work, pose);
  return pose;
}

class Traversals : public testing::TestWithParam<std::string> {
 protected:
  const simd::Kernels* kernels_ = simd::find_kernels(GetParam().c_str());
  const dna::Dna dna_ = many_groups();
};

TEST_P(Traversals, GiveTheSumsOfTheFile) {
  const Rig rig = must_compile(dna_, kernels_);
  Workspace work = make_workspace(rig);  // shared by all frames, to find state that remains
  std::size_t whole = 0;
  for (const std::size_t active : {kRaw, std::size_t{0}, std::size_t{1}, std::size_t{9}, kRaw}) {
    for (std::uint32_t lod = 0; lod < 3; ++lod) {
      const std::vector<float> raw = some_active(active, static_cast<std::uint32_t>(active + lod));
      const auto sums = expected(dna_, raw, lod);
      for (const Traversal way : {Traversal::kWhole, Traversal::kAdded, Traversal::kListed}) {
        whole += way == Traversal::kWhole ? 1 : 0;
        const Pose pose = evaluate_by(rig, work, way, raw, lod);
        EXPECT_EQ(work.whole_frames, whole);
        EXPECT_EQ(work.added_frames, way == Traversal::kWhole ? whole - 1 : whole);
        for (std::size_t i = 0; i < sums.size(); ++i) {
          ASSERT_LE(std::fabs(pose.joints[i] - sums[i].value), sums[i].bound)
              << "attribute " << i << ", " << active << " active, LOD " << lod;
        }
      }
    }
  }
}

TEST_P(Traversals, GiveTheSameBitsInBothWidths) {
  for (const auto precision : {compile::Precision::kFloat32, compile::Precision::kFloat16}) {
    compile::CompileOptions options;
    options.kernels = kernels_;
    options.precision = precision;
    const auto rig = compile::compile(dna_, options);
    ASSERT_TRUE(rig.has_value());
    Workspace work = make_workspace(*rig);
    for (std::size_t active = 0; active <= kRaw; ++active) {
      const std::vector<float> raw = some_active(active, 3);
      for (std::uint32_t lod = 0; lod < 3; ++lod) {
        const Pose listed = evaluate_by(*rig, work, Traversal::kListed, raw, lod);
        EXPECT_EQ(evaluate_by(*rig, work, Traversal::kWhole, raw, lod).joints, listed.joints);
        EXPECT_EQ(evaluate_by(*rig, work, Traversal::kAdded, raw, lod).joints, listed.joints);
      }
    }
  }
}

TEST_P(Traversals, OfABatchGiveTheBitsOfTheFrameAlone) {
  constexpr std::size_t kCount = 8;
  const Rig rig = must_compile(dna_, kernels_);
  std::vector<float> frames;
  for (std::uint32_t f = 0; f < kCount; ++f) {
    const std::vector<float> raw = some_active(f * 3, f);
    frames.insert(frames.end(), raw.begin(), raw.end());
  }
  Workspace alone = make_workspace(rig), work = make_batch_workspace(rig);
  for (const Traversal way : {Traversal::kWhole, Traversal::kListed}) {
    work.traversal = way;
    work.whole_frames = 0;
    for (std::uint32_t lod = 0; lod < 3; ++lod) {
      Pose all = make_pose(rig);
      const std::size_t joints = all.joints.size();
      all.joints.assign(joints * kCount, kNan);
      all.controls.resize(all.controls.size() * kCount);
      evaluate_frames(rig, frames.data(), kCount, lod, true, work, view(all));
      for (std::size_t f = 0; f < kCount; ++f) {
        const std::vector<float> raw(frames.begin() + static_cast<std::ptrdiff_t>(f * kRaw),
                                     frames.begin() + static_cast<std::ptrdiff_t>((f + 1) * kRaw));
        const Pose one = evaluate_by(rig, alone, Traversal::kListed, raw, lod);
        EXPECT_TRUE(std::equal(one.joints.begin(), one.joints.end(),
                               all.joints.begin() + static_cast<std::ptrdiff_t>(f * joints)));
      }
    }
    EXPECT_EQ(work.whole_frames, way == Traversal::kWhole ? 3u : 0u);
  }
}

// A group without active columns may share a block of 16 joint attributes with an active group. Its
// attributes must then be 0, and not keep their values of the frame before.
TEST_P(Traversals, LeaveNothingOfTheFrameBefore) {
  const Rig rig = must_compile(dna_, kernels_);
  Workspace work = make_batch_workspace(rig), fresh = make_workspace(rig);
  const std::vector<float> before = some_active(kRaw, 1);
  for (std::size_t control = 0; control < kRaw; ++control) {
    std::vector<float> raw(kRaw, 0.0f), frames;
    raw[control] = 1.0f;
    const Pose expected = evaluate_by(rig, fresh, Traversal::kWhole, raw, 0);
    for (const Traversal way : {Traversal::kListed, Traversal::kAdded}) {
      evaluate_by(rig, work, way, before, 0);
      EXPECT_EQ(evaluate_by(rig, work, way, raw, 0).joints, expected.joints);
    }
    Pose all = make_pose(rig);
    all.joints.resize(all.joints.size() * simd::kFrames);
    all.controls.resize(all.controls.size() * simd::kFrames);
    for (const std::vector<float>* frame : {&before, &std::as_const(raw)}) {
      frames.clear();
      for (std::size_t f = 0; f < simd::kFrames; ++f) {
        frames.insert(frames.end(), frame->begin(), frame->end());
      }
      evaluate_frames(rig, frames.data(), simd::kFrames, 0, true, work, view(all));
    }
    EXPECT_TRUE(std::equal(expected.joints.begin(), expected.joints.end(),
                           all.joints.end() - std::ptrdiff_t(expected.joints.size())));
  }
}

// An Instance sets only those blocks of joint attributes to 0 that the frame before wrote. No value
// of that frame may remain.
TEST_P(Traversals, OfAnInstanceLeaveNothingOfTheFrameBefore) {
  const Rig rig = must_compile(dna_, kernels_);
  Instance face(rig);
  std::mt19937 random(4);
  for (std::uint32_t step = 0; step < 300; ++step) {
    if (step % 9 == 8) face.set_lod(static_cast<std::uint32_t>(random() % 3));
    const std::vector<float> raw =
        some_active(step % 3 == 0 ? 0 : random() % 4, static_cast<std::uint32_t>(random() % kRaw));
    Workspace fresh = make_workspace(rig);
    Pose alone = make_pose(rig);
    evaluate(rig, raw.data(), face.lod(), false, fresh, alone);
    ASSERT_EQ(face.evaluate(raw.data()).joints, alone.joints) << "step " << step;
  }
}

TEST_P(Traversals, KeepNanInTheGroupsThatHaveItAsAColumn) {
  const Rig rig = must_compile(dna_, kernels_);
  Workspace work = make_workspace(rig);
  std::vector<float> raw = some_active(kRaw, 5);
  const Pose clean = evaluate_by(rig, work, Traversal::kListed, raw, 0);
  raw[4] = kNan;
  const Pose listed = evaluate_by(rig, work, Traversal::kListed, raw, 0),
             added = evaluate_by(rig, work, Traversal::kAdded, raw, 0),
             whole = evaluate_by(rig, work, Traversal::kWhole, raw, 0);
  std::size_t spoilt = 0;
  for (std::size_t i = 0; i < clean.joints.size(); ++i) {
    EXPECT_EQ(std::isnan(listed.joints[i]), std::isnan(whole.joints[i])) << i;
    EXPECT_EQ(std::isnan(added.joints[i]), std::isnan(whole.joints[i])) << i;
    spoilt += std::isnan(whole.joints[i]) ? 1 : 0;
    if (!std::isnan(whole.joints[i])) {
      EXPECT_EQ(whole.joints[i], clean.joints[i]);
    }
  }
  EXPECT_GT(spoilt, 0u);
  EXPECT_LT(spoilt, clean.joints.size());
  raw = some_active(kRaw, 5);
  EXPECT_EQ(evaluate_by(rig, work, Traversal::kAdded, raw, 0).joints, clean.joints);
}

// 1 to 3 joints have 9, 18 or 27 attributes, so the last block of 16 attributes is incomplete. It
// must be filled from several pieces, without a write to the memory after the last attribute.
TEST_P(Traversals, FillTheLastBlockAndNothingBehindIt) {
  for (std::uint16_t joints = 1; joints < 4; ++joints) {
    const auto places = static_cast<std::uint16_t>(joints * 9);
    dna::Dna dna = make_face(2, 0, joints, 1);
    // Consecutive rows for ascending attributes form one piece. In descending order each row is a
    // piece of its own.
    std::vector<std::uint16_t> outputs;
    std::vector<float> values, expected(places);
    for (std::uint16_t p = places; p-- > 0;) {
      outputs.push_back(p);
      values.push_back(static_cast<float>(p + 1));
      expected[p] = values.back();
    }
    dna.behavior.joint_groups = std::vector{make_group({places}, {0}, outputs, values)};
    const Rig rig = must_compile(dna, kernels_);
    Workspace work = make_batch_workspace(rig);
    EXPECT_EQ(evaluate_by(rig, work, Traversal::kListed, {1.0f, 0.0f}, 0).joints, expected);
    EXPECT_EQ(evaluate_by(rig, work, Traversal::kAdded, {1.0f, 0.0f}, 0).joints, expected);
    std::vector<float> raw, all;
    for (std::size_t f = 0; f < simd::kFrames; ++f) {
      raw.insert(raw.end(), {static_cast<float>(f % 2), 0.0f});
      for (const float v : expected) all.push_back(v * static_cast<float>(f % 2));
    }
    Pose pose = make_pose(rig);
    pose.joints.assign(all.size(), kNan);
    pose.controls.resize(pose.controls.size() * simd::kFrames);
    evaluate_frames(rig, raw.data(), simd::kFrames, 0, true, work, view(pose));
    EXPECT_EQ(pose.joints, all);
  }
}

INSTANTIATE_TEST_SUITE_P(Every, Traversals, testing::ValuesIn([] {
                           std::vector<std::string> all;
                           for (const simd::Kernels* k :
                                {&simd::scalar_kernels(), simd::sse4_kernels(),
                                 simd::avx2_kernels(), simd::avx512_kernels(),
                                 simd::neon_kernels()}) {
                             if (k != nullptr) all.emplace_back(k->name);
                           }
                           return all;
                         }()),
                         [](const auto& about) { return about.param; });

TEST(Traversal, IsChosenByTheBytesThatItMoves) {
  // A column of 90 rows has 360 bytes; listing a column moves 32 bytes. With 11 of 12 controls
  // active, reading all columns costs the bytes of the inactive column and of all entries, 360 + 12
  // * 8, more than listing, 11 * 32. With columns of 2 rows it costs less.
  for (const auto& [rows, eleven] :
       {std::pair{std::uint16_t{90}, 0u}, std::pair{std::uint16_t{2}, 1u}}) {
    dna::Dna dna = make_face(12, 0, 10, 1);
    std::vector<std::uint16_t> inputs(12), outputs(rows);
    for (std::uint16_t i = 0; i < 12; ++i) inputs[i] = i;
    for (std::uint16_t i = 0; i < rows; ++i) outputs[i] = i;
    dna.behavior.joint_groups = std::vector{
        make_group({rows}, inputs, outputs, std::vector<float>(rows * std::size_t{12}, 1.0f))};
    const Rig rig = must_compile(dna);
    Workspace work = make_workspace(rig);
    std::vector<float> raw(12, 1.0f);
    evaluate_by(rig, work, Traversal::kCounted, raw, 0);
    EXPECT_EQ(work.whole_frames, 1u) << "nothing rests";
    raw[7] = 0.0f;
    evaluate_by(rig, work, Traversal::kCounted, raw, 0);
    EXPECT_EQ(work.whole_frames, 1u + eleven) << rows << " rows";
    std::ranges::fill(raw, 0.0f);
    evaluate_by(rig, work, Traversal::kCounted, raw, 0);
    EXPECT_EQ(work.whole_frames, 1u + eleven) << "everything rests";
  }
}

// Columns are added one by one if there are fewer active columns per group than the kernels' limit.
TEST(Traversal, AddsTheColumnsOfFewControls) {
  constexpr std::uint16_t kControls = 80, kColumnRows = 90;
  dna::Dna dna = make_face(kControls, 0, 10, 1);
  std::vector<std::uint16_t> inputs(kControls), outputs(kColumnRows);
  for (std::uint16_t i = 0; i < kControls; ++i) inputs[i] = i;
  for (std::uint16_t i = 0; i < kColumnRows; ++i) outputs[i] = i;
  const std::vector<float> values(std::size_t{kColumnRows} * kControls, 1.0f);
  dna.behavior.joint_groups = std::vector{make_group({kColumnRows}, inputs, outputs, values)};
  for (const bool is_half : {false, true}) {
    compile::CompileOptions options;
    if (is_half) options.precision = compile::Precision::kFloat16;
    const auto rig = compile::compile(dna, options);
    ASSERT_TRUE(rig.has_value());
    Workspace work = make_workspace(*rig);
    const simd::FewColumns& few = rig->kernels->few;
    const bool always = !is_half && few.floats > kControls;
    const std::size_t most = always ? 63 : (is_half ? few.halves : few.floats) - std::size_t{1};
    ASSERT_LT(most, kControls - 10u);
    std::vector<float> raw(kControls, 0.0f);
    std::fill_n(raw.begin(), most, 1.0f);
    evaluate_by(*rig, work, Traversal::kCounted, raw, 0);
    EXPECT_EQ(work.added_frames, 1u);
    raw[most] = 1.0f;
    evaluate_by(*rig, work, Traversal::kCounted, raw, 0);
    EXPECT_EQ(work.added_frames, always ? 2u : 1u);
    std::ranges::fill(raw, 1.0f);
    evaluate_by(*rig, work, Traversal::kCounted, raw, 0);
    EXPECT_EQ(work.whole_frames, 1u);
    EXPECT_EQ(work.added_frames, always ? 2u : 1u);
  }
}

TEST(Traversal, NeverReadsAColumnAtRestThatIsNotFinite) {
  dna::Dna dna = make_face(2, 0, 1, 1);
  dna.behavior.joint_groups =
      std::vector{make_group({1}, {0, 1}, {0}, {1.0f, std::numeric_limits<float>::infinity()})};
  const Rig rig = must_compile(dna);
  Workspace work = make_workspace(rig);
  EXPECT_EQ(evaluate_by(rig, work, Traversal::kWhole, {1.0f, 0.0f}, 0).joints[0], 1.0f);
  EXPECT_EQ(work.whole_frames, 0u);
}

}  // namespace
}  // namespace risorius::rig
