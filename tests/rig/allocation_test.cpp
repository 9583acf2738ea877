// SPDX-License-Identifier: MIT
// Evaluation allocates nothing. The counter sees every operator new of this executable.
#include <limits>
#include <ostream>
#include <type_traits>

#include "rig/stages/evaluate.h"
#include "rig/stages/instance.h"
#include "rig/stages/tables.h"
#include "support/counted_new.h"
#include "support/face.h"
#include "support/full_face.h"

namespace risorius::rig {
namespace {

using namespace testing_support;

TEST(Allocation, CounterSeesAnAllocation) {
  const long before = allocations;
  const std::vector<float> some(10);
  EXPECT_GT(allocations, before);
}

// Whether a function is noexcept. Evaluation must never throw, because the caller's thread may not
// be able to handle an exception.
template <class F, class... Args>
constexpr bool never_throws = std::is_nothrow_invocable_v<F, Args...>;
using Evaluate = void (*)(const Rig&, const float*, std::uint32_t, bool, Workspace&,
                          const PoseView&) noexcept;
using EvaluatePose = void (*)(const Rig&, const float*, std::uint32_t, bool, Workspace&,
                              Pose&) noexcept;
// These assignments compile only if the functions are noexcept.
constexpr Evaluate kEvaluate = &evaluate;
constexpr EvaluatePose kEvaluatePose = &evaluate;
static_assert(never_throws<decltype(kEvaluate), const Rig&, const float*, std::uint32_t, bool,
                           Workspace&, const PoseView&>);
static_assert(never_throws<decltype(kEvaluatePose), const Rig&, const float*, std::uint32_t, bool,
                           Workspace&, Pose&>);
static_assert(never_throws<decltype(evaluate_frames), const Rig&, const float*, std::size_t,
                           std::uint32_t, bool, Workspace&, const PoseView&>);
static_assert(never_throws<decltype(gui_to_raw), const Rig&, const float*, float*>);
static_assert(never_throws<decltype(raw_to_gui), const Rig&, const float*, float*>);
static_assert(never_throws<decltype(&Instance::evaluate), Instance&, const float*>);
static_assert(never_throws<decltype(&Instance::set_lod), Instance&, std::uint32_t>);
static_assert(never_throws<decltype(&Instance::set_mask), Instance&, std::size_t, float>);

// A variant of a face that has every part that is evaluated. If `operations` is true, operations of
// the layer mlbe run the networks; otherwise the file has only a list of networks.
struct Kind {
  const char* name;
  bool operations;
  compile::Rotation rotation;
  compile::Precision precision;
};
void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }
constexpr Kind kKinds[] = {
    {"Euler", true, compile::Rotation::kEuler, compile::Precision::kFloat32},
    {"Quaternion", true, compile::Rotation::kQuaternion, compile::Precision::kFloat32},
    {"HalfEuler", false, compile::Rotation::kEuler, compile::Precision::kFloat16},
    {"HalfQuaternion", false, compile::Rotation::kQuaternion, compile::Precision::kFloat16},
};

Rig full_rig(const Kind& kind) {
  dna::Dna dna = make_full_face();
  if (!kind.operations) dna.machine_learned_behavior_ext = {};
  compile::CompileOptions options;
  options.rotation = kind.rotation;
  options.precision = kind.precision;
  core::Result<Rig> rig = compile::compile(dna, options);
  if (!rig) {
    ADD_FAILURE() << rig.error().describe();
    std::abort();
  }
  return std::move(rig).value();
}

constexpr std::size_t kFilm = 2 * simd::kFrames + 3;  // whole blocks and a partial one

// Raw controls, float32[kFilm, 5]. Six frames repeat: neutral, usual values, out of range, NaN,
// infinite, and usual values again.
std::vector<float> film() {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  const float frames[][5] = {{0, 0, 0, 0, 1},
                             {0.5f, 0.6f, 0, 0, 0.8f},
                             {-3, 2, 2, 2, 2},
                             {std::numeric_limits<float>::quiet_NaN(), 0, 0, 0, 0},
                             {kInf, -kInf, 0, 1e38f, 1},
                             {1, 0, 0.6f, 0, 0.8f}};
  std::vector<float> out;
  for (std::size_t n = 0; n < kFilm; ++n) out.insert(out.end(), frames[n % 6], frames[n % 6] + 5);
  return out;
}

class EveryKind : public testing::TestWithParam<Kind> {
 protected:
  const Rig rig_ = full_rig(GetParam());
  const std::vector<float> film_ = film();
};

TEST_P(EveryKind, EvaluateTakesNoMemory) {
  Workspace work = make_workspace(rig_);
  Pose pose = make_pose(rig_);
  const long before = allocations;
  for (std::size_t n = 0; n < kFilm; ++n) {
    for (const std::uint32_t lod : {0u, 1u, 99u}) {
      evaluate(rig_, film_.data() + 5 * n, lod, true, work, pose);
      evaluate(rig_, film_.data() + 5 * n, lod, false, work, pose);
    }
  }
  EXPECT_EQ(allocations, before);
}

TEST_P(EveryKind, ABatchTakesNoMemory) {
  Workspace work = make_batch_workspace(rig_);
  std::vector<float> joints(kFilm * rig_.joint_count * rig_.joint_stride),
      shapes(kFilm * rig_.blend_shape_count), maps(kFilm * rig_.animated_map_count),
      controls(kFilm * rig_.control_count);
  const PoseView first{joints.data(), shapes.data(), maps.data(), controls.data()};
  const long before = allocations;
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, simd::kFrames, kFilm}) {
    evaluate_frames(rig_, film_.data(), count, 0, true, work, first);
    evaluate_frames(rig_, film_.data(), count, 1, false, work, first);
  }
  EXPECT_EQ(allocations, before);
}

TEST_P(EveryKind, AFaceThatChangesItsLodAndMasksTakesNoMemory) {
  Instance face(rig_);
  ASSERT_FALSE(face.masks().empty());
  const long before = allocations;
  for (std::size_t n = 0; n < kFilm; ++n) {
    face.set_lod(static_cast<std::uint32_t>(n % 3));
    face.set_mask(0, static_cast<float>(n / 2 % 2));
    (void)face.evaluate(film_.data() + 5 * n);
    (void)face.evaluate(film_.data() + 5 * n);
  }
  EXPECT_EQ(allocations, before);
}

TEST_P(EveryKind, TablesTakeNoMemory) {
  std::vector<float> raw(rig_.raw_count), gui(rig_.gui_count);
  const long before = allocations;
  for (std::size_t n = 0; n < kFilm; ++n) {
    raw_to_gui(rig_, film_.data() + 5 * n, gui.data());
    gui_to_raw(rig_, gui.data(), raw.data());
  }
  EXPECT_EQ(allocations, before);
}

INSTANTIATE_TEST_SUITE_P(Allocation, EveryKind, testing::ValuesIn(kKinds),
                         [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace risorius::rig
