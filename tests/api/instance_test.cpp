// SPDX-License-Identifier: MIT
// The poses of the C API have the same bits as the poses of the C++ evaluator.
#include "rig/stages/instance.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

#include "api/opened.h"
#include "bytes/source.h"
#include "compile/compile.h"
#include "dna/file/parse.h"
#include "rig/stages/evaluate.h"
#include "rig/stages/tables.h"

namespace risorius {
namespace {

using namespace testing_support;

const char* const kGolden[] = {"core", "medium", "ml", "mlquat", "rbf", "quatjoints", "twistswing"};

rig::Rig compile_golden(const std::string& name, const compile::CompileOptions& options = {}) {
  auto source = bytes::open_file(golden_path(name));
  const auto dna = dna::parse(*source.value());
  auto rig = compile::compile(dna.value(), options);
  EXPECT_TRUE(rig.has_value());
  return std::move(rig).value();
}

// Numbers between 0 and 1 that depend on `turn`; every third one is 0.
std::vector<float> wave(std::size_t count, std::size_t turn) {
  std::vector<float> out(count, 0.0f);
  for (std::size_t i = 0; i < count; ++i) {
    if ((i + turn) % 3 != 0) out[i] = static_cast<float>((i * 37 + turn * 11) % 97) / 96.0f;
  }
  return out;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

void expect_pose(const InstancePtr& instance, const rig::Pose& wanted, const std::string& what) {
  EXPECT_TRUE(same_bits(values(instance, RISORIUS_JOINTS), wanted.joints)) << what;
  EXPECT_TRUE(same_bits(values(instance, RISORIUS_SHAPES), wanted.blend_shapes)) << what;
  EXPECT_TRUE(same_bits(values(instance, RISORIUS_MAPS), wanted.animated_maps)) << what;
}

void set_raw(const InstancePtr& instance, const std::vector<float>& raw) {
  ASSERT_EQ(risorius_set(instance.get(), RISORIUS_RAW_CONTROLS, 0,
                         static_cast<std::uint32_t>(raw.size()), raw.data()),
            RISORIUS_OK);
}

void expect_poses(const std::string& name, std::uint32_t flags,
                  const compile::CompileOptions& options) {
  risorius_options wanted{};
  wanted.flags = flags;
  const FacePtr face = open_golden(name, wanted);
  const InstancePtr instance = make_instance(face);
  const rig::Rig rig = compile_golden(name, options);
  rig::Workspace work = rig::make_workspace(rig);
  rig::Pose pose = rig::make_pose(rig);
  for (std::uint32_t turn = 0; turn < 2 * rig.lod_count; ++turn) {
    const std::uint32_t lod = turn % rig.lod_count;
    const std::vector<float> raw = wave(rig.raw_count, turn);
    set_raw(instance, raw);
    ASSERT_EQ(risorius_set_lod(instance.get(), lod), RISORIUS_OK);
    ASSERT_EQ(risorius_evaluate(instance.get()), RISORIUS_OK);
    rig::evaluate(rig, raw.data(), lod, true, work, pose);
    expect_pose(instance, pose, name + " " + std::to_string(turn));
  }
}

TEST(ApiInstance, HasThePosesOfTheEvaluator) {
  for (const char* name : kGolden) expect_poses(name, 0, {});
}

TEST(ApiInstance, HasTheFormsThatWereAskedFor) {
  compile::CompileOptions options;
  options.rotation = compile::Rotation::kQuaternion;
  for (const char* name : kGolden) expect_poses(name, RISORIUS_QUATERNIONS, options);
  options = {};
  options.precision = compile::Precision::kFloat16;
  expect_poses("medium", RISORIUS_FLOAT16, options);
}

TEST(ApiInstance, HasTheLatencyOfTheReferenceWhereAsked) {
  for (const char* name : kGolden) {
    const FacePtr face = open_golden(name);
    const InstancePtr instance = make_instance(face, RISORIUS_LATENT);
    const rig::Rig rig = compile_golden(name);
    rig::Instance wanted(rig);
    for (std::uint32_t turn = 0; turn < 6; ++turn) {
      const std::uint32_t lod = turn / 3 % rig.lod_count;
      const std::vector<float> raw = wave(rig.raw_count, turn);
      set_raw(instance, raw);
      ASSERT_EQ(risorius_set_lod(instance.get(), lod), RISORIUS_OK);
      ASSERT_EQ(risorius_evaluate(instance.get()), RISORIUS_OK);
      wanted.set_lod(lod);
      expect_pose(instance, wanted.evaluate(raw.data()), name);
    }
  }
}

TEST(ApiInstance, BeginsAtRest) {
  const FacePtr face = open_golden("rbf");
  const InstancePtr instance = make_instance(face);
  const rig::Rig rig = compile_golden("rbf");
  const std::vector<float> initial(rig.initial_controls.begin(),
                                   rig.initial_controls.begin() + rig.raw_count);
  EXPECT_EQ(values(instance, RISORIUS_RAW_CONTROLS), initial);
  EXPECT_EQ(values(instance, RISORIUS_JOINTS), std::vector<float>(rig.joint_count * 9, 0.0f));
}

TEST(ApiInstance, GuiControlsMoveTheRawControlsOfTheirTableAndNoOther) {
  const FacePtr face = open_golden("rbf");
  const InstancePtr instance = make_instance(face);
  const rig::Rig rig = compile_golden("rbf");
  const std::vector<float> before = wave(rig.raw_count, 1), gui = wave(rig.gui_count, 2);
  ASSERT_GT(gui.size(), 1u);
  set_raw(instance, before);
  // GUI controls are set one by one. Each call computes the raw controls
  // from all GUI controls.
  for (std::uint32_t i = 0; i < gui.size(); ++i) {
    ASSERT_EQ(risorius_set(instance.get(), RISORIUS_GUI_CONTROLS, i, 1, &gui[i]), RISORIUS_OK);
  }
  std::vector<float> wanted(rig.raw_count);
  rig::gui_to_raw(rig, gui.data(), wanted.data());
  std::vector<bool> written(rig.raw_count, false);
  for (const rig::ConditionalRow& row : rig.gui_rows) written[row.output] = true;
  bool all = true;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!written[i]) wanted[i] = before[i], all = false;
  }
  EXPECT_FALSE(all);
  EXPECT_EQ(values(instance, RISORIUS_RAW_CONTROLS), wanted);
  EXPECT_EQ(values(instance, RISORIUS_GUI_CONTROLS), gui);
}

TEST(ApiInstance, OutlivesItsFace) {
  FacePtr face = open_golden("core");
  const InstancePtr first = make_instance(face), second = make_instance(face);
  const std::vector<float> raw = wave(values(first, RISORIUS_RAW_CONTROLS).size(), 1);
  set_raw(first, raw);
  ASSERT_EQ(risorius_evaluate(first.get()), RISORIUS_OK);
  face.reset();
  set_raw(second, raw);
  ASSERT_EQ(risorius_evaluate(second.get()), RISORIUS_OK);
  EXPECT_EQ(values(first, RISORIUS_JOINTS), values(second, RISORIUS_JOINTS));
}

TEST(ApiInstance, TwoThreadsWithOneEachDoNotMeet) {
  const FacePtr face = open_golden("medium");
  const std::size_t raw_count = risorius_count(face.get(), RISORIUS_RAW_CONTROLS);
  const auto film = [&](std::size_t first, std::vector<std::vector<float>>& out) {
    const InstancePtr instance = make_instance(face);
    for (std::size_t turn = first; turn < first + 200; ++turn) {
      const std::vector<float> raw = wave(raw_count, turn);
      EXPECT_EQ(risorius_set(instance.get(), RISORIUS_RAW_CONTROLS, 0,
                             static_cast<std::uint32_t>(raw_count), raw.data()),
                RISORIUS_OK);
      EXPECT_EQ(risorius_evaluate(instance.get()), RISORIUS_OK);
      out.push_back(values(instance, RISORIUS_JOINTS));
      // Each thread has its own last error, so the message contains the invalid LOD that this
      // thread has set, and not the LOD that the other thread has set.
      EXPECT_EQ(risorius_set_lod(instance.get(), static_cast<std::uint32_t>(1000 + first)),
                RISORIUS_BAD_ARGUMENT);
      EXPECT_NE(std::string(risorius_last_error()->message).find(std::to_string(1000 + first)),
                std::string::npos);
    }
  };
  std::vector<std::vector<float>> alone[2], together[2];
  film(0, alone[0]);
  film(7, alone[1]);
  std::thread other(film, 7, std::ref(together[1]));
  film(0, together[0]);
  other.join();
  EXPECT_EQ(together[0], alone[0]);
  EXPECT_EQ(together[1], alone[1]);
}

}  // namespace
}  // namespace risorius
