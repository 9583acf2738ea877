// SPDX-License-Identifier: MIT
// Tests that compile() takes heap memory in proportion to the size of the face.
#include <gtest/gtest.h>

#include "compile/compile.h"
#include "dna/size.h"
#include "support/bombs.h"
#include "support/heap.h"

namespace risorius::compile {
namespace {

using namespace testing_support;

// Limit of heap memory: kTimesTheFace times the face's size, plus kBeside bytes. kBeside is twice
// the constant in compile::budget_for(), for vectors that double and for auxiliary lists.
constexpr std::size_t kTimesTheFace = 64, kBeside = 2u << 20;

struct Taken {
  std::size_t size, peak;
};

Taken take(const dna::Dna& dna) {
  const HeapCount heap;
  const auto rig = compile(dna);
  if (!rig) {
    EXPECT_EQ(rig.error().code, core::ErrorCode::kLimitExceeded) << rig.error().describe();
  }
  return {static_cast<std::size_t>(dna::size_in_bytes(dna)), heap.peak()};
}

class CompileMemory : public testing::TestWithParam<Bomb> {};

TEST_P(CompileMemory, GrowsWithTheFace) {
  for (const std::uint16_t n : {std::uint16_t{1000}, std::uint16_t{2000}}) {
    const Taken taken = take(GetParam().make(n));
    EXPECT_LE(taken.peak, kTimesTheFace * taken.size + kBeside)
        << n << ": a face of " << taken.size << " bytes";
  }
}

INSTANTIATE_TEST_SUITE_P(Every, CompileMemory, testing::ValuesIn(kBombs),
                         [](const auto& about) { return std::string(about.param.name); });

// Compares the numbers of steps that compile() takes for GUI tables of 10,000 and 20,000 rows. A
// linear search in a list of ranges would need four times as many steps for twice the rows.
TEST(CompileSteps, OfAGuiTableGrowWithItsRows) {
  const auto steps = [](std::uint16_t rows) {
    core::Budget budget("this test", core::Budget::kUnlimited, core::Budget::kUnlimited);
    CompileOptions options;
    options.budget = &budget;
    EXPECT_TRUE(compile(bombs::gui(rows), options).has_value());
    return budget.steps();
  };
  const std::uint64_t once = steps(10000), twice = steps(20000);
  EXPECT_GT(once, 20000u);
  EXPECT_LT(twice, once * 5 / 2);
}

TEST(CompileSteps, BeyondTheBudgetNameTheFieldWhatWasTakenAndTheLimit) {
  core::Budget budget("compiling this face", 1000, 1000);
  CompileOptions options;
  options.budget = &budget;
  const auto rig = compile(bombs::poses(2000), options);
  ASSERT_FALSE(rig.has_value());
  EXPECT_EQ(rig.error().code, core::ErrorCode::kLimitExceeded);
  EXPECT_EQ(rig.error().where, "rbf_behavior.solvers[0].pose_indices");
  EXPECT_EQ(rig.error().message,
            "compiling this face takes at least 4000000 steps, the limit for an input of this "
            "size is 1000");
}

}  // namespace
}  // namespace risorius::compile
