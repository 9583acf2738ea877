// SPDX-License-Identifier: MIT
// A rig uses the table of kernels with which it was compiled, and RISORIUS_SIMD chooses this table.
#include <cstdlib>

#include "support/face.h"

namespace risorius::rig {
namespace {

using namespace testing_support;

dna::Dna one_group() {
  dna::Dna dna = make_face(1, 0, 1);
  dna.behavior.joint_groups = std::vector{make_probe({0})};
  return dna;
}

int calls = 0;

void spy(const float*, const simd::Column*, std::size_t, const float*, float* out,
         std::size_t rows) {
  ++calls;
  for (std::size_t r = 0; r < rows; ++r) out[r] = 42.0f;
}

TEST(ForcedSimd, RunsTheTableThatTheRigWasCompiledWith) {
  simd::Kernels table = simd::scalar_kernels();
  table.columns = spy;
  const Rig rig = must_compile(one_group(), &table);
  calls = 0;
  EXPECT_EQ(evaluate_once(rig, {1.0f}).joints[0], 42.0f);
  EXPECT_EQ(calls, 1);
}

TEST(ForcedSimd, EnvironmentReachesTheRig) {
  const char* forced = std::getenv("RISORIUS_SIMD");
  if (forced == nullptr || *forced == '\0') GTEST_SKIP() << "RISORIUS_SIMD is not set in this run";
  const auto result = compile::compile(one_group());
  if (simd::find_kernels(forced) == nullptr) {
    ASSERT_FALSE(result.has_value());
    EXPECT_NE(result.error().message.find("scalar"), std::string::npos);
    return;
  }
  ASSERT_TRUE(result.has_value());
  EXPECT_STREQ(result.value().kernels->name, forced);
}

}  // namespace
}  // namespace risorius::rig
